//! Invariants of every image, checked before an image is written, and again by `verify` on the files.

use crate::model::annotate;
use crate::model::recipe::{ImageOrigin, Recipe};
use crate::model::record::{Leaf, Plant, Seen};
use crate::model::sample::{IGNORE, Sample};
use furrow_base::math::{ToFloat, ToInt};
use furrow_base::{Error, Result};
use furrow_render::scene::tag::Class;
use std::collections::BTreeMap;

/// Smallest coverage, of 255, of the class of a decided pixel. The margin to 255 exceeds the effect of lens blur and of
/// a few samples.
const DECIDED: u8 = 243;

/// Fraction of the decided pixels whose centre may nevertheless show another class. A leaf thinner than the footprint
/// of the pixels can lie along a row of pixel centres.
const THIN: f64 = 0.005;

/// Further fraction of the decided pixels that is allowed because samples are few: FEW · 0.5ⁿ for n samples. If an edge
/// halves a pixel, all n samples miss the class at its centre with probability 0.5ⁿ. An image with one pixel in four on
/// an edge consists of little but edges.
const FEW: f64 = 0.25;

/// Allowed fraction of the decided pixels on an edge between labels. It applies to images that consist of little but
/// edges, such as feathery leaves finer than the pixels. Measured over 256 fields of `any-field.ron` at 480 × 360: at
/// most 0.05 at 4 and 8 samples; maps shifted by one pixel have 0.3 or more at 2 samples and above.
const THIN_ON_EDGES: f64 = 0.1;
/// Number of such pixels that is allowed in an image of any size: in an image of one pixel, a blade may miss the
/// centre.
const ALWAYS_ALLOWED: f64 = 2.0;

/// Checks a sample. The error names the image and all violated invariants.
pub fn check(recipe: &Recipe, sample: &Sample) -> Result<()> {
    let faults = faults(recipe, sample);
    if faults.is_empty() {
        return Ok(());
    }
    Err(Error::damaged(format!("image {}: {}", sample.record.name, faults.join("; "))))
}

/// Returns a description of each violated invariant.
pub fn faults(recipe: &Recipe, sample: &Sample) -> Vec<String> {
    let sizes = sizes(sample, recipe.labels_only());
    // Further checks need maps of equal size.
    if !sizes.is_empty() {
        return sizes;
    }
    let rendered = matches!(recipe.made, ImageOrigin::Rendered(_));
    let mut all = Vec::new();
    all.extend(nesting(sample, rendered));
    all.extend(numbers(recipe, sample));
    all.extend(counts(sample));
    let spp = recipe.rendering().map_or(u32::MAX, |r| r.spp);
    all.extend(shares(sample, spp));
    all.extend(geometry(sample));
    all
}

/// Checks that each map has the image's size, or is empty if it is optional. With `labels_only` the colour image is
/// optional.
fn sizes(sample: &Sample, labels_only: bool) -> Vec<String> {
    let n = sample.pixels();
    let maps = [
        ("rgb", sample.rgb.len(), labels_only),
        ("nir", sample.nir.len(), true),
        ("semantics", sample.semantics.len(), false),
        ("species", sample.species.len(), true),
        ("parts", sample.parts.len(), true),
        ("plants", sample.plants.len(), false),
        ("leaves", sample.leaves.len(), false),
        ("coverage", sample.coverage.len(), true),
        ("depth", sample.depth.len(), true),
        ("normals", sample.normals.len(), true),
    ];
    let wrong = maps.into_iter().filter(|(_, len, optional)| *len != n && !(*optional && *len == 0));
    wrong.map(|(name, len, _)| format!("{name} has {len} values for {n} pixels")).collect()
}

/// Checks that classes are known, that each leaf pixel has a plant, and that a plant has one class and one species.
/// Pixels without a plant have no species, and in rendered images they are soil.
fn nesting(sample: &Sample, rendered: bool) -> Vec<String> {
    let mut of_plant: BTreeMap<u32, (u8, Option<u8>)> = BTreeMap::new();
    let (mut loose, mut mixed, mut bare, mut unknown) = (0_u64, 0_u64, 0_u64, 0_u64);
    for i in 0..sample.pixels() {
        let (class, plant, leaf) = (sample.semantics[i], sample.plants[i], sample.leaves[i]);
        let species = sample.species.get(i).copied();
        let vegetation = class == Class::Crop as u8 || class == Class::Weed as u8;
        unknown += u64::from(annotate::class_of(class).is_none() && (rendered || class != IGNORE));
        if plant == 0 {
            loose += u64::from(leaf != 0 || species.is_some_and(|s| s != 0));
            bare += u64::from(rendered && vegetation);
        } else {
            mixed += u64::from(*of_plant.entry(plant).or_insert((class, species)) != (class, species) || !vegetation);
        }
    }
    let recorded = [
        (unknown, "have an unknown class"),
        (loose, "have a leaf or a species but no plant"),
        (bare, "are crop or weed but no plant"),
        (mixed, "have another class or species than the rest of their plant, or are soil"),
    ];
    recorded.into_iter().filter(|(n, _)| *n > 0).map(|(n, words)| format!("{n} pixels {words}")).collect()
}

/// Checks that species are in the recipe's table, that the record agrees with the recipe, that coordinates are finite,
/// and that identities are unique.
fn numbers(recipe: &Recipe, sample: &Sample) -> Vec<String> {
    let record = &sample.record;
    let mut all = Vec::new();
    let known = recipe.species.len();
    if let Some(most) = sample.species.iter().max().filter(|m| usize::from(**m) > known) {
        all.push(format!("species {most} is not among the {known} of the recipe"));
    }
    if record.split != recipe.split_of(record.index) {
        all.push(format!("it is in the split {}, but its number belongs to another", record.split.name()));
    }
    let (field, capture) = recipe.field_of(record.index);
    let recorded = record.capture.as_ref().map(|capture| (capture.field, capture.time_s.is_finite()));
    let frames = record.capture.as_ref().is_none_or(|recorded| u64::from(recorded.frame) <= capture);
    let day = record.capture.as_ref().and_then(|capture| capture.day);
    let of_day = recipe.days().get((capture / recipe.captures_a_day()).to_usize()).copied();
    if recorded != recipe.has_sequences().then_some((field, true)) || !frames || day != of_day {
        all.push("its field, frame or day does not match its number".into());
    }
    if record.light != (recipe.lights() > 1).then(|| recipe.light_of(record.index)) {
        all.push("its light does not match its number".into());
    }
    let points = record
        .plants
        .iter()
        .flat_map(|p| p.stem.iter().chain(p.leaves.iter().flat_map(|l| l.base.iter().chain(&l.tip))));
    if points.into_iter().any(|k| !(k.x.is_finite() && k.y.is_finite())) {
        all.push("a keypoint is not a number".into());
    }
    all.extend(identities(sample));
    all
}

/// Checks that no two plants or leaves of an image have the same identity, and that none is 0. Records of earlier
/// versions have no identities.
fn identities(sample: &Sample) -> Option<String> {
    let mut ids: Vec<u32> = sample
        .record
        .plants
        .iter()
        .flat_map(|p| p.id.into_iter().chain(p.leaves.iter().filter_map(|l| l.id)))
        .collect();
    ids.sort_unstable();
    let twice = ids.windows(2).find(|pair| pair[0] == pair[1]).map(|pair| pair[0]);
    let wrong = ids.first().copied().filter(|id| *id == 0).or(twice)?;
    Some(format!("the identity {wrong} is 0 or belongs to several plants or leaves"))
}

/// Checks that pixels, boxes and masks of the record are those of the maps, and that no plant or leaf has more visible
/// pixels than it has without occlusion.
fn counts(sample: &Sample) -> Vec<String> {
    let record = &sample.record;
    let mut all = Vec::new();
    let (mut classes, ignored) = annotate::classes(sample);
    if sample.coverage.is_empty() {
        // The coverage was summed when the map existed; the map was not stored.
        for (share, recorded) in classes.iter_mut().zip(&record.classes) {
            share.covered = recorded.covered;
        }
    }
    if (&classes, ignored) != (&record.classes, record.ignored) {
        all.push("the record's pixel counts of the classes differ from the map".into());
    }
    let shown = annotate::plants(sample);
    let recorded: Vec<&Plant> = record.seen().collect();
    let same_leaf = |(a, b): (&Leaf, &Leaf)| a.number == b.number && same(&a.seen, &b.seen);
    let same_plant = |(a, b): (&Plant, &&Plant)| {
        let leaves: Vec<&Leaf> = b.leaves.iter().filter(|l| l.seen.pixels > 0).collect();
        let fits = (a.number, a.class, a.leaves.len()) == (b.number, b.class, leaves.len()) && same(&a.seen, &b.seen);
        fits && a.leaves.iter().zip(leaves).all(same_leaf)
    };
    if shown.len() != recorded.len() || !shown.iter().zip(&recorded).all(same_plant) {
        all.push("the record's plants, boxes or masks differ from the maps".into());
    }
    for plant in &record.plants {
        let leaves = plant.leaves.iter().map(|l| &l.seen);
        if leaves.clone().chain([&plant.seen]).any(|s| !in_order(s)) {
            all.push(format!("more is seen of plant {} than there is of it", plant.number));
        }
        if leaves.clone().any(|s| s.pixels > plant.seen.pixels || s.unoccluded > plant.seen.unoccluded) {
            all.push(format!("a leaf of plant {} is larger than the plant", plant.number));
        }
    }
    all
}

fn same(a: &Seen, b: &Seen) -> bool {
    (a.pixels, a.bounds, &a.mask) == (b.pixels, b.bounds, &b.mask)
}

fn in_order(seen: &Seen) -> bool {
    let unoccluded = seen.unoccluded.unwrap_or(seen.pixels);
    seen.pixels <= unoccluded && unoccluded <= seen.whole.unwrap_or(unoccluded)
}

/// Checks that the fractions of each pixel sum to one, and that they agree with the label where a class is decided.
fn shares(sample: &Sample, spp: u32) -> Vec<String> {
    let mut all = Vec::new();
    let wrong = sample.coverage.iter().filter(|c| c.iter().map(|n| u32::from(*n)).sum::<u32>() != 255).count();
    if wrong > 0 {
        all.push(format!("the shares of {wrong} pixels do not sum to one"));
    }
    let decided = |c: &[u8; 3]| (0_u8..3).find(|k| c[usize::from(*k)] >= DECIDED);
    let edges = edges(sample);
    let of_edges = edges.iter().filter(|edge| **edge).count().to_f64();
    let (mut asked, mut on_edges, mut other) = (0_u64, 0_u64, 0_u64);
    for (at, (share, label)) in sample.coverage.iter().zip(&sample.semantics).enumerate() {
        if let Some(class) = decided(share) {
            asked += 1;
            on_edges += u64::from(edges[at]);
            other += u64::from(class != *label);
        }
    }
    let missed = 0.5_f64.powi(spp.min(64).to_i32());
    let allowed = (THIN + FEW * missed) * asked.to_f64();
    let allowed_on_edges = (THIN_ON_EDGES * on_edges.to_f64()).max(by_chance(spp) * of_edges);
    // If few pixels are decided, the allowed fraction can be less than one pixel.
    if other.to_f64() > allowed.max(allowed_on_edges).max(ALWAYS_ALLOWED) {
        all.push(format!("{other} of {asked} pixels are of one class by their samples and of another by their centre"));
    }
    all
}

/// Returns the largest probability that all n samples of a pixel show one label and its centre another, if the
/// structures in it are much finer than the pixel. With a fraction p of one label it is pⁿ(1 − p) + (1 − p)ⁿp. Up to
/// three samples it is largest at p = ½, above that at about n / (n + 1).
fn by_chance(spp: u32) -> f64 {
    let n = f64::from(spp.max(1));
    let p = if spp <= 3 { 0.5 } else { n / (n + 1.0) };
    p.powf(n) * (1.0 - p) + (1.0 - p).powf(n) * p
}

/// Returns for each pixel whether the label of a horizontal or vertical neighbour differs.
fn edges(sample: &Sample) -> Vec<bool> {
    let (width, labels) = (sample.size().0.to_usize(), &sample.semantics);
    let mut edges = vec![false; labels.len()];
    for at in 0..labels.len() {
        let beside = ((at + 1) % width > 0).then_some(at + 1);
        for next in beside.into_iter().chain(Some(at + width).filter(|next| *next < labels.len())) {
            if labels[at] != labels[next] {
                (edges[at], edges[next]) = (true, true);
            }
        }
    }
    edges
}

/// Checks that depths are positive and not NaN, and that normals are unit vectors, or zero where nothing is visible.
fn geometry(sample: &Sample) -> Vec<String> {
    let mut all = Vec::new();
    if sample.depth.iter().any(|d| d.is_nan() || *d <= 0.0) {
        all.push("a depth is not a number or not before the camera".into());
    }
    let unit = |n: &[f32; 3]| {
        let square: f32 = n.iter().map(|x| x * x).sum();
        // Each component may be rounded to 1/128.
        square == 0.0 || (square - 1.0).abs() < 2e-2
    };
    if !sample.normals.iter().all(unit) {
        all.push("a normal is not a unit vector".into());
    }
    all
}
