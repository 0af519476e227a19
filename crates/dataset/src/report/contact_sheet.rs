//! The contact sheet: some images of each split with overlaid labels, which can be filtered, sorted, searched and
//! enlarged.

use crate::Set;
use crate::model::record::Record;
use crate::model::sample::{IGNORE, Sample};
use crate::model::split::Split;
use crate::read::native;
use furrow_base::Result;
use furrow_base::math::{ToFloat, ToInt};
use furrow_field::record::SpeciesRecord;
use furrow_optics::light::LightRecord;
use furrow_output::ImageData;
use furrow_render::scene::tag::Class;
use furrow_report::{count, data_url, percent};
use maud::{Markup, html};
use rayon::prelude::*;

/// Largest number of images.
const MOST: usize = 24;
/// Largest side of an image, pixels.
const SIDE: u32 = 360;
/// Background colour of datasets of labels alone.
const EARTH: [u8; 3] = [70, 62, 54];
/// JPEG quality of the images.
const QUALITY: u8 = 82;

/// Returns the contact sheet. `names` are the images of each split, in the order of [`Split::ALL`].
pub(super) fn sheet(set: &Set, names: &[Vec<String>; 3]) -> Result<Markup> {
    let all: Vec<&String> = chosen(names.each_ref().map(Vec::len), set.recipe.lights().to_usize())
        .into_iter()
        .zip(names)
        .flat_map(|(places, names)| places.into_iter().map(move |k| &names[k]))
        .collect();
    let samples: Vec<Sample> = all.par_iter().map(|name| native::sample(set, name)).collect::<Result<_>>()?;
    let properties: Vec<ImageProperties> =
        samples.iter().map(|sample| ImageProperties::of(&sample.record, &set.recipe.species)).collect();
    let unusual = unusual(&properties);
    let cards: Vec<Markup> = samples
        .par_iter()
        .zip(&properties)
        .zip(&unusual)
        .map(|((sample, properties), unusual)| card(sample, properties, *unusual, set.recipe.pack.is_none()))
        .collect::<Result<_>>()?;
    Ok(html! {
        (tools(&properties))
        div.sheet { @for card in &cards { (card) } }
        dialog #large {
            form method="dialog" { button { "Close" } }
            div {}
            p {}
        }
    })
}

/// Properties for filtering and sorting images.
struct ImageProperties {
    /// Fractions of the image covered by crop and by weed, percent.
    cover: [f64; 2],
    /// BBCH stage of the oldest crop plant.
    stage: Option<u32>,
    /// Species in view, sorted and without duplicates.
    species: Vec<String>,
    /// Kinds of its lights, sorted and without duplicates.
    lights: Vec<&'static str>,
    /// Elevation of the sun, degrees.
    sun: Option<f64>,
}

impl ImageProperties {
    fn of(record: &Record, table: &[SpeciesRecord]) -> Self {
        let pixels = f64::from(record.width) * f64::from(record.height);
        let share = |class: Class| {
            100.0 * record.classes.iter().find(|c| c.class == class).map_or(0, |c| c.pixels).to_f64() / pixels
        };
        let crops = record.seen().filter(|p| p.class == Class::Crop);
        let stage = crops.filter_map(|p| Some(p.grown.as_ref()?.bbch)).max();
        let named = |kind: u16| Some(table.get(usize::from(kind).checked_sub(1)?)?.name.clone());
        let mut species: Vec<String> = record.seen().filter_map(|p| named(p.kind)).collect();
        species.sort();
        species.dedup();
        let all = record.conditions.as_ref().map_or(&[][..], |conditions| &conditions.lights);
        let mut lights: Vec<&str> = all.iter().map(LightRecord::kind).collect();
        lights.sort_unstable();
        lights.dedup();
        let sun = all.iter().find_map(|light| match light {
            LightRecord::Daylight(day) => Some(day.sun_elevation_deg),
            _ => None,
        });
        Self { cover: [share(Class::Crop), share(Class::Weed)], stage, species, lights, sun }
    }

    fn values(&self) -> [f64; 3] {
        [self.cover[0], self.cover[1], self.stage.map_or(f64::NAN, f64::from)]
    }
}

/// Returns a measure of how unusual each image is: the largest distance of one of its values from the mean, in standard
/// deviations.
fn unusual(properties: &[ImageProperties]) -> Vec<f64> {
    let mut far = vec![0.0_f64; properties.len()];
    for k in 0..3 {
        let known = || properties.iter().map(|f| f.values()[k]).filter(|v| v.is_finite());
        let n = known().count().max(1).to_f64();
        let mean = known().sum::<f64>() / n;
        let sd = (known().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt();
        for (far, properties) in far.iter_mut().zip(properties) {
            let distance = (properties.values()[k] - mean).abs() / sd.max(1e-9);
            if distance.is_finite() && sd > 0.0 {
                *far = far.max(distance);
            }
        }
    }
    far
}

/// Returns the controls for filtering and sorting; they are hidden without scripts.
fn tools(properties: &[ImageProperties]) -> Markup {
    let mut species: Vec<&String> = properties.iter().flat_map(|f| &f.species).collect();
    species.sort();
    species.dedup();
    let mut lights: Vec<&str> = properties.iter().flat_map(|f| f.lights.iter().copied()).collect();
    lights.sort_unstable();
    lights.dedup();
    html! {
        p.tools hidden {
            label { "Show " select #show {
                option value="all" { "all" }
                option value="crop" { "with crop" }
                option value="weed" { "with weeds" }
                option value="bare" { "without plants" }
                @for name in species { option value={ "species:" (name) } { "with " (name) } }
                @for kind in lights { option value={ "light:" (kind) } { "lit by " (kind) } }
            } }
            label { "Sort by " select #sort {
                option value="place" { "set" }
                option value="unusual" { "most unusual first" }
                option value="cover" { "most cover first" }
                option value="bare" { "least cover first" }
                option value="stage" { "oldest crop first" }
                option value="sun" { "lowest sun first" }
            } }
            label { "Find " input #find type="search" placeholder="number" size="8"; }
            span #shown {}
        }
    }
}

/// Returns the indices of the images to show for splits of these sizes: the same number from each split if it has
/// enough, spread evenly over it and over the `lights` of a view, whose images follow one another.
fn chosen(sizes: [usize; Split::ALL.len()], lights: usize) -> [Vec<usize>; Split::ALL.len()] {
    let mut quota = [0; Split::ALL.len()];
    while quota.iter().sum::<usize>() < MOST && quota != sizes {
        // Chooses the split with the fewest chosen images among those with images left.
        let left = (0..sizes.len()).filter(|k| quota[*k] < sizes[*k]).min_by_key(|k| quota[*k]);
        if let Some(k) = left {
            quota[k] += 1;
        }
    }
    // A split never cuts a view, so its size is a multiple of `lights`.
    let place = |i: usize, k: usize| i * sizes[k] / quota[k] / lights * lights + i % lights;
    std::array::from_fn(|k| (0..quota[k]).map(|i| place(i, k)).collect())
}

/// Returns the card of one image: image, labels, caption.
fn card(sample: &Sample, properties: &ImageProperties, unusual: f64, has_files: bool) -> Result<Markup> {
    let Record { name, source, split, width, height, .. } = &sample.record;
    // Labels without a rendered image are shown on a uniform background.
    let earth = if sample.rgb.is_empty() { vec![EARTH; sample.pixels()] } else { Vec::new() };
    let photograph = if sample.jpeg.is_some() { "rgb.jpg" } else { "rgb.png" };
    let (shown, full) = if earth.is_empty() { (&sample.rgb, photograph) } else { (&earth, "semantics.png") };
    let (w, h, rgb) = furrow_output::shrink(*width, *height, shown, SIDE);
    let photograph = data_url("jpeg", &furrow_output::encode_jpeg(w, h, &rgb, QUALITY)?);
    let labels = data_url("png", &furrow_output::encode_png(w, h, &ImageData::Rgba(&overlay(sample, w, h)), "")?);
    Ok(html! {
        figure.shot data-name=(name) data-crop=(rounded(properties.cover[0])) data-weed=(rounded(properties.cover[1]))
            data-stage=[properties.stage] data-unusual=(rounded(unusual)) data-species=(properties.species.join("|"))
            data-light=(properties.lights.join("|")) data-sun=[properties.sun.map(rounded)] {
            label title=[source.as_ref()] {
                input type="checkbox";
                span.frame {
                    img src=(photograph) width=(w) height=(h) alt={ "image " (name) };
                    img.labels src=(labels) width=(w) height=(h) alt={ "labels of image " (name) };
                }
            }
            figcaption {
                b { (name) } " " (split.name()) " · " (words(&sample.record)) " "
                @if has_files {
                    a.enlarge href={ (native::folder(name)) "/" (full) } { "full size" } " "
                    a href={ (native::folder(name)) "/record.json" } { "record" }
                }
            }
        }
    })
}

/// Formats a value with two decimals, so that equal datasets have equal pages.
fn rounded(value: f64) -> String {
    format!("{value:.2}")
}

/// Returns the caption of an image: its numbers of plants, or the fractions of the classes if plants are not labelled.
fn words(record: &Record) -> String {
    let pixels = f64::from(record.width) * f64::from(record.height);
    let share =
        |class: Class| record.classes.iter().find(|c| c.class == class).map_or(0, |c| c.pixels).to_f64() / pixels;
    let (crop, weed) = (share(Class::Crop), share(Class::Weed));
    if record.plants.is_empty() && crop + weed > 0.0 {
        return format!("crop {}, weed {}", percent(crop), percent(weed));
    }
    let of = |class: Class| record.seen().filter(|p| p.class == class).count().to_u64();
    let stages: Vec<u32> =
        record.seen().filter(|p| p.class == Class::Crop).filter_map(|p| Some(p.grown.as_ref()?.bbch)).collect();
    let stage = match (stages.iter().min(), stages.iter().max()) {
        (Some(a), Some(b)) if a == b => format!(" at BBCH {a}"),
        (Some(a), Some(b)) => format!(" at BBCH {a} to {b}"),
        _ => String::new(),
    };
    format!(
        "{}{stage}, {}",
        count(of(Class::Crop), "crop plant", "crop plants"),
        count(of(Class::Weed), "weed", "weeds")
    )
}

/// Returns the labels as a translucent overlay of `w` × `h` pixels: tinted by class, with a different shade for
/// adjacent plant numbers, and outlined.
fn overlay(sample: &Sample, w: u32, h: u32) -> Vec<[u8; 4]> {
    let (width, height) = sample.size();
    // Index of the full-size pixel at the centre of a small pixel.
    let of = |x: u32, y: u32| {
        let at = |k: u32, small: u32, large: u32| (2 * u64::from(k) + 1) * u64::from(large) / (2 * u64::from(small));
        (at(y, h, height) * u64::from(width) + at(x, w, width)).to_usize()
    };
    let who = |x: u32, y: u32| (sample.semantics[of(x, y)], sample.plants[of(x, y)]);
    let mut out = Vec::with_capacity(w.to_usize() * h.to_usize());
    for y in 0..h {
        for x in 0..w {
            let here = who(x, y);
            let edge = x + 1 < w && who(x + 1, y) != here
                || y + 1 < h && who(x, y + 1) != here
                || x > 0 && who(x - 1, y) != here
                || y > 0 && who(x, y - 1) != here;
            out.push(tint(here, edge));
        }
    }
    out
}

/// Returns the overlay colour of a class and plant.
fn tint((class, plant): (u8, u32), edge: bool) -> [u8; 4] {
    const CROP: [[u8; 3]; 3] = [[40, 200, 80], [20, 160, 120], [130, 210, 50]];
    const WEED: [[u8; 3]; 3] = [[235, 60, 50], [215, 50, 120], [250, 125, 40]];
    let shade = (plant % 3).to_usize();
    let color = match class {
        c if c == Class::Crop as u8 => CROP[shade],
        c if c == Class::Weed as u8 => WEED[shade],
        IGNORE => [140; 3],
        _ => return [0; 4],
    };
    let [r, g, b] = color;
    if edge { [r, g, b, 255] } else { [r, g, b, 115] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_image_that_is_unlike_the_others_is_the_most_unusual() {
        let properties = |crop: f64, stage| ImageProperties {
            cover: [crop, 1.0],
            stage,
            species: Vec::new(),
            lights: Vec::new(),
            sun: None,
        };
        let all = [
            properties(10.0, Some(14)),
            properties(11.0, Some(14)),
            properties(12.0, None),
            properties(60.0, Some(14)),
        ];
        let far = unusual(&all);
        assert!(far[3] > 1.5 && far[..3].iter().all(|f| *f < far[3]), "{far:?}");
        assert_eq!(unusual(&[properties(1.0, None)]), [0.0]);
    }

    #[test]
    fn every_split_is_shown_in_the_contact_sheet() {
        assert_eq!(chosen([10, 1, 1], 1), [(0..10).collect(), vec![0], vec![0]]);
        let many = chosen([80_000, 10_000, 10_000], 1);
        assert_eq!(many.each_ref().map(Vec::len), [8, 8, 8]);
        assert_eq!(many[0][1], 10_000);
        assert_eq!(chosen([100, 0, 2], 1).map(|p| p.len()), [22, 0, 2]);
        assert_eq!(chosen([0, 0, 0], 1).map(|p| p.len()), [0, 0, 0]);
        // Every light of 48 images is shown equally often, and all images if there is room for them.
        let lit = chosen([48, 0, 0], 4)[0].clone();
        assert!((0..4).all(|light| lit.iter().filter(|k| **k % 4 == light).count() == 6), "{lit:?}");
        assert_eq!(chosen([12, 4, 0], 4), [(0..12).collect(), (0..4).collect(), vec![]]);
    }
}
