//! Source for COCO instances: masks of plants and optionally of leaves, as polygons or run lengths; keypoints named
//! stem, base and tip. Leaves may be in a separate `leaves_SPLIT.json` beside `instances_SPLIT.json`.
//!
//! Pixels without a mask are soil. Where masks overlap, the smaller one is on top. A leaf belongs to the plant that
//! contains most of its pixels. A crowd (`iscrowd` 1) has a class and no instance, unless [`Crowds`] makes it one. A
//! polygon contains the pixels whose centres are inside by the even-odd rule; the reference implementation may decide
//! otherwise for pixels on the outline. Source: COCO data format, <https://cocodataset.org/#format-data>.
//!
//! | file | contents |
//! |---|---|
//! | `document` | the JSON, in the spellings of different tools |
//! | `names` | the image files that a document names |
//! | `spot` | the entry that an error is about |

mod document;
mod names;
mod spot;

use super::classes::{Meaning, Names};
use super::files::{Shot, length, photograph};
use super::instances::{Instances, instances};
use super::{Labelled, Source, SourceImage};
use crate::model::record::{Keypoint, PointState};
use crate::model::split::Split;
use crate::model::warnings;
use document::{Annotation, Category, Document, Id, Segmentation};
use furrow_base::math::{RoundTo, ToInt};
use furrow_base::{Error, Result};
use furrow_render::scene::tag::Class;
use sha2::{Digest, Sha256};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A source of images with COCO annotations.
pub struct Coco {
    listed: Vec<SourceImage>,
    images: Vec<Annotated>,
    words: String,
    crowds: Crowds,
    warnings: Vec<String>,
}

/// Meaning of an annotation with `iscrowd` 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Crowds {
    /// An area of several plants, as COCO defines it: it has a class, but no plant number.
    #[default]
    Class,
    /// A plant. Some labelling tools, such as CVAT, mark every mask that is painted with a brush as a crowd.
    Instances,
}

/// An image and its annotations.
struct Annotated {
    path: PathBuf,
    /// The annotation file.
    document: Arc<Path>,
    /// Width and height in the annotation file, if it states them. They are compared, not used.
    size: Option<(u64, u64)>,
    things: Vec<Thing>,
    warnings: Vec<String>,
}

/// An annotation: a plant, a leaf, a crowd or an unlabelled area.
struct Thing {
    id: Option<Id>,
    /// Its place in the list of annotations, from 1.
    place: usize,
    /// The file that contains the annotation.
    document: Arc<Path>,
    meaning: Meaning,
    crowd: bool,
    /// Number of its plant, from the attribute `plant` if present.
    plant: Option<u32>,
    segmentation: Segmentation,
    /// Keypoints stem, base and tip.
    points: [Option<Keypoint>; 3],
}

impl Coco {
    /// Opens a file of annotations, or a folder with `annotations/instances_SPLIT.json`. The images are in `images` or
    /// in its subfolder of the split; if `images` is `None`, in the folder `images` beside the annotations. `classes`
    /// gives the meanings of the categories; without it, the categories must be named soil, crop, weed or leaf.
    pub fn open(from: &Path, images: Option<&Path>, classes: Option<&Names>, crowds: Crowds) -> Result<Self> {
        let mut words = format!("{:?}\n", classes.map(Names::words));
        if crowds != Crowds::Class {
            let _ = writeln!(words, "crowds: {crowds:?}");
        }
        let warnings = others(from);
        let mut all = Self { listed: Vec::new(), images: Vec::new(), words, crowds, warnings };
        let mut found: Vec<(SourceImage, Annotated)> = Vec::new();
        for (split, document) in documents(from)? {
            let folder = images.map_or_else(|| beside(from, &document), Path::to_path_buf);
            found.extend(all.document(split, &document, &folder, classes)?);
        }
        found.sort_by(|a, b| a.0.cmp(&b.0));
        let mut paths = BTreeSet::new();
        if let Some(twice) = found.iter().find(|(one, image)| !paths.insert((one.split, &image.path))) {
            return Err(Error::input("this image is listed twice").in_file(&twice.1.path));
        }
        if found.is_empty() {
            return Err(Error::input("it lists no images").in_file(from));
        }
        let files: BTreeSet<&Path> = paths.iter().map(|(_, path)| path.as_path()).collect();
        let twice = paths.len() - files.len();
        if twice > 0 {
            let what = format!("{}: {twice} images are in more than one split", from.display());
            all.warnings.push(format!("{what}; scores on a split with images of another are too good"));
        }
        for (one, image) in found {
            let _ = writeln!(all.words, "{one:?} {}", length(&image.path)?);
            all.listed.push(one);
            all.images.push(image);
        }
        Ok(all)
    }

    /// Reads the images of one annotation file, including the leaves of the file beside it.
    fn document(
        &mut self,
        split: Option<Split>,
        path: &Path,
        folder: &Path,
        classes: Option<&Names>,
    ) -> Result<Vec<(SourceImage, Annotated)>> {
        let instances = Read::open(path)?;
        let leaves = leaves_beside(path).map(|path| Read::open(&path)).transpose()?;
        let document: Arc<Path> = path.into();
        let mut found: BTreeMap<Id, (SourceImage, Annotated)> = BTreeMap::new();
        for image in &instances.document.images {
            let file = names::find(path, folder, split, &image.file_name)?;
            let annotated = Annotated {
                path: file.path,
                document: document.clone(),
                size: image.size(),
                things: Vec::new(),
                warnings: file.warning.into_iter().collect(),
            };
            let listed = SourceImage { split, name: image.file_name.clone() };
            if found.insert(image.id.clone(), (listed, annotated)).is_some() {
                return Err(instances.wrong(format!("two images have the id {}", image.id.0)));
            }
        }
        for read in [Some(instances), leaves].into_iter().flatten() {
            let _ = writeln!(self.words, "{split:?} {:x?}", Sha256::digest(&read.bytes));
            read.annotate(classes, &mut found)?;
        }
        for (_, image) in found.values_mut().filter(|(_, image)| image.things.is_empty()) {
            image.warnings.push("the source has no annotations of this image; all its pixels are soil".into());
        }
        Ok(found.into_values().collect())
    }
}

/// A parsed annotation file.
struct Read {
    path: PathBuf,
    bytes: Vec<u8>,
    document: Document,
}

impl Read {
    fn open(path: &Path) -> Result<Self> {
        let bytes = furrow_base::input::contents(path).map_err(Error::reading(path))?;
        let document = document::parse(path, &bytes)?;
        Ok(Self { path: path.into(), bytes, document })
    }

    fn wrong(&self, what: String) -> Error {
        Error::input(what).in_file(&self.path)
    }

    /// Adds the annotations to their images.
    fn annotate(mut self, classes: Option<&Names>, found: &mut BTreeMap<Id, (SourceImage, Annotated)>) -> Result<()> {
        let annotations = std::mem::take(&mut self.document.annotations);
        let kinds = self.kinds(classes, &annotations)?;
        let document: Arc<Path> = self.path.as_path().into();
        let mut ids = BTreeSet::new();
        for (place, annotation) in (1..).zip(annotations) {
            let Annotation { id, image_id, category_id, segmentation, iscrowd, keypoints, attributes } = annotation;
            let name = || named(id.as_ref(), place, &self.bytes);
            let wrong = |what: &str| self.wrong(format!("{}{what}", name())).help(document::HELP);
            let (_, image) = found
                .get_mut(&image_id)
                .ok_or_else(|| wrong(&format!("is of image {}, which the file lacks", image_id.0)))?;
            let (meaning, names) = kinds
                .get(&category_id)
                .ok_or_else(|| wrong(&format!("has the category {}, which the file lacks", category_id.0)))?;
            if id.as_ref().is_some_and(|id| !ids.insert(id.clone())) {
                image.warnings.push("1 annotations have the id of another annotation; all were read".into());
            }
            let segmentation = segmentation.filter(|mask| !mask.is_empty());
            let segmentation = segmentation.ok_or_else(|| wrong(NO_MASK).help(NO_MASK_HELP))?;
            image.warnings.extend(segmentation.check().map_err(|what| wrong(&what).help(NO_MASK_HELP))?);
            let values = keypoints.as_deref().unwrap_or_default();
            let points = ["stem", "base", "tip"].map(|name| point(names, name, values));
            image.things.push(Thing {
                id,
                place,
                document: document.clone(),
                meaning: *meaning,
                crowd: iscrowd.is_some_and(|flag| flag.0),
                plant: attributes["plant"].as_u64().and_then(|n| u32::try_from(n).ok()),
                segmentation,
                points,
            });
        }
        Ok(())
    }

    /// Returns the meaning and the names of the keypoints of each category.
    fn kinds(&self, classes: Option<&Names>, annotations: &[Annotation]) -> Result<BTreeMap<Id, (Meaning, &[String])>> {
        let mut kinds: BTreeMap<Id, (Meaning, &[String])> = BTreeMap::new();
        for Category { id, name, keypoints } in &self.document.categories {
            let known = match classes {
                Some(names) => names.0.get(name).copied(),
                None => Meaning::named(name),
            };
            if let Some(meaning) = known {
                let before = kinds.insert(id.clone(), (meaning, keypoints.as_deref().unwrap_or_default()));
                if before.is_some_and(|(other, _)| other != meaning) {
                    return Err(self.wrong(format!("two categories have the id {} and different classes", id.0)));
                }
            } else if annotations.iter().any(|a| a.category_id == *id) {
                let help = format!("give --classes '{name}=crop,…'; classes are soil, crop, weed, leaf, ignore");
                return Err(self.wrong(format!("no class was given for the category `{name}`")).help(help));
            }
        }
        Ok(kinds)
    }
}

const NO_MASK: &str = "has no mask; boxes alone cannot label pixels";
const NO_MASK_HELP: &str = "draw its mask in the labelling tool, or remove the annotation";

impl Segmentation {
    /// Returns `true` for a list without polygons, which labelling tools write for a box.
    fn is_empty(&self) -> bool {
        matches!(self, Self::Polygons(polygons) if polygons.iter().all(Vec::is_empty))
    }

    /// Checks the polygons. Returns a warning if some of them have no area by their number of points, an error if none
    /// has one.
    fn check(&self) -> Result<Option<String>, String> {
        let Self::Polygons(polygons) = self else { return Ok(None) };
        if let Some(odd) = polygons.iter().find(|polygon| polygon.len() % 2 == 1) {
            return Err(format!("has a polygon of {} numbers; a polygon is a list of x and y", odd.len()));
        }
        match polygons.iter().filter(|polygon| polygon.len() < 2 * 3).count() {
            0 => Ok(None),
            few if few == polygons.len() => {
                Err(format!("has a polygon of {} points; a mask has at least three", polygons[0].len() / 2))
            }
            few => Ok(Some(format!("{few} polygons with fewer than three points were left out of their masks"))),
        }
    }
}

/// Returns the file of leaves beside a file of instances, if it exists: `leaves_train.json` beside
/// `instances_train.json`.
fn leaves_beside(path: &Path) -> Option<PathBuf> {
    let split = path.file_name()?.to_str()?.strip_prefix("instances_")?;
    Some(path.with_file_name(format!("leaves_{split}"))).filter(|leaves| leaves.is_file())
}

/// Returns the beginning of an error message: an annotation with its id and line.
fn named(id: Option<&Id>, place: usize, document: &[u8]) -> String {
    let Some(Id(id)) = id else { return format!("annotation at position {place} of the list ") };
    let line = spot::line_of(&String::from_utf8_lossy(document), id);
    format!("annotation {id}{} ", line.map(|line| format!(" in line {line}")).unwrap_or_default())
}

/// Returns the annotation files, each with the split in its name, if any.
fn documents(from: &Path) -> Result<Vec<(Option<Split>, PathBuf)>> {
    if from.is_file() {
        return Ok(vec![(None, from.into())]);
    }
    let file = |split: Split| from.join("annotations").join(format!("instances_{}.json", split.name()));
    let found: Vec<_> = Split::ALL.into_iter().map(|s| (Some(s), file(s))).filter(|(_, path)| path.is_file()).collect();
    if found.is_empty() {
        return Err(Error::input("it does not contain annotations/instances_train.json, …_val.json or …_test.json")
            .in_file(from)
            .help("give --from such a folder or one JSON file"));
    }
    Ok(found)
}

/// Returns a warning about annotation files in a folder that are not read: those without the name of a split.
fn others(from: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(from.join("annotations")).ok().into_iter().flatten().filter_map(Result::ok);
    let known = |name: &str| {
        let split =
            name.strip_prefix("instances_").or(name.strip_prefix("leaves_")).and_then(|n| n.strip_suffix(".json"));
        split.is_some_and(|split| Split::ALL.into_iter().any(|known| known.name() == split))
    };
    let names = entries.map(|entry| entry.file_name().to_string_lossy().into_owned());
    let mut left: Vec<String> = names.filter(|name| name.to_lowercase().ends_with(".json") && !known(name)).collect();
    left.sort();
    match left.first() {
        None => Vec::new(),
        Some(first) => vec![format!(
            "{}: {} files were left out, such as {first}: of a folder, instances_train.json, instances_val.json and \
             instances_test.json are read; give another file itself with --from",
            from.join("annotations").display(),
            left.len()
        )],
    }
}

/// Returns the default folder of the images of an annotation file.
fn beside(from: &Path, document: &Path) -> PathBuf {
    let root = if from.is_file() { document.parent().unwrap_or(Path::new(".")) } else { from };
    let images = root.join("images");
    if images.is_dir() { images } else { root.into() }
}

/// Returns the keypoint with this name, if the annotation has it.
fn point(names: &[String], name: &str, values: &[f32]) -> Option<Keypoint> {
    let at = names.iter().position(|n| n == name)?;
    let [x, y, v] = values.as_chunks::<3>().0.get(at)?;
    let state = match v {
        2.0 => PointState::Visible,
        1.0 => PointState::Hidden,
        _ => return None,
    };
    Some(Keypoint { x: *x, y: *y, state })
}

impl Source for Coco {
    fn name(&self) -> &'static str {
        "coco"
    }

    fn images(&self) -> &[SourceImage] {
        &self.listed
    }

    fn words(&self) -> &str {
        &self.words
    }

    fn warnings(&self) -> &[String] {
        &self.warnings
    }

    fn read(&self, place: usize) -> Result<Labelled> {
        let image = &self.images[place];
        let Shot { size, pixels: rgb, mut warnings, stored, orientation } =
            photograph(furrow_output::open_photo(&image.path)?);
        let as_stored = || image.things.iter().any(|thing| thing.segmentation.has_size(stored)).then(|| wide(stored));
        if let Some(listed) = image.size.or_else(as_stored).filter(|listed| *listed != wide(size)) {
            return Err(image.other_size(listed, size, stored, orientation));
        }
        warnings.extend(image.warnings.iter().cloned());
        let (semantics, found, points) = painted(image, size, self.crowds)?;
        warnings.extend(found.warnings);
        Ok(Labelled {
            size,
            rgb,
            nir: Vec::new(),
            semantics,
            plants: found.plants,
            leaves: found.leaves,
            points,
            warnings: warnings::summed(&warnings),
        })
    }
}

impl Annotated {
    /// Returns the error about a picture whose size is not the one in the annotation file.
    fn other_size(&self, listed: (u64, u64), size: (u32, u32), stored: (u32, u32), orientation: u8) -> Error {
        let ((w, h), (x, y)) = (size, listed);
        let document = self.document.display();
        let error = if listed == wide(stored) {
            Error::input(format!(
                "its EXIF orientation {orientation} turns it to {w} × {h} pixels; {document} was drawn on the picture \
                 as stored, {x} × {y}"
            ))
            .help("remove the orientation from the picture, or draw the labels on the picture as viewers show it")
        } else {
            Error::input(format!("it has {w} × {h} pixels, but {x} × {y} in {document}"))
                .help("give the pictures that were labelled, at their size")
        };
        error.in_file(&self.path)
    }
}

fn wide((w, h): (u32, u32)) -> (u64, u64) {
    (w.into(), h.into())
}

type Points = BTreeMap<(u32, u16), [Option<Keypoint>; 3]>;

/// Rasterizes the annotations of an image. Returns the classes, the plants and leaves, and their keypoints.
fn painted(image: &Annotated, (w, h): (u32, u32), crowds: Crowds) -> Result<(Vec<u8>, Instances, Points)> {
    let n = w.to_usize() * h.to_usize();
    let (mut semantics, mut plants, mut leaves) = (vec![Class::Soil as u8; n], vec![0_u32; n], vec![0_u32; n]);
    let mut masks: Vec<(usize, Vec<u32>)> = Vec::new();
    for (k, thing) in image.things.iter().enumerate() {
        masks.push((k, pixels((w, h), thing)?));
    }
    let mut dropped = doubts(image, (w, h), &masks, crowds);
    masks.sort_by_key(|(k, pixels)| (std::cmp::Reverse(pixels.len()), *k));
    let numbers = plant_numbers(&image.things, crowds);
    for (k, pixels) in masks.iter().filter(|(k, _)| image.things[*k].meaning != Meaning::Leaf) {
        for i in pixels {
            semantics[i.to_usize()] = image.things[*k].meaning.number();
            plants[i.to_usize()] = numbers[*k];
        }
    }
    let mut owners = vec![0; image.things.len()];
    let mut beyond = 0_u64;
    for (k, pixels) in masks.iter().filter(|(k, _)| image.things[*k].meaning == Meaning::Leaf) {
        let mut votes: BTreeMap<u32, u64> = BTreeMap::new();
        for i in pixels {
            *votes.entry(plants[i.to_usize()]).or_default() += 1;
        }
        votes.remove(&0);
        // If plants have equal votes, takes the one with the lowest number.
        let owner =
            votes.into_iter().max_by_key(|(plant, n)| (*n, std::cmp::Reverse(*plant))).map_or(0, |(plant, _)| plant);
        owners[*k] = owner;
        for i in pixels {
            if plants[i.to_usize()] == owner {
                leaves[i.to_usize()] = k.to_u32() + 1;
            } else {
                beyond += 1;
            }
        }
    }
    let mut found = instances(&image.path, &semantics, &plants, &leaves)?;
    if beyond > 0 {
        dropped.push(format!("{beyond} pixels of leaves are outside their plants and were removed"));
    }
    let seen: BTreeSet<u32> = plants.iter().copied().collect();
    let hidden =
        masks.iter().filter(|(k, pixels)| !pixels.is_empty() && numbers[*k] > 0 && !seen.contains(&numbers[*k]));
    match hidden.count() {
        0 => {}
        n => dropped.push(format!("{n} plants are covered by other masks and have no pixel")),
    }
    found.warnings.splice(0..0, dropped);
    let mut points = Points::new();
    for (k, thing) in image.things.iter().enumerate() {
        let leaf = thing.meaning == Meaning::Leaf;
        let own = if leaf { (owners[k], k.to_u32() + 1) } else { (numbers[k], 0) };
        if let Some(place) = found.numbers.get(&own) {
            points.insert(*place, thing.points);
        }
    }
    Ok((semantics, found, points))
}

/// Returns warnings about masks that label no pixel or not all that they seem to.
fn doubts(image: &Annotated, (w, h): (u32, u32), masks: &[(usize, Vec<u32>)], crowds: Crowds) -> Vec<String> {
    let empty = masks.iter().filter(|(_, pixels)| pixels.is_empty()).count();
    let beyond = image.things.iter().filter(|thing| thing.segmentation.reaches_beyond(w, h)).count();
    let is_crowd = |thing: &&Thing| thing.crowd && matches!(thing.meaning, Meaning::Class(Class::Crop | Class::Weed));
    let alone = if crowds == Crowds::Class { image.things.iter().filter(is_crowd).count() } else { 0 };
    let stated = [
        (empty, ["annotation covers no pixel and was left out", "annotations cover no pixel and were left out"]),
        (
            beyond,
            [
                "mask reaches more than a pixel beyond the image and was cut at its border",
                "masks reach more than a pixel beyond the image and were cut at its border",
            ],
        ),
        (
            alone,
            [
                "crowd (`iscrowd` 1) has a class and no plant number; if a tool marks painted plants so, give --crowds \
                 instances",
                "crowds (`iscrowd` 1) have a class and no plant number; if a tool marks painted plants so, give \
                 --crowds instances",
            ],
        ),
    ];
    let counted = |(n, [one, many]): (usize, [&str; 2])| format!("{n} {}", if n == 1 { one } else { many });
    stated.into_iter().filter(|(n, _)| *n > 0).map(counted).collect()
}

impl Segmentation {
    /// Returns whether it is run lengths of an image of this width and height.
    fn has_size(&self, (w, h): (u32, u32)) -> bool {
        matches!(self, Self::Runs(rle) if rle.size == [h, w])
    }

    fn reaches_beyond(&self, w: u32, h: u32) -> bool {
        let Self::Polygons(polygons) = self else { return false };
        let outside = |[x, y]: &[f64; 2]| *x < -1.0 || *y < -1.0 || *x > f64::from(w) + 1.0 || *y > f64::from(h) + 1.0;
        polygons.iter().any(|polygon| polygon.as_chunks::<2>().0.iter().any(outside))
    }
}

/// Returns the plant number of each annotation, 0 for other annotations. Uses the numbers in the attributes if all
/// plants have different ones, otherwise counts from 1.
fn plant_numbers(things: &[Thing], crowds: Crowds) -> Vec<u32> {
    let is_one = |t: &Thing| !t.crowd || crowds == Crowds::Instances;
    let is_plant = |t: &Thing| is_one(t) && matches!(t.meaning, Meaning::Class(Class::Crop | Class::Weed));
    let stated: Vec<u32> = things.iter().filter(|t| is_plant(t)).filter_map(|t| t.plant).collect();
    let distinct: BTreeSet<u32> = stated.iter().copied().filter(|n| *n > 0).collect();
    let own = distinct.len() == things.iter().filter(|t| is_plant(t)).count();
    let mut last = 0;
    let number = |thing: &Thing| {
        if !is_plant(thing) {
            return 0;
        }
        last += 1;
        thing.plant.filter(|_| own).unwrap_or(last)
    };
    things.iter().map(number).collect()
}

/// Returns the pixels of a mask, as indices into the image row by row.
fn pixels((w, h): (u32, u32), thing: &Thing) -> Result<Vec<u32>> {
    let wrong = |what: String| {
        let document = furrow_base::input::contents(&thing.document).unwrap_or_default();
        let name = named(thing.id.as_ref(), thing.place, &document);
        Error::input(format!("{name}has a wrong mask: {what}")).help(document::HELP).in_file(thing.document.as_ref())
    };
    let rle = match &thing.segmentation {
        Segmentation::Polygons(polygons) => return Ok(inside(w, h, polygons)),
        Segmentation::Runs(rle) => rle,
    };
    if rle.size != [h, w] {
        return Err(wrong(format!("it is {} × {} pixels, its image {w} × {h}", rle.size[1], rle.size[0])));
    }
    Ok(rle.pixels().map_err(|e| wrong(e.to_string()))?.map(ToInt::to_u32).collect())
}

/// Returns the pixels whose centres are inside at least one of the polygons by the even-odd rule, by ascending index.
/// The time depends on the rows that edges cross, not on the size of the image.
fn inside(w: u32, h: u32, polygons: &[Vec<f64>]) -> Vec<u32> {
    let mut crossings: Vec<Crossing> = polygons.iter().enumerate().flat_map(|(k, p)| crossings(h, k, p)).collect();
    crossings.sort_by(|a, b| (a.row, a.polygon).cmp(&(b.row, b.polygon)).then(a.x.total_cmp(&b.x)));
    let mut all = Vec::new();
    for line in crossings.chunk_by(|a, b| (a.row, a.polygon) == (b.row, b.polygon)) {
        for [from, to] in line.as_chunks::<2>().0 {
            // The pixels whose centres are between the two crossings.
            let first = (from.x - 0.5).ceil().clamp(0.0, f64::from(w)).trunc_to::<u32>();
            let end = (to.x - 0.5).ceil().clamp(0.0, f64::from(w)).trunc_to::<u32>();
            all.extend((first..end).map(|x| from.row * w + x));
        }
    }
    // Polygons of one annotation may overlap.
    all.sort_unstable();
    all.dedup();
    all
}

/// A point where a polygon crosses the centre line of a row.
struct Crossing {
    row: u32,
    /// Index of the polygon.
    polygon: usize,
    x: f64,
}

/// Returns the crossings of polygon `polygon` with the rows of an image of `h` rows, edge by edge.
fn crossings(h: u32, polygon: usize, corners: &[f64]) -> Vec<Crossing> {
    let points = corners.as_chunks::<2>().0;
    let mut all = Vec::new();
    for (k, [x0, y0]) in points.iter().enumerate() {
        let [x1, y1] = points[(k + 1) % points.len()];
        for row in rows(h, *y0, y1) {
            let y = f64::from(row) + 0.5;
            if (*y0 <= y) != (y1 <= y) {
                all.push(Crossing { row, polygon, x: x0 + (y - y0) / (y1 - y0) * (x1 - x0) });
            }
        }
    }
    all
}

/// Returns the rows that an edge from height `y0` to `y1` may cross, extended by one row at each end because of
/// rounding.
fn rows(h: u32, y0: f64, y1: f64) -> std::ops::Range<u32> {
    let held = |y: f64| y.clamp(0.0, f64::from(h)).trunc_to::<u32>();
    held((y0.min(y1) - 1.5).floor())..held((y0.max(y1) + 0.5).ceil())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_polygon_holds_the_pixels_whose_centres_lie_in_it() {
        let square = vec![1.0, 1.0, 3.0, 1.0, 3.0, 3.0, 1.0, 3.0];
        assert_eq!(inside(5, 4, std::slice::from_ref(&square)), [6, 7, 11, 12]);
        // A second polygon that covers one pixel and is partly outside the image.
        let corner = vec![4.4, -1.0, 9.0, -1.0, 9.0, 0.6, 4.4, 0.6];
        assert_eq!(inside(5, 4, &[square, corner]), [4, 6, 7, 11, 12]);
        // A polygon above the pixel centres contains no pixel.
        assert_eq!(inside(5, 4, &[vec![0.0, 0.0, 5.0, 0.0, 5.0, 0.4, 0.0, 0.4]]), Vec::<u32>::new());
        let triangle = vec![0.0, 0.0, 4.0, 0.0, 0.0, 4.0];
        assert_eq!(inside(4, 4, &[triangle]).len(), 6);
        assert_eq!(inside(4, 4, &[vec![]]), Vec::<u32>::new());
    }

    /// Reference implementation that tests every edge in every row.
    fn row_by_row(w: u32, h: u32, polygons: &[Vec<f64>]) -> Vec<u32> {
        let mut all = Vec::new();
        for row in 0..h {
            let y = f64::from(row) + 0.5;
            for polygon in polygons {
                let points = polygon.as_chunks::<2>().0;
                let mut crossings = Vec::new();
                for (k, [x0, y0]) in points.iter().enumerate() {
                    let [x1, y1] = points[(k + 1) % points.len()];
                    if (*y0 <= y) != (y1 <= y) {
                        crossings.push(x0 + (y - y0) / (y1 - y0) * (x1 - x0));
                    }
                }
                crossings.sort_by(f64::total_cmp);
                for [from, to] in crossings.as_chunks::<2>().0 {
                    let column = |x: f64| (x - 0.5).ceil().clamp(0.0, f64::from(w)).trunc_to::<u32>();
                    all.extend((column(*from)..column(*to)).map(|x| row * w + x));
                }
            }
        }
        all.sort_unstable();
        all.dedup();
        all
    }

    /// Expected: the same pixels as with the reference implementation, for polygons that intersect themselves, overlap,
    /// extend beyond the image and have vertices on centre lines of rows.
    #[test]
    fn edges_cross_the_rows_that_a_plain_scan_finds() {
        let mut s = furrow_base::sampling::Stream::of(5, 0, furrow_base::sampling::Purpose::Test, 0);
        for round in 0..300 {
            let (w, h) = (1 + s.index(30).to_u32(), 1 + s.index(30).to_u32());
            let mut polygon = |n: usize| -> Vec<f64> {
                let mut value = || {
                    let v = s.range(-6.0, 36.0);
                    if round % 2 == 0 { v } else { (2.0 * v).round() / 2.0 }
                };
                (0..2 * n).map(|_| value()).collect()
            };
            let polygons = [polygon(3), polygon(9), polygon(1), polygon(0)];
            assert_eq!(inside(w, h, &polygons), row_by_row(w, h, &polygons), "{w} × {h}: {polygons:?}");
        }
    }

    /// Rationale: testing every edge in every row is slow for large images. Expected: an edge tests the rows that it
    /// crosses and at most four more, whatever the size of the image.
    #[test]
    fn an_edge_looks_at_its_own_rows() {
        for h in [100, 10_000, 1_000_000] {
            assert!(rows(h, 40.2, 41.7).len() <= 2 + 4 && rows(h, 41.7, 40.2) == rows(h, 40.2, 41.7));
            assert!(rows(h, -1e9, -1.0).is_empty() && rows(h, 3e9, 4e9).is_empty());
            assert_eq!(rows(h, -1e9, 1e9), 0..h);
        }
    }
}
