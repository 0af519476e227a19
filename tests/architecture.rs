//! Method 13: architecture. Layers, forbidden imports and allowed places, read from the sources' `use` lines and paths.
//!
//! Rationale: modules that import only what lies below them can be understood, tested and replaced one at a time; a label that
//! cannot name a light cannot be lit. Expected: no violation. Source: the table in `src/lib.rs` for layers; the rules here.
//!
//! What counts: `crate::module`, `use crate::{…}`, `super::` chains that leave their module, `furrow::module` in programs, and the
//! first name of a path for foreign crates. Tests inside the sources are free: they may look anywhere to check something.

#[path = "architecture/circles.rs"]
mod circles;

use circles::circles;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// Modules (left) that never import others (right), beyond what layers forbid.
///
/// A path with a slash is one file. `material` and `light` sit on neighbouring layers, `bsdf` and `scene` far apart; layers
/// alone would let some of these through, or would if a module moved.
const NEVER: &[(&str, &str)] = &[
    // Botany, soil and the places of plants know no optics.
    ("plant", "material bsdf scene light accel sensor integrator"),
    ("soil", "material bsdf scene light accel sensor integrator"),
    ("scatter", "material bsdf scene light accel sensor integrator"),
    // Local frame, pure functions, testable alone.
    ("bsdf", "geometry texture scene light material sampling"),
    ("material", "light"),
    ("light", "material"),
    // Meshes and their masks; the rest holds a `&dyn Intersect`.
    ("accel", "material light scene sensor"),
    // Files → meshes and what they look like; what light does there is the materials' business.
    ("model", "material bsdf light scene optics accel integrator"),
    // A label cannot be filtered, noisy or lit.
    ("render/label.rs", "film sampling bsdf material light integrator"),
    ("integrator", "accel film output plant soil scatter texture"),
    ("film", "scene sampling"),
    // The other way of drawing shares the scene, not the rays.
    ("raster", "integrator accel bsdf sampling output"),
    // The pipeline knows no dataset, and what it writes is output's.
    ("job", "dataset train compare"),
    // Data alone.
    ("settings", "integrator render output raster"),
    // It says what is otherwise; who grows, draws and writes is theirs.
    ("ablation", "integrator accel bsdf output dataset"),
    // It asks `render` for an image and a label map.
    ("dataset", "integrator bsdf"),
    // It reads what writers wrote, so it reads real images too.
    ("train", "scene render integrator accel film light material bsdf plant soil scatter"),
    // It reads pictures, whatever program made them.
    ("compare", "render integrator accel film light material bsdf plant soil scatter"),
    // `cli` is what the programs share.
    ("*", "cli bin"),
];

/// Foreign crates and the only files (or folders, or modules) that may name them. `*` is anywhere.
const ALLOWED: &[(&str, &str)] = &[
    // Bytes written as text inside a model's document, or a page's.
    ("base64", "model/uri.rs report/page.rs"),
    // Numbers as bytes for the card, and waiting for it.
    ("bytemuck", "raster/"),
    // Command lines; hyper-parameters are read from flags and from files alike.
    ("clap", "bin/ cli/mod.rs train/fit/settings.rs reference/manual.rs"),
    // Checksums of TensorBoard's records.
    ("crc32c", "train/fit/log/events.rs"),
    // Tables: measured spectra in; boxes of plants and numbers of reports out.
    (
        "csv",
        "optics/measured.rs optics/munsell.rs optics/prospect.rs dataset/format/cropandweed.rs dataset/format/traits.rs report/csv.rs",
    ),
    // Layers out, pictures of light in.
    ("exr", "output/exr/mod.rs texture/exr_size.rs texture/panorama.rs"),
    // Vectors are re-exported by `math`; two files sum in double precision.
    ("glam", "math/ film/ accel/brute.rs"),
    // Weights of networks that ship.
    ("half", "train/weights.rs"),
    // Checksums as text.
    ("hex", "scene/library.rs dataset/ train/data/photos.rs train/run.rs train/weights.rs report/page.rs"),
    ("humantime", "bin/ cli/mod.rs"),
    ("hw_skymodel", "light/hosek.rs"),
    // Photographs in, and small ones out for pages that people look at.
    ("image", "texture/ output/photo.rs"),
    ("indicatif", "bin/"),
    // Open Image Denoise, where it is there.
    ("libloading", "output/denoise/oidn/"),
    // Pages that people read: what writes them, and the parts that they share.
    (
        "maud",
        "report/ compare/page.rs compare/gap/ dataset/report/ train/figure/page.rs bin/trace/catalogue/page.rs bin/trace/dataset/status/page.rs",
    ),
    ("noise", "texture/noise.rs"),
    // Files that are saved while they are watched.
    ("notify", "bin/trace/watch/files.rs"),
    // Measures of difference that others have written and checked.
    ("nv_flip", "compare/flip.rs"),
    ("palette", "compare/color.rs"),
    // Labels need bits that stay, drawn textures need 16 bits and words inside.
    ("png", "output/png.rs texture/draw/"),
    // Tables of a dataset.
    ("parquet", "dataset/index/table.rs"),
    ("pollster", "raster/gpu.rs"),
    // ONNX files.
    ("prost", "train/deploy/onnx/ train/fit/log/events.rs"),
    // Documents of Mitsuba.
    ("quick_xml", "output/mitsuba/xml.rs"),
    ("rand", "sampling/rng.rs"),
    ("rand_pcg", "sampling/rng.rs"),
    // Parallel at the top only.
    // Images, plants, the soil's maps and the sensor's pixels: loops over what is many.
    (
        "rayon",
        "accel/embree.rs render/ sensor/ job/threads.rs dataset/ compare/ scene/assemble/bank.rs scene/assemble/estimate.rs scene/assemble/ground.rs scene/assemble/stand.rs scene/shipped.rs scene/traits.rs soil/bake.rs soil/crumb.rs soil/ground.rs soil/in_view.rs soil/openness.rs material/ground.rs raster/sheets.rs",
    ),
    // One reader for all RON files; faults inside a value are found where they lie.
    ("ron", "ron_file/"),
    // Spectra of pictures.
    ("rustfft", "compare/gap/frequency.rs"),
    // Types of files say what may stand in them.
    ("schemars", "*"),
    ("serde", "*"),
    // glTF documents, read and written; records and formats of datasets; what a page asks and is told.
    (
        "serde_json",
        "model/document.rs model/gltf.rs output/gltf/ dataset/ compare/table.rs compare/gap/known.rs compare/gap/table.rs train/ report/table.rs reference/ ron_file/schema.rs bin/trace/watch/",
    ),
    // Weights, as every trainer reads them.
    ("safetensors", "train/weights.rs"),
    ("sha2", "scene/library.rs model/files.rs dataset/ train/data/photos.rs train/run.rs train/weights.rs"),
    ("signal_hook", "cli/signal.rs"),
    // Parts that a pixel met: one or two, nearly always.
    ("smallvec", "film/tally.rs output/exr/cryptomatte.rs"),
    ("sobol_burley", "sampling/sobol.rs"),
    ("solar_positioning", "light/position.rs"),
    // How far a misspelt name is from those that are known.
    ("strsim", "ron_file/suggest.rs"),
    // Images as one archive, for programs that read them as they are made.
    ("tar", "dataset/archive.rs dataset/pack/ dataset/stream.rs"),
    // libtorch: networks and how they learn.
    (
        "tch",
        "train/torch/ train/fit/gradients.rs train/fit/loss.rs train/fit/optimiser.rs train/fit/trainer.rs train/deploy/",
    ),
    // Files appear whole or not at all: images of fields, and drawn textures below them. The denoiser's go through a folder,
    // and so do a scene that is taken into a dataset or a stream, and the small dataset that a bill is made of.
    (
        "tempfile",
        "cli/mod.rs dataset/bill.rs dataset/plan.rs dataset/push.rs dataset/stream.rs output/atomic.rs output/denoise/program.rs texture/draw/write.rs",
    ),
    // Another program that shows pictures.
    ("tev_client", "bin/trace/watch/tev.rs"),
    // A page on this machine.
    ("tiny_http", "bin/trace/watch/answer.rs bin/trace/watch/server.rs"),
    ("tobj", "model/obj.rs"),
    // Graphics cards.
    ("wgpu", "raster/"),
];

/// Dependencies that no source names: libtorch's place is told to the build script of whoever depends on it directly.
const UNNAMED: &[&str] = &["torch_sys"];

/// A source file without its comments, strings and tests.
struct Source {
    /// Below `src`, with `/`.
    path: String,
    code: String,
}

impl Source {
    fn new(path: &str, text: &str) -> Self {
        Self { path: path.to_owned(), code: bare(text) }
    }

    /// The module that the file belongs to; "bin" for programs.
    fn module(&self) -> &str {
        self.path.split('/').next().unwrap_or_default().trim_end_matches(".rs")
    }

    /// Module path of the file: `plant/mod.rs` is `[plant]`, `plant/leaf.rs` is `[plant, leaf]`.
    fn path_of_modules(&self) -> Vec<&str> {
        let parts = self.path.trim_end_matches(".rs").split('/');
        parts.filter(|p| !matches!(*p, "mod" | "lib")).collect()
    }

    /// Modules that the file names, its own among them.
    fn modules(&self) -> BTreeSet<String> {
        let own = if self.module() == "bin" { "furrow" } else { "crate" };
        let mut modules: BTreeSet<String> = named(&self.code, own).into_iter().collect();
        let depth = self.path_of_modules().len();
        let climb = "super::".repeat(depth);
        if depth > 0 {
            // As many steps up as the module is deep lead to the crate's root.
            let shorter = format!("{climb}super::");
            modules.extend(named(&self.code.replace(&shorter, ""), &format!("{climb}self").replace("::self", "")));
        }
        modules
    }
}

fn is_name(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// The first names behind `prefix::`, alone or in braces.
fn named(code: &str, prefix: &str) -> Vec<String> {
    let mut names = Vec::new();
    for (at, found) in code.match_indices(prefix) {
        let before = code[..at].chars().next_back();
        let rest = code[at + found.len()..].trim_start();
        let Some(rest) = rest.strip_prefix("::") else { continue };
        if before.is_some_and(|c| is_name(c) || c == ':') {
            continue;
        }
        let rest = rest.trim_start();
        match rest.strip_prefix('{') {
            Some(list) => names.extend(first_names(list)),
            None => names.push(rest.chars().take_while(|c| is_name(*c)).collect()),
        }
    }
    names
}

/// The first name of each item of a list in braces.
fn first_names(list: &str) -> Vec<String> {
    let (mut names, mut depth, mut fresh) = (Vec::new(), 0, true);
    let mut chars = list.char_indices();
    while let Some((at, c)) = chars.next() {
        match c {
            '}' if depth == 0 => break,
            '}' => depth -= 1,
            '{' => depth += 1,
            ',' if depth == 0 => fresh = true,
            c if fresh && is_name(c) => {
                let name: String = list[at..].chars().take_while(|c| is_name(*c)).collect();
                for _ in 1..name.chars().count() {
                    chars.next();
                }
                names.push(name);
                fresh = false;
            }
            _ => {}
        }
    }
    names
}

/// Code without comments, texts, characters and `#[cfg(test)]` modules.
fn bare(text: &str) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        if rest.starts_with("//") {
            rest = &rest[rest.find('\n').unwrap_or(rest.len())..];
        } else if rest.starts_with("/*") {
            rest = &rest[rest.find("*/").map_or(rest.len(), |i| i + 2)..];
        } else if let Some(len) = raw_text(rest).filter(|_| !out.ends_with(is_name)) {
            rest = &rest[len..];
        } else if c == '"' {
            let mut escaped = false;
            let end = rest[1..].find(|c| {
                let ends = c == '"' && !escaped;
                escaped = c == '\\' && !escaped;
                ends
            });
            rest = &rest[end.map_or(rest.len(), |e| e + 2)..];
        } else if c == '\'' {
            // A character, or a lifetime.
            let mut after = rest[1..].char_indices();
            let (first, second) = (after.next(), after.next());
            let len = match (first, second) {
                (Some((_, '\\')), _) => rest[3..].find('\'').map_or(rest.len(), |i| i + 4),
                (_, Some((at, '\''))) => at + 2,
                _ => 1,
            };
            rest = &rest[len..];
        } else {
            out.push(c);
            rest = &rest[c.len_utf8()..];
        }
    }
    without_tests(&out)
}

/// Length of the raw text that begins here.
fn raw_text(rest: &str) -> Option<usize> {
    let body = rest.strip_prefix('r').or_else(|| rest.strip_prefix("br"))?;
    let hashes = body.len() - body.trim_start_matches('#').len();
    if !body[hashes..].starts_with('"') {
        return None;
    }
    let close = format!("\"{}", "#".repeat(hashes));
    let start = rest.len() - body.len() + hashes + 1;
    Some(rest[start..].find(&close).map_or(rest.len(), |i| start + i + close.len()))
}

fn without_tests(code: &str) -> String {
    let mut out = String::new();
    let mut rest = code;
    while let Some(at) = rest.find("#[cfg(test)]") {
        out.push_str(&rest[..at]);
        let item = &rest[at..];
        let open = item.find('{').unwrap_or(item.len());
        let end = item.find(';').unwrap_or(item.len());
        if end < open {
            rest = item.get(end + 1..).unwrap_or_default();
            continue;
        }
        let mut depth = 0;
        let close = item[open..].find(|c| {
            depth += i32::from(c == '{') - i32::from(c == '}');
            depth == 0
        });
        rest = close.and_then(|c| item.get(open + c + 1..)).unwrap_or_default();
    }
    out + rest
}

/// Every source file; tests of a module in a file of their own left out.
fn sources() -> Vec<Source> {
    fn walk(folder: &Path, root: &Path, out: &mut Vec<Source>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                walk(&path, root, out);
            } else if path.extension().is_some_and(|e| e == "rs") && !path.ends_with("tests.rs") {
                let name = path.strip_prefix(root).unwrap().to_str().unwrap().replace('\\', "/");
                out.push(Source::new(&name, &fs::read_to_string(&path).unwrap()));
            }
        }
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut out = Vec::new();
    walk(&root, &root, &mut out);
    out.sort_by(|a, b| a.path.cmp(&b.path));
    out
}

/// Layers by module, from the table in `src/lib.rs`.
fn layers(lib: &str) -> BTreeMap<String, u32> {
    let mut layers = BTreeMap::new();
    for line in lib.lines() {
        let cells: Vec<&str> = line.trim_start_matches("//!").split('|').map(str::trim).collect();
        let [_, layer, modules, _] = cells.as_slice() else { continue };
        let Ok(layer) = layer.parse() else { continue };
        for module in modules.split(',') {
            layers.insert(module.trim().trim_matches(['[', ']', '`']).to_owned(), layer);
        }
    }
    layers
}

fn layer_faults(sources: &[Source], layers: &BTreeMap<String, u32>) -> Vec<String> {
    let mut faults = Vec::new();
    for source in sources.iter().filter(|s| !matches!(s.module(), "lib" | "bin")) {
        let Some(own) = layers.get(source.module()) else {
            faults.push(format!("src/{}: its module has no layer in the table of src/lib.rs", source.path));
            continue;
        };
        for module in source.modules().iter().filter(|r| *r != source.module()) {
            if let Some(other) = layers.get(module)
                && other >= own
            {
                faults.push(format!(
                    "src/{}: imports `{module}` of layer {other}, but is in layer {own}: move what is shared below both",
                    source.path
                ));
            }
        }
    }
    faults
}

fn never_faults(sources: &[Source]) -> Vec<String> {
    let mut faults = Vec::new();
    for source in sources.iter().filter(|s| !matches!(s.module(), "lib" | "bin")) {
        let modules = source.modules();
        for (who, whom) in NEVER {
            if *who == "*" || *who == source.module() || *who == source.path {
                for module in whom.split(' ').filter(|r| modules.contains(*r) && *r != source.module()) {
                    faults.push(format!("src/{}: `{who}` never imports `{module}`", source.path));
                }
            }
        }
    }
    faults
}

fn crate_faults(sources: &[Source]) -> Vec<String> {
    let mut faults = Vec::new();
    for source in sources {
        for (krate, places) in ALLOWED {
            if names(source, krate) && !places.split(' ').any(|place| opens(place, &source.path)) {
                faults.push(format!(
                    "src/{}: names the crate `{krate}`, which only these may name: {places}",
                    source.path
                ));
            }
        }
    }
    faults
}

fn opens(place: &str, path: &str) -> bool {
    place == "*" || path == place || place.ends_with('/') && path.starts_with(place)
}

/// Whether a source names a foreign crate. A module may have a crate's name: behind `mod noise;`, `noise::` is ours.
fn names(source: &Source, krate: &str) -> bool {
    !own_module(source, krate) && named(&source.code, krate).len() + renamed(&source.code, krate) > 0
}

/// How often a crate is imported under another name or as a whole: `use noise as other;`, `use ::noise::Perlin;`.
fn renamed(code: &str, krate: &str) -> usize {
    let forms =
        [format!("use {krate} as "), format!("use {krate};"), format!("::{krate}::"), format!("extern crate {krate}")];
    forms
        .iter()
        .flat_map(|form| code.match_indices(form.as_str()))
        .filter(|(at, _)| !code[..*at].ends_with(|c: char| is_name(c) || c == '>'))
        .count()
}

/// Whether a name means a module or an import of this file rather than a crate.
fn own_module(source: &Source, name: &str) -> bool {
    let declared = source.code.lines().any(|l| {
        let l = l
            .trim_start()
            .trim_start_matches("pub ")
            .trim_start_matches("pub(super) ")
            .trim_start_matches("pub(crate) ");
        l == format!("mod {name};") || l.starts_with(&format!("mod {name} "))
    });
    let imported = source
        .code
        .split(';')
        .filter(|s| s.contains("use ") && !s.contains(&format!("use {name}")) && !s.contains(&format!("use ::{name}")))
        .any(|s| s.split(|c: char| !is_name(c)).any(|word| word == name));
    declared || imported
}

fn lib() -> String {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("src/lib.rs")).unwrap()
}

#[test]
fn modules_import_only_lower_layers() {
    let faults = layer_faults(&sources(), &layers(&lib()));
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
}

#[test]
fn the_codemap_lists_every_module_once() {
    let lib = lib();
    let declared: BTreeSet<String> =
        lib.lines().filter_map(|l| l.strip_prefix("pub mod ")?.strip_suffix(';')).map(str::to_owned).collect();
    let listed: BTreeSet<String> = layers(&lib).into_keys().collect();
    assert_eq!(declared, listed);
    assert!(listed.len() > 15);
}

#[test]
fn some_modules_never_import_others() {
    let sources = sources();
    let faults = never_faults(&sources);
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
    // A rule about a file or module that is gone would hold for ever.
    for (who, _) in NEVER {
        assert!(
            *who == "*" || sources.iter().any(|s| s.module() == *who || s.path == *who),
            "no source is called {who}"
        );
    }
}

#[test]
fn foreign_crates_are_named_only_where_the_table_allows() {
    let sources = sources();
    let faults = crate_faults(&sources);
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
    // A permission that nothing uses must go.
    for (krate, places) in ALLOWED {
        for place in places.split(' ') {
            assert!(
                sources.iter().any(|s| opens(place, &s.path) && names(s, krate)),
                "nothing in {place} names {krate}"
            );
        }
    }
}

#[test]
fn every_dependency_is_in_the_table() {
    let manifest = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.toml")).unwrap();
    let section = manifest.split("[dependencies]").nth(1).unwrap().split("\n[").next().unwrap();
    let named: BTreeSet<String> =
        section.lines().filter_map(|l| l.split_once(" = ")).map(|(name, _)| name.replace('-', "_")).collect();
    let places = ALLOWED.iter().map(|(name, _)| name);
    let listed: BTreeSet<String> = places.chain(UNNAMED).map(|name| (*name).to_owned()).collect();
    assert_eq!(named, listed);
    for krate in UNNAMED {
        let faults: Vec<String> = sources().iter().filter(|s| names(s, krate)).map(|s| s.path.clone()).collect();
        assert!(faults.is_empty(), "{krate} is named in {faults:?}: list it with its files");
    }
}

/// The only folders that may hold `unsafe`: they call Embree and Open Image Denoise.
const UNSAFE: [&str; 2] = ["accel/rtc/", "output/denoise/oidn/"];

/// Sources that hold `unsafe`, or allow it, elsewhere than in [`UNSAFE`].
fn unsafe_faults(sources: &[Source]) -> Vec<String> {
    let words = |s: &Source| s.code.split(|c: char| !is_name(c)).any(|word| matches!(word, "unsafe" | "unsafe_code"));
    let elsewhere = |s: &&Source| !UNSAFE.iter().any(|folder| s.path.starts_with(folder));
    sources.iter().filter(elsewhere).filter(|s| words(s)).map(|s| s.path.clone()).collect()
}

/// Rationale: the compiler cannot check what calls C, so it lies in few places where people do. Expected: `unsafe` nowhere else, and no
/// permission for it that the lint in `Cargo.toml` would let through.
#[test]
fn what_is_unsafe_lies_in_two_folders() {
    let sources = sources();
    assert_eq!(unsafe_faults(&sources), Vec::<String>::new());
    for folder in UNSAFE {
        let calls = |s: &Source| s.path.starts_with(folder) && s.code.contains("unsafe {");
        assert!(sources.iter().any(calls), "{folder}: nothing is left to allow");
    }
    for code in ["fn f() { unsafe { g() } }", "#![allow(unsafe_code)]\nfn f() {}", "unsafe impl Send for A {}"] {
        assert_eq!(unsafe_faults(&[Source::new("film/a.rs", code)]), ["film/a.rs"], "{code}");
        assert!(unsafe_faults(&[Source::new("accel/rtc/a.rs", code)]).is_empty(), "{code}");
        assert!(unsafe_faults(&[Source::new("output/denoise/oidn/a.rs", code)]).is_empty(), "{code}");
    }
    assert!(unsafe_faults(&[Source::new("film/a.rs", "// unsafe\nfn unsafely() { say(\"unsafe\") }")]).is_empty());
}

/// Help that is hidden in a message, in a literal of the source: after a line break, be it on the next line of the literal.
fn hidden_help(code: &str) -> bool {
    code.match_indices("\\n").any(|(at, _)| {
        let rest = code[at + 2..].trim_start().trim_start_matches("\\\n");
        rest.trim_start().starts_with("help: ")
    })
}

/// Rationale: an error's help is a field of its own, for programs to use and for one place to print. Expected: no message holds it.
#[test]
fn no_message_hides_its_help() {
    fn walk(dir: &Path, faults: &mut Vec<String>) {
        for entry in fs::read_dir(dir).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                walk(&path, faults);
            } else if path.extension().is_some_and(|e| e == "rs") && !path.ends_with("src/error.rs") {
                let code = fs::read_to_string(&path).unwrap();
                let code = code.split("#[cfg(test)]").next().unwrap();
                if hidden_help(code) {
                    faults.push(path.display().to_string());
                }
            }
        }
    }
    let mut faults = Vec::new();
    walk(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"), &mut faults);
    assert!(faults.is_empty(), "give the help to Error::help: {faults:?}");
    for hidden in ["\"a\\n help: b\"", "\"a\\n \\\n        help: b\"", "\"a\\n \\\n help: b\""] {
        assert!(hidden_help(hidden), "{hidden}");
    }
    for plain in ["\"help: b\"", "\"a\\n b help: c\""] {
        assert!(!hidden_help(plain), "{plain}");
    }
}

#[test]
fn files_of_one_module_do_not_need_each_other() {
    let sources = sources();
    let found: Vec<String> = circles(&sources).into_iter().map(|group| group.join(" ")).collect();
    assert!(found.is_empty(), "files that need each other: put data below and what calls it above\n{found:#?}");
}

/// The search for circles must be able to fail, and must not see circles where there are none.
#[test]
fn made_up_circles_are_found() {
    let found = |files: &[(&str, &str)]| {
        let sources: Vec<Source> = files.iter().map(|(path, code)| Source::new(path, code)).collect();
        circles(&sources).into_iter().map(|group| group.join(" ")).collect::<Vec<_>>()
    };
    for leaf in [
        "use super::stem::Stem;",
        "use super::{stem::Stem, Other};",
        "use super::{\n    stem::{self, Stem},\n};",
        "use crate::plant::stem::Stem as Other;",
        "use super::stem;\nfn f() { stem::grow(); }",
        "fn f() { super::stem::grow(); }",
        "fn f(of: crate::plant::stem::Stem) {}",
        // Through what mod.rs hands on.
        "use super::Stem;",
        "use crate::plant::Stem;",
        "use super::*;\nuse super::stem::*;",
    ] {
        let files = [
            ("plant/mod.rs", "mod leaf;\nmod stem;\npub use leaf::Leaf;\npub use stem::Stem;"),
            ("plant/leaf.rs", leaf),
            ("plant/stem.rs", "use super::leaf::Leaf;"),
        ];
        assert_eq!(found(&files), ["plant/leaf.rs plant/stem.rs"], "{leaf}");
    }
    // Of three, and across folders.
    let files = [
        ("a/mod.rs", "mod b;\nmod c;"),
        ("a/b.rs", "use super::c::d::D;"),
        ("a/c/mod.rs", "mod d;\nmod e;"),
        ("a/c/d.rs", "use super::e::E;"),
        ("a/c/e.rs", "use crate::a::b::B;"),
    ];
    assert_eq!(found(&files), ["a/b.rs a/c/d.rs a/c/e.rs"]);
    // A mod.rs that both holds what a child uses and calls the child.
    for code in
        ["mod leaf;\nuse leaf::grow;\npub struct Plant;", "mod leaf;\nfn f() { leaf::grow() }\npub struct Plant;"]
    {
        assert_eq!(found(&[("p/mod.rs", code), ("p/leaf.rs", "use super::Plant;")]), ["p/leaf.rs p/mod.rs"], "{code}");
    }
    let used = "mod leaf;\npub use leaf::Leaf;\npub struct Plant(Leaf);";
    assert_eq!(found(&[("p/mod.rs", used), ("p/leaf.rs", "use super::Plant;")]), ["p/leaf.rs p/mod.rs"]);

    for (top, leaf) in [
        // It names its children and hands on what they have.
        ("mod leaf;\nmod stem;\npub use leaf::{Leaf, grow};\npub(crate) use stem::Stem;", "use super::Stem;"),
        // It holds data and calls nobody, or calls and holds nothing.
        ("mod leaf;\nmod stem;\npub struct Plant;", "use super::Plant;"),
        ("mod leaf;\nmod stem;\nfn f() { leaf::grow(); stem::grow(); }", "use super::stem::Stem;"),
        // A module in the file itself, a test, a comment, who may look, another module's file.
        ("mod leaf;\nmod stem;\nfn f() { leaf::grow(); }\nmod inner { use super::Plant; }", ""),
        ("mod leaf;\nfn f() { leaf::grow(); }", "#[cfg(test)]\nmod tests { use super::super::f; }"),
        ("mod leaf;\nfn f() { leaf::grow(); }", "// use super::f;"),
        ("mod leaf;\nfn f() { leaf::grow(); }", "pub(in crate::p) fn grow() {}"),
        ("mod leaf;\nfn f() { leaf::grow(); }", "use crate::q::leaf::Leaf;"),
    ] {
        let files = [("p/mod.rs", top), ("p/leaf.rs", leaf), ("p/stem.rs", ""), ("q/leaf.rs", "use crate::p::f;")];
        assert_eq!(found(&files), Vec::<String>::new(), "{top}\n{leaf}");
    }
}

/// The test must be able to fail.
#[test]
fn made_up_violations_are_found() {
    let layers = layers("//! | 3 | [`light`] |\n//! | 2 | [`film`], [`sampling`] |\n//! | 1 | [`math`] |");
    assert_eq!(layers.len(), 4);
    for code in [
        "use crate::light::Sun;",
        "use crate::{Error, light::{self, Sun}, math};",
        "fn f() -> crate::light::Sun { todo!() }",
        "use super::light::Sun;",
        "use crate::sampling::Stream;",
    ] {
        assert_eq!(layer_faults(&[Source::new("film.rs", code)], &layers).len(), 1, "{code}");
    }
    assert_eq!(layer_faults(&[Source::new("film/tile.rs", "use super::super::light::Sun;")], &layers).len(), 1);
    assert_eq!(layer_faults(&[Source::new("film/tile.rs", "use super::light::Sun;")], &layers).len(), 0);
    for code in [
        "// use crate::light::Sun;",
        "const A: &str = \"crate::light\"; const B: char = '\"'; fn f<'a>() {} const C: &str = r#\"crate::light \"#;",
        "#[cfg(test)]\nmod tests { use crate::light::Sun; }",
        "use crate::math::Vec3; use crate::Error;",
    ] {
        assert_eq!(layer_faults(&[Source::new("film.rs", code)], &layers), Vec::<String>::new(), "{code}");
    }
    assert_eq!(layer_faults(&[Source::new("attic/mod.rs", "")], &layers).len(), 1);

    for (path, code) in [
        ("plant/leaf.rs", "use crate::material::Leaf;"),
        ("render/label.rs", "use crate::film::Film;"),
        ("scene/assemble/mod.rs", "crate::cli::fail(&e);"),
    ] {
        assert_eq!(never_faults(&[Source::new(path, code)]).len(), 1, "{code}");
    }
    assert!(never_faults(&[Source::new("render/mod.rs", "use crate::film::Film;")]).is_empty());

    for (path, code) in [
        ("accel/brute.rs", "use noise as other;"),
        ("output/mod.rs", "exr::prelude::read();"),
        ("plant/leaf.rs", "use rayon::prelude::*;"),
        ("soil/relief.rs", "let p = noise::Perlin::new(3);"),
        ("soil/relief.rs", "use ::noise::Perlin;"),
    ] {
        assert_eq!(crate_faults(&[Source::new(path, code)]).len(), 1, "{code}");
    }
    for (path, code) in [
        ("texture/noise.rs", "use noise as other;"),
        ("soil/relief.rs", "use crate::texture::noise; let p = noise::Perlin::new(3);"),
        ("output/mod.rs", "mod exr;\nexr::encode();"),
    ] {
        assert_eq!(crate_faults(&[Source::new(path, code)]), Vec::<String>::new(), "{code}");
    }
}
