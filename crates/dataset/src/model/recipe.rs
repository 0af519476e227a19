//! The recipe of a dataset: its `dataset.json`.
//!
//! Everything that affects a byte of an image is in the recipe or in the folder `scene/` beside it. Nothing else
//! affects the images: no clock, no path of a machine, no number of threads. So any shard on any machine that has the
//! folder can continue the dataset.

use crate::model::classes::Classes;
use crate::model::image_format::ImageFormat;
use crate::model::labelling::Labelling;
use crate::model::optional_maps::{OmittableMap, OptionalMap};
use crate::model::split::{Shares, Split};
use furrow_base::input::{Scope, below};
use furrow_base::math::ToInt;
use furrow_base::{Error, Result};
use furrow_field::ablation::{self, Edit};
use furrow_field::record::SpeciesRecord;
use furrow_render::settings::{Engine, Preset, Quality, RenderOptions, Technique, Techniques};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};

/// Recipe of a dataset.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Recipe {
    /// Version of the program.
    pub furrow: String,
    /// Origin of the images.
    pub made: ImageOrigin,
    /// Number of images.
    pub count: u64,
    /// Proportions of the splits.
    pub split: Shares,
    /// Names of additional formats; the native format is always written.
    pub formats: Vec<String>,
    /// Classes of the formats, and limits below which they omit plants and leaves.
    #[serde(default, skip_serializing_if = "Labelling::is_usual")]
    pub labelling: Labelling,
    /// Number of images per archive; omitted if each image has a folder of its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pack: Option<u64>,
    /// Licence of the dataset, as free text.
    pub licence: String,
    /// Species in the order of their numbers in `species.png`, from 1.
    pub species: Vec<SpeciesRecord>,
}

/// Origin of images.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ImageOrigin {
    /// Rendered from a scene file.
    Rendered(Box<Rendering>),
    /// Imported from another tool.
    Imported {
        /// Name of the format that they were imported from.
        from: String,
        /// SHA-256 of everything that determined how they were read: options, names and lengths of files.
        source_sha256: String,
        /// Whether they have near infrared: all of them or none. Omitted in recipes of earlier versions.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        nir: Option<bool>,
    },
}

/// Parameters of rendered images.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rendering {
    /// Path of the scene file, relative to the dataset's folder.
    pub scene: String,
    /// SHA-256 of the scene file and of every species file, texture and table that it names.
    pub scene_sha256: String,
    /// Seed. Image k shows field k / `captures` of the scene file with this seed.
    pub seed: u64,
    /// Number of images of each field; they have consecutive numbers.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub captures: u64,
    /// Number of lights under which each view of a field is rendered. Images of the same view have consecutive numbers.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub lights: u64,
    /// Days on which images are taken: all images of one day, then those of the next. Omitted if fields have no days.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub days: Vec<u32>,
    /// Image width, pixels.
    pub width: u32,
    /// Image height, pixels.
    pub height: u32,
    /// Render engine.
    pub engine: Engine,
    /// Samples per pixel.
    pub spp: u32,
    /// Whether images are denoised.
    pub denoise: bool,
    /// Render techniques that are switched off.
    pub without: Vec<Technique>,
    /// Maximum number of surfaces on a path; null for the default.
    pub max_depth: Option<u32>,
    /// Maximum radiance of a path; null for no limit.
    pub clamp: Option<f32>,
    /// Preset of quality; omitted for the full integrator.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quality: Option<Preset>,
    /// Whether images have a `parts.png`.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub parts: bool,
    /// Names of the scene's models from disk, in the order of their numbers in `parts.png`; omitted if the scene file
    /// names none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub models: Vec<String>,
    /// Maps that are stored in addition to image, labels and record; [`OptionalMap::OLDEST`] for recipes of earlier versions,
    /// which do not list them.
    #[serde(default = "oldest", skip_serializing_if = "is_oldest")]
    pub keep: Vec<OptionalMap>,
    /// Label maps that are not stored, since the records contain the same information; empty for recipes of earlier
    /// versions.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub omit: Vec<OmittableMap>,
    /// Whether images are labels only, without rendered images and maps from samples; `spp` then has no effect.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub labels_only: bool,
    /// Encoding of the images. Omitted in recipes of earlier versions: their images are PNG files with the same comment
    /// as label maps.
    #[serde(default, rename = "photo", skip_serializing_if = "Option::is_none")]
    pub image_format: Option<ImageFormat>,
    /// Ray tracing kernels with their instruction set, or graphics card with its driver.
    pub kernels: String,
    /// Name of the applied ablation among [`ablation::EDITS`]; its changes of render options are in the fields above as
    /// well.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub edit: Option<String>,
}

fn oldest() -> Vec<OptionalMap> {
    OptionalMap::OLDEST.to_vec()
}

fn is_oldest(kept: &[OptionalMap]) -> bool {
    kept == OptionalMap::OLDEST
}

fn one() -> u64 {
    1
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it with a reference to the field")]
fn is_one(captures: &u64) -> bool {
    *captures == 1
}

impl Rendering {
    /// Returns the path of the scene file in the dataset's `folder`; an error if the recipe names a file elsewhere.
    pub fn scene_in(&self, folder: &Path) -> Result<PathBuf> {
        Ok(scope(folder).check(below(folder, &self.scene)?)?)
    }

    /// Returns the applied ablation; [`ablation::FULL`] for none.
    pub fn edit(&self) -> Result<&'static Edit> {
        self.edit.as_deref().map_or(Ok(&ablation::FULL), Edit::named)
    }

    /// Returns engine, quality and techniques, including the changes by the ablation.
    pub fn options(&self) -> RenderOptions {
        let techniques = Techniques::new(&self.without, self.max_depth, self.clamp);
        RenderOptions {
            engine: self.engine,
            quality: Quality { denoise: self.denoise, ..Quality::spp(self.spp) },
            techniques,
            preset: self.quality,
        }
    }
}

/// Returns the scope of the files that a dataset's scene may name: only the dataset's folder, since datasets may come
/// from other people.
pub(crate) fn scope(folder: &Path) -> Scope {
    let help = "a dataset contains all files of its scene: restore it, or create another from your own scene file";
    Scope::Below { folder: folder.into(), help }
}

/// Maximum number of images in a dataset: their names have at most eight digits.
pub const MOST_IMAGES: u64 = 99_999_999;

/// Name of the recipe's file in the dataset's folder.
pub const FILE: &str = "dataset.json";

/// Name of the manifest's file in the dataset's folder.
pub const MANIFEST: &str = "manifest.json";

impl Recipe {
    /// Reads the recipe of the dataset in `folder`.
    pub fn read(folder: &Path) -> Result<Self> {
        let path = folder.join(FILE);
        let bytes = match furrow_base::input::contents(&path) {
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
                return Err(Error::input(format!("this is no dataset, it has no {FILE}"))
                    .in_file(folder)
                    .help("`trace dataset plan` creates one, `trace dataset import` imports one"));
            }
            other => other.map_err(Error::reading(&path))?,
        };
        let wrong = |what: String| {
            Error::input(what)
                .in_file(&path)
                .help("repeat the command that created the dataset with another --out, or restore the file")
        };
        let recipe: Self =
            serde_json::from_slice(&bytes).map_err(|e| wrong(format!("this is not a dataset's recipe: {e}")))?;
        if recipe.count > MOST_IMAGES {
            return Err(wrong(format!("it has {} images; datasets have at most {MOST_IMAGES}", recipe.count)));
        }
        Ok(recipe)
    }

    /// Returns the contents of the recipe's file.
    pub fn text(&self) -> Result<Vec<u8>> {
        json(self)
    }

    /// Returns the SHA-256, in hex, of everything that affects the bytes of an image's native files: the recipe without
    /// count, formats, labelling, pack size and licence.
    pub fn fingerprint(&self) -> Result<String> {
        let (formats, labelling, licence) = (Vec::new(), Labelling::default(), String::new());
        let same = Self { count: 0, formats, labelling, pack: None, licence, ..self.clone() };
        Ok(hex::encode(Sha256::digest(json(&same)?)))
    }

    /// Returns the recipe of an imported dataset without images, with these species.
    #[cfg(test)]
    pub(crate) fn of_species(species: Vec<SpeciesRecord>) -> Self {
        Self {
            furrow: String::new(),
            made: ImageOrigin::Imported { from: String::new(), source_sha256: String::new(), nir: None },
            count: 0,
            split: Shares::default(),
            formats: Vec::new(),
            labelling: Labelling::default(),
            pack: None,
            licence: String::new(),
            species,
        }
    }

    /// Returns the number of images of each field; 1 for imported images.
    pub fn captures(&self) -> u64 {
        match &self.made {
            ImageOrigin::Rendered(rendering) => rendering.captures.max(1),
            ImageOrigin::Imported { .. } => 1,
        }
    }

    /// Returns the number of lights under which each view of a field is rendered; 1 for imported images.
    pub fn lights(&self) -> u64 {
        self.rendering().map_or(1, |rendering| rendering.lights.max(1))
    }

    /// Returns the number of the light under which an image is rendered, 0 for the field's own.
    pub fn light_of(&self, index: u64) -> u64 {
        self.field_of(index).1 % self.lights()
    }

    /// Returns the number of views of each field per day: frames times cameras.
    pub fn views_a_day(&self) -> u64 {
        (self.captures_a_day() / self.lights()).max(1)
    }

    /// Returns the field that an image shows, and the number of the image within the field.
    pub fn field_of(&self, index: u64) -> (u64, u64) {
        (index / self.captures(), index % self.captures())
    }

    /// Returns the number of images of each field per day, under all lights.
    pub fn captures_a_day(&self) -> u64 {
        (self.captures() / self.days().len().max(1).to_u64()).max(1)
    }

    /// Returns the days on which images are taken; empty if fields have no days.
    pub fn days(&self) -> &[u32] {
        self.rendering().map_or(&[], |rendering| &rendering.days)
    }

    /// Returns the names of the scene's models from disk; empty for imported images.
    pub fn models(&self) -> &[String] {
        self.rendering().map_or(&[], |rendering| &rendering.models)
    }

    /// Returns the number of the scene, among all scenes that are built, that an image shows: a field is built once for
    /// each of its days.
    pub fn growing_of(&self, index: u64) -> u64 {
        index / self.captures_a_day()
    }

    /// Returns whether records state the position of the image in a drive, a rig or the days of its field.
    pub fn has_sequences(&self) -> bool {
        self.views_a_day() > 1 || !self.days().is_empty()
    }

    /// Returns the split of an image; all images of a field have the same one.
    pub fn split_of(&self, index: u64) -> Split {
        self.split.of(self.field_of(index).0)
    }

    /// Returns an error if `classes` need `parts.png` and the images have none.
    pub fn check_parts(&self, classes: &Classes) -> Result<()> {
        let has_parts = matches!(&self.made, ImageOrigin::Rendered(rendering) if rendering.parts);
        if has_parts || !classes.needs_parts() {
            return Ok(());
        }
        let what = "classes of organs or of objects on the ground need parts.png, which these images lack";
        let help = "omit those labels from --classes, or create another dataset with these --classes";
        Err(Error::misuse(what).help(help))
    }

    /// Returns whether the images are labels only, without rendered images.
    pub fn labels_only(&self) -> bool {
        matches!(&self.made, ImageOrigin::Rendered(rendering) if rendering.labels_only)
    }

    /// Returns the encoding of the images.
    pub fn image_format(&self) -> ImageFormat {
        match &self.made {
            ImageOrigin::Rendered(rendering) => rendering.image_format.unwrap_or_default(),
            ImageOrigin::Imported { .. } => ImageFormat::Png,
        }
    }

    /// Returns whether the image files contain a comment, as in earlier versions. Without a comment, formats contain
    /// the same bytes.
    pub fn has_comments(&self) -> bool {
        matches!(&self.made, ImageOrigin::Rendered(rendering) if rendering.image_format.is_none())
    }

    /// Returns whether the images were imported instead of rendered.
    pub fn is_imported(&self) -> bool {
        matches!(self.made, ImageOrigin::Imported { .. })
    }

    /// Returns the render parameters; an error for imported images.
    pub fn rendering(&self) -> Result<&Rendering> {
        match &self.made {
            ImageOrigin::Rendered(rendering) => Ok(rendering),
            ImageOrigin::Imported { from, .. } => {
                Err(Error::misuse(format!("these images were imported from {from} and cannot be rendered")).help(
                    "`trace dataset verify` checks them, \
                 `trace dataset finish --format …` writes further formats",
                ))
            }
        }
    }

    /// Returns whether the images have a map, if its file exists. Rendered images have the maps in `keep`. Imported
    /// images have the maps that they came with; if their recipe does not state near infrared, they may have it.
    pub fn keeps(&self, map: OptionalMap) -> bool {
        match &self.made {
            ImageOrigin::Rendered(rendering) => rendering.keep.contains(&map),
            ImageOrigin::Imported { nir, .. } => map != OptionalMap::Nir || nir.unwrap_or(true),
        }
    }

    /// Returns whether the images omit a label map; their records contain the same information.
    pub fn omits(&self, map: OmittableMap) -> bool {
        matches!(&self.made, ImageOrigin::Rendered(rendering) if rendering.omit.contains(&map))
    }

    /// Returns the name of a species by its number in `species.png`; `None` for 0 and unknown numbers.
    pub fn species_name(&self, number: u16) -> Option<&str> {
        let place = usize::from(number).checked_sub(1)?;
        self.species.get(place).map(|s| s.name.as_str())
    }

    /// Checks that `other` can continue this dataset: it must make the same images, but may have more of them, other
    /// formats, other labels and another licence; images in folders may be packed. The error lists the differences.
    pub fn check_goes_on(&self, folder: &Path, other: &Self) -> Result<()> {
        let (before, now) = (fields(self)?, fields(other)?);
        let free = ["count", "formats", "licence", "classes", "min_pixels", "min_visible"];
        let keys: std::collections::BTreeSet<&String> = before.keys().chain(now.keys()).collect();
        let value = |of: &std::collections::BTreeMap<String, String>, key: &String| {
            of.get(key).cloned().unwrap_or_else(|| "none".into())
        };
        let differing: Vec<&String> = keys
            .into_iter()
            .filter(|key| !free.contains(&key.as_str()) && before.get(*key) != now.get(*key))
            // Images in folders may be packed later.
            .filter(|key| *key != "pack" || self.pack.is_some())
            .collect();
        let differs: Vec<String> = differing
            .iter()
            .map(|key| format!("{} {} there, {} here", in_words(key), value(&before, key), value(&now, key)))
            .collect();
        if differs.is_empty() && other.count >= self.count {
            return Ok(());
        }
        let what = if differs.is_empty() {
            format!("it has {} images, more than {}", self.count, other.count)
        } else {
            differs.join("; ")
        };
        let maps = differing.iter().any(|key| ["keep", "omit"].contains(&key.as_str()));
        let help = if maps {
            "omit --keep to continue with the dataset's maps; formats take omitted label maps from the records"
        } else {
            "give another --out, or the same arguments to continue it; --count may be larger, and --format may list more"
        };
        Err(Error::misuse(format!("another dataset is in this folder: {what}")).in_file(folder).help(help))
    }
}

/// Returns the description of a value of the recipe for error messages.
fn in_words(key: &str) -> &str {
    match key {
        "keep" => "maps of --keep",
        "omit" => "label maps that --keep leaves out",
        "nir" => "near infrared",
        key => key,
    }
}

/// Returns the recipe's values by name, including those of its rendering.
pub(crate) fn fields(recipe: &Recipe) -> Result<std::collections::BTreeMap<String, String>> {
    let mut all = std::collections::BTreeMap::new();
    let mut todo = vec![(String::new(), serde_json::to_value(recipe).map_err(failed)?)];
    while let Some((name, value)) = todo.pop() {
        match value {
            serde_json::Value::Object(object) => todo.extend(object),
            value => drop(all.insert(name, value.to_string())),
        }
    }
    Ok(all)
}

fn failed(e: impl std::fmt::Display) -> Error {
    Error::failed(format!("cannot write JSON: {e}"))
}

/// Serializes a value as indented JSON with a final newline.
pub(crate) fn json(value: &impl Serialize) -> Result<Vec<u8>> {
    let mut bytes = serde_json::to_vec_pretty(value).map_err(failed)?;
    bytes.push(b'\n');
    Ok(bytes)
}

/// Serializes a value as JSON on one line, with a final newline.
pub(crate) fn compact(value: &impl Serialize) -> Result<Vec<u8>> {
    let mut bytes = serde_json::to_vec(value).map_err(failed)?;
    bytes.push(b'\n');
    Ok(bytes)
}
