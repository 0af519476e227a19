//! Source for COCO instances: masks of plants and optionally of leaves, as polygons or run lengths; keypoints named
//! stem, base and tip. Leaves may be in a separate `leaves_SPLIT.json` beside `instances_SPLIT.json`.
//!
//! Pixels without a mask are soil. Where masks overlap, the smaller one is on top. A leaf belongs to the plant that
//! contains most of its pixels. A crowd (`iscrowd` 1) has a class and no instance. A polygon contains the pixels whose
//! centres are inside by the even-odd rule; the reference implementation may decide otherwise for pixels on the
//! outline. Source: COCO data format, <https://cocodataset.org/#format-data>.

use super::classes::{Meaning, Names};
use super::files::{length, same_size};
use super::instances::{Instances, instances};
use super::{Labelled, Listed, Source};
use crate::model::record::{Keypoint, PointState};
use crate::model::rle::Rle;
use crate::model::split::Split;
use furrow_base::input::Scope;
use furrow_base::{Error, Result};
use furrow_render::scene::tag::Class;
use serde::Deserialize;
use serde_json::Value;
use sha2::{Digest, Sha256};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A source of images with COCO annotations.
pub struct Coco {
    listed: Vec<Listed>,
    images: Vec<Annotated>,
    words: String,
}

/// An image and its annotations.
struct Annotated {
    path: PathBuf,
    size: (u32, u32),
    things: Vec<Thing>,
}

/// An annotation: a plant, a leaf, a crowd or an unlabelled area.
struct Thing {
    id: u64,
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

#[derive(Deserialize)]
struct Document {
    images: Vec<Image>,
    annotations: Vec<Annotation>,
    categories: Vec<Category>,
}

#[derive(Deserialize)]
struct Image {
    id: u64,
    file_name: String,
    width: u32,
    height: u32,
}

#[derive(Deserialize)]
struct Annotation {
    #[serde(default)]
    id: u64,
    image_id: u64,
    category_id: u64,
    segmentation: Option<Segmentation>,
    #[serde(default)]
    iscrowd: u8,
    #[serde(default)]
    keypoints: Vec<f32>,
    #[serde(default)]
    attributes: Value,
}

#[derive(Deserialize)]
struct Category {
    id: u64,
    name: String,
    #[serde(default)]
    keypoints: Vec<String>,
}

/// A mask in one of COCO's encodings.
#[derive(Deserialize)]
#[serde(untagged)]
enum Segmentation {
    Packed(Rle),
    Runs { size: [u32; 2], counts: Vec<u64> },
    Polygons(Vec<Vec<f64>>),
}

impl Coco {
    /// Opens a file of annotations, or a folder with `annotations/instances_SPLIT.json`. The images are in `images` or
    /// in its subfolder of the split; if `images` is `None`, in the folder `images` beside the annotations. `classes`
    /// gives the meanings of the categories; without it, the categories must be named soil, crop, weed or leaf.
    pub fn open(from: &Path, images: Option<&Path>, classes: Option<&Names>) -> Result<Self> {
        let mut all =
            Self { listed: Vec::new(), images: Vec::new(), words: format!("{:?}\n", classes.map(Names::words)) };
        let mut found: Vec<(Listed, Annotated)> = Vec::new();
        for (split, document) in documents(from)? {
            let folder = images.map_or_else(|| beside(from, &document), Path::to_path_buf);
            found.extend(all.document(split, &document, &folder, classes)?);
        }
        found.sort_by(|a, b| a.0.cmp(&b.0));
        if let Some(pair) = found.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            return Err(Error::input("this image is listed twice").in_file(&pair[0].1.path));
        }
        if found.is_empty() {
            return Err(Error::input("it lists no images").in_file(from));
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
    ) -> Result<Vec<(Listed, Annotated)>> {
        let instances = Read::open(path)?;
        let leaves = leaves_beside(path).map(|path| Read::open(&path)).transpose()?;
        let mut found: BTreeMap<u64, (Listed, Annotated)> = BTreeMap::new();
        let scope =
            Scope::Below { folder: folder.into(), help: "name images by their paths below the folder of --images" };
        for Image { id, file_name, width, height } in &instances.document.images {
            let named =
                |folder: &Path| scope.resolve(folder, file_name).map_err(|outside| Error::from(outside).in_file(path));
            let of_split = split.map(|s| named(&folder.join(s.name()))).transpose()?.filter(|p| p.is_file());
            let image = of_split.map_or_else(|| named(folder), Ok)?;
            if !image.is_file() {
                let what = format!("its image {} is missing", image.display());
                return Err(instances.wrong(what).help("give the folder of the images with --images"));
            }
            let annotated = Annotated { path: image, size: (*width, *height), things: Vec::new() };
            if found.insert(*id, (Listed { split, name: file_name.clone() }, annotated)).is_some() {
                return Err(instances.wrong(format!("two images have the id {id}")));
            }
        }
        for read in [Some(instances), leaves].into_iter().flatten() {
            let _ = writeln!(self.words, "{split:?} {:x?}", Sha256::digest(&read.bytes));
            read.annotate(classes, &mut found)?;
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
        let document = serde_json::from_slice(&bytes)
            .map_err(|e| Error::input(format!("this is not a COCO file of instances: {e}")).in_file(path))?;
        Ok(Self { path: path.into(), bytes, document })
    }

    fn wrong(&self, what: String) -> Error {
        Error::input(what).in_file(&self.path)
    }

    /// Adds the annotations to their images.
    fn annotate(mut self, classes: Option<&Names>, found: &mut BTreeMap<u64, (Listed, Annotated)>) -> Result<()> {
        let annotations = std::mem::take(&mut self.document.annotations);
        let mut kinds: BTreeMap<u64, (Meaning, &[String])> = BTreeMap::new();
        for Category { id, name, keypoints } in &self.document.categories {
            let known = match classes {
                Some(names) => names.0.get(name).copied(),
                None => Meaning::named(name),
            };
            if let Some(meaning) = known {
                kinds.insert(*id, (meaning, keypoints));
            } else if annotations.iter().any(|a| a.category_id == *id) {
                let help = format!("give --classes '{name}=crop,…'; classes are soil, crop, weed, leaf, ignore");
                return Err(self.wrong(format!("no class was given for the category `{name}`")).help(help));
            }
        }
        let document: Arc<Path> = self.path.as_path().into();
        for annotation in annotations {
            let id = annotation.id;
            let wrong = |what: &str| self.wrong(format!("{}{what}", named(id, &self.bytes)));
            let (_, image) = found
                .get_mut(&annotation.image_id)
                .ok_or_else(|| wrong(&format!("is of image {}, which the file lacks", annotation.image_id)))?;
            let (meaning, names) = kinds
                .get(&annotation.category_id)
                .ok_or_else(|| wrong(&format!("has the category {}, which the file lacks", annotation.category_id)))?;
            image.things.push(Thing {
                id,
                document: document.clone(),
                meaning: *meaning,
                crowd: annotation.iscrowd != 0,
                plant: annotation.attributes["plant"].as_u64().and_then(|n| u32::try_from(n).ok()),
                segmentation: annotation
                    .segmentation
                    .ok_or_else(|| wrong("has no mask; boxes alone cannot label pixels"))?,
                points: ["stem", "base", "tip"].map(|name| point(names, name, &annotation.keypoints)),
            });
        }
        Ok(())
    }
}

/// Returns the file of leaves beside a file of instances, if it exists: `leaves_train.json` beside
/// `instances_train.json`.
fn leaves_beside(path: &Path) -> Option<PathBuf> {
    let split = path.file_name()?.to_str()?.strip_prefix("instances_")?;
    Some(path.with_file_name(format!("leaves_{split}"))).filter(|leaves| leaves.is_file())
}

/// Returns the beginning of an error message: an annotation with its id and line. Searches only behind the key
/// `annotations`, since images have ids too.
fn named(id: u64, document: &[u8]) -> String {
    let text = String::from_utf8_lossy(document);
    let from = text.find("\"annotations\"").unwrap_or(0);
    let key = text[from..].match_indices("\"id\"").map(|(at, key)| from + at + key.len()).find(|at| {
        let value = text[*at..].trim_start().strip_prefix(':').map_or("", str::trim_start);
        value.split(|c: char| !c.is_ascii_digit()).next().and_then(|digits| digits.parse().ok()) == Some(id)
    });
    let line = key.map(|at| format!(" in line {}", text[..at].matches('\n').count() + 1)).unwrap_or_default();
    format!("annotation {id}{line} ")
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

    fn images(&self) -> &[Listed] {
        &self.listed
    }

    fn words(&self) -> &str {
        &self.words
    }

    fn read(&self, place: usize) -> Result<Labelled> {
        let image = &self.images[place];
        let (w, h, rgb) = furrow_output::read_photo(&image.path)?;
        same_size(&image.path, (w, h), image.size)?;
        let (semantics, found, points) = painted(image)?;
        let Instances { plants, leaves, warnings, .. } = found;
        Ok(Labelled { size: (w, h), rgb, nir: Vec::new(), semantics, plants, leaves, points, warnings })
    }
}

type Points = BTreeMap<(u32, u16), [Option<Keypoint>; 3]>;

/// Rasterizes the annotations of an image. Returns the classes, the plants and leaves, and their keypoints.
fn painted(image: &Annotated) -> Result<(Vec<u8>, Instances, Points)> {
    let (w, h) = image.size;
    let n = w as usize * h as usize;
    let (mut semantics, mut plants, mut leaves) = (vec![Class::Soil as u8; n], vec![0_u32; n], vec![0_u32; n]);
    let mut masks: Vec<(usize, Vec<u32>)> = Vec::new();
    for (k, thing) in image.things.iter().enumerate() {
        masks.push((k, pixels(image, thing)?));
    }
    masks.sort_by_key(|(k, pixels)| (std::cmp::Reverse(pixels.len()), *k));
    let numbers = plant_numbers(&image.things);
    for (k, pixels) in masks.iter().filter(|(k, _)| image.things[*k].meaning != Meaning::Leaf) {
        for i in pixels {
            semantics[*i as usize] = image.things[*k].meaning.number();
            plants[*i as usize] = numbers[*k];
        }
    }
    let mut owners = vec![0; image.things.len()];
    let mut beyond = 0_u64;
    for (k, pixels) in masks.iter().filter(|(k, _)| image.things[*k].meaning == Meaning::Leaf) {
        let mut votes: BTreeMap<u32, u64> = BTreeMap::new();
        for i in pixels {
            *votes.entry(plants[*i as usize]).or_default() += 1;
        }
        votes.remove(&0);
        // If plants have equal votes, takes the one with the lowest number.
        let owner =
            votes.into_iter().max_by_key(|(plant, n)| (*n, std::cmp::Reverse(*plant))).map_or(0, |(plant, _)| plant);
        owners[*k] = owner;
        for i in pixels {
            if plants[*i as usize] == owner {
                leaves[*i as usize] = *k as u32 + 1;
            } else {
                beyond += 1;
            }
        }
    }
    let mut found = instances(&image.path, &semantics, &plants, &leaves)?;
    if beyond > 0 {
        found.warnings.push(format!("{beyond} pixels of leaves are outside their plants and were removed"));
    }
    let mut points = Points::new();
    for (k, thing) in image.things.iter().enumerate() {
        let leaf = thing.meaning == Meaning::Leaf;
        let own = if leaf { (owners[k], k as u32 + 1) } else { (numbers[k], 0) };
        if let Some(place) = found.numbers.get(&own) {
            points.insert(*place, thing.points);
        }
    }
    Ok((semantics, found, points))
}

/// Returns the plant number of each annotation, 0 for other annotations. Uses the numbers in the attributes if all
/// plants have different ones, otherwise counts from 1.
fn plant_numbers(things: &[Thing]) -> Vec<u32> {
    let is_plant = |t: &Thing| !t.crowd && matches!(t.meaning, Meaning::Class(Class::Crop | Class::Weed));
    let told: Vec<u32> = things.iter().filter(|t| is_plant(t)).filter_map(|t| t.plant).collect();
    let distinct: BTreeSet<u32> = told.iter().copied().filter(|n| *n > 0).collect();
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
fn pixels(image: &Annotated, thing: &Thing) -> Result<Vec<u32>> {
    let (w, h) = image.size;
    let wrong = |what: String| {
        let document = furrow_base::input::contents(&thing.document).unwrap_or_default();
        Error::input(format!("{}has a wrong mask: {what}", named(thing.id, &document))).in_file(thing.document.as_ref())
    };
    let rle = match &thing.segmentation {
        Segmentation::Polygons(polygons) => return Ok(inside(w, h, polygons)),
        Segmentation::Packed(rle) => rle.clone(),
        Segmentation::Runs { size, counts } => Rle::of_runs(*size, counts),
    };
    if rle.size != [h, w] {
        return Err(wrong(format!("it is {} × {} pixels, its image {w} × {h}", rle.size[1], rle.size[0])));
    }
    Ok(rle.pixels().map_err(|e| wrong(e.to_string()))?.map(|pixel| pixel as u32).collect())
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
            let first = (from.x - 0.5).ceil().clamp(0.0, f64::from(w)) as u32;
            let end = (to.x - 0.5).ceil().clamp(0.0, f64::from(w)) as u32;
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
    let held = |y: f64| y.clamp(0.0, f64::from(h)) as u32;
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

    #[test]
    fn an_annotation_is_named_with_its_line() {
        let text = b"{\"images\": [\n{\"id\": 7}],\n\"annotations\": [{\"id\" : 71},\n {\"image_id\": 7, \"id\": 7}]}";
        assert_eq!(named(7, text), "annotation 7 in line 4 ");
        assert_eq!(named(71, text), "annotation 71 in line 3 ");
        assert_eq!(named(8, text), "annotation 8 ");
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
                    let column = |x: f64| (x - 0.5).ceil().clamp(0.0, f64::from(w)) as u32;
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
            let (w, h) = (1 + s.index(30) as u32, 1 + s.index(30) as u32);
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
