//! Memory accounting of a field's images: computed from their headers, so that an image beyond the limit is refused before it is decoded.

use super::estimate::{Share, usual_memory};
use furrow_base::geometry::Cost;
use furrow_base::math::ToFloat;
use furrow_base::ron_file::Step;
use furrow_base::{Error, Result};
use furrow_optics::texture::{Header, MemoryLimit, Need};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Key of a counted image: its file, its height map's file (empty if none), and a number for other parameters that it depends on.
pub(super) type ImageKey = (PathBuf, PathBuf, u32);

/// Memory needs of the images of the current field.
#[derive(Clone, Default)]
pub(super) struct ImageMemory {
    /// Memory limit, bytes; [`usual_memory`] if `None`.
    memory: Option<u64>,
    /// Needs of all images counted so far, for this field or earlier ones.
    needs: BTreeMap<ImageKey, Need>,
    /// Images of the current field.
    asked: BTreeSet<ImageKey>,
}

impl ImageMemory {
    /// Starts a new field with this memory limit in bytes.
    pub(super) fn begin(&mut self, memory: Option<u64>) {
        self.memory = memory;
        self.asked.clear();
    }

    /// Counts an image by its headers. Returns whether they can be read; if not, decoding reports the error. If all images together
    /// exceed the limit, returns an error about the larger of its files.
    pub(super) fn count(&mut self, picture: &ImageKey, need: fn(&Header, Option<&Header>) -> Need) -> Result<bool> {
        let need = match self.needs.get(picture) {
            Some(known) => Some(*known),
            None => self.weigh(picture, need)?,
        };
        if let Some(need) = need {
            self.note(picture.clone(), need);
        }
        Ok(need.is_some())
    }

    /// Returns an error if reading an environment map would take too much memory.
    pub(super) fn check_panorama(&self, file: &Path) -> Result<()> {
        let Some(header) = Header::of_panorama(file) else { return Ok(()) };
        let refused = |what: String| Error::input(what).help(MemoryLimit::HELP).in_file(file);
        self.allowance().take(&header, header.panorama()).map_err(refused)
    }

    /// Returns the memory need of an image, checked against the limit together with the other images of the field. Returns `None` if a
    /// header cannot be read; decoding then reports the error.
    fn weigh(&self, (file, beside, _): &ImageKey, need: fn(&Header, Option<&Header>) -> Need) -> Result<Option<Need>> {
        let Some(header) = Header::of_file(file) else { return Ok(None) };
        let alone = beside.as_os_str().is_empty();
        let height = if alone { None } else { Header::of_file(beside) };
        let (larger, of) = match &height {
            Some(height) if height.pixels() > header.pixels() => (beside, height),
            _ => (file, &header),
        };
        let need = need(&header, height.as_ref());
        let refused = |what: String| Error::input(what).help(MemoryLimit::HELP).in_file(larger);
        self.allowance().take(of, need).map_err(refused)?;
        Ok((alone || height.is_some()).then_some(need))
    }

    /// Adds an image with a known need to the current field.
    pub(super) fn note(&mut self, picture: ImageKey, need: Need) {
        self.needs.insert(picture.clone(), need);
        self.asked.insert(picture);
    }

    /// Adds images that were counted before to the current field.
    pub(super) fn again(&mut self, pictures: &[ImageKey]) {
        self.asked.extend(pictures.iter().cloned());
    }

    /// Returns the memory left for further images.
    pub(super) fn allowance(&self) -> MemoryLimit {
        let most = self.memory.unwrap_or_else(usual_memory).to_f64();
        MemoryLimit { most, taken: self.asked.iter().filter_map(|picture| self.needs.get(picture)).copied().sum() }
    }

    /// Returns the memory cost of images by the places of the scene file that name them. An image counts at the first place that names it.
    /// Temporary memory for decoding is added at one place only, the one that needs most.
    pub(super) fn shares(&self, places: Vec<(Vec<Step<'static>>, Vec<ImageKey>)>) -> Vec<Share> {
        let mut seen = BTreeSet::new();
        let mut all = Vec::new();
        for (at, mut pictures) in places {
            pictures.retain(|picture| seen.insert(picture.clone()));
            let counted = pictures.iter().filter_map(|picture| Some((picture, *self.needs.get(picture)?)));
            let Some((largest, _)) = counted.clone().max_by(|a, b| a.1.peak.total_cmp(&b.1.peak)) else { continue };
            let advice = format!("use smaller images, first for `{}`", name(&largest.0));
            all.push((at, counted.map(|(_, need)| need).sum::<Need>(), advice));
        }
        let passing = |k: &usize| all[*k].1.passing();
        let longest = (0..all.len()).max_by(|a, b| passing(a).total_cmp(&passing(b)));
        let share = |(k, (at, need, advice)): (usize, (Vec<Step<'static>>, Need, String))| {
            let bytes = if Some(k) == longest { need.peak } else { need.held };
            Share { at, cost: Cost::work(bytes, 0.0), advice }
        };
        all.into_iter().enumerate().map(share).collect()
    }
}

/// Returns the name of a file without its folder.
fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn leaf(name: &str) -> ImageKey {
        (Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../textures/leaf/{name}.png")), PathBuf::new(), 0)
    }

    /// Expected: an image counts once for each field that uses it, whether or not an earlier field did; the error names its file.
    #[test]
    fn each_field_counts_its_pictures_once() {
        let mut pictures = ImageMemory::default();
        let taken = |pictures: &ImageMemory| pictures.allowance().taken;
        pictures.count(&leaf("rape"), Header::leaf).unwrap();
        let one = taken(&pictures);
        pictures.count(&leaf("rape"), Header::leaf).unwrap();
        assert!(one.held > 5e6 && taken(&pictures) == one);
        pictures.begin(Some(8 << 20));
        assert_eq!(taken(&pictures), Need::default());
        pictures.again(&[leaf("rape")]);
        assert_eq!(taken(&pictures), one);
        let error = pictures.count(&leaf("grass"), Header::leaf).unwrap_err();
        assert!(error.message().contains("123 × 2048 pixels would take"), "{error}");
        assert!(error.place().is_some_and(|place| place.file.ends_with("grass.png")), "{error}");
        assert_eq!(taken(&pictures), one);
    }

    /// Expected: an image named at two places counts once, and the shares add up to the total of all images.
    #[test]
    fn shares_are_what_all_take() {
        let mut pictures = ImageMemory::default();
        for name in ["rape", "grass"] {
            pictures.count(&leaf(name), Header::leaf).unwrap();
        }
        let at = |field| vec![Step::Field(field)];
        let places = ["rape", "rape", "grass"].map(|name| vec![leaf(name)]);
        let places = [at("crops"), at("weeds"), at("plants")].into_iter().zip(places).collect();
        let shares = pictures.shares(places);
        let bytes: f64 = shares.iter().map(|share| share.cost.bytes).sum();
        assert_eq!(shares.iter().map(|share| share.at.clone()).collect::<Vec<_>>(), [at("crops"), at("plants")]);
        assert!((bytes - pictures.allowance().taken.peak).abs() < 1.0);
        assert!(shares[1].advice.contains("`grass.png`"), "{}", shares[1].advice);
    }
}
