//! Cache of all files that a scene file names: species, images, models, soil layers, environment maps. Each is read once.

use super::desc::{ModelDesc, SpeciesDesc};
use super::image_memory::{self, ImageMemory};
use super::layer::Layer;
use super::named_file::{IMAGE_HELP, at_its_place, digest};
use super::poses;
use super::scene_edit::SceneEdit;
use super::shipped::species as shipped_species;
use super::species::{LeafImage, NamedMaterial, Species, unlikely};
use super::species_text::SpeciesFile;
use furrow_base::input::{self, Outside, Scope, shipped};
use furrow_base::math::{Spectrum, ToInt};
use furrow_base::ron_file::{Pick, RonFile, nearest};
use furrow_base::{Error, Result};
use furrow_grow::model::{Model, Up};
use furrow_grow::soil::LayerDesc;
use furrow_optics::light::{Infrared, Table};
use furrow_optics::optics::measured;
use furrow_optics::sensor::{Calibration, Pose};
use furrow_optics::texture::{ColorSpace, Header, Height, HeightFromBrightness, Maps, Texture, Wrap};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Maximum size of a file of poses in bytes: about a million lines.
const MOST_POSES: u64 = 64 << 20;
/// Maximum size of a file of a camera's calibration, bytes: it may hold the points of many images.
const MOST_CALIBRATION: u64 = 64 << 20;

/// Files read so far. The hash covers the contents of every file, in the order of their paths.
#[derive(Clone, Default)]
pub(super) struct Library {
    /// Folders that files may be read from.
    scope: Scope,
    files: BTreeMap<PathBuf, [u8; 32]>,
    /// Leaf images by file and by the bits of `relief_range`, which scales the height map beside the image.
    pictures: BTreeMap<(PathBuf, u32), Arc<LeafImage>>,
    species: BTreeMap<PathBuf, Arc<Species>>,
    /// Models by file, by whether their z axis points up, and by whether they may name files outside their folder.
    models: BTreeMap<(PathBuf, bool, bool), Arc<Model>>,
    layers: BTreeMap<(PathBuf, PathBuf), Arc<Layer>>,
    /// Resolved files of soil layers, by the paths of colour and height map in the scene file.
    layer_files: BTreeMap<(PathBuf, PathBuf), image_memory::ImageKey>,
    /// Memory that all these images take.
    pub(super) counted: ImageMemory,
    environment_maps: BTreeMap<(PathBuf, Infrared), Arc<Table>>,
    /// Warnings about species files and models, by file: images that look wrong, and what a model loses.
    file_warnings: BTreeMap<PathBuf, Vec<String>>,
    /// Built-in files, by the names that the scene file uses for them.
    shipped: BTreeMap<String, PathBuf>,
    /// Changes that an experiment makes to the descriptions of field and species.
    pub(super) growing: SceneEdit,
    /// Whether the images of every species are decoded when a scene file names it, as a check does; otherwise when a field grows it.
    pub(super) decodes_all: bool,
    /// Texts to read in place of those of scene and species files, by path.
    pub(super) replaced: BTreeMap<PathBuf, String>,
    /// Whether images and maps whose hash the previous library knows are not read again: `true` while a search for mistakes
    /// reads the same files many times.
    trusts_images: bool,
    /// Bytes of the files that this library has read.
    bytes_read: u64,
    /// Library of the previous field: its entries are reused if the contents of their files have not changed.
    before: Option<Arc<Library>>,
}

impl Library {
    /// Creates an empty library that reads nothing outside `scope`, whatever its files name.
    pub(super) fn within(scope: Scope) -> Self {
        Self { scope, ..Self::default() }
    }

    /// Returns an empty library that rereads every file, but reuses this library's decoded data for files whose contents are unchanged.
    pub(super) fn renewed(self) -> Self {
        let (scope, growing) = (self.scope.clone(), self.growing);
        let before = Some(Arc::new(Self { before: None, ..self }));
        Self { scope, growing, before, ..Self::default() }
    }

    /// Like [`Library::renewed`], for reading the same files many times at one moment: images are not hashed and names of
    /// built-in files not looked up again.
    pub(super) fn renewed_at_once(self) -> Self {
        let shipped = self.shipped.clone();
        Self { shipped, trusts_images: true, ..self.renewed() }
    }

    /// Returns the decoded data of the previous library if none of `files` has changed. All that exist must have been noted before.
    fn kept<T>(&self, files: &[&Path], known: impl FnOnce(&Self) -> Option<T>) -> Option<T> {
        let before = self.before.as_deref()?;
        let same = files.iter().all(|file| before.files.get(*file) == self.files.get(*file));
        if same { known(before) } else { None }
    }

    /// Resolves a path that `page` names. Returns an error that points into the page if the file does not exist or is outside the scope.
    pub(super) fn need(&self, page: &RonFile, path: &str) -> Result<PathBuf> {
        let folder = page.path.parent().unwrap_or(Path::new(""));
        self.scope.resolve(folder, path).map_err(outside(page, path))?;
        page.need_file(path)
    }

    /// Resolves a path that may also be the name of a built-in file. `find` looks the name up; `all` lists the built-in files for
    /// suggestions. A file of that name beside the page takes precedence (a folder does not), and the lookup happens only if the
    /// page may name files anywhere.
    pub(super) fn need_or_shipped(
        &mut self,
        page: &RonFile,
        path: &str,
        find: impl FnOnce(&str) -> Result<Option<PathBuf>>,
        all: impl FnOnce() -> Result<Vec<PathBuf>>,
    ) -> Result<PathBuf> {
        if let Some(known) = self.shipped.get(path) {
            return Ok(known.clone());
        }
        let beside = page.resolve(path);
        if self.scope == Scope::Anywhere && shipped::is_bare(path) && (beside.is_dir() || !beside.exists()) {
            let found = find(path).map_err(|e| page.about(path, e.message(), e.advice().unwrap_or_default()))?;
            if let Some(full) = found {
                self.shipped.insert(path.to_owned(), full.clone());
                return Ok(full);
            }
            return self.need(page, path).map_err(|error| likely(error, path, &all().unwrap_or_default()));
        }
        self.need(page, path)
    }

    /// Reads the scene file or species file at `path` and notes its hash.
    pub(super) fn page(&mut self, path: &Path) -> Result<RonFile> {
        let page = match self.replaced.get(path) {
            Some(text) => RonFile { path: path.into(), text: text.clone() },
            None => RonFile::read(path)?,
        };
        Ok(self.page_of(path, &page.text))
    }

    /// Notes the hash of `text` as the contents of `path`, and returns the text with its path.
    pub(super) fn page_of(&mut self, path: &Path, text: &str) -> RonFile {
        self.files.insert(path.into(), Sha256::digest(text.as_bytes()).into());
        self.bytes_read += text.len().to_u64();
        RonFile { path: path.into(), text: text.to_owned() }
    }

    /// Returns the number of bytes of the files that this library has read.
    pub(super) fn bytes_read(&self) -> u64 {
        self.bytes_read
    }

    /// Returns the paths of all files that were read, sorted.
    pub(super) fn files(&self) -> Vec<PathBuf> {
        self.files.keys().cloned().collect()
    }

    /// Returns the names that the scene file uses for built-in files, with the paths of those files.
    pub(super) fn shipped(&self) -> BTreeMap<String, PathBuf> {
        self.shipped.clone()
    }

    /// Returns the warnings about the species files and models that were read, in the order of their paths.
    pub(super) fn warnings(&self) -> Vec<String> {
        self.file_warnings.values().flatten().cloned().collect()
    }

    /// Returns the SHA-256 of the contents of all files that were read, in hex. Paths are not hashed, so a moved project keeps its hash.
    pub(super) fn hash(&self) -> String {
        let mut all = Sha256::new();
        for digest in self.files.values() {
            all.update(digest);
        }
        hex::encode(all.finalize())
    }

    /// Returns the species that `page` names.
    pub(super) fn species(&mut self, page: &RonFile, path: &str) -> Result<Arc<Species>> {
        let full = self.need_or_shipped(page, path, shipped_species, shipped::species_files)?;
        if let Some(known) = self.species.get(&full) {
            self.counted.again(&known.pictures);
            if self.decodes_all {
                known.open()?;
            }
            return Ok(known.clone());
        }
        let file = Arc::new(self.species_file(&full)?);
        let species = self.species_of(&full, &file).map_err(|error| file.locate(error))?;
        if self.decodes_all {
            species.open()?;
        }
        self.species.insert(full, species.clone());
        Ok(species)
    }

    /// Loads the species of a file that was read from `full`. The position of an error refers to the merged text of the file.
    fn species_of(&mut self, full: &Path, file: &Arc<SpeciesFile>) -> Result<Arc<Species>> {
        let own = file.page();
        let mut desc: SpeciesDesc = own.parse_all()?;
        file.check_materials(&desc)?;
        let (mut named, mut pictures) = (Vec::new(), Vec::new());
        for (name, leaf) in &desc.materials {
            let paths = leaf.texture.as_ref().map_or(&[][..], Pick::all);
            let mut images = Vec::new();
            for path in paths {
                let (image, picture) = self.picture(own, path, leaf.relief_range.f32())?;
                pictures.push(picture);
                // Calibrated images hold reflectances, as `trace texture` paints them, and need no check.
                if !leaf.calibrated {
                    let decoded = image.decoded().map_err(|e| at_its_place(own, path, IMAGE_HELP, e))?;
                    let warning = unlikely(path, decoded.mask.as_deref());
                    self.file_warnings.entry(full.into()).or_default().extend(warning);
                }
                images.push((path.clone(), image));
            }
            named.push(NamedMaterial { name: name.clone(), desc: leaf.clone(), images });
        }
        let known = |before: &Self| {
            let held = |image: &Arc<LeafImage>| before.pictures.values().any(|known| Arc::ptr_eq(known, image));
            let mut images = named.iter().flat_map(|material| &material.images);
            images.all(|(_, image)| held(image)).then(|| before.species.get(full).cloned())?
        };
        let files: Vec<&Path> = file.sources().map(|source| source.path.as_path()).collect();
        if let Some(known) = self.kept(&files, known) {
            return Ok(known);
        }
        if let Some(change) = self.growing.species {
            change(&mut desc);
        }
        Ok(Arc::new(Species::new(desc, file, named, pictures)))
    }

    /// Returns a leaf image, and its key among the counted images. The image is decoded at once only if its header cannot be read,
    /// which is then the error.
    fn picture(
        &mut self,
        page: &RonFile,
        path: &str,
        relief_range: f32,
    ) -> Result<(Arc<LeafImage>, image_memory::ImageKey)> {
        let full = self.need(page, path)?;
        // The height map is the file beside the image that ends in .height.png; without it the relief is derived from brightness.
        let beside = self.scope.check(full.with_extension("height.png")).map_err(outside(page, path))?;
        let relief = beside.is_file();
        let counted = (full.clone(), if relief { beside.clone() } else { PathBuf::new() }, relief_range.to_bits());
        let readable =
            self.counted.count(&counted, Header::leaf).map_err(|e| at_its_place(page, path, IMAGE_HELP, e))?;
        let key = (full.clone(), relief_range.to_bits());
        if let Some(known) = self.pictures.get(&key) {
            return Ok((known.clone(), counted));
        }
        let color = (full.clone(), self.note(&full)?);
        let height = if relief { Some((beside.clone(), self.note(&beside)?)) } else { None };
        let known = self.kept(&[&full, &beside], |before| before.pictures.get(&key).cloned());
        let image = known.unwrap_or_else(|| Arc::new(LeafImage::new(color, height, relief_range)));
        if !readable {
            image.decoded().map_err(|e| at_its_place(page, path, IMAGE_HELP, e))?;
        }
        self.pictures.insert(key, image.clone());
        Ok((image, counted))
    }

    /// Returns the model that `page` names, loaded with the files that it refers to.
    pub(super) fn model(&mut self, page: &RonFile, desc: &ModelDesc) -> Result<Arc<Model>> {
        let path = desc.file.as_str();
        let full = self.need(page, path)?;
        let key = (full.clone(), desc.up == Up::Z, desc.allow_outside);
        if let Some(known) = self.models.get(&key) {
            self.counted.note(counted_model(&key), known.pictures);
            return Ok(known.clone());
        }
        let lifted = desc.allow_outside.then_some(&self.scope);
        let model = if let Some(known) = self.model_before(&key) {
            known
        } else {
            let model = Model::load_within(&full, desc.up, lifted, self.counted.allowance());
            Arc::new(model.map_err(|e| at_its_place(page, path, MODEL_HELP, e))?)
        };
        let warnings = model.warnings.iter().map(|words| format!("{path}: {words}")).collect();
        self.file_warnings.insert(full.clone(), warnings);
        // Hashes of the bytes that the model was loaded from: the files may have changed since.
        self.files.extend(model.files.iter().map(|(file, digest)| (file.clone(), *digest)));
        self.counted.note(counted_model(&key), model.pictures);
        self.models.insert(key, model.clone());
        Ok(model)
    }

    /// Returns the key under which the images of the model that `page` names are counted.
    pub(super) fn model_pictures(&mut self, page: &RonFile, desc: &ModelDesc) -> Result<image_memory::ImageKey> {
        self.model(page, desc)?;
        let full = self.need(page, &desc.file)?;
        Ok(counted_model(&(full, desc.up == Up::Z, desc.allow_outside)))
    }

    /// Returns the previous library's model if the contents of its files are unchanged.
    fn model_before(&self, key: &(PathBuf, bool, bool)) -> Option<Arc<Model>> {
        let before = self.before.as_deref()?;
        let known = before.models.get(key)?;
        let same = |(file, known): (&PathBuf, &[u8; 32])| digest(file).is_ok_and(|digest| digest == *known);
        known.files.iter().all(same).then(|| known.clone())
    }

    /// Notes the hash of an environment map that `page` names, even if the current field does not use it.
    pub(super) fn environment_map_file(&mut self, page: &RonFile, path: &str) -> Result<()> {
        let full = self.need(page, path)?;
        if self.files.contains_key(&full) { Ok(()) } else { self.note(&full).map(drop) }
    }

    /// Returns an error if the environment map that `page` names is too large for the memory, by its header; it is not decoded.
    pub(super) fn check_environment_map(&mut self, page: &RonFile, path: &str) -> Result<()> {
        self.environment_map_file(page, path)?;
        let full = self.need(page, path)?;
        self.counted.check_panorama(&full).map_err(|error| at_its_place(page, path, IMAGE_HELP, error))
    }

    /// Returns the environment map that `page` names.
    pub(super) fn environment_map(&mut self, page: &RonFile, path: &str, infrared: Infrared) -> Result<Arc<Table>> {
        let full = self.need(page, path)?;
        let key = (full.clone(), infrared);
        if let Some(known) = self.environment_maps.get(&key) {
            return Ok(known.clone());
        }
        self.environment_map_file(page, path)?;
        if let Some(known) = self.kept(&[&full], |before| before.environment_maps.get(&key).cloned()) {
            self.environment_maps.insert(key, known.clone());
            return Ok(known);
        }
        self.counted.check_panorama(&full).map_err(|error| at_its_place(page, path, IMAGE_HELP, error))?;
        let table = Arc::new(Table::load(&full, infrared).map_err(|error| {
            let help = "name an equirectangular .exr or .hdr; `nir` sets the source of near infrared: Channel, Sky or OfRed(0.8)";
            at_its_place(page, path, help, error)
        })?);
        self.environment_maps.insert(key, table.clone());
        Ok(table)
    }

    /// Reads the file of poses that `page` names: times in seconds, and poses.
    pub(super) fn poses(&mut self, page: &RonFile, path: &str) -> Result<Vec<(f64, Pose)>> {
        let full = self.need(page, path)?;
        let bytes = input::read(&full, MOST_POSES).map_err(|refusal| refusal.into_error(&full))?;
        self.files.insert(full.clone(), Sha256::digest(&bytes).into());
        poses::read(&bytes).map_err(|e| at_its_place(page, path, "", e.in_file(&full)))
    }

    /// Reads the calibration of a camera that `page` names.
    pub(super) fn calibration(&mut self, page: &RonFile, path: &str) -> Result<Calibration> {
        let full = self.need(page, path)?;
        let bytes = input::read(&full, MOST_CALIBRATION).map_err(|refusal| refusal.into_error(&full))?;
        self.files.insert(full.clone(), Sha256::digest(&bytes).into());
        let read = input::utf8_lossy(&bytes).and_then(|text| Calibration::read(&text));
        read.map_err(|e| at_its_place(page, path, "", e.in_file(&full)))
    }

    /// Notes a warning about the file that `page` names, once.
    pub(super) fn warn(&mut self, page: &RonFile, path: &str, words: &str) -> Result<()> {
        let full = self.need(page, path)?;
        let known = self.file_warnings.entry(full).or_default();
        let words = format!("{path}: {words}");
        if !known.contains(&words) {
            known.push(words);
        }
        Ok(())
    }

    /// Returns the band means of the soil spectrum that `page` names.
    pub(super) fn soil_spectrum(&mut self, page: &RonFile, path: &str) -> Result<Spectrum> {
        let full = self.need(page, path)?;
        let bytes = input::read(&full, input::LARGEST).map_err(|refusal| refusal.into_error(&full))?;
        self.files.insert(full.clone(), Sha256::digest(&bytes).into());
        let read = input::utf8(&bytes).and_then(measured::reflectance);
        read.map_err(|e| at_its_place(page, path, "", e.in_file(full)))
    }

    /// Resolves the texture files of a soil layer, counts them, and returns their key among the counted images.
    pub(super) fn layer_pictures(&mut self, page: &RonFile, desc: &LayerDesc) -> Result<image_memory::ImageKey> {
        let key = (desc.albedo.clone(), desc.height.clone());
        if let Some(known) = self.layer_files.get(&key) {
            self.counted.again(std::slice::from_ref(known));
            return Ok(known.clone());
        }
        let mut need = |path: &Path| {
            let text = path.to_string_lossy();
            self.need_or_shipped(page, &text, shipped::soil_texture, shipped::soil_textures)
        };
        let albedo = need(&desc.albedo)?;
        let height = if desc.height.as_os_str().is_empty() { PathBuf::new() } else { need(&desc.height)? };
        let files = (albedo, height, 0);
        self.counted.count(&files, Header::layer).map_err(|e| {
            let of_height = e.place().is_some_and(|place| place.file == files.1);
            let named = if of_height { &desc.height } else { &desc.albedo };
            at_its_place(page, &named.to_string_lossy(), IMAGE_HELP, e)
        })?;
        self.layer_files.insert(key, files.clone());
        Ok(files)
    }

    /// Returns the textures of a soil layer.
    pub(super) fn layer(&mut self, page: &RonFile, desc: &LayerDesc) -> Result<Arc<Layer>> {
        let key = (desc.albedo.clone(), desc.height.clone());
        let (albedo, height, _) = self.layer_pictures(page, desc)?;
        if let Some(known) = self.layers.get(&key) {
            return Ok(known.clone());
        }
        let height = (!height.as_os_str().is_empty()).then_some(height);
        let files: Vec<&Path> = std::iter::once(&albedo).chain(&height).map(PathBuf::as_path).collect();
        for file in &files {
            self.note(file)?;
        }
        if let Some(known) = self.kept(&files, |before| before.layers.get(&key).cloned()) {
            self.layers.insert(key, known.clone());
            return Ok(known);
        }
        let wrong = |named: &Path, error| at_its_place(page, &named.to_string_lossy(), IMAGE_HELP, error);
        let (albedo, height) = rayon::join(
            || Texture::load(&albedo, ColorSpace::Srgb).map_err(|e| wrong(&desc.albedo, e)),
            || height.map(|height| Height::load(&height, 1.0).map_err(|e| wrong(&desc.height, e))).transpose(),
        );
        let albedo = albedo?.wrapped(Wrap::Repeat);
        let height = height?.unwrap_or_else(|| read_off(&albedo));
        let layer = Arc::new(Layer::new(albedo, height.wrapped(Wrap::Repeat)));
        self.layers.insert(key, layer.clone());
        Ok(layer)
    }

    /// Notes the hash of a file's contents, and returns it.
    fn note(&mut self, path: &Path) -> Result<[u8; 32]> {
        let known = self.before.as_deref().filter(|_| self.trusts_images).and_then(|before| before.files.get(path));
        let hash = if let Some(known) = known {
            *known
        } else {
            self.bytes_read += std::fs::metadata(path).map_or(0, |about| about.len());
            digest(path)?
        };
        self.files.insert(path.into(), hash);
        Ok(hash)
    }
}

/// Returns the key under which the images of a model are counted.
fn counted_model((file, z_up, outside): &(PathBuf, bool, bool)) -> image_memory::ImageKey {
    (file.clone(), PathBuf::new(), u32::from(*z_up) + 2 * u32::from(*outside))
}

/// Returns a function that makes the error about a path in `page` that leads outside the scope.
fn outside(page: &RonFile, literal: &str) -> impl FnOnce(Outside) -> Error {
    move |outside| page.about(literal, outside.to_string(), outside.help)
}

/// Adds a suggestion to the error about a missing file: the built-in file with the most similar name.
fn likely(error: Error, path: &str, shipped: &[PathBuf]) -> Error {
    let names: Vec<&str> = shipped.iter().filter_map(|file| file.file_name()?.to_str()).collect();
    let advice = error.advice().unwrap_or_default();
    match nearest(&names, path) {
        Some(near) if !advice.starts_with("did you mean") => {
            let help = format!("did you mean `{near}`, which ships? {advice}");
            error.help(help)
        }
        _ => error,
    }
}

/// Derives heights between 0 and 1 from a soil's brightness, for an image without a height map.
fn read_off(albedo: &Texture) -> Height {
    let height = Maps::derive(albedo, &HeightFromBrightness::SOIL).height;
    let (columns, rows) = height.size();
    let unit = |h: &f32| (0.5 + 0.5 * h / HeightFromBrightness::SOIL.amplitude).clamp(0.0, 1.0);
    Height::from_values(columns, rows, height.values().iter().map(unit).collect())
}

/// Help text of errors about models that cannot be used, if the error has none of its own.
const MODEL_HELP: &str = "export it again from the program that made it";

#[cfg(test)]
mod tests {
    use super::*;

    /// Rationale: two species may share an image and give different heights of its relief. Expected: heights in the ratio of the two
    /// values. Source: the definition of `relief_range`.
    #[test]
    fn one_picture_has_the_relief_that_each_material_gives_it() {
        let page = RonFile::of("Species()");
        let mut library = Library::default();
        let mut highest = |range: f32| {
            let (cut, _) = library
                .picture(&page, concat!(env!("CARGO_MANIFEST_DIR"), "/../../textures/leaf/sugar_beet.png"), range)
                .unwrap();
            cut.decoded().unwrap().picture.maps.height.values().iter().fold(0.0_f32, |most, h| most.max(h.abs()))
        };
        let (low, high, again) = (highest(0.01), highest(0.04), highest(0.01));
        assert!(low > 0.0 && (high / low - 4.0).abs() < 0.1, "{low} {high}");
        assert_eq!(low, again);
    }

    /// Rationale: saving a scene file again must not decode its textures again, and must never show an outdated one. Expected: the
    /// identical object if the file's contents are unchanged, a new one otherwise; the same hash as a library without a predecessor.
    #[test]
    fn what_did_not_change_is_not_decoded_again() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("leaf.png");
        let leaves = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../textures/leaf");
        let copy = |name: &str| std::fs::copy(leaves.join(format!("{name}.png")), &path).unwrap();
        copy("sugar_beet");
        let page = RonFile { path: folder.path().join("page.ron"), text: "Species()".to_owned() };
        let read = |library: &mut Library| {
            let (image, _) = library.picture(&page, "leaf.png", 0.02).unwrap();
            image.decoded().unwrap().picture.clone()
        };
        let mut first = Library::default();
        let picture = read(&mut first);
        let mut second = first.clone().renewed();
        assert!(Arc::ptr_eq(&picture, &read(&mut second)));
        assert_eq!(first.hash(), second.hash());
        copy("galium");
        let mut third = second.renewed();
        assert!(!Arc::ptr_eq(&picture, &read(&mut third)));
        let mut fresh = Library::default();
        read(&mut fresh);
        assert_eq!(third.hash(), fresh.hash());
    }

    /// Rationale: the search for mistakes reads the same files up to 150 times. Expected: it reads images once; a later search,
    /// or the next field, reads them again.
    #[test]
    fn one_search_reads_images_once() {
        let page = RonFile::of("Species()");
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../textures/leaf/sugar_beet.png");
        let read = |mut library: Library| {
            library.picture(&page, path, 0.02).unwrap();
            (library.bytes_read(), library)
        };
        let (first, library) = read(Library::default());
        let (again, library) = read(library.renewed_at_once());
        let (next, _) = read(library.renewed());
        assert!(first > 0 && again == 0 && next == first, "{first} {again} {next}");
    }

    /// Rationale: a scene file may name many more species than a field grows. Expected: naming a species decodes none of its images,
    /// and does not change the hash of the scene; a check decodes them. An image that changes before it is decoded is an error, as
    /// the scene's hash is not that of the new image.
    #[test]
    fn images_of_a_species_are_decoded_when_it_is_grown() {
        let page =
            RonFile { path: concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/x.ron").into(), text: String::new() };
        let mut library = Library::default();
        let beet = library.species(&page, "sugar_beet.ron").unwrap();
        assert!(!beet.is_open() && beet.materials().is_err());
        let hash = library.hash();
        library.decodes_all = true;
        let again = library.species(&page, "sugar_beet.ron").unwrap();
        assert!(Arc::ptr_eq(&beet, &again) && beet.is_open() && library.hash() == hash);

        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("leaf.png");
        let leaves = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../textures/leaf");
        std::fs::copy(leaves.join("galium.png"), &path).unwrap();
        let page = RonFile { path: folder.path().join("page.ron"), text: "Species()".to_owned() };
        let (image, _) = Library::default().picture(&page, "leaf.png", 0.02).unwrap();
        std::fs::copy(leaves.join("sugar_beet.png"), &path).unwrap();
        let error = image.decoded().err().unwrap();
        assert!(error.message().contains("has changed"), "{error}");
    }

    #[test]
    fn a_soil_photograph_without_a_height_map_gets_one() {
        let texel =
            |i: u32| if (i / 8 + i / 64 / 8).is_multiple_of(2) { [150, 120, 90, 255] } else { [90, 70, 50, 255] };
        let pixels: Vec<u8> = (0..64 * 64).flat_map(texel).collect();
        let height = read_off(&Texture::from_rgba8(64, 64, &pixels, ColorSpace::Srgb).wrapped(Wrap::Repeat));
        assert!(height.values().iter().all(|h| (0.0..=1.0).contains(h)));
        let (low, high) = height.values().iter().fold((1.0_f32, 0.0_f32), |(l, h), v| (l.min(*v), h.max(*v)));
        assert!(low < 0.35 && high > 0.65, "{low} to {high}: bright texels should be high, dark ones low");
    }
}
