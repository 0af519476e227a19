//! Import circles between the files of one module.
//!
//! A file needs another one where it imports from it, or names it in a path. Re-exports are followed to the file that defines an item, so
//! `use super::Camera` means `camera.rs` where `mod.rs` hands on what that file defines. Declaring a child (`mod leaf;`) and handing on what
//! it has (`pub use leaf::Leaf;`) is no need; what the code of a `mod.rs` makes use of is one, and so is an item that a child takes from the
//! `mod.rs` that defines it. So a `mod.rs` either holds data that its children use, or calls its children: not both.
//!
//! Tests inside the sources and the programs are free. Names in texts (`#[serde(with = "…")]`) and methods that another file adds to a type
//! are not seen.

use super::{Source, is_name};
use std::collections::{BTreeMap, BTreeSet};

/// A path as a source writes it: its names, and the name under which it is known from then on.
struct Named {
    path: Vec<String>,
    name: String,
}

/// The paths of a `use` statement's tree: `a::{b, c::d as e}` is `a::b` and `a::c::d`, known as `e`.
fn leaves(tree: &str, before: &[String], out: &mut Vec<Named>) {
    let tree = tree.trim();
    if let Some(open) = tree.find('{') {
        let mut path = before.to_vec();
        path.extend(tree[..open].split("::").map(str::trim).filter(|n| !n.is_empty()).map(str::to_owned));
        let inner = &tree[open + 1..tree.rfind('}').unwrap_or(tree.len())];
        let (mut depth, mut start) = (0, 0);
        for (at, c) in inner.char_indices() {
            match c {
                '{' => depth += 1,
                '}' => depth -= 1,
                ',' if depth == 0 => {
                    leaves(&inner[start..at], &path, out);
                    start = at + 1;
                }
                _ => {}
            }
        }
        leaves(&inner[start..], &path, out);
    } else if !tree.is_empty() {
        let (tree, renamed) = tree.split_once(" as ").map_or((tree, None), |(t, n)| (t, Some(n.trim().to_owned())));
        let mut path = before.to_vec();
        path.extend(tree.split("::").map(|n| n.trim().to_owned()).filter(|n| !n.is_empty()));
        if path.len() > 1 && path.last().is_some_and(|n| n == "self") {
            path.pop();
        }
        let name = renamed.unwrap_or_else(|| path.last().cloned().unwrap_or_default());
        out.push(Named { path, name });
    }
}

/// Code in which `super::` of a module inside the file, which means the file itself, is written `self::`.
fn level(code: &str) -> String {
    let mut out = String::new();
    let mut rest = code;
    while let Some(at) = rest.find("mod ") {
        let open = rest[at..].find(['{', ';']).map(|i| at + i).filter(|i| rest[*i..].starts_with('{'));
        let Some(open) = open.filter(|_| !rest[..at].ends_with(is_name)) else {
            out.push_str(&rest[..at + 4]);
            rest = &rest[at + 4..];
            continue;
        };
        let mut depth = 0;
        let close = rest[open..].find(|c| {
            depth += i32::from(c == '{') - i32::from(c == '}');
            depth == 0
        });
        let close = close.map_or(rest.len(), |c| open + c);
        out.push_str(&rest[..open]);
        out.push_str(&rest[open..close].replace("super::", "self::"));
        rest = &rest[close..];
    }
    out + rest
}

/// What a file says of others: its imports (those that it hands on first), and the paths in its code.
#[derive(Default)]
struct Says {
    hands_on: Vec<Named>,
    imports: Vec<Named>,
    paths: Vec<Vec<String>>,
    /// Every name in the code.
    words: BTreeSet<String>,
}

impl Says {
    fn of(code: &str) -> Self {
        // `pub(in crate::plant)` says who may look, not what is needed.
        let code = &level(&code.replace("(in crate::", "(in "));
        let mut says = Self::default();
        let (rest, mut code) = (code, String::new());
        let mut from = 0;
        while let Some(at) = rest[from..].find("use ").map(|i| from + i) {
            let word = !rest[..at].ends_with(is_name);
            let line = rest[..at].rfind(['\n', ';', '}', '{']).map_or(0, |i| i + 1);
            let visibility = rest[line..at].trim();
            let end = rest[at..].find(';').map_or(rest.len(), |i| at + i);
            if !word || !(visibility.is_empty() || visibility.starts_with("pub") || visibility.starts_with("#[")) {
                code.push_str(&rest[from..at + 4]);
                from = at + 4;
                continue;
            }
            code.push_str(&rest[from..at]);
            let list = if visibility.contains("pub") { &mut says.hands_on } else { &mut says.imports };
            leaves(&rest[at + 4..end], &[], list);
            from = end;
        }
        code.push_str(&rest[from..]);
        // `mod leaf;` says that there is a file, not that the code makes use of `leaf`.
        let declared = |line: &&str| line.trim_end().ends_with(';') && line.split(' ').rev().nth(1) == Some("mod");
        let code: String = code.lines().filter(|line| !declared(line)).flat_map(|line| [line, "\n"]).collect();
        let mut chars = code.as_str();
        while let Some(start) = chars.find(|c: char| c.is_alphabetic() || c == '_') {
            let (mut path, mut tail) = (Vec::new(), &chars[start..]);
            loop {
                let len = tail.find(|c: char| !is_name(c)).unwrap_or(tail.len());
                path.push(tail[..len].to_owned());
                tail = &tail[len..];
                match tail.strip_prefix("::").filter(|t| t.starts_with(|c: char| c.is_alphabetic() || c == '_')) {
                    Some(next) => tail = next,
                    None => break,
                }
            }
            says.words.insert(path[0].clone());
            if path.len() > 1 {
                says.paths.push(path);
            }
            chars = tail;
        }
        says
    }
}

/// The files of the library by module path, and what each says of the others.
struct Files<'a> {
    sources: BTreeMap<Vec<&'a str>, (&'a Source, Says)>,
}

impl<'a> Files<'a> {
    fn new(sources: &'a [Source]) -> Self {
        let files = sources.iter().filter(|s| !matches!(s.module(), "bin" | "lib"));
        Self { sources: files.map(|s| (s.path_of_modules(), (s, Says::of(&s.code)))).collect() }
    }

    fn is_file(&self, path: &[String]) -> bool {
        self.sources.contains_key(&path.iter().map(String::as_str).collect::<Vec<_>>())
    }

    /// A path that `own` writes, from the crate's root; `None` for what is none of ours.
    fn absolute(&self, own: &[&str], path: &[String], followed: usize) -> Option<Vec<String>> {
        let owned = |names: &[&str]| names.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>();
        let first = path.first()?.as_str();
        if first == "crate" {
            return Some(path[1..].to_vec());
        }
        if matches!(first, "self" | "super") {
            let ups = path.iter().take_while(|n| *n == "super").count();
            let base = own.len().checked_sub(ups)?;
            let rest = path.iter().skip_while(|n| matches!(n.as_str(), "super" | "self"));
            return Some(owned(&own[..base]).into_iter().chain(rest.cloned()).collect());
        }
        let child: Vec<String> = owned(own).into_iter().chain([first.to_owned()]).collect();
        if self.is_file(&child) {
            return Some(child.into_iter().chain(path[1..].iter().cloned()).collect());
        }
        if followed == 0 {
            return None;
        }
        let (_, says) = self.sources.get(own)?;
        let import = says.imports.iter().chain(&says.hands_on).find(|i| i.name == first && i.path != path)?;
        let base = self.absolute(own, &import.path, followed - 1)?;
        Some(base.into_iter().chain(path[1..].iter().cloned()).collect())
    }

    /// The file that defines what a path from the root names: through re-exports to where it is.
    fn defines(&self, path: &[String], followed: usize) -> Option<Vec<&'a str>> {
        let len = (1..=path.len()).rev().find(|n| self.is_file(&path[..*n]))?;
        let names: Vec<&str> = path[..len].iter().map(String::as_str).collect();
        let (module, (_, says)) = self.sources.iter().find(|(module, _)| **module == names)?;
        let Some(item) = path.get(len) else { return Some(module.clone()) };
        let handed = says.hands_on.iter().chain(&says.imports).filter(|_| followed > 0);
        for import in handed.filter(|i| i.name == *item || i.name == "*") {
            let mut target = import.path.clone();
            if import.name == "*" {
                target.last_mut()?.clone_from(item);
            }
            let Some(target) = self.absolute(module, &target, 1) else { continue };
            if target != path {
                let target: Vec<String> = target.into_iter().chain(path[len + 1..].iter().cloned()).collect();
                return self.defines(&target, followed - 1);
            }
        }
        Some(module.clone())
    }

    /// Which files of its own module each file needs.
    fn needs(&self) -> BTreeMap<&'a str, BTreeSet<&'a str>> {
        let mut needs = BTreeMap::new();
        for (own, (source, says)) in &self.sources {
            let mut of: BTreeSet<&str> = BTreeSet::new();
            let imports = says.imports.iter().map(|i| &i.path);
            // What is handed on is only named, unless the code makes use of it.
            let used = says.hands_on.iter().filter(|i| says.words.contains(&i.name)).map(|i| &i.path);
            for (path, is_import) in imports.chain(used).map(|p| (p, true)).chain(says.paths.iter().map(|p| (p, false)))
            {
                let Some(path) = self.absolute(own, path, 3) else { continue };
                // A folder imported as a name says nothing yet; what is taken out of it does.
                let folder = self.is_file(&path) && self.is_folder(&path);
                if path.first().map(String::as_str) != Some(source.module()) || folder && is_import {
                    continue;
                }
                if let Some(target) = self.defines(&path, 8)
                    && target != *own
                {
                    of.insert(&self.sources[&target].0.path);
                }
            }
            needs.insert(source.path.as_str(), of);
        }
        needs
    }

    fn is_folder(&self, path: &[String]) -> bool {
        self.sources.keys().any(|m| m.len() > path.len() && m.iter().zip(path).all(|(a, b)| a == b))
    }
}

/// Files of one module that need each other, each group once: what a file reaches that reaches it.
pub(super) fn circles(sources: &[Source]) -> Vec<Vec<&str>> {
    let files = Files::new(sources);
    let needs = files.needs();
    let reach = |from: &str| {
        let (mut seen, mut open) = (BTreeSet::new(), vec![from.to_owned()]);
        while let Some(at) = open.pop() {
            for next in needs.get(at.as_str()).into_iter().flatten() {
                if seen.insert((*next).to_owned()) {
                    open.push((*next).to_owned());
                }
            }
        }
        seen
    };
    let reached: BTreeMap<&str, BTreeSet<String>> = needs.keys().map(|f| (*f, reach(f))).collect();
    let paths: Vec<&str> = reached.keys().copied().collect();
    let mut groups = Vec::new();
    let mut done = BTreeSet::new();
    for a in &paths {
        if !reached[a].contains(*a) || !done.insert(*a) {
            continue;
        }
        let group: Vec<&str> =
            paths.iter().copied().filter(|b| b == a || reached[a].contains(*b) && reached[b].contains(*a)).collect();
        done.extend(group.iter().copied());
        groups.push(group);
    }
    groups
}
