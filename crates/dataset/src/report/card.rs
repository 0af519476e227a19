//! The dataset card: contents, provenance, reading the files, limits.

use super::statistics::{Species, Statistics};
use crate::format;
use crate::model::image_files::belongs;
use crate::model::image_format::ImageFormat;
use crate::model::optional_maps::OptionalMap;
use crate::model::recipe::{ImageOrigin, Recipe, Rendering};
use crate::model::split::Split;
use furrow_base::math::{ToFloat, ToInt};
use furrow_render::scene::tag::Class;
use furrow_render::settings::Engine;
use furrow_report::{count, keyed, legend, list, pairs, percent, whole};
use maud::{Markup, html};

/// Returns the title: the scene file's name without folder and extension, or the format of imported images.
pub(super) fn title(recipe: &Recipe) -> String {
    match &recipe.made {
        ImageOrigin::Rendered(rendering) => {
            let file = rendering.scene.rsplit('/').next().unwrap_or_default();
            file.trim_end_matches(".ron").to_owned()
        }
        ImageOrigin::Imported { from, .. } => format!("imported from {from}"),
    }
}

/// Returns a one-sentence description of the dataset.
pub(super) fn lead(recipe: &Recipe, found: &Statistics) -> String {
    let sizes: Vec<String> = found.sizes.keys().map(|(w, h)| format!("{w} × {h}")).collect();
    let size = match sizes.as_slice() {
        [one] => format!("{one} pixels"),
        many => format!("{} sizes, {} to {} pixels", many.len(), many[0], many[many.len() - 1]),
    };
    match &recipe.made {
        ImageOrigin::Rendered(rendering) if rendering.labels_only => {
            format!("Labels of procedurally grown crop fields at {size}, exact from the geometry, without images.")
        }
        ImageOrigin::Rendered(rendering) => {
            let Rendering { engine, spp, .. } = &**rendering;
            let how = if *engine == Engine::Trace { "path traced" } else { "rasterized" };
            format!(
                "Procedurally grown crop fields, {how} with {} per pixel in colour and near infrared at {size}. Every pixel is \
                 labelled exactly from the rendered geometry.",
                count(u64::from(*spp), "sample", "samples")
            )
        }
        ImageOrigin::Imported { from, .. } => format!("Images and labels imported from {from}, {size}."),
    }
}

/// Returns the provenance: everything that determines the images.
pub(super) fn provenance(recipe: &Recipe) -> Markup {
    let mut rows: Vec<(&str, Markup)> = Vec::new();
    match &recipe.made {
        ImageOrigin::Rendered(made) => {
            rows.push(("scene", html! { code { (made.scene) } }));
            rows.push(("scene SHA-256", html! { code { (made.scene_sha256) } }));
            rows.push(("seed", html! { (made.seed) }));
            rows.push(("image size", html! { (made.width) " × " (made.height) " pixels" }));
            let engine = if made.engine == Engine::Trace { "path tracer" } else { made.engine.name() };
            if made.labels_only {
                rows.push(("rendered", html! { "labels alone, one ray per pixel" }));
            } else {
                rows.push(("engine", html! { (engine) }));
                rows.push(("samples per pixel", html! { (made.spp) }));
                rows.push(("denoised", html! { (if made.denoise { "yes, Open Image Denoise" } else { "no" }) }));
            }
            let mut deviations: Vec<String> = made.without.iter().map(|t| format!("without {}", t.name())).collect();
            deviations.extend(made.max_depth.map(|n| format!("at most {n} surfaces on a path")));
            deviations.extend(made.clamp.map(|x| format!("radiance of a path clamped to {x}")));
            deviations.extend(made.quality.map(|preset| format!("quality {} ({})", preset.name(), preset.bias())));
            deviations.extend(made.edit.as_ref().map(|name| format!("edit {name}")));
            if !deviations.is_empty() {
                rows.push(("deviations", html! { (deviations.join(", ")) }));
            }
            rows.push(("kernels", html! { (made.kernels) }));
        }
        ImageOrigin::Imported { from, .. } => rows.push(("imported from", html! { (from) })),
    }
    rows.push(("program", html! { "Furrow " (recipe.furrow) }));
    rows.push(("licence of the images", html! { (recipe.licence) }));
    pairs(&rows)
}

/// Returns the table of splits with their numbers of images.
pub(super) fn splits(recipe: &Recipe, names: &[Vec<String>; 3], images: u64) -> Markup {
    let words = match &recipe.made {
        ImageOrigin::Rendered(_) => {
            "Fields are never divided between splits: no plant and no patch of soil is in two splits."
        }
        ImageOrigin::Imported { .. } => "Only the source can state whether a plant or a field is in two splits.",
    };
    html! {
        table {
            thead { tr { th { "split" } th { "images" } th { "share" } } }
            tbody {
                @for (split, names) in Split::ALL.into_iter().zip(names) {
                    @let n = names.len().to_u64();
                    tr {
                        th { (split.name()) }
                        td { (keyed(&format!("split.{}", split.name()), n, &whole(n))) }
                        td { (percent(n.to_f64() / images.max(1).to_f64())) }
                    }
                }
            }
        }
        p { (words) }
    }
}

/// Returns the table of species with the numbers of visible plants and pixels.
pub(super) fn species(recipe: &Recipe, found: &Statistics) -> Markup {
    let of = |(k, one): (usize, &'_ furrow_field::record::SpeciesRecord)| {
        (k.to_u16() + 1, one.name.clone(), one.eppo.clone(), one.class.name())
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
                        th { "species" } th { "EPPO" } th { "class" } th { "visible plants" } th { "images" } th { "pixels" } th { "BBCH" }
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
                            td { (percent(of.pixels.to_f64() / all.max(1).to_f64())) }
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

/// Returns the list of an image's files, with an example of reading them.
pub(super) fn reading(recipe: &Recipe, nir: bool) -> Markup {
    let has = |file: &str| belongs(recipe, file);
    let jpeg = recipe.image_format() != ImageFormat::Png;
    let mut rows = Vec::new();
    if !recipe.labels_only() {
        rows.push((if jpeg { "rgb.jpg" } else { "rgb.png" }, html! { "colour image, 8-bit sRGB" }));
    }
    if nir {
        rows.push((if jpeg { "nir.jpg" } else { "nir.png" }, html! { "near-infrared image, 8 bits" }));
    }
    rows.push(("semantics.png", html! { "class, indexed: 0 soil, 1 crop, 2 weed, 255 no label" }));
    if has("species.png") {
        rows.push(("species.png", html! { "number of the species in the table above, 0 for none" }));
    }
    if has("plants.png") {
        let plants = "number of the plant, 0 for none; 16 bits, or R + 256 G + 65536 B if a number exceeds 65535";
        rows.push(("plants.png", html! { (plants) }));
    }
    if has("leaves.png") {
        rows.push(("leaves.png", html! { "number of the leaf on its plant, 16 bits, 0 for none" }));
    }
    if has("coverage.png") {
        let coverage = "fractions of soil, crop and weed in the pixel as R, G, B; their sum is 255";
        rows.push(("coverage.png", html! { (coverage) }));
    }
    if has("geometry.exr") {
        let keeps = |maps: [OptionalMap; 2]| maps.into_iter().any(|map| recipe.keeps(map));
        let (depth, normals) =
            (keeps([OptionalMap::Depth, OptionalMap::Depth32]), keeps([OptionalMap::Normals, OptionalMap::Normals16]));
        let geometry = html! {
            @if depth { code { "depth.Z" } " in metres along the optical axis" }
            @if depth && normals { ", " }
            @if normals { code { "normal.X/Y/Z" } " in world coordinates" }
        };
        rows.push(("geometry.exr", geometry));
    }
    let record =
        "plants and leaves with boxes, masks, visible fractions and keypoints; the conditions sampled for the image";
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
            p { "The same images in other formats, each in the folder of its name:" }
            (pairs(&recipe.formats.iter().map(|name| (name, format_description(name))).collect::<Vec<_>>()))
        }
    }
}

/// Returns the description of a format, and how to open it.
fn format_description(name: &str) -> Markup {
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

/// The example for datasets without `plants.png`.
const WITHOUT_PLANTS: &str = "semantics = np.array(Image.open(read(\"semantics.png\")))
record = json.load(read(\"record.json\"))
for plant in record[\"plants\"]:
    print(plant[\"number\"], plant[\"class\"], plant[\"seen\"][\"pixels\"], plant[\"seen\"][\"mask\"])
";

/// Returns the list of limits that users of the dataset should know.
pub(super) fn limits(recipe: &Recipe, found: &Statistics) -> Markup {
    let mut all: Vec<String> = Vec::new();
    match &recipe.made {
        ImageOrigin::Rendered(made) => {
            all.push(
                "The images are synthetic. Only real images can show their value for real fields: keep some as a test set."
                    .into(),
            );
            all.push(
                "A label is that of the surface at the pixel's centre; coverage gives the fraction of each class in pixels at edges."
                    .into(),
            );
            all.push("Stones, straw and everything else that is not a plant are soil.".into());
            if !made.labels_only {
                all.push(if made.denoise {
                    "Denoising blurs structures finer than a pixel.".into()
                } else {
                    format!("The images contain the noise of {} samples per pixel, and sensor noise.", made.spp)
                });
            }
            all.push("Wind and diseases are not modelled. Insect damage, dead tissue and motion blur occur if the scene file requests them.".into());
        }
        ImageOrigin::Imported { .. } => {
            all.push("The labels and their accuracy are those of the source.".into());
            if !found.has_plants() {
                all.push("The source labels classes; it does not distinguish plants.".into());
            }
            all.push("Occlusion is unknown: all visible fractions are 1.".into());
        }
    }
    all.extend(found.warnings.iter().map(|(words, n)| format!("{}: {words}", count(*n, "image", "images"))));
    list(&all)
}

/// Returns the literature on which the dataset is based.
pub(super) fn sources(recipe: &Recipe) -> Markup {
    match &recipe.made {
        ImageOrigin::Rendered(_) => html! {
            p {
                "Procedural fields for plant detection: Di Cicco, Potena, Grisetti & Pretto, "
                cite { "Automatic Model Based Dataset Generation for Fast and Accurate Crop and Weeds Detection" }
                ", IROS 2017. Growth stages: Meier 2001 (BBCH). Leaf optics: Féret, Gitelson, Noble & Jacquemoud 2017 (PROSPECT-D). \
                 Sky: Hošek & Wilkie 2012. Rays: Embree, Wald et al. 2014."
            }
        },
        ImageOrigin::Imported { .. } => html! { p { "Cite the source of the images, and comply with its licence." } },
    }
}

/// Returns the bar of the pixels' classes, with its legend.
pub(super) fn pixels(found: &Statistics) -> Markup {
    let all: u64 = found.pixels.iter().sum::<u64>() + found.ignored;
    let mut parts: Vec<(&str, u64)> = Class::ALL.iter().map(|c| (c.name(), found.pixels[*c as usize])).collect();
    if found.ignored > 0 {
        parts.push(("no label", found.ignored));
    }
    let share = |n: u64| n.to_f64() / all.max(1).to_f64();
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
