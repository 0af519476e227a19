//! The dataset card: what the images are, where they come from, how they are read, what they cannot be used for.

use super::statistics::{Species, Statistics};
use crate::format;
use crate::model::image_files::belongs;
use crate::model::photo::Photo;
use crate::model::recipe::{Made, Recipe, Rendering};
use crate::model::split::Split;
use furrow_render::scene::tag::Class;
use furrow_render::settings::Engine;
use furrow_report::{count, keyed, legend, list, pairs, percent, whole};
use maud::{Markup, html};

/// The scene file's name without folder and ending, or where the images come from.
pub(super) fn title(recipe: &Recipe) -> String {
    match &recipe.made {
        Made::Rendered(rendering) => {
            let file = rendering.scene.rsplit('/').next().unwrap_or_default();
            file.trim_end_matches(".ron").to_owned()
        }
        Made::Imported { from, .. } => format!("imported from {from}"),
    }
}

/// One sentence on what it is.
pub(super) fn lead(recipe: &Recipe, found: &Statistics) -> String {
    let sizes: Vec<String> = found.sizes.keys().map(|(w, h)| format!("{w} × {h}")).collect();
    let size = match sizes.as_slice() {
        [one] => format!("{one} pixels"),
        many => format!("{} sizes, {} to {} pixels", many.len(), many[0], many[many.len() - 1]),
    };
    match &recipe.made {
        Made::Rendered(rendering) if rendering.labels_only => {
            format!("Labels of procedurally grown crop fields at {size}, exact by their geometry, without photographs.")
        }
        Made::Rendered(rendering) => {
            let Rendering { engine, spp, .. } = &**rendering;
            let how = if *engine == Engine::Trace { "path traced" } else { "rasterized" };
            format!(
                "Procedurally grown crop fields, {how} with {} a pixel in colour and near infrared at {size}, every pixel labelled \
                 exactly by the geometry that was drawn.",
                count(u64::from(*spp), "sample", "samples")
            )
        }
        Made::Imported { from, .. } => format!("Images and labels imported from {from}, {size}."),
    }
}

/// What decides the images.
pub(super) fn provenance(recipe: &Recipe) -> Markup {
    let mut rows: Vec<(&str, Markup)> = Vec::new();
    match &recipe.made {
        Made::Rendered(made) => {
            rows.push(("scene", html! { code { (made.scene) } }));
            rows.push(("scene SHA-256", html! { code { (made.scene_sha256) } }));
            rows.push(("seed", html! { (made.seed) }));
            rows.push(("image size", html! { (made.width) " × " (made.height) " pixels" }));
            let engine = if made.engine == Engine::Trace { "path tracer" } else { made.engine.name() };
            if made.labels_only {
                rows.push(("drawn", html! { "labels alone, one ray a pixel" }));
            } else {
                rows.push(("engine", html! { (engine) }));
                rows.push(("samples a pixel", html! { (made.spp) }));
                rows.push(("denoised", html! { (if made.denoise { "yes, Open Image Denoise" } else { "no" }) }));
            }
            let mut deviations: Vec<String> = made.without.iter().map(|t| format!("without {}", t.name())).collect();
            deviations.extend(made.max_depth.map(|n| format!("at most {n} surfaces on a path")));
            deviations.extend(made.clamp.map(|x| format!("radiance of a path clamped to {x}")));
            deviations.extend(made.edit.as_ref().map(|name| format!("edit {name}")));
            if !deviations.is_empty() {
                rows.push(("deviations", html! { (deviations.join(", ")) }));
            }
            rows.push(("kernels", html! { (made.kernels) }));
        }
        Made::Imported { from, .. } => rows.push(("imported from", html! { (from) })),
    }
    rows.push(("program", html! { "Furrow " (recipe.furrow) }));
    rows.push(("licence of the images", html! { (recipe.licence) }));
    pairs(&rows)
}

/// Splits with their numbers of images.
pub(super) fn splits(recipe: &Recipe, names: &[Vec<String>; 3], images: u64) -> Markup {
    let words = match &recipe.made {
        Made::Rendered(_) => "Every image is a field of its own: no plant and no patch of soil is in two splits.",
        Made::Imported { .. } => "Whether one plant or one field is in two splits only the source can tell.",
    };
    html! {
        table {
            thead { tr { th { "split" } th { "images" } th { "share" } } }
            tbody {
                @for (split, names) in Split::ALL.into_iter().zip(names) {
                    @let n = names.len() as u64;
                    tr {
                        th { (split.name()) }
                        td { (keyed(&format!("split.{}", split.name()), n, &whole(n))) }
                        td { (percent(n as f64 / images.max(1) as f64)) }
                    }
                }
            }
        }
        p { (words) }
    }
}

/// Species with what the images show of them.
pub(super) fn species(recipe: &Recipe, found: &Statistics) -> Markup {
    let of = |(k, one): (usize, &'_ furrow_field::record::SpeciesRecord)| {
        (k as u16 + 1, one.name.clone(), one.eppo.clone(), one.class.name())
    };
    let mut rows: Vec<(u16, String, String, &str)> = recipe.species.iter().enumerate().map(of).collect();
    if found.species.contains_key(&0) {
        rows.push((0, "unknown".into(), String::new(), ""));
    }
    if rows.is_empty() {
        return html! {};
    }
    let none = Species::default();
    let all: u64 = found.pixels.iter().sum::<u64>() + found.ignored;
    html! {
        div.wide {
            table {
                thead {
                    tr {
                        th { "species" } th { "EPPO" } th { "class" } th { "plants seen" } th { "images" } th { "pixels" } th { "BBCH" }
                    }
                }
                tbody {
                    @for (kind, name, eppo, class) in rows {
                        @let of = found.species.get(&kind).unwrap_or(&none);
                        tr {
                            th { i.dot.(class) {} (name) }
                            td { (eppo) }
                            td { (class) }
                            td { (keyed(&format!("species.{kind}.plants"), of.plants, &whole(of.plants))) }
                            td { (keyed(&format!("species.{kind}.images"), of.images, &whole(of.images))) }
                            td { (percent(of.pixels as f64 / all.max(1) as f64)) }
                            td { (stages(of)) }
                        }
                    }
                }
            }
        }
    }
}

fn stages(of: &Species) -> String {
    match of.bbch {
        Some((a, b)) if a == b => a.to_string(),
        Some((a, b)) => format!("{a} to {b}"),
        None => "–".into(),
    }
}

/// The files of an image, and how they are opened.
pub(super) fn reading(recipe: &Recipe, nir: bool) -> Markup {
    let has = |file: &str| belongs(recipe, file);
    let jpeg = recipe.photo() != Photo::Png;
    let mut rows = Vec::new();
    if !recipe.labels_only() {
        rows.push((if jpeg { "rgb.jpg" } else { "rgb.png" }, html! { "photograph in colour, 8-bit sRGB" }));
    }
    if nir {
        rows.push((if jpeg { "nir.jpg" } else { "nir.png" }, html! { "photograph in near infrared, 8 bit" }));
    }
    rows.push(("semantics.png", html! { "class, indexed: 0 soil, 1 crop, 2 weed, 255 no label" }));
    if has("species.png") {
        rows.push(("species.png", html! { "number of the species in the table above, 0 for none" }));
    }
    if has("plants.png") {
        let plants = "number of the plant, 0 for none; 16 bit, or R + 256 G + 65536 B where one is above 65535";
        rows.push(("plants.png", html! { (plants) }));
    }
    if has("leaves.png") {
        rows.push(("leaves.png", html! { "number of the leaf on its plant, 16 bit, 0 for none" }));
    }
    if has("coverage.png") {
        let coverage = "share of soil, crop, weed in the pixel as R, G, B; they sum to 255";
        rows.push(("coverage.png", html! { (coverage) }));
    }
    if has("geometry.exr") {
        let geometry = html! {
            code { "depth.Z" } " in metres along the optical axis, " code { "normal.X/Y/Z" } " in world coordinates"
        };
        rows.push(("geometry.exr", geometry));
    }
    let record =
        "plants and leaves with boxes, masks, visible fractions and keypoints; the conditions drawn for the image";
    rows.push(("record.json", html! { (record) }));
    let example = if has("plants.png") { EXAMPLE } else { WITHOUT_PLANTS };
    html! {
        (pairs(&rows))
        pre { code { (if recipe.pack.is_some() { PACKED } else { FOLDERS }) (example) } }
        p {
            code { "manifest.json" } " lists every file with its SHA-256; " code { "trace dataset verify DIR" }
            " checks them and every label."
        }
        @if !recipe.formats.is_empty() {
            p { "The same images for other tools, each in the folder of its name:" }
            (pairs(&recipe.formats.iter().map(|name| (name, told(name))).collect::<Vec<_>>()))
        }
    }
}

/// What a format is, and how it is opened.
fn told(name: &str) -> Markup {
    let of = |table: &[(&str, &'static str)]| table.iter().find(|(n, _)| *n == name).map_or("", |(_, text)| text);
    html! { (of(format::NAMES)) br; code { (of(format::READ)) } }
}

const FOLDERS: &str = "import json, numpy as np
from PIL import Image
read = lambda name: open(f\"images/000000/{name}\", \"rb\")
";

const PACKED: &str = "import json, tarfile, numpy as np
from PIL import Image
archive = tarfile.open(\"packs/train-000000.tar\")
read = lambda name: archive.extractfile(f\"000000.{name}\")
";

const EXAMPLE: &str = "semantics = np.array(Image.open(read(\"semantics.png\")))
plants = np.array(Image.open(read(\"plants.png\")))
if plants.ndim == 3:  # numbers beyond 16 bits
    plants = plants @ [1, 1 << 8, 1 << 16]
record = json.load(read(\"record.json\"))
for plant in record[\"plants\"]:
    print(plant[\"number\"], plant[\"class\"], plant[\"seen\"][\"pixels\"], np.sum(plants == plant[\"number\"]))
";

/// The same where images go without `plants.png`.
const WITHOUT_PLANTS: &str = "semantics = np.array(Image.open(read(\"semantics.png\")))
record = json.load(read(\"record.json\"))
for plant in record[\"plants\"]:
    print(plant[\"number\"], plant[\"class\"], plant[\"seen\"][\"pixels\"], plant[\"seen\"][\"mask\"])
";

/// What whoever uses it should know.
pub(super) fn limits(recipe: &Recipe, found: &Statistics) -> Markup {
    let mut all: Vec<String> = Vec::new();
    match &recipe.made {
        Made::Rendered(made) => {
            all.push(
                "The images are synthetic. What they are worth for real fields shows only on real images: keep some as a test set."
                    .into(),
            );
            all.push(
                "A label is that of the surface at the pixel's centre; coverage tells what share of an edge pixel each class has."
                    .into(),
            );
            all.push("Stones, straw and everything else that is no plant is soil.".into());
            if !made.labels_only {
                all.push(if made.denoise {
                    "Denoising blurs what is finer than a pixel.".into()
                } else {
                    format!("The photographs hold the noise of {} samples a pixel, beside the sensor's.", made.spp)
                });
            }
            all.push("Wind and diseases are not modelled. Damage by insects, dead tissue and motion blur are there where the scene file says so.".into());
        }
        Made::Imported { .. } => {
            all.push("The labels are those of the source, as exact as whoever drew them.".into());
            if !found.has_plants() {
                all.push("The source tells classes; no plant is told from another.".into());
            }
            all.push("How much of a plant others hide is not known: visible fractions stand at 1.".into());
        }
    }
    all.extend(found.warnings.iter().map(|(words, n)| format!("{}: {words}", count(*n, "image", "images"))));
    list(&all)
}

/// Whose work it stands on.
pub(super) fn sources(recipe: &Recipe) -> Markup {
    match &recipe.made {
        Made::Rendered(_) => html! {
            p {
                "Procedural fields for plant detection: Di Cicco, Potena, Grisetti & Pretto, "
                cite { "Automatic Model Based Dataset Generation for Fast and Accurate Crop and Weeds Detection" }
                ", IROS 2017. Growth stages: Meier 2001 (BBCH). Leaf optics: Féret, Gitelson, Noble & Jacquemoud 2017 (PROSPECT-D). \
                 Sky: Hošek & Wilkie 2012. Rays: Embree, Wald et al. 2014."
            }
        },
        Made::Imported { .. } => html! { p { "Cite the source of the images, and keep to its licence." } },
    }
}

/// The bar of what the pixels show.
pub(super) fn pixels(found: &Statistics) -> Markup {
    let all: u64 = found.pixels.iter().sum::<u64>() + found.ignored;
    let mut parts: Vec<(&str, u64)> = Class::ALL.iter().map(|c| (c.name(), found.pixels[*c as usize])).collect();
    if found.ignored > 0 {
        parts.push(("no label", found.ignored));
    }
    let share = |n: u64| n as f64 / all.max(1) as f64;
    let class = |name: &str| Class::named(name).map_or("none", Class::name);
    let entry = |(name, n): &(&str, u64)| {
        let value = keyed(&format!("pixels.{}", class(name)), n, &percent(share(*n)));
        (html! { i.dot.(class(name)) {} }, html! { (name) " " (value) })
    };
    html! {
        div.stack aria-hidden="true" {
            @for (name, n) in &parts { i class=(class(name)) style=(format!("flex-grow:{:.6}", share(*n))) {} }
        }
        (legend(parts.iter().map(entry)))
    }
}
