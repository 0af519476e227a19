//! Circular imports between the files of one module.
//!
//! A file needs another one if it imports from it or names it in a path. Re-exports are followed to the file that
//! defines an item, so `use super::Camera` means `camera.rs` if `mod.rs` re-exports the item from there.
//!
//! Declaring a child (`mod leaf;`) and re-exporting its items (`pub use leaf::Leaf;`) does not count. Items that the
//! code of a `mod.rs` uses do count, and so does an item that a child takes from the `mod.rs` that defines it. A
//! `mod.rs` therefore either holds data for its children or calls its children, not both.
//!
//! Unit tests inside the sources and the programs are exempt. Names in strings (`#[serde(with = "…")]`) and methods
//! that another file adds to a type are not detected.

use super::{Source, is_name};
use std::collections::{BTreeMap, BTreeSet};

/// A path as written in a source: its names, and the name that the file uses for the item.
struct Named {
    path: Vec<String>,
    name: String,
}

/// Collects the paths of a `use` tree: `a::{b, c::d as e}` gives `a::b` and `a::c::d`, the latter named `e`.
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

/// Rewrites `super::` to `self::` inside inline modules, where it means the file itself.
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

/// References of a file to others: its imports (re-exports listed separately) and the paths in its code.
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
        // `pub(in crate::plant)` is a visibility, not a dependency.
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
        // `mod leaf;` declares a file; it does not use it.
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

/// The files of the library by module path, with the references of each.
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

    /// Resolves a path written in the module `own` to a path from the crate's root; `None` for foreign paths.
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

    /// Returns the file that defines the item a path from the root names, following re-exports.
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

    /// Returns the files of its own module that each file needs.
    fn needs(&self) -> BTreeMap<&'a str, BTreeSet<&'a str>> {
        let mut needs = BTreeMap::new();
        for (own, (source, says)) in &self.sources {
            let mut of: BTreeSet<&str> = BTreeSet::new();
            let imports = says.imports.iter().map(|i| &i.path);
            // A re-export counts only if the file's own code uses the name.
            let used = says.hands_on.iter().filter(|i| says.words.contains(&i.name)).map(|i| &i.path);
            for (path, is_import) in imports.chain(used).map(|p| (p, true)).chain(says.paths.iter().map(|p| (p, false)))
            {
                let Some(path) = self.absolute(own, path, 3) else { continue };
                // Importing a folder's name is not a dependency; the items taken from it are.
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

/// Returns the groups of files in one module that need each other; each group is listed once.
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

/// Returns the groups of folders and files in one folder that need each other, as `folder: child child`.
///
/// A child folder needs another child if any file below it needs a file below the other. A folder's own `mod.rs` is no child: it names
/// its children.
pub(super) fn folder_circles(sources: &[Source]) -> Vec<String> {
    let files = Files::new(sources);
    let mut graphs: BTreeMap<String, BTreeMap<&str, BTreeSet<&str>>> = BTreeMap::new();
    for (file, targets) in files.needs() {
        for target in targets {
            let (from, to): (Vec<&str>, Vec<&str>) = (file.split('/').collect(), target.split('/').collect());
            let shared = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
            let (Some(a), Some(b)) = (from.get(shared), to.get(shared)) else { continue };
            if *a != "mod.rs" && *b != "mod.rs" {
                graphs.entry(from[..shared].join("/")).or_default().entry(a).or_default().insert(b);
            }
        }
    }
    let mut found = Vec::new();
    for (folder, graph) in graphs {
        let reach = |from| {
            let (mut seen, mut open) = (BTreeSet::new(), vec![from]);
            while let Some(at) = open.pop() {
                open.extend(graph.get(at).into_iter().flatten().copied().filter(|next| seen.insert(*next)));
            }
            seen
        };
        let reached: BTreeMap<&str, BTreeSet<&str>> = graph.keys().map(|child| (*child, reach(child))).collect();
        let mut done = BTreeSet::new();
        for (child, below) in &reached {
            let group: Vec<&str> = below
                .iter()
                .copied()
                .filter(|other| reached.get(other).is_some_and(|back| back.contains(child)))
                .collect();
            if below.contains(child) && group.iter().all(|other| done.insert(*other)) {
                found.push(format!("{folder}: {}", group.join(" ")));
            }
        }
    }
    found
}
