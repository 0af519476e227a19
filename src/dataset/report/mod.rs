//! What is in a dataset, for people: `report.html`.
//!
//! One page that needs no network and nothing beside it: style, charts and pictures lie inside. It holds no clock time and no
//! path, so equal datasets have equal reports. Records are read one by one and few pictures are shown, so it stays small
//! however many images there are.
//!
//! | file | idea |
//! |---|---|
//! | `statistics`, `histogram`, `photographs` | what the images say together |
//! | `sheet`, `chart`, `card` | pictures, charts, words |
//!
//! How text and numbers look is `html`'s.

mod card;
mod chart;
mod histogram;
mod photographs;
mod sheet;
mod statistics;
#[cfg(test)]
mod tests;

use super::set::{Set, Whole};
use super::split::Split;
use crate::Result;
use crate::html::{document, escape, keyed, section, whole};
use chart::{Series, histograms};
use histogram::Histogram;

use photographs::Photographs;
use statistics::{PLANTS, Pair, Statistics};

/// The report's file, below the dataset's folder.
pub const FILE: &str = "report.html";

/// Writes the report of a dataset whose images are all there.
pub fn write(set: &Set, out: &mut Whole<'_>) -> Result<()> {
    let mut found = Statistics::new(set.recipe.count);
    for record in set.all() {
        found.add(&record?);
    }
    let names = Split::ALL.map(|split| set.names(split));
    let sheet = sheet::sheet(set, &names)?;
    let photographs = photographs::measure(set)?;
    out.file(FILE, |page| page.put(html(set, &found, &photographs, &names, &sheet)))
}

/// The page.
fn html(set: &Set, found: &Statistics, photographs: &Photographs, names: &[Vec<String>; 3], sheet: &str) -> String {
    let recipe = &set.recipe;
    let switch = "<input type=\"checkbox\" id=\"labels\"><label for=\"labels\" class=\"switch\">Show labels on all</label>\
                  <span class=\"hint\">or point at one image, or tap it</span>";
    let card = format!(
        "<div class=\"two\"><div><h3>Where it comes from</h3>{}</div><div><h3>Splits</h3>{}</div></div>",
        card::provenance(recipe),
        card::splits(recipe, names, found.images)
    );
    let body = [
        figures(found),
        card::pixels(found),
        section("Images", &format!("{switch}<div class=\"sheet\">{sheet}</div>")),
        section("Labels", &grid(&labels(found))),
        section("Plants", &(card::species(recipe, found) + &grid(&plants(found)))),
        section("Light", &grid(&light(found))),
        section("Soil", &grid(&soil(found))),
        section("Camera and photographs", &grid(&camera(found, photographs))),
        section("Dataset card", &card),
        section("How to read it", &card::reading(recipe, photographs.nir.n() > 0)),
        section("Limits", &card::limits(recipe, found)),
        section("Sources", card::sources(recipe)),
    ];
    let footer = format!("Written by Furrow {}", escape(&recipe.furrow));
    document("Dataset", &card::title(recipe), &card::lead(recipe, found), "", &body.concat(), &footer)
}

/// The numbers at the top.
fn figures(found: &Statistics) -> String {
    let [crop, weed] = sums(&found.plants);
    let leaves: u64 = found.leaf_pixels.iter().map(Histogram::n).sum();
    let rows = [
        ("images", found.images, "images"),
        ("plants.crop", crop, "crop plants seen"),
        ("plants.weed", weed, "weeds seen"),
        ("leaves", leaves, "leaves seen"),
        ("plants.cut", found.cut, "plants cut by the frame"),
        ("plants.hidden", found.hidden, "plants wholly hidden"),
    ];
    // Nobody counted what was not told apart.
    let rows = if found.has_plants() { &rows[..] } else { &rows[..1] };
    let row = |(key, n, words): &(&str, u64, &str)| {
        format!("<div><b>{}</b><span>{words}</span></div>", keyed(key, n, &whole(*n)))
    };
    format!("<div class=\"figures\">{}</div>\n", rows.iter().map(row).collect::<String>())
}

/// Plants over all images, by class.
fn sums(plants: &Pair) -> [u64; 2] {
    plants.each_ref().map(|h| (h.mean() * h.n() as f64).round() as u64)
}

fn grid(charts: &str) -> String {
    if charts.is_empty() { String::new() } else { format!("<div class=\"charts\">\n{charts}</div>") }
}

/// A chart with a row for crop and a row for weed.
fn pair(key: &str, title: &str, unit: &str, values: &Pair) -> String {
    let rows = PLANTS.into_iter().zip(values).map(|(class, values)| Series {
        name: class.name(),
        class: class.name(),
        values,
    });
    histograms(key, title, unit, &rows.collect::<Vec<_>>())
}

/// A chart with one row.
fn one(key: &str, title: &str, unit: &str, class: &str, values: &Histogram) -> String {
    histograms(key, title, unit, &[Series { name: "", class, values }])
}

fn labels(found: &Statistics) -> String {
    let [_, crop, weed] = &found.shares;
    let row = |name, values| Series { name, class: name, values };
    histograms("share", "Share of an image", "% of its pixels; images", &[row("crop", crop), row("weed", weed)])
        + &if found.has_plants() {
            pair("plants", "Plants in an image", "images", &found.plants)
        } else {
            String::new()
        }
        + &pair("plant_pixels", "Size of a plant", "pixels seen; plants", &found.plant_pixels)
        + &pair("leaf_pixels", "Size of a leaf", "pixels seen; leaves", &found.leaf_pixels)
        + &pair(
            "plant_visible",
            "Visible fraction of a plant",
            "%, 100 where nothing hides it; plants",
            &found.plant_visible,
        )
        + &pair(
            "leaf_visible",
            "Visible fraction of a leaf",
            "%, 100 where nothing hides it; leaves",
            &found.leaf_visible,
        )
}

fn plants(found: &Statistics) -> String {
    pair("bbch", "Growth stage", "BBCH; plants", &found.bbch)
        + &pair("age_days", "Age", "days after emergence; plants", &found.age_days)
        + &pair("height_cm", "Height", "cm; plants", &found.height_cm)
}

fn light(found: &Statistics) -> String {
    let light = &found.light;
    let all: u64 = light.kinds.values().sum();
    let kinds: Vec<(String, &str, f64)> =
        light.kinds.iter().map(|(kind, n)| (kind.clone(), "light", *n as f64 / all.max(1) as f64)).collect();
    let kinds = if kinds.len() > 1 { chart::shares("Lights", "share of all lights", &kinds) } else { String::new() };
    chart::suns(&light.suns)
        + &one("sun_elevation_deg", "Elevation of the sun", "degrees; images", "light", &light.elevation_deg)
        + &one("irradiance", "Light on the ground", "mean of R, G, B, W·m⁻²·nm⁻¹; images", "light", &light.irradiance)
        + &one("cloud", "Cloud cover", "%; images", "light", &light.cloud)
        + &one("turbidity", "Turbidity", "2 clear, 10 hazy; images", "light", &light.turbidity)
        + &kinds
}

fn soil(found: &Statistics) -> String {
    let soil = &found.soil;
    let all: f64 = soil.layers.values().sum();
    let name = |file: &str| file.rsplit_once('.').map_or(file, |(stem, _)| stem).to_owned();
    let layers: Vec<(String, &str, f64)> =
        soil.layers.iter().map(|(file, sum)| (name(file), "soil", sum / all.max(1e-12))).collect();
    one("moisture", "Moisture", "% of saturation; images", "soil", &soil.moisture)
        + &chart::shares("Layers", "mean share of the ground", &layers)
        + &one("roughness_mm", "Roughness", "rms height of the ground, mm; images", "soil", &soil.roughness_mm)
        + &one("clods", "Clods", "longer than 5 mm, on a square metre; images", "soil", &soil.clods)
        + &one("straw", "Straw", "% of the ground; images", "soil", &soil.straw)
}

fn camera(found: &Statistics, photographs: &Photographs) -> String {
    let camera = &found.camera;
    let unit = |words: &str| format!("{words}; {} images", whole(photographs.measured));
    one("camera_height_m", "Height of the camera", "m; images", "plain", &camera.height_m)
        + &one("tilt_deg", "Tilt of the camera", "degrees from straight down; images", "plain", &camera.tilt_deg)
        + &one("pixel_mm", "Size of a pixel on the ground", "mm; images", "plain", &camera.pixel_mm)
        + &chart::swatches("Mean colours of photographs", &unit("dark to bright"), &photographs.colors)
        + &one("brightness", "Brightness", &unit("mean of R, G, B, of 255"), "plain", &photographs.brightness)
        + &one("nir", "Brightness in near infrared", &unit("of 255"), "plain", &photographs.nir)
        + &one("clipped", "Overexposed pixels", &unit("% of an image"), "plain", &photographs.clipped)
}
