//! The dataset card: what the images are, where they come from, how they are read, what they cannot be used for.

use super::statistics::{Species, Statistics};
use crate::dataset::format;
use crate::dataset::recipe::{Made, Recipe, Rendering};
use crate::dataset::split::Split;
use crate::html::{count, escape, keyed, pairs, percent, whole};
use crate::scene::tag::Class;
use crate::settings::Engine;
use std::fmt::Write;

/// The page's name without folder and ending, or where the images come from.
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
        Made::Rendered(Rendering { engine, spp, .. }) => {
            let how = if *engine == Engine::Trace { "path traced" } else { "drawn" };
            format!(
                "Procedurally grown crop fields, {how} with {} a pixel in colour and near infrared at {size}, every pixel labelled \
                 exactly by the geometry that was drawn.",
                count(u64::from(*spp), "sample", "samples")
            )
        }
        Made::Imported { from, .. } => format!("Images and labels brought in from {}, {size}.", escape(from)),
    }
}

/// What decides the images.
pub(super) fn provenance(recipe: &Recipe) -> String {
    let mut rows: Vec<(&str, String)> = Vec::new();
    let code = |text: &str| format!("<code>{}</code>", escape(text));
    match &recipe.made {
        Made::Rendered(made) => {
            rows.push(("scene", code(&made.scene)));
            rows.push(("scene SHA-256", code(&made.scene_sha256)));
            rows.push(("seed", made.seed.to_string()));
            rows.push(("image size", format!("{} × {} pixels", made.width, made.height)));
            let engine = if made.engine == Engine::Trace { "path tracer" } else { made.engine.name() };
            rows.push(("engine", engine.into()));
            rows.push(("samples a pixel", made.spp.to_string()));
            rows.push(("denoised", if made.denoise { "yes, Open Image Denoise".into() } else { "no".into() }));
            let mut deviations: Vec<String> = made.without.iter().map(|t| format!("without {}", t.name())).collect();
            deviations.extend(made.max_depth.map(|n| format!("at most {n} surfaces on a path")));
            deviations.extend(made.clamp.map(|x| format!("radiance of a path cut at {x}")));
            deviations.extend(made.edit.as_ref().map(|name| format!("edit {}", escape(name))));
            if !deviations.is_empty() {
                rows.push(("deviations", deviations.join(", ")));
            }
            rows.push(("kernels", escape(&made.kernels)));
        }
        Made::Imported { from, .. } => rows.push(("imported from", escape(from))),
    }
    rows.push(("program", format!("Furrow {}", escape(&recipe.furrow))));
    rows.push(("licence of the images", escape(&recipe.licence)));
    pairs(&rows)
}

/// Splits with their numbers of images.
pub(super) fn splits(recipe: &Recipe, names: &[Vec<String>; 3], images: u64) -> String {
    let mut rows = String::new();
    for (split, names) in Split::ALL.into_iter().zip(names) {
        let n = names.len() as u64;
        let key = format!("split.{}", split.name());
        let share = percent(n as f64 / images.max(1) as f64);
        let _ =
            write!(rows, "<tr><th>{}</th><td>{}</td><td>{share}</td></tr>", split.name(), keyed(&key, n, &whole(n)));
    }
    let words = match &recipe.made {
        Made::Rendered(_) => "Every image is a field of its own: no plant and no patch of soil is in two splits.",
        Made::Imported { .. } => "Whether one plant or one field is in two splits only the source can tell.",
    };
    format!(
        "<table><thead><tr><th>split</th><th>images</th><th>share</th></tr></thead><tbody>{rows}</tbody></table><p>{words}</p>"
    )
}

/// Species with what the images show of them.
pub(super) fn species(recipe: &Recipe, found: &Statistics) -> String {
    let none = Species::default();
    let all: u64 = found.pixels.iter().sum::<u64>() + found.ignored;
    let mut rows = String::new();
    let mut row = |name: &str, eppo: &str, class: &str, kind: u16| {
        let of = found.species.get(&kind).unwrap_or(&none);
        let stages = match of.bbch {
            Some((a, b)) if a == b => a.to_string(),
            Some((a, b)) => format!("{a} to {b}"),
            None => "–".into(),
        };
        let _ = write!(
            rows,
            "<tr><th><i class=\"dot {class}\"></i>{}</th><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{stages}</td></tr>",
            escape(name),
            escape(eppo),
            class,
            keyed(&format!("species.{kind}.plants"), of.plants, &whole(of.plants)),
            keyed(&format!("species.{kind}.images"), of.images, &whole(of.images)),
            percent(of.pixels as f64 / all.max(1) as f64),
        );
    };
    for (k, one) in recipe.species.iter().enumerate() {
        row(&one.name, &one.eppo, one.class.name(), k as u16 + 1);
    }
    if found.species.contains_key(&0) {
        row("not told", "", "", 0);
    }
    if rows.is_empty() {
        return String::new();
    }
    format!(
        "<div class=\"wide\"><table><thead><tr><th>species</th><th>EPPO</th><th>class</th><th>plants seen</th><th>images</th>\
         <th>pixels</th><th>BBCH</th></tr></thead><tbody>{rows}</tbody></table></div>"
    )
}

/// The files of an image, and how they are opened.
pub(super) fn reading(recipe: &Recipe, nir: bool) -> String {
    let rendered = matches!(recipe.made, Made::Rendered(_));
    let mut rows: Vec<(&str, String)> = vec![("rgb.png", "photograph in colour, 8-bit sRGB".into())];
    if nir {
        rows.push(("nir.png", "photograph in near infrared, 8 bit".into()));
    }
    rows.push(("semantics.png", "class, indexed: 0 soil, 1 crop, 2 weed, 255 no label".into()));
    if rendered {
        rows.push(("species.png", "number of the species in the table above, 0 for none".into()));
    }
    rows.push(("plants.png", "number of the plant, 16 bit, 0 for none".into()));
    rows.push(("leaves.png", "number of the leaf on its plant, 16 bit, 0 for none".into()));
    if rendered {
        rows.push(("coverage.png", "share of soil, crop, weed in the pixel as R, G, B; they sum to 255".into()));
        rows.push((
            "geometry.exr",
            "<code>depth.Z</code> in metres along the optical axis, <code>normal.X/Y/Z</code> in the world".into(),
        ));
    }
    rows.push((
        "record.json",
        "plants and leaves with boxes, masks, visible fractions and keypoints; what was drawn for the image".into(),
    ));
    let mut html = pairs(&rows);
    html.push_str(EXAMPLE);
    if !recipe.formats.is_empty() {
        let of =
            |table: &[(&str, &'static str)], name: &str| table.iter().find(|(n, _)| *n == name).map_or("", |(_, t)| t);
        let told = |name: &str| {
            format!("{}<br><code>{}</code>", escape(of(format::NAMES, name)), escape(of(format::READ, name)))
        };
        let rows: Vec<(&str, String)> = recipe.formats.iter().map(|f| (f.as_str(), told(f))).collect();
        let _ = write!(html, "<p>The same images for other tools, each in the folder of its name:</p>{}", pairs(&rows));
    }
    html
}

const EXAMPLE: &str = "<pre><code>import json, numpy as np
from PIL import Image
folder = \"images/000000\"
semantics = np.array(Image.open(f\"{folder}/semantics.png\"))
plants = np.array(Image.open(f\"{folder}/plants.png\"))
record = json.load(open(f\"{folder}/record.json\"))
for plant in record[\"plants\"]:
    print(plant[\"number\"], plant[\"class\"], plant[\"seen\"][\"pixels\"], np.sum(plants == plant[\"number\"]))
</code></pre>
<p><code>manifest.json</code> lists every file with its SHA-256; <code>trace dataset verify DIR</code> checks them and every label.</p>";

/// What whoever uses it should know.
pub(super) fn limits(recipe: &Recipe, found: &Statistics) -> String {
    let mut all: Vec<String> = Vec::new();
    match &recipe.made {
        Made::Rendered(made) => {
            all.push(
                "The images are synthetic. What they are worth for real fields shows only on real images: keep some to judge by.".into(),
            );
            all.push(
                "A label is that of the surface at the pixel's centre; coverage tells what share of an edge pixel each class has."
                    .into(),
            );
            all.push("Stones, straw and everything else that is no plant is soil.".into());
            all.push(if made.denoise {
                "Denoising blurs what is finer than a pixel.".into()
            } else {
                format!("The photographs hold the noise of {} samples a pixel, beside the sensor's.", made.spp)
            });
            all.push("No disease, no damage by insects, no wind, no motion blur.".into());
        }
        Made::Imported { .. } => {
            all.push("The labels are those of the source, as exact as whoever drew them.".into());
            if !found.has_plants() {
                all.push("The source tells classes; no plant is told from another.".into());
            }
            all.push("How much of a plant others hide is not known: visible fractions stand at 1.".into());
        }
    }
    for (words, n) in &found.warnings {
        all.push(format!("{}: {}", count(*n, "image", "images"), escape(words)));
    }
    format!("<ul><li>{}</li></ul>", all.join("</li><li>"))
}

/// Whose work it stands on.
pub(super) fn sources(recipe: &Recipe) -> &'static str {
    match &recipe.made {
        Made::Rendered(_) => {
            "<p>Procedural fields for plant detection: Di Cicco, Potena, Grisetti &amp; Pretto, <cite>Automatic Model Based Dataset \
             Generation for Fast and Accurate Crop and Weeds Detection</cite>, IROS 2017. Growth stages: Meier 2001 (BBCH). Leaf optics: \
             Féret, Gitelson, Noble &amp; Jacquemoud 2017 (PROSPECT-D). Sky: Hošek &amp; Wilkie 2012. Rays: Embree, Wald et al. 2014.</p>"
        }
        Made::Imported { .. } => "<p>Cite the source of the images, and keep to its licence.</p>",
    }
}

/// The bar of what the pixels show.
pub(super) fn pixels(found: &Statistics) -> String {
    let all: u64 = found.pixels.iter().sum::<u64>() + found.ignored;
    let mut parts: Vec<(&str, u64)> = Class::ALL.iter().map(|c| (c.name(), found.pixels[*c as usize])).collect();
    if found.ignored > 0 {
        parts.push(("no label", found.ignored));
    }
    let share = |n: u64| n as f64 / all.max(1) as f64;
    let (mut bar, mut legend) = (String::new(), String::new());
    for (name, n) in parts {
        let class = if Class::named(name).is_some() { name } else { "none" };
        let _ = write!(bar, "<i class=\"{class}\" style=\"flex-grow:{:.6}\"></i>", share(n));
        let value = keyed(&format!("pixels.{class}"), n, &percent(share(n)));
        let _ = write!(legend, "<span><i class=\"dot {class}\"></i>{name} {value}</span>");
    }
    format!("<div class=\"stack\" aria-hidden=\"true\">{bar}</div><p class=\"legend\">{legend}</p>")
}
