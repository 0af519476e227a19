//! What makes a dataset: its `dataset.json`.
//!
//! Everything that decides a byte of an image stands here or in the `scene/` beside it, and nothing else does: no clock, no path
//! of a machine, no number of threads. So any shard on any machine that has the folder can go on with it.

use crate::model::classes::Classes;
use crate::model::keep::{Kept, Omitted};
use crate::model::labelling::Labelling;
use crate::model::photo::Photo;
use crate::model::split::{Shares, Split};
use furrow_base::input::{Scope, below};
use furrow_base::{Error, Result};
use furrow_field::ablation::{self, Edit};
use furrow_field::record::SpeciesRecord;
use furrow_render::settings::{Engine, Quality, RenderOptions, Technique, Techniques};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};

/// A dataset's recipe.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Recipe {
    /// The program's version.
    pub furrow: String,
    /// Where the images come from.
    pub made: Made,
    /// How many there are.
    pub count: u64,
    /// How they are split.
    pub split: Shares,
    /// Formats beside the native one, by name.
    pub formats: Vec<String>,
    /// Classes of the formats, and what they leave out.
    #[serde(default, skip_serializing_if = "Labelling::is_usual")]
    pub labelling: Labelling,
    /// Images of an archive, where they do not lie in folders of their own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pack: Option<u64>,
    /// What others may do with it, in its owner's words.
    pub licence: String,
    /// The species that `species.png` numbers from 1.
    pub species: Vec<SpeciesRecord>,
}

/// Where images come from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Made {
    /// Rendered from a scene file.
    Rendered(Box<Rendering>),
    /// Brought from elsewhere.
    Imported {
        /// The format that they were in.
        from: String,
        /// SHA-256 of everything that told how they were read: options, names and lengths of files.
        source_sha256: String,
        /// Whether they have near infrared: all of them or none. Recipes of before do not say.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        nir: Option<bool>,
    },
}

/// How images are rendered.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rendering {
    /// The scene file, below the dataset's folder.
    pub scene: String,
    /// SHA-256 of the scene file and every species file, texture and table that it names.
    pub scene_sha256: String,
    /// Seed; image k is field k of the scene file with this seed, or belongs to field k / `captures`.
    pub seed: u64,
    /// How many images are taken of each field, one after another.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub captures: u64,
    /// The days on which they are taken: all images of a day, then those of the next. Left out of fields that are seen as they are written.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub days: Vec<u32>,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// What renders.
    pub engine: Engine,
    /// Samples a pixel.
    pub spp: u32,
    /// Whether photographs are without the noise of few samples.
    pub denoise: bool,
    /// Techniques left out.
    pub without: Vec<Technique>,
    /// Most surfaces on a path, where it is not the default.
    pub max_depth: Option<u32>,
    /// Most radiance of a path, where there is a limit.
    pub clamp: Option<f32>,
    /// Whether images have a `parts.png`.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub parts: bool,
    /// Names of its models from disk, in the order of their numbers in `parts.png`; left out where the scene file gives none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub models: Vec<String>,
    /// Maps that images keep beside photograph, labels and record; [`Kept::OLDEST`] where a recipe of before does not say.
    #[serde(default = "oldest", skip_serializing_if = "is_oldest")]
    pub keep: Vec<Kept>,
    /// Label maps that images go without, since their records tell the same; recipes of before name none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub omit: Vec<Omitted>,
    /// Whether images are labels alone: no photographs and nothing that samples tell, so `spp` says nothing.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub labels_only: bool,
    /// How photographs are stored. Recipes of before do not say: theirs are PNG files, with the same comment as label maps.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub photo: Option<Photo>,
    /// The ray tracing kernels and their instruction set, or the graphics card and its driver.
    pub kernels: String,
    /// What was changed of the field, by its name among [`ablation::EDITS`]. What an edit of the drawing changes stands above as well.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub edit: Option<String>,
}

fn oldest() -> Vec<Kept> {
    Kept::OLDEST.to_vec()
}

fn is_oldest(kept: &[Kept]) -> bool {
    kept == Kept::OLDEST
}

fn one() -> u64 {
    1
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde calls it with a reference to the field")]
fn is_one(captures: &u64) -> bool {
    *captures == 1
}

impl Rendering {
    /// The scene file below the dataset's folder; an error where the recipe names one elsewhere.
    pub fn scene_in(&self, folder: &Path) -> Result<PathBuf> {
        Ok(scope(folder).check(below(folder, &self.scene)?)?)
    }

    /// The edit; [`ablation::FULL`] where nothing was changed.
    pub fn edit(&self) -> Result<&'static Edit> {
        self.edit.as_deref().map_or(Ok(&ablation::FULL), Edit::named)
    }

    /// Engine, quality and techniques, the edit's change of them included.
    pub fn options(&self) -> RenderOptions {
        let techniques = Techniques::new(&self.without, self.max_depth, self.clamp);
        RenderOptions {
            engine: self.engine,
            quality: Quality { denoise: self.denoise, ..Quality::spp(self.spp) },
            techniques,
        }
    }
}

/// Where everything lies that the scene of a dataset names, whoever made it: in the dataset's folder.
pub(crate) fn scope(folder: &Path) -> Scope {
    let help = "a dataset holds all that its scene names: restore it, or begin another from a scene file of your own";
    Scope::Below { folder: folder.into(), help }
}

/// Most images of a dataset: their names have eight digits at most.
pub const MOST_IMAGES: u64 = 99_999_999;

/// The recipe's file, below the dataset's folder.
pub const FILE: &str = "dataset.json";

/// The manifest's file.
pub const MANIFEST: &str = "manifest.json";

impl Recipe {
    /// Reads a dataset's recipe.
    pub fn read(folder: &Path) -> Result<Self> {
        let path = folder.join(FILE);
        let bytes = match furrow_base::input::contents(&path) {
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => {
                return Err(Error::input(format!("this is no dataset, it has no {FILE}"))
                    .in_file(folder)
                    .help("`trace dataset plan` begins one, `trace dataset import` brings one in"));
            }
            other => other.map_err(Error::reading(&path))?,
        };
        let wrong = |what: String| {
            Error::damaged(what)
                .in_file(&path)
                .help("run the command that began the dataset again with another --out, or restore the file")
        };
        let recipe: Self =
            serde_json::from_slice(&bytes).map_err(|e| wrong(format!("this is not a dataset's recipe: {e}")))?;
        if recipe.count > MOST_IMAGES {
            return Err(wrong(format!("it tells of {} images; datasets have at most {MOST_IMAGES}", recipe.count)));
        }
        Ok(recipe)
    }

    /// Its text.
    pub fn text(&self) -> Result<Vec<u8>> {
        json(self)
    }

    /// What decides the bytes of an image's native files: SHA-256 of the recipe without its length, formats and words.
    pub fn fingerprint(&self) -> Result<String> {
        let (formats, labelling, licence) = (Vec::new(), Labelling::default(), String::new());
        let same = Self { count: 0, formats, labelling, pack: None, licence, ..self.clone() };
        Ok(hex::encode(Sha256::digest(json(&same)?)))
    }

    /// Of images that were never made, of these species.
    #[cfg(test)]
    pub(crate) fn of_species(species: Vec<SpeciesRecord>) -> Self {
        Self {
            furrow: String::new(),
            made: Made::Imported { from: String::new(), source_sha256: String::new(), nir: None },
            count: 0,
            split: Shares::default(),
            formats: Vec::new(),
            labelling: Labelling::default(),
            pack: None,
            licence: String::new(),
            species,
        }
    }

    /// How many images are taken of each field; 1 of what was imported.
    pub fn captures(&self) -> u64 {
        match &self.made {
            Made::Rendered(rendering) => rendering.captures.max(1),
            Made::Imported { .. } => 1,
        }
    }

    /// The field that an image shows, and which image of it this is.
    pub fn field_of(&self, index: u64) -> (u64, u64) {
        (index / self.captures(), index % self.captures())
    }

    /// How many images are taken of each field on a day.
    pub fn captures_a_day(&self) -> u64 {
        (self.captures() / self.days().len().max(1) as u64).max(1)
    }

    /// The days on which images are taken; none where fields are seen as they are written.
    pub fn days(&self) -> &[u32] {
        self.rendering().map_or(&[], |rendering| &rendering.days)
    }

    /// Names that the scene file gives to models from disk; none for images from elsewhere.
    pub fn models(&self) -> &[String] {
        self.rendering().map_or(&[], |rendering| &rendering.models)
    }

    /// Number of the growing, among all, of the field that an image shows: fields grow anew for each of their days.
    pub fn growing_of(&self, index: u64) -> u64 {
        index / self.captures_a_day()
    }

    /// Whether images tell which of their field they are.
    pub fn has_sequences(&self) -> bool {
        self.captures() > 1 || !self.days().is_empty()
    }

    /// The split of an image: all images of a field are in one.
    pub fn split_of(&self, index: u64) -> Split {
        self.split.of(self.field_of(index).0)
    }

    /// An error where classes are told apart by `parts.png` alone, and its images have none.
    pub fn check_parts(&self, classes: &Classes) -> Result<()> {
        let has_parts = matches!(&self.made, Made::Rendered(rendering) if rendering.parts);
        if has_parts || !classes.needs_parts() {
            return Ok(());
        }
        let what = "classes of organs or of things on the ground need parts.png, which these images lack";
        let help = "leave those labels out of --classes, or begin another dataset with these --classes";
        Err(Error::misuse(what).help(help))
    }

    /// Whether its images are labels alone, without photographs.
    pub fn labels_only(&self) -> bool {
        matches!(&self.made, Made::Rendered(rendering) if rendering.labels_only)
    }

    /// How its photographs are stored.
    pub fn photo(&self) -> Photo {
        match &self.made {
            Made::Rendered(rendering) => rendering.photo.unwrap_or_default(),
            Made::Imported { .. } => Photo::Png,
        }
    }

    /// Whether its photographs hold a comment, as those of before do; without one, they are the very bytes that formats hold.
    pub fn has_comments(&self) -> bool {
        matches!(&self.made, Made::Rendered(rendering) if rendering.photo.is_none())
    }

    /// How it is rendered; an error for images from elsewhere.
    pub fn rendering(&self) -> Result<&Rendering> {
        match &self.made {
            Made::Rendered(rendering) => Ok(rendering),
            Made::Imported { from, .. } => {
                Err(Error::misuse(format!("these images were imported from {from} and cannot be rendered")).help(
                    "`trace dataset verify` checks them, \
                 `trace dataset finish --format …` writes further formats",
                ))
            }
        }
    }

    /// Whether images keep a map. Imported ones do that came with it; where their recipe is one of before, near infrared may be among them.
    pub fn keeps(&self, map: Kept) -> bool {
        match &self.made {
            Made::Rendered(rendering) => rendering.keep.contains(&map),
            Made::Imported { nir, .. } => map != Kept::Nir || nir.unwrap_or(true),
        }
    }

    /// Whether images go without a label map, which their records tell.
    pub fn omits(&self, map: Omitted) -> bool {
        matches!(&self.made, Made::Rendered(rendering) if rendering.omit.contains(&map))
    }

    /// The name of a species by its number in `species.png`; `None` for 0 and numbers of no species.
    pub fn species_name(&self, number: u16) -> Option<&str> {
        let place = usize::from(number).checked_sub(1)?;
        self.species.get(place).map(|s| s.name.as_str())
    }

    /// Whether `other` makes the same images as far as both go: it may be longer and have other formats.
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
            // Images that lie in folders may be packed later.
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
            "without --keep it goes on with the maps that it has; formats read label maps that were left out from the records"
        } else {
            "give another --out, or the same arguments to go on with it; --count may grow and --format may be longer"
        };
        Err(Error::misuse(format!("another dataset lies in this folder: {what}")).in_file(folder).help(help))
    }
}

/// What a value of the recipe is to whoever has not read it.
fn in_words(key: &str) -> &str {
    match key {
        "keep" => "maps of --keep",
        "omit" => "label maps that --keep leaves out",
        "nir" => "near infrared",
        key => key,
    }
}

/// The recipe's values by name, those of its rendering as well.
fn fields(recipe: &Recipe) -> Result<std::collections::BTreeMap<String, String>> {
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

/// Readable JSON with a line's end.
pub(crate) fn json(value: &impl Serialize) -> Result<Vec<u8>> {
    let mut bytes = serde_json::to_vec_pretty(value).map_err(failed)?;
    bytes.push(b'\n');
    Ok(bytes)
}

/// JSON on one line.
pub(crate) fn compact(value: &impl Serialize) -> Result<Vec<u8>> {
    let mut bytes = serde_json::to_vec(value).map_err(failed)?;
    bytes.push(b'\n');
    Ok(bytes)
}
