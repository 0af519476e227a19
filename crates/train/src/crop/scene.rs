//! Scene file of fields with named crops: `scenes/any-field.ron` with its cameras, lights, soils and weeds, and only these crops.
//!
//! The text is copied entry by entry, so that users can read and edit the result like any scene file.

use super::species::Species;
use furrow_base::input::shipped;
use furrow_base::ron_file::{RonFile, Spliced, Step};
use furrow_base::{Error, Result};
use furrow_field::desc::{CropDesc, FieldDesc, Role};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Name of the scene file that the crops are taken from.
const WIDE: &str = "any-field.ron";
/// Indentation of entries in the scene file.
const INDENT: &str = "        ";
/// Density of a relative of the crop or of another weed that the wide scene file does not list: volunteers in two of seven fields.
const SPREAD: &str = "spread: (per_m2: Weighted([(0, 5), (3, 1), (15, 1)]))";
/// Rows of a crop that the wide scene file does not list: estimates, from cereals to maize.
const ROWS: &str = "rows: (spacing_m: Uniform(0.15, 0.75), in_row_m: Uniform(0.05, 0.3), azimuth_deg: Uniform(0, 180), offset_m: Uniform(-0.2, 0.2), emergence: Uniform(0.6, 0.97))";
/// First BBCH stage with inflorescences; the ages of a species that the wide scene file does not list end before it.
const FLOWERING: u32 = 50;
/// Three overlapping parts of a plant's growth, as fractions: seedlings, young plants, grown ones.
const AGES: [(f64, f64); 3] = [(0.0, 0.4), (0.25, 0.7), (0.6, 1.0)];

/// Returns the text of a scene file for fields with these crops. Its weeds are those of the wide scene file and the relatives of the
/// crops, or exactly `weeds` if they are given. `command` is the command that makes it, for the comment at its head.
pub fn scene(crops: &[Species], weeds: Option<&[Species]>, command: &str) -> Result<String> {
    let wide = Wide::read()?;
    let mut sown = Vec::new();
    for crop in crops {
        let own = wide.crops_of(crop);
        if own.is_empty() {
            sown.push(format!("(species: {:?}, {}, {ROWS})", crop.written, growth(crop)?));
        }
        sown.extend(own);
    }
    let known = wide.crops()?;
    let (mut wild, others) = match weeds {
        Some(weeds) => (Vec::new(), weeds.iter().collect()),
        None => (wide.all_weeds(), relatives(crops, &known)),
    };
    for other in others {
        wild.push(wide.weed(other)?);
    }
    let text = wide.with(&sown, &wild)?;
    let body = text.find("Field(").map_or(text.as_str(), |start| &text[start..]);
    let names: Vec<&str> = crops.iter().map(|crop| crop.desc.name.as_str()).collect();
    Ok(format!(
        "// Fields of {} with every soil, light, camera and age of the scene file `{WIDE}`. All other plants are weeds.\n//\n//   {command}\n//\n// Edit it before images are rendered: a folder of images keeps its scene.\n{body}",
        names.join(" and of ")
    ))
}

/// The wide scene file: its text and its contents.
struct Wide {
    text: Spliced,
    desc: FieldDesc,
}

impl Wide {
    fn read() -> Result<Self> {
        let page = RonFile::read(&shipped::folder()?.join("scenes").join(WIDE))?;
        let desc = page.parse_all()?;
        Ok(Self { text: Spliced::of(page), desc })
    }

    fn file(&self, species: &str) -> PathBuf {
        self.text.page.resolve(species)
    }

    /// Returns the text of the value that `path` leads to.
    fn at(&self, path: &[Step<'_>]) -> &str {
        self.text.find(path).map_or("", |at| &self.text.page.text[at])
    }

    /// Returns the entries of a crop. Fields without its plants are left out.
    fn crops_of(&self, crop: &Species) -> Vec<String> {
        let is = |desc: &CropDesc| self.file(&desc.species) == crop.file && desc.rows.emergence.largest() > 0.0;
        let own = self.desc.crops.iter().enumerate().filter(|(_, desc)| is(desc));
        own.map(|(k, _)| self.at(&[Step::Field("crops"), Step::Item(k)]).to_owned()).collect()
    }

    /// Returns the species of all crops, each once.
    fn crops(&self) -> Result<Vec<Species>> {
        let files: BTreeSet<PathBuf> = self.desc.crops.iter().map(|crop| self.file(&crop.species)).collect();
        files.iter().map(|file| Species::find(&stem(file))).collect()
    }

    /// Returns the entries of all weeds.
    fn all_weeds(&self) -> Vec<String> {
        (0..self.desc.weeds.len()).map(|k| self.at(&[Step::Field("weeds"), Step::Item(k)]).to_owned()).collect()
    }

    /// Returns the entry of a species as a weed: the scene file's, or one of its ages as a crop or of all ages before it flowers.
    fn weed(&self, species: &Species) -> Result<String> {
        if let Some(k) = self.desc.weeds.iter().position(|desc| self.file(&desc.species) == species.file) {
            return Ok(self.at(&[Step::Field("weeds"), Step::Item(k)]).to_owned());
        }
        let sown = self.desc.crops.iter().position(|desc| self.file(&desc.species) == species.file);
        let growth = match sown {
            Some(k) => {
                format!("growth: {}", self.at(&[Step::Field("crops"), Step::Item(k), Step::Field("growth")]))
            }
            None => growth(species)?,
        };
        Ok(format!("(species: {:?}, {growth}, {SPREAD})", species.written))
    }

    /// Returns the text with these crops and weeds. Species, soils and models are found from any folder.
    fn with(&self, crops: &[String], weeds: &[String]) -> Result<String> {
        let list = |entries: &[String]| {
            let lines: Vec<String> = entries.iter().map(|entry| format!("{INDENT}{entry},\n")).collect();
            format!("[\n{}    ]", lines.concat())
        };
        let mut text = self.text.page.text.clone();
        // From the end, so that byte offsets stay valid.
        for (field, entries) in [("weeds", weeds), ("crops", crops)] {
            let at = self.text.find(&[Step::Field(field)]).ok_or_else(|| {
                Error::input(format!("this scene file has no `{field}`")).in_file(&self.text.page.path)
            })?;
            text.replace_range(at, &list(entries));
        }
        let page = RonFile { path: self.text.page.path.clone(), text };
        let place = |path: &str| found_anywhere(&page.resolve(path));
        Ok(page.replace_quoted(place).unwrap_or(page.text))
    }
}

/// Returns what a scene file in any folder writes for a file that ships: the bare name for species and soils, its absolute path
/// for others. Returns `None` if there is no such file.
fn found_anywhere(file: &Path) -> Option<String> {
    if !file.is_file() {
        return None;
    }
    if shipped::species_files().ok()?.iter().any(|species| species == file) {
        return Some(stem(file));
    }
    let name = file.file_name()?.to_str()?;
    let same = |soil: PathBuf| soil.canonicalize().ok() == file.canonicalize().ok();
    if shipped::soil_texture(name).ok().flatten().is_some_and(same) {
        return Some(name.to_owned());
    }
    std::path::absolute(file).ok().map(|path| path.to_string_lossy().into_owned())
}

fn stem(file: &Path) -> String {
    file.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// Returns the growth of a species that the wide scene file does not list, with one age for each part of [`AGES`]: from its first stage
/// to the last before it flowers.
fn growth(species: &Species) -> Result<String> {
    let stages = &species.desc.plant.stages;
    let days: Vec<f64> = stages.iter().filter(|s| s.bbch < FLOWERING).map(|s| s.days.get()).collect();
    let ends = days.first().zip(days.last());
    let (first, last) = ends.ok_or_else(|| {
        Error::input(format!("this species has no stage before BBCH {FLOWERING}")).in_file(&species.file)
    })?;
    let age = |(from, to): (f64, f64)| {
        let day = |part: f64| (first + part * (last - first)).round();
        format!("AgeDays(Uniform({}, {}))", day(from), day(to))
    };
    Ok(format!("growth: Either([{}])", AGES.map(age).join(", ")))
}

/// Returns the relatives of the named crops among `all`: those of the same genus, or if there are none, of the same growth form.
fn relatives<'a>(crops: &[Species], all: &'a [Species]) -> Vec<&'a Species> {
    let mut found: Vec<&Species> = Vec::new();
    for crop in crops {
        let others = || all.iter().filter(|other| !crops.iter().any(|named| named.file == other.file));
        let mut own: Vec<&Species> =
            others().filter(|other| !crop.genus().is_empty() && other.genus() == crop.genus()).collect();
        if own.is_empty() {
            own = others().filter(|other| other.desc.grows_like(&crop.desc)).collect();
        }
        found.extend(own.into_iter().filter(|other| other.desc.role == Role::Crop));
    }
    found.sort_by(|a, b| a.file.cmp(&b.file));
    found.dedup_by(|a, b| a.file == b.file);
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> FieldDesc {
        RonFile::of(text).parse_all().unwrap()
    }

    fn made(crops: &[&str], weeds: Option<&[&str]>) -> (String, FieldDesc) {
        let named = |names: &[&str]| names.iter().map(|name| Species::find(name).unwrap()).collect::<Vec<_>>();
        let weeds = weeds.map(named);
        let text = scene(&named(crops), weeds.as_deref(), "train make").unwrap();
        let desc = read(&text);
        (text, desc)
    }

    /// Rationale: a network learns the crop only if no field has another one sown. Expected: the crop's entry of the wide scene file,
    /// all its weeds, and the other crops of its form as weeds; all else is unchanged but for paths that hold in any folder.
    #[test]
    fn one_crop_is_sown_and_its_relatives_are_weeds() {
        let (text, desc) = made(&["maize"], None);
        let wide = Wide::read().unwrap().desc;
        let species: Vec<&str> = desc.crops.iter().map(|crop| crop.species.as_str()).collect();
        assert_eq!(species, ["maize"]);
        let weeds: Vec<&str> = desc.weeds.iter().map(|weed| weed.species.as_str()).collect();
        assert!(weeds.contains(&"chenopodium"), "{weeds:?}");
        assert_eq!(weeds[wide.weeds.len()..], ["barley", "onion", "rice", "wheat"]);
        assert_eq!((&desc.camera, &desc.lights, desc.seed), (&wide.camera, &wide.lights, wide.seed));
        assert_eq!(desc.crops[0].growth, wide.crops[2].growth);
        assert!(text.contains("\"dirt.png\"") && !text.contains("\"../") && !text.contains("\"models/"), "{text}");
        assert!(text.starts_with("// Fields of maize with"), "{text}");
    }

    /// Expected: relatives are those of the genus if it has any; two crops are both sown and neither is a weed; `--weeds` is exact;
    /// fields without plants of a crop are left out.
    #[test]
    fn relatives_are_of_the_genus_or_else_of_the_form() {
        let extra = |crops: &[&str]| {
            let (_, desc) = made(crops, None);
            desc.weeds[Wide::read().unwrap().desc.weeds.len()..]
                .iter()
                .map(|weed| weed.species.clone())
                .collect::<Vec<_>>()
        };
        assert_eq!(extra(&["rape"]), ["cabbage", "cauliflower"]);
        assert_eq!(extra(&["sugar beet"]), ["lettuce", "rape", "spinach"]);
        assert_eq!(extra(&["maize", "wheat"]), ["barley", "onion", "rice"]);
        let (_, desc) = made(&["sugar beet", "rape"], Some(&["thistle", "maize"]));
        let species: Vec<&str> = desc.crops.iter().map(|crop| crop.species.as_str()).collect();
        assert_eq!(species, ["sugar_beet", "sugar_beet", "rape", "rape"]);
        let weeds: Vec<&str> = desc.weeds.iter().map(|weed| weed.species.as_str()).collect();
        assert_eq!(weeds, ["cirsium", "maize"]);
    }

    /// Expected: a species file of the user's own becomes a crop with three ages up to its last stage before flowering.
    #[test]
    fn a_species_of_ones_own_is_sown() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("own.ron");
        let base = Species::find("soybean").unwrap();
        let text = format!("Species(name: \"own bean\", eppo: \"OWNBN\", role: Crop, like: {:?})", base.file);
        std::fs::write(&file, text).unwrap();
        let (_, desc) = made(&[file.to_str().unwrap()], Some(&[]));
        assert_eq!(desc.crops[0].species, file.to_str().unwrap());
        assert!(matches!(&desc.crops[0].growth, furrow_field::desc::Growth::Either(ages) if ages.len() == 3));
        assert!(desc.weeds.is_empty());
    }
}
