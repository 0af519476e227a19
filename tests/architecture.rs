//! Architecture rules: module layers, forbidden imports, and the files that may use a crate, checked on the
//! sources' `use` lines and paths.
//!
//! Rationale: modules that import only lower layers can be understood, tested and replaced one at a time; label code
//! that cannot name a light cannot depend on lighting. Expected: no violation. Source: the table of layers in
//! `src/lib.rs` and the rules in this file.
//!
//! References that count: `crate::module`, `use crate::{…}`, `super::` chains that leave their module, `furrow::module`
//! in programs, and the first name of a path for foreign crates. Unit tests inside the sources may import anything.

#[path = "architecture/circles.rs"]
mod circles;

use circles::{circles, folder_circles};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// Modules (left) that never import others (right), in addition to the rules of the layers.
///
/// A path with a slash is one file. `material` and `light` are on neighbouring layers, `bsdf` and `scene` far apart;
/// the layers alone would allow some of these imports, or would allow them if a module moved.
const NEVER: &[(&str, &str)] = &[
    // Botany, soil and plant placement do not depend on optics.
    ("plant", "material bsdf scene light accel sensor integrator"),
    ("soil", "material bsdf scene light accel sensor integrator"),
    ("scatter", "material bsdf scene light accel sensor integrator"),
    // Pure functions in the local shading frame, testable in isolation.
    ("bsdf", "geometry texture scene light material sampling"),
    ("material", "light"),
    ("light", "material"),
    // Takes textures, marks and maps as plain data, whoever grew them.
    ("material", "plant soil scatter model"),
    // Uses meshes and their masks only; other modules hold a `&dyn Intersect`.
    ("accel", "material light scene sensor"),
    // Reads files into meshes and surface descriptions; the scattering of light is the materials' task.
    ("model", "material bsdf light scene optics accel integrator"),
    // A label must not depend on filtering, noise or light.
    ("render/label.rs", "film sampling bsdf material light integrator"),
    ("integrator", "accel film output plant soil scatter texture"),
    ("film", "scene sampling"),
    // The rasterizer shares the scene with the path tracer, but no ray tracing.
    ("raster", "integrator accel bsdf sampling output"),
    // A writer receives what rays have found; it traces none.
    ("output/mitsuba/", "accel"),
    // The pipeline does not depend on datasets; writing files is the task of `output`.
    ("job", "dataset train compare"),
    // Plain data.
    ("settings", "integrator render output raster"),
    // Describes the changes; building, rendering and writing are the tasks of other modules.
    ("field/ablation/", "integrator accel bsdf output dataset"),
    // Obtains images and label maps from `render`.
    ("dataset", "integrator bsdf"),
    // Reads the files that writers produce, and so also works on real images.
    ("train", "scene render integrator accel film light material bsdf plant soil scatter"),
    // Reads image files, whichever program wrote them.
    ("compare", "render integrator accel film light material bsdf plant soil scatter"),
    // `cli` is shared by the programs.
    ("*", "cli bin"),
];

/// Foreign crates, and the only files, folders or modules that may name them. `*` allows any file.
const ALLOWED: &[(&str, &str)] = &[
    // Bytes encoded as text inside a model's document or an HTML page.
    ("base64", "model/uri.rs report/page.rs"),
    // Numbers as bytes for the GPU, and waiting for it.
    ("bytemuck", "raster/"),
    // Command lines; hyper-parameters are read from flags and from files alike.
    ("clap", "bin/ cli/mod.rs train/fit/settings.rs reference/manual.rs"),
    // Checksums of TensorBoard records.
    ("crc32c", "train/fit/log/events.rs"),
    // Checksums at the end of PNG files.
    ("crc32fast", "texture/png_end.rs"),
    // Tables: measured spectra and points on plants (input), bounding boxes of plants and report figures (output).
    (
        "csv",
        "optics/measured.rs optics/munsell.rs optics/prospect.rs dataset/format/cropandweed.rs dataset/format/traits.rs report/csv.rs train/deploy/points.rs",
    ),
    // Layers (output), environment maps (input).
    ("exr", "output/exr/mod.rs texture/exr_size.rs texture/openexr.rs"),
    // Text on sheets of images.
    ("font8x8", "output/letters.rs"),
    // `math` re-exports the vectors; two files sum in double precision.
    ("glam", "math/ film/ accel/brute.rs"),
    // Weights of the networks that ship with the project.
    ("half", "train/weights.rs"),
    // Checksums as text.
    ("hex", "field/library.rs dataset/ train/data/photos.rs train/run.rs train/weights.rs report/page.rs"),
    // Heads of requests to a local web page.
    ("httparse", "bin/trace/watch/http.rs"),
    ("humantime", "bin/ cli/mod.rs"),
    ("hw_skymodel", "light/hosek.rs"),
    // Photographs (input), and thumbnails for HTML pages (output).
    ("image", "texture/ output/photo.rs"),
    ("indicatif", "bin/"),
    // Compressed point clouds.
    ("laz", "output/las.rs"),
    // Open Image Denoise, if installed.
    ("libloading", "output/denoise/oidn/"),
    // HTML pages: the modules that write them, and the parts they share.
    (
        "maud",
        "report/ compare/page.rs compare/gap/ dataset/report/ train/figure/page.rs bin/trace/catalogue/page.rs bin/trace/dataset/status/page.rs",
    ),
    // Principal components and a linear solver.
    ("nalgebra", "train/refine/appearance/logistic.rs train/refine/self_training.rs"),
    ("noise", "texture/noise.rs"),
    // File watching: reload when a file is saved.
    ("notify", "bin/trace/watch/files.rs"),
    // Established implementations of image metrics.
    ("nv_flip", "compare/flip.rs"),
    ("palette", "compare/color.rs"),
    // Label maps need lossless pixels; generated textures need 16 bits and text chunks; some programs store EXIF in those.
    ("png", "output/png.rs texture/draw/ texture/orientation.rs"),
    // Tables of a dataset.
    ("parquet", "dataset/index/table.rs"),
    ("pollster", "raster/gpu.rs"),
    // Core time and memory of the process, memory of the machine.
    ("procfs", "dataset/make/meter.rs field/estimate.rs field/profile.rs"),
    // ONNX files.
    ("prost", "train/deploy/onnx/ train/fit/log/events.rs"),
    // Mitsuba scene documents.
    ("quick_xml", "output/mitsuba/xml.rs"),
    ("rand", "sampling/rng.rs"),
    ("rand_pcg", "sampling/rng.rs"),
    // Only outer loops run in parallel: images, plants, soil maps, sensor pixels, textures of exports.
    (
        "rayon",
        "accel/embree.rs render/ sensor/ job/threads.rs dataset/ compare/ field/assemble/bank.rs field/assemble/estimate.rs field/assemble/ground.rs field/assemble/sow.rs field/assemble/stand.rs field/library.rs field/shipped.rs field/species.rs field/traits.rs output/appearance/ output/mitsuba/ output/usd/ soil/bake.rs soil/crack.rs soil/crumb.rs soil/ground.rs soil/in_view.rs soil/openness.rs light/sky.rs texture/maps.rs material/ground.rs raster/textures.rs",
    ),
    // One reader for all RON files, which reports faults inside a value at their position.
    ("ron", "ron_file/"),
    // Power spectra of images.
    ("rustfft", "compare/gap/frequency.rs"),
    // File types describe their own schema.
    ("schemars", "*"),
    ("serde", "*"),
    // glTF documents, read and written; dataset records and formats; requests and responses of the `watch` page
    // and of `serve`; scene files as JSON.
    (
        "serde_json",
        "model/document.rs model/gltf/ output/gltf/ dataset/ compare/table.rs compare/gap/known.rs compare/gap/table.rs train/ report/table.rs reference/ ron_file/json.rs ron_file/schema.rs bin/trace/serve/ bin/trace/watch/",
    ),
    // Weights, in the format that training frameworks read.
    ("safetensors", "train/weights.rs"),
    (
        "sha2",
        "field/library.rs field/named_file.rs model/files.rs dataset/ train/data/photos.rs train/run.rs train/weights.rs",
    ),
    ("signal_hook", "cli/signal.rs"),
    // Parts hit by the samples of a pixel: nearly always one or two.
    ("smallvec", "film/tally.rs output/exr/cryptomatte.rs"),
    ("sobol_burley", "sampling/sobol.rs"),
    ("solar_positioning", "light/position.rs"),
    // Edit distance of a misspelt name to the known names.
    ("strsim", "ron_file/suggest.rs"),
    // Images as one archive, for programs that read them while they are generated.
    ("tar", "dataset/read/archive.rs dataset/make/pack/ dataset/deliver/stream.rs"),
    // libtorch: networks and their training.
    (
        "tch",
        "train/torch/ train/fit/gradients.rs train/fit/loss.rs train/fit/optimiser.rs train/fit/trainer.rs train/deploy/",
    ),
    // Files are written completely or not at all. Temporary folders serve the denoiser, a scene copied into a dataset or a stream, and the small dataset that a cost estimate renders.
    (
        "tempfile",
        "atomic_file.rs cli/mod.rs dataset/make/cost_estimate.rs dataset/make/plan.rs dataset/make/push/ dataset/deliver/stream.rs output/denoise/program.rs",
    ),
    // An external image viewer.
    ("tev_client", "bin/trace/watch/tev.rs"),
    // GPUs.
    ("wgpu", "raster/"),
];

/// Dependencies that no source names: Cargo passes the path of libtorch only to the build scripts of direct dependents.
const UNNAMED: &[&str] = &["torch_sys"];

/// Dependencies of tests and benches alone.
const TESTS_ALONE: [&str; 3] = ["criterion", "gltf", "proptest"];

/// A source file without its comments, string literals and unit tests.
struct Source {
    /// Path below `src`, with `/`.
    path: String,
    code: String,
}

impl Source {
    fn new(path: &str, text: &str) -> Self {
        Self { path: path.to_owned(), code: bare(text) }
    }

    /// Returns the module that the file belongs to; "bin" for programs.
    fn module(&self) -> &str {
        self.path.split('/').next().unwrap_or_default().trim_end_matches(".rs")
    }

    /// Returns the module path of the file: `plant/mod.rs` is `[plant]`, `plant/leaf.rs` is `[plant, leaf]`.
    fn path_of_modules(&self) -> Vec<&str> {
        let parts = self.path.trim_end_matches(".rs").split('/');
        parts.filter(|p| !matches!(*p, "mod" | "lib")).collect()
    }

    /// Returns the modules that the file names, including its own.
    fn modules(&self) -> BTreeSet<String> {
        let own = if self.module() == "bin" { "furrow" } else { "crate" };
        let mut modules: BTreeSet<String> = named(&self.code, own).into_iter().collect();
        let depth = self.path_of_modules().len();
        let climb = "super::".repeat(depth);
        if depth > 0 {
            // One `super::` per level of the module leads to the root of the crate.
            let shorter = format!("{climb}super::");
            modules.extend(named(&self.code.replace(&shorter, ""), &format!("{climb}self").replace("::self", "")));
        }
        modules
    }
}

fn is_name(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// Returns the first names after `prefix::`, single or in braces.
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

/// Returns the first name of each item of a list in braces.
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

/// Returns the code without comments, string and character literals, and `#[cfg(test)]` modules.
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
            // A character literal, or a lifetime.
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

/// Returns the length of the raw string literal at the start of `rest`; `None` if there is none.
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

/// Crates whose modules are layered one by one; in all others the crate is the module.
const MANY: [&str; 5] = ["base", "optics", "grow", "render", "cli"];

/// Paths as if all crates were one: `crates/grow/src/plant/leaf.rs` is `plant/leaf.rs`, `crates/dataset/src/read/set.rs` is
/// `dataset/read/set.rs`; `furrow_grow::plant` is `crate::plant`, and `crate::read` in `furrow-dataset` is `crate::dataset::read`.
fn unified(krate: &str, path: &str, text: &str, crates: &[String]) -> Option<Source> {
    let many = MANY.contains(&krate);
    let path = match path {
        "lib.rs" if many => return None,
        "lib.rs" => format!("{krate}/mod.rs"),
        path if many => path.to_owned(),
        path => format!("{krate}/{path}"),
    };
    let mut text = bare(text);
    if !many {
        text = text.replace("(in crate::", &format!("(in crate::{krate}::"));
        text = replaced(&text, "crate", &format!("crate::{krate}"));
    }
    for other in crates {
        let target = if MANY.contains(&other.as_str()) { "crate".into() } else { format!("crate::{other}") };
        text = replaced(&text, &format!("furrow_{other}"), &target);
    }
    // Re-exported at the root of the crate.
    let text = text.replace("crate::Error", "crate::error::Error").replace("crate::Result", "crate::error::Result");
    Some(Source { path, code: text })
}

/// Replaces a path's first name.
fn replaced(code: &str, name: &str, with: &str) -> String {
    let mut out = String::new();
    let mut rest = code;
    while let Some(at) = rest.find(name) {
        let (before, after) = (&rest[..at], &rest[at + name.len()..]);
        let whole = !before.ends_with(|c: char| is_name(c) || c == ':') && after.starts_with("::");
        out.push_str(before);
        out.push_str(if whole { with } else { name });
        rest = after;
    }
    out + rest
}

/// All sources of the workspace but those of `furrow-embree`, which knows no other crate; without files of tests.
fn sources() -> Vec<Source> {
    fn walk(folder: &Path, root: &Path, found: &mut Vec<(String, String)>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                walk(&path, root, found);
            } else if path.extension().is_some_and(|e| e == "rs") && !path.ends_with("tests.rs") {
                let name = path.strip_prefix(root).unwrap().to_str().unwrap().replace('\\', "/");
                found.push((name, fs::read_to_string(&path).unwrap()));
            }
        }
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut crates: Vec<String> = fs::read_dir(root.join("crates"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_str().unwrap().to_owned())
        .filter(|name| name != "embree")
        .collect();
    crates.sort();
    let mut out = Vec::new();
    for krate in &crates {
        let (folder, mut files) = (root.join("crates").join(krate).join("src"), Vec::new());
        walk(&folder, &folder, &mut files);
        out.extend(files.iter().filter_map(|(path, text)| unified(krate, path, text, &crates)));
    }
    let (folder, mut files) = (root.join("src"), Vec::new());
    walk(&folder, &folder, &mut files);
    for (path, text) in files {
        let mut code = bare(&text);
        for other in &crates {
            let target = if MANY.contains(&other.as_str()) { "furrow".into() } else { format!("furrow::{other}") };
            code = replaced(&code, &format!("furrow_{other}"), &target);
        }
        out.push(Source { path, code });
    }
    out.sort_by(|a, b| a.path.cmp(&b.path));
    out
}

/// Layers by module, from the table in `src/lib.rs`: ten a crate, and one more for each `·` between its modules. A crate that lists no
/// modules is one.
fn layers(lib: &str) -> BTreeMap<String, u32> {
    let mut layers = BTreeMap::new();
    for line in lib.lines() {
        let cells: Vec<&str> = line.trim_start_matches("//!").split('|').map(str::trim).collect();
        let [_, layer, krate, modules, _] = cells.as_slice() else { continue };
        let Ok(layer) = layer.parse::<u32>() else { continue };
        let krate = krate.trim_matches('`').trim_start_matches("furrow-");
        if !MANY.contains(&krate) {
            layers.insert(krate.to_owned(), 10 * layer);
            continue;
        }
        for (level, modules) in (10 * layer..).zip(modules.split('·')) {
            layers.extend(modules.split(',').map(|module| (module.trim().trim_matches('`').to_owned(), level)));
        }
    }
    layers
}

fn layer_faults(sources: &[Source], layers: &BTreeMap<String, u32>) -> Vec<String> {
    let mut faults = Vec::new();
    for source in sources.iter().filter(|s| !matches!(s.module(), "lib" | "bin" | "prelude" | "scene_format")) {
        let Some(own) = layers.get(source.module()) else {
            faults.push(format!("src/{}: its module has no layer in the table of src/lib.rs", source.path));
            continue;
        };
        for module in source.modules().iter().filter(|r| *r != source.module()) {
            if let Some(other) = layers.get(module)
                && other >= own
            {
                faults.push(format!(
                    "src/{}: imports `{module}` of layer {other}, but is in layer {own}: move the shared code into a lower layer",
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
            if *who == "*" || *who == source.module() || opens(who, &source.path) {
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

/// Returns whether a source names a foreign crate. A module may share a crate's name: after `mod noise;`, `noise::` is
/// the module.
fn names(source: &Source, krate: &str) -> bool {
    !own_module(source, krate) && named(&source.code, krate).len() + renamed(&source.code, krate) > 0
}

/// Counts imports of a crate under another name or as a whole: `use noise as other;`, `use ::noise::Perlin;`.
fn renamed(code: &str, krate: &str) -> usize {
    let forms =
        [format!("use {krate} as "), format!("use {krate};"), format!("::{krate}::"), format!("extern crate {krate}")];
    forms
        .iter()
        .flat_map(|form| code.match_indices(form.as_str()))
        .filter(|(at, _)| !code[..*at].ends_with(|c: char| is_name(c) || c == '>'))
        .count()
}

/// Returns whether a name refers to a module or an import of this file instead of a crate.
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
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut declared: BTreeSet<String> = BTreeSet::new();
    for entry in fs::read_dir(root.join("crates")).unwrap() {
        let path = entry.unwrap().path();
        let krate = path.file_name().unwrap().to_str().unwrap().to_owned();
        if MANY.contains(&krate.as_str()) {
            let lib = fs::read_to_string(path.join("src/lib.rs")).unwrap();
            let modules = lib.lines().filter_map(|l| l.strip_prefix("pub mod ")?.strip_suffix(';'));
            declared.extend(modules.map(str::to_owned));
        } else {
            declared.insert(krate);
        }
    }
    declared.insert("furrow".into());
    let listed: BTreeSet<String> = layers(&lib()).into_keys().collect();
    assert_eq!(declared, listed);
    assert!(listed.len() > 15);
}

#[test]
fn some_modules_never_import_others() {
    let sources = sources();
    let faults = never_faults(&sources);
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
    // A rule about a file or module that no longer exists would always pass.
    for (who, _) in NEVER {
        assert!(
            *who == "*" || sources.iter().any(|s| s.module() == *who || opens(who, &s.path)),
            "no source file or module is named {who}"
        );
    }
}

#[test]
fn foreign_crates_are_named_only_where_the_table_allows() {
    let sources = sources();
    let faults = crate_faults(&sources);
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
    // An unused permission must be removed.
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
    let section = manifest.split("[workspace.dependencies]").nth(1).unwrap().split("\n[").next().unwrap();
    let named: BTreeSet<String> = section
        .lines()
        .filter_map(|l| l.split_once(" = "))
        .map(|(name, _)| name.replace('-', "_"))
        .filter(|name| !name.starts_with("furrow_") && !TESTS_ALONE.contains(&name.as_str()))
        .collect();
    let places = ALLOWED.iter().map(|(name, _)| name);
    let listed: BTreeSet<String> = places.chain(UNNAMED).map(|name| (*name).to_owned()).collect();
    assert_eq!(named, listed);
    for krate in UNNAMED {
        let faults: Vec<String> = sources().iter().filter(|s| names(s, krate)).map(|s| s.path.clone()).collect();
        assert!(faults.is_empty(), "{krate} is named in {faults:?}: list it with its files");
    }
}

/// The only folder that may contain `unsafe`, beside the crate `furrow-embree`: it calls Open Image Denoise.
const UNSAFE: [&str; 1] = ["output/denoise/oidn/"];

/// Returns the sources outside [`UNSAFE`] that contain `unsafe` or allow it.
fn unsafe_faults(sources: &[Source]) -> Vec<String> {
    let words = |s: &Source| s.code.split(|c: char| !is_name(c)).any(|word| matches!(word, "unsafe" | "unsafe_code"));
    let elsewhere = |s: &&Source| !UNSAFE.iter().any(|folder| s.path.starts_with(folder));
    sources.iter().filter(elsewhere).filter(|s| words(s)).map(|s| s.path.clone()).collect()
}

/// Rationale: the compiler cannot check calls into C, so they are confined to the crate `furrow-embree`, which is
/// not among these sources, and one folder that reviewers watch.
/// Expected: no `unsafe` anywhere else, and no `allow` attribute that would override the lint in `Cargo.toml`.
#[test]
fn unsafe_code_is_confined() {
    let sources = sources();
    assert_eq!(unsafe_faults(&sources), Vec::<String>::new());
    for folder in UNSAFE {
        let calls = |s: &Source| s.path.starts_with(folder) && s.code.contains("unsafe {");
        assert!(sources.iter().any(calls), "{folder}: no `unsafe` block left, remove it from UNSAFE");
    }
    for code in ["fn f() { unsafe { g() } }", "#![allow(unsafe_code)]\nfn f() {}", "unsafe impl Send for A {}"] {
        assert_eq!(unsafe_faults(&[Source::new("film/a.rs", code)]), ["film/a.rs"], "{code}");
        assert!(unsafe_faults(&[Source::new("output/denoise/oidn/a.rs", code)]).is_empty(), "{code}");
    }
    assert!(unsafe_faults(&[Source::new("film/a.rs", "// unsafe\nfn unsafely() { say(\"unsafe\") }")]).is_empty());
}

/// Returns whether a string literal of the source contains a help text after a line break, even on the literal's next
/// source line.
fn hidden_help(code: &str) -> bool {
    code.match_indices("\\n").any(|(at, _)| {
        let rest = code[at + 2..].trim_start().trim_start_matches("\\\n");
        rest.trim_start().starts_with("help: ")
    })
}

/// Rationale: an error's help is a separate field, which programs can read and one function prints. Expected: no
/// message contains it.
#[test]
fn no_message_hides_its_help() {
    fn walk(dir: &Path, faults: &mut Vec<String>) {
        for entry in fs::read_dir(dir).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                walk(&path, faults);
            } else if path.extension().is_some_and(|e| e == "rs") && !path.ends_with("crates/base/src/error.rs") {
                let code = fs::read_to_string(&path).unwrap();
                let code = code.split("#[cfg(test)]").next().unwrap();
                if hidden_help(code) {
                    faults.push(path.display().to_string());
                }
            }
        }
    }
    let mut faults = Vec::new();
    for folder in ["src", "crates"] {
        walk(&Path::new(env!("CARGO_MANIFEST_DIR")).join(folder), &mut faults);
    }
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
    assert!(
        found.is_empty(),
        "circular imports: move data into a lower module and its callers into a higher one\n{found:#?}"
    );
}

#[test]
fn folders_of_one_module_do_not_need_each_other() {
    let sources = sources();
    let found = folder_circles(&sources);
    assert!(found.is_empty(), "folders that need each other: move the shared files into a lower folder\n{found:#?}");
    let files = [
        ("a/b/x.rs", "use crate::a::c::y::Y;"),
        ("a/b/z.rs", ""),
        ("a/c/y.rs", ""),
        ("a/c/w.rs", "use crate::a::b::z::Z;"),
    ];
    let files = files.map(|(path, code)| Source::new(path, code));
    assert!(circles(&files).is_empty(), "no file needs itself");
    assert_eq!(folder_circles(&files), ["a: b c"]);
}

/// The circle search must find circles, and must not report any where there are none.
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
        // Through a re-export of mod.rs.
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
    // A circle of three files, across folders.
    let files = [
        ("a/mod.rs", "mod b;\nmod c;"),
        ("a/b.rs", "use super::c::d::D;"),
        ("a/c/mod.rs", "mod d;\nmod e;"),
        ("a/c/d.rs", "use super::e::E;"),
        ("a/c/e.rs", "use crate::a::b::B;"),
    ];
    assert_eq!(found(&files), ["a/b.rs a/c/d.rs a/c/e.rs"]);
    // A mod.rs that defines an item a child uses, and also calls the child.
    for code in
        ["mod leaf;\nuse leaf::grow;\npub struct Plant;", "mod leaf;\nfn f() { leaf::grow() }\npub struct Plant;"]
    {
        assert_eq!(found(&[("p/mod.rs", code), ("p/leaf.rs", "use super::Plant;")]), ["p/leaf.rs p/mod.rs"], "{code}");
    }
    let used = "mod leaf;\npub use leaf::Leaf;\npub struct Plant(Leaf);";
    assert_eq!(found(&[("p/mod.rs", used), ("p/leaf.rs", "use super::Plant;")]), ["p/leaf.rs p/mod.rs"]);

    for (top, leaf) in [
        // It declares its children and re-exports their items.
        ("mod leaf;\nmod stem;\npub use leaf::{Leaf, grow};\npub(crate) use stem::Stem;", "use super::Stem;"),
        // It holds data and calls nothing, or calls and holds nothing.
        ("mod leaf;\nmod stem;\npub struct Plant;", "use super::Plant;"),
        ("mod leaf;\nmod stem;\nfn f() { leaf::grow(); stem::grow(); }", "use super::stem::Stem;"),
        // An inline module, a test, a comment, a visibility path, a file of another module.
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

/// The rules must find violations.
#[test]
fn made_up_violations_are_found() {
    let layers =
        layers("//! | 3 | `furrow-optics` | `light` |\n//! | 2 | `furrow-render` | `math` · `film`, `sampling` |");
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
        ("field/assemble/mod.rs", "crate::cli::fail(&e);"),
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
