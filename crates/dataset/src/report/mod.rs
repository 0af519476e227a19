//! The report of a dataset, `report.html`.
//!
//! It is a single self-contained page with embedded styles, charts and images, and works without a network. It contains
//! no clock time and no path, so equal datasets have equal reports. Records are read one by one and few images are
//! shown, so its size is limited whatever the number of images.
//!
//! | file | contents |
//! |---|---|
//! | `statistics`, `photographs` | statistics of the records and of the pixel values |
//! | `sheet`, `again`, `card` | contact sheet, command that renders an image again, dataset card |
//!
//! The charts and the page layout are those of [`furrow_report`].

mod again;
mod card;
mod contact_sheet;
mod photographs;
mod statistics;
#[cfg(test)]
mod tests;

use crate::model::split::Split;
use crate::read::set::{Set, SetWriter};
use furrow_base::Result;
use furrow_base::math::{RoundTo, ToFloat};
use furrow_report::chart::{self, Series, grid, histograms};
use furrow_report::{Number, Page, Tally, numbers, section, whole};
use maud::{Markup, html};
use photographs::Photographs;
use statistics::{PLANTS, Pair, Statistics};

const STYLE: &str = include_str!("sheet.css");
const SCRIPT: &str = include_str!("sheet.js");

/// The report's file, below the dataset's folder.
pub const FILE: &str = "report.html";

/// Writes the report of a dataset with all its images.
pub fn write(set: &Set, out: &mut SetWriter<'_>) -> Result<()> {
    let mut found = Statistics::new(set.recipe.count);
    for record in set.all() {
        found.add(&record?);
    }
    let names = Split::ALL.map(|split| set.names(split));
    let sheet = contact_sheet::sheet(set, &names)?;
    let photographs = photographs::measure(set)?;
    out.file(FILE, |page| page.put(html(set, &found, &photographs, &names, &sheet)))
}

/// Returns the HTML of the page.
fn html(set: &Set, found: &Statistics, photographs: &Photographs, names: &[Vec<String>; 3], sheet: &Markup) -> String {
    let recipe = &set.recipe;
    let body = html! {
        (figures(found))
        (card::pixels(found))
        (section("Images", html! {
            input type="checkbox" id="labels";
            label for="labels" class="switch" { "Show labels on all" }
            span.hint { "or point at an image, or tap it" }
            (sheet)
            (again::section(recipe))
        }))
        (section("Labels", grid(labels(found))))
        (section("Plants", html! { (card::species(recipe, found)) (grid(plants(found))) }))
        (section("Light", grid(light(found))))
        (section("Soil", grid(soil(found))))
        (section("Camera and exposure", grid(camera(found, photographs))))
        (section("Dataset card", html! {
            div.two {
                div { h3 { "Where it comes from" } (card::provenance(recipe)) }
                div { h3 { "Splits" } (card::splits(recipe, names, found.images)) }
            }
        }))
        (section("Reading the files", card::reading(recipe, photographs.nir.n() > 0)))
        (section("Limits", card::limits(recipe, found)))
        (section("Sources", card::sources(recipe)))
    };
    let (title, lead) = (card::title(recipe), card::lead(recipe, found));
    Page { kind: "Dataset", title: &title, lead: html! { (lead) }, style: STYLE, body, script: SCRIPT }
        .html(&recipe.furrow)
}

/// Returns the figures at the top of the page.
fn figures(found: &Statistics) -> Markup {
    let [crop, weed] = sums(&found.plants);
    let leaves: u64 = found.leaf_pixels.iter().map(Tally::n).sum();
    let all = [
        Number::count("images", found.images, "images"),
        Number::count("plants.crop", crop, "visible crop plants"),
        Number::count("plants.weed", weed, "visible weeds"),
        Number::count("leaves", leaves, "visible leaves"),
        Number::count("plants.cut", found.cut, "plants cut by the frame"),
        Number::count("plants.hidden", found.hidden, "fully hidden plants"),
    ];
    // Without plant labels only the number of images is known.
    let known = if found.has_plants() { all.len() } else { 1 };
    numbers(all.into_iter().take(known))
}

/// Returns the total number of plants in all images, by class.
fn sums(plants: &Pair) -> [u64; 2] {
    plants.each_ref().map(|tally| (tally.mean() * tally.n().to_f64()).round_to::<u64>())
}

/// Returns a chart with a row for crop and a row for weed.
fn pair(key: &str, title: &str, unit: &str, values: &Pair) -> Markup {
    let rows = PLANTS.into_iter().zip(values).map(|(class, values)| Series {
        name: class.name(),
        class: class.name(),
        values,
    });
    histograms(key, title, unit, &rows.collect::<Vec<_>>())
}

/// Returns a chart with one row.
fn one(key: &str, title: &str, unit: &str, class: &str, values: &Tally) -> Markup {
    histograms(key, title, unit, &[Series { name: "", class, values }])
}

fn labels(found: &Statistics) -> Vec<Markup> {
    let [_, crop, weed] = &found.shares;
    let row = |name, values| Series { name, class: name, values };
    let shares = [row("crop", crop), row("weed", weed)];
    let mut all = vec![histograms("share", "Fraction of an image", "% of its pixels; images", &shares)];
    if found.has_plants() {
        all.push(pair("plants", "Plants per image", "images", &found.plants));
    }
    let hidden = |things: &str| format!("%, 100 if nothing hides it; {things}");
    all.extend([
        pair("plant_pixels", "Size of a plant", "visible pixels; plants", &found.plant_pixels),
        pair("leaf_pixels", "Size of a leaf", "visible pixels; leaves", &found.leaf_pixels),
        pair("plant_visible", "Visible fraction of a plant", &hidden("plants"), &found.plant_visible),
        pair("leaf_visible", "Visible fraction of a leaf", &hidden("leaves"), &found.leaf_visible),
    ]);
    all
}

fn plants(found: &Statistics) -> [Markup; 3] {
    [
        pair("bbch", "Growth stage", "BBCH; plants", &found.bbch),
        pair("age_days", "Age", "days after emergence; plants", &found.age_days),
        pair("height_cm", "Height", "cm; plants", &found.height_cm),
    ]
}

fn light(found: &Statistics) -> [Markup; 6] {
    let light = &found.light;
    let all: u64 = light.kinds.values().sum();
    let kinds: Vec<(String, &str, f64)> =
        light.kinds.iter().map(|(kind, n)| (kind.clone(), "light", n.to_f64() / all.max(1).to_f64())).collect();
    [
        chart::suns(&light.suns),
        one("sun_elevation_deg", "Elevation of the sun", "degrees; images", "light", &light.elevation_deg),
        one("irradiance", "Irradiance on the ground", "mean RGB, W·m⁻²·nm⁻¹; images", "light", &light.irradiance),
        one("cloud", "Cloud cover", "%; images", "light", &light.cloud),
        one("turbidity", "Turbidity", "2 is clear, 10 hazy; images", "light", &light.turbidity),
        chart::shares("Lights", "fraction of all lights", if kinds.len() > 1 { &kinds } else { &[] }),
    ]
}

fn soil(found: &Statistics) -> [Markup; 5] {
    let soil = &found.soil;
    let all: f64 = soil.layers.values().sum();
    let name = |file: &str| file.rsplit_once('.').map_or(file, |(stem, _)| stem).to_owned();
    let layers: Vec<(String, &str, f64)> =
        soil.layers.iter().map(|(file, sum)| (name(file), "soil", sum / all.max(1e-12))).collect();
    [
        one("moisture", "Moisture", "% of saturation; images", "soil", &soil.moisture),
        chart::shares("Layers", "mean fraction of the ground", &layers),
        one("roughness_mm", "Roughness", "rms height of the ground, mm; images", "soil", &soil.roughness_mm),
        one("clods", "Clods", "longer than 5 mm, per m²; images", "soil", &soil.clods),
        one("straw", "Straw", "% of the ground; images", "soil", &soil.straw),
    ]
}

fn camera(found: &Statistics, photographs: &Photographs) -> [Markup; 7] {
    let camera = &found.camera;
    let unit = |words: &str| format!("{words}; {} images", whole(photographs.measured));
    [
        one("camera_height_m", "Height of the camera", "m; images", "plain", &camera.height_m),
        one("tilt_deg", "Tilt of the camera", "degrees from vertical; images", "plain", &camera.tilt_deg),
        one("pixel_mm", "Size of a pixel on the ground", "mm; images", "plain", &camera.pixel_mm),
        chart::colors("Mean colours of images", &unit("dark to bright"), &photographs.colors),
        one("brightness", "Brightness", &unit("mean of R, G, B, of 255"), "plain", &photographs.brightness),
        one("nir", "Brightness in near infrared", &unit("of 255"), "plain", &photographs.nir),
        one("clipped", "Overexposed pixels", &unit("% of an image"), "plain", &photographs.clipped),
    ]
}
