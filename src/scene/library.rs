//! Everything that scene files name, read once: species, pictures, soil layers.

use super::desc::{ModelDesc, SpeciesDesc};
use super::growing::Growing;
use super::layer::Layer;
use super::pictures::{self, Pictures};
use super::poses;
use super::shipped::species as shipped_species;
use super::species_text::SpeciesFile;
use crate::error::{Kind, Place};
use crate::geometry::{AlphaMask, Margin};
use crate::input::{self, Outside, Scope, shipped};
use crate::light::{Infrared, Table};
use crate::material::{LeafMaterial, Picture, Tones};
use crate::math::Spectrum;
use crate::model::{Model, Up};
use crate::optics::{Pigments, measured};
use crate::ron_file::{Pick, RENAMED, RonFile, nearest};
use crate::sensor::Pose;
use crate::soil::LayerDesc;
use crate::texture::{ColorSpace, Header, Height, HeightFromBrightness, Maps, Texture, Wrap};
use crate::{Error, Result};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

/// Most bytes of a file of poses: about a million lines.
const MOST_POSES: u64 = 64 << 20;

/// A picture with the mask that it cuts.
#[derive(Clone)]
pub(super) struct Cut {
    picture: Arc<Picture>,
    mask: Option<Arc<AlphaMask>>,
    margin: Option<Arc<Margin>>,
}

/// One choice of a material.
pub(super) struct Choice {
    pub(super) material: LeafMaterial,
    /// What of a blade is there.
    pub(super) mask: Option<Arc<AlphaMask>>,
    /// How far its places are from where it ends.
    pub(super) margin: Option<Arc<Margin>>,
    /// Whether it has a picture.
    pub(super) pictured: bool,
    tones: OnceLock<Arc<Tones>>,
}

impl Choice {
    /// What its tissue becomes, worked out when the first leaf asks; `pigments` are its own.
    pub(super) fn tones(&self, pigments: &Pigments) -> Arc<Tones> {
        self.tones.get_or_init(|| Arc::new(Tones::new(pigments))).clone()
    }
}

/// A species with its materials ready.
pub(super) struct Species {
    pub(super) desc: SpeciesDesc,
    /// By the material's name.
    pub(super) materials: BTreeMap<String, Vec<Choice>>,
    /// Those of its leaves.
    pub(super) pictures: Vec<pictures::Picture>,
}

/// One is equal to itself alone: its files may have changed.
impl PartialEq for Species {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::eq(self, other)
    }
}

/// What was read so far. Every file's bytes go into the hash in the order of their paths.
#[derive(Clone, Default)]
pub(super) struct Library {
    /// Where files may lie.
    scope: Scope,
    files: BTreeMap<PathBuf, [u8; 32]>,
    /// By file and by the bits of `relief_range`, which scales the height map beside it.
    pictures: BTreeMap<(PathBuf, u32), Cut>,
    species: BTreeMap<PathBuf, Arc<Species>>,
    /// By file, by whether z points up in it, and by whether it may name files outside its folder.
    models: BTreeMap<(PathBuf, bool, bool), Arc<Model>>,
    layers: BTreeMap<(PathBuf, PathBuf), Arc<Layer>>,
    /// The files of soil layers.
    layer_files: BTreeMap<(PathBuf, PathBuf), pictures::Picture>,
    /// What all these pictures take.
    pub(super) counted: Pictures,
    environment_maps: BTreeMap<(PathBuf, Infrared), Arc<Table>>,
    /// What to tell of species files, by file: keywords that were renamed, pictures that look wrong.
    told: BTreeMap<PathBuf, Vec<String>>,
    /// What ships, by the names that stand for it in the scene file.
    shipped: BTreeMap<String, PathBuf>,
    /// How species grow otherwise than their files say.
    pub(super) growing: Growing,
    /// What was read before: used again where the contents of its files are what they were.
    before: Option<Arc<Library>>,
}

impl Library {
    /// One that reads nothing outside a scope, whatever its files name.
    pub(super) fn within(scope: Scope) -> Self {
        Self { scope, ..Self::default() }
    }

    /// One that has read nothing yet, and decodes nothing again whose files hold what they held.
    pub(super) fn renewed(self) -> Self {
        let (scope, growing) = (self.scope.clone(), self.growing);
        let before = Some(Arc::new(Self { before: None, ..self }));
        Self { scope, growing, before, ..Self::default() }
    }

    /// What was made of these files before, if they hold what they held; all that are there have been noted.
    fn kept<T>(&self, files: &[&Path], known: impl FnOnce(&Self) -> Option<T>) -> Option<T> {
        let before = self.before.as_deref()?;
        let same = files.iter().all(|file| before.files.get(*file) == self.files.get(*file));
        if same { known(before) } else { None }
    }

    /// Where a file lies that `page` names; an error about the page where it is not there or may not be read.
    pub(super) fn need(&self, page: &RonFile, path: &str) -> Result<PathBuf> {
        let folder = page.path.parent().unwrap_or(Path::new(""));
        self.scope.resolve(folder, path).map_err(outside(page, path))?;
        page.need_file(path)
    }

    /// The same where `path` may also be the name of something that ships, which `find` looks up among `all`: where no such file lies beside
    /// the page, folders passed over, and the page may name files anywhere.
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

    /// The scene file itself.
    pub(super) fn page(&mut self, path: &Path) -> Result<RonFile> {
        let page = RonFile::read(path)?;
        Ok(self.page_of(path, &page.text))
    }

    /// The scene file with this text.
    pub(super) fn page_of(&mut self, path: &Path, text: &str) -> RonFile {
        self.files.insert(path.into(), Sha256::digest(text.as_bytes()).into());
        RonFile { path: path.into(), text: text.to_owned() }
    }

    /// Everything that was read, in order.
    pub(super) fn files(&self) -> Vec<PathBuf> {
        self.files.keys().cloned().collect()
    }

    /// Names of the scene file that stand for files that ship, and those files.
    pub(super) fn shipped(&self) -> BTreeMap<String, PathBuf> {
        self.shipped.clone()
    }

    /// What to tell of the species files that were read, in the order of their paths.
    pub(super) fn warnings(&self) -> Vec<String> {
        self.told.values().flatten().cloned().collect()
    }

    /// SHA-256 over the contents of everything that was read, in hex: contents, not names, so a moved project keeps it.
    pub(super) fn hash(&self) -> String {
        let mut all = Sha256::new();
        for digest in self.files.values() {
            all.update(digest);
        }
        hex::encode(all.finalize())
    }

    /// The species file that `page` names.
    pub(super) fn species(&mut self, page: &RonFile, path: &str) -> Result<Arc<Species>> {
        let full = self.need_or_shipped(page, path, shipped_species, shipped::species_files)?;
        if let Some(known) = self.species.get(&full) {
            self.counted.again(&known.pictures);
            return Ok(known.clone());
        }
        let file = self.species_file(&full)?;
        let species = self.species_of(&full, &file).map_err(|error| file.locate(error))?;
        self.species.insert(full, species.clone());
        Ok(species)
    }

    /// The species of a file that was read from `full`; an error lies in the file's whole text.
    fn species_of(&mut self, full: &Path, file: &SpeciesFile) -> Result<Arc<Species>> {
        let own = file.page();
        let mut desc: SpeciesDesc = own.parse_all()?;
        self.told.insert(full.into(), file.sources().iter().flat_map(|source| source.renamed(RENAMED)).collect());
        file.check_materials(&desc)?;
        let (mut cuts, mut pictures): (Vec<Vec<Cut>>, Vec<pictures::Picture>) = (Vec::new(), Vec::new());
        for leaf in desc.materials.values() {
            let paths = leaf.texture.as_ref().map_or(&[][..], Pick::all);
            let range = leaf.relief_range.f32();
            let mut all = Vec::new();
            for path in paths {
                let (cut, picture) = self.picture(own, path, range)?;
                pictures.push(picture);
                // Pictures that the program drew are sound.
                if !leaf.calibrated {
                    self.told.entry(full.into()).or_default().extend(unlikely(path, cut.mask.as_deref()));
                }
                all.push(cut);
            }
            cuts.push(all);
        }
        let known = |before: &Self| {
            let held = |cut: &Cut| before.pictures.values().any(|c| Arc::ptr_eq(&c.picture, &cut.picture));
            cuts.iter().flatten().all(held).then(|| before.species.get(full).cloned())?
        };
        let files: Vec<&Path> = file.sources().iter().map(|source| source.path.as_path()).collect();
        if let Some(known) = self.kept(&files, known) {
            return Ok(known);
        }
        let mut materials = BTreeMap::new();
        for ((name, leaf), cuts) in desc.materials.iter().zip(cuts) {
            let mut choices = Vec::new();
            for Cut { picture, mask, margin } in cuts {
                let material = LeafMaterial::new(leaf, Some(picture));
                choices.push(Choice { material, mask, margin, pictured: true, tones: OnceLock::new() });
            }
            if choices.is_empty() {
                let material = LeafMaterial::new(leaf, None);
                choices.push(Choice { material, mask: None, margin: None, pictured: false, tones: OnceLock::new() });
            }
            materials.insert(name.clone(), choices);
        }
        if let Some(change) = self.growing.species {
            change(&mut desc);
        }
        Ok(Arc::new(Species { desc, materials, pictures }))
    }

    /// A leaf's picture, and what it is counted as.
    fn picture(&mut self, page: &RonFile, path: &str, relief_range: f32) -> Result<(Cut, pictures::Picture)> {
        let full = self.need(page, path)?;
        // A height map drawn or measured for the picture lies beside it; without one the relief is read off the colours.
        let beside = self.scope.check(full.with_extension("height.png")).map_err(outside(page, path))?;
        let relief = beside.is_file();
        let counted = (full.clone(), if relief { beside.clone() } else { PathBuf::new() }, relief_range.to_bits());
        self.counted.count(&counted, Header::leaf).map_err(|e| at_its_place(page, path, IMAGE_HELP, e))?;
        let key = (full.clone(), relief_range.to_bits());
        if let Some(known) = self.pictures.get(&key) {
            return Ok((known.clone(), counted));
        }
        self.note(&full)?;
        if relief {
            self.note(&beside)?;
        }
        if let Some(known) = self.kept(&[&full, &beside], |before| before.pictures.get(&key).cloned()) {
            self.pictures.insert(key, known.clone());
            return Ok((known, counted));
        }
        let color = Texture::load(&full, ColorSpace::Srgb).map_err(|e| at_its_place(page, path, IMAGE_HELP, e))?;
        let maps = if relief {
            Maps::from_height(Height::load(&beside, relief_range).map_err(|e| at_its_place(page, path, IMAGE_HELP, e))?)
        } else {
            Maps::derive(&color, &HeightFromBrightness::LEAF)
        };
        let mask = color.alpha_mask().map(Arc::new);
        let margin = mask.as_deref().map(|m| Arc::new(Margin::of(m)));
        let cut = Cut { picture: Arc::new(Picture { color, maps }), mask, margin };
        self.pictures.insert(key, cut.clone());
        Ok((cut, counted))
    }

    /// The model that `page` names, with the files that it needs.
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
        // Of the bytes that it was made of: the files may have been written since.
        self.files.extend(model.files.iter().map(|(file, digest)| (file.clone(), *digest)));
        self.counted.note(counted_model(&key), model.pictures);
        self.models.insert(key, model.clone());
        Ok(model)
    }

    /// What the pictures of a model are counted as that `page` names.
    pub(super) fn model_pictures(&mut self, page: &RonFile, desc: &ModelDesc) -> Result<pictures::Picture> {
        self.model(page, desc)?;
        let full = self.need(page, &desc.file)?;
        Ok(counted_model(&(full, desc.up == Up::Z, desc.allow_outside)))
    }

    /// A model that was read before and whose files hold what they held.
    fn model_before(&self, key: &(PathBuf, bool, bool)) -> Option<Arc<Model>> {
        let before = self.before.as_deref()?;
        let known = before.models.get(key)?;
        let same = |(file, known): (&PathBuf, &[u8; 32])| digest(file).is_ok_and(|digest| digest == *known);
        known.files.iter().all(same).then(|| known.clone())
    }

    /// The file of an environment map that `page` names, whether or not a field draws it.
    pub(super) fn environment_map_file(&mut self, page: &RonFile, path: &str) -> Result<()> {
        let full = self.need(page, path)?;
        if self.files.contains_key(&full) { Ok(()) } else { self.note(&full) }
    }

    /// The environment map that `page` names.
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
            let help = "name an equirectangular .exr or .hdr; `nir` says where near infrared comes from: Channel, Sky or OfRed(0.8)";
            at_its_place(page, path, help, error)
        })?);
        self.environment_maps.insert(key, table.clone());
        Ok(table)
    }

    /// The file of poses that `page` names.
    pub(super) fn poses(&mut self, page: &RonFile, path: &str) -> Result<Vec<(f64, Pose)>> {
        let full = self.need(page, path)?;
        let bytes = input::read(&full, MOST_POSES).map_err(|refusal| refusal.into_error(&full))?;
        self.files.insert(full.clone(), Sha256::digest(&bytes).into());
        poses::read(&bytes).map_err(|e| at_its_place(page, path, "", e.in_file(&full)))
    }

    /// Band means of the soil whose spectrum `page` names.
    pub(super) fn soil_spectrum(&mut self, page: &RonFile, path: &str) -> Result<Spectrum> {
        let full = self.need(page, path)?;
        let bytes = input::read(&full, input::LARGEST).map_err(|refusal| refusal.into_error(&full))?;
        self.files.insert(full.clone(), Sha256::digest(&bytes).into());
        let text = String::from_utf8_lossy(&bytes);
        measured::reflectance(&text).map_err(|e| at_its_place(page, path, "", e.in_file(full)))
    }

    /// The files of a soil layer's textures, counted.
    pub(super) fn layer_pictures(&mut self, page: &RonFile, desc: &LayerDesc) -> Result<pictures::Picture> {
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

    /// A soil layer's textures.
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
        let albedo = Texture::load(&albedo, ColorSpace::Srgb).map_err(|e| wrong(&desc.albedo, e))?;
        let albedo = albedo.wrapped(Wrap::Repeat);
        let height = match height {
            None => read_off(&albedo),
            Some(height) => Height::load(&height, 1.0).map_err(|e| wrong(&desc.height, e))?,
        };
        let layer = Arc::new(Layer::new(albedo, height.wrapped(Wrap::Repeat)));
        self.layers.insert(key, layer.clone());
        Ok(layer)
    }

    fn note(&mut self, path: &Path) -> Result<()> {
        self.files.insert(path.into(), digest(path)?);
        Ok(())
    }
}

/// What the pictures of a model are counted as.
fn counted_model((file, z_up, outside): &(PathBuf, bool, bool)) -> pictures::Picture {
    (file.clone(), PathBuf::new(), u32::from(*z_up) + 2 * u32::from(*outside))
}

/// SHA-256 of a file's contents.
fn digest(path: &Path) -> Result<[u8; 32]> {
    let bytes = input::read(path, input::LARGEST).map_err(|refusal| refusal.into_error(path))?;
    Ok(Sha256::digest(&bytes).into())
}

/// A file that `page` names where none may lie.
fn outside(page: &RonFile, literal: &str) -> impl FnOnce(Outside) -> Error {
    move |outside| page.about(literal, outside.to_string(), outside.help)
}

/// An error about a file that is not there, which names the one of these that was probably meant.
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

/// Heights 0 to 1 read off a soil's brightness, for a photograph without a height map.
fn read_off(albedo: &Texture) -> Height {
    let height = Maps::derive(albedo, &HeightFromBrightness::SOIL).height;
    let (columns, rows) = height.size();
    let unit = |h: &f32| (0.5 + 0.5 * h / HeightFromBrightness::SOIL.amplitude).clamp(0.0, 1.0);
    Height::from_values(columns, rows, height.values().iter().map(unit).collect())
}

/// Share of a blade's picture that must hang together with its foot, the rest being holes and specks.
const WHOLE: f64 = 0.95;

/// What looks wrong with a photograph of a leaf.
fn unlikely(path: &str, mask: Option<&AlphaMask>) -> Option<String> {
    let Some(mask) = mask else {
        return Some(format!(
            "{path} has no transparent pixels, so its whole rectangle is the blade; cut the leaf out"
        ));
    };
    let share = mask.hanging().count() as f64 / mask.count().max(1) as f64;
    (share < WHOLE).then(|| {
        format!(
            "{path}: {:.0} % of its opaque pixels do not hang together with the foot in the middle of its lower edge; \
             one leaf a picture, its base at the bottom",
            100.0 * (1.0 - share)
        )
    })
}

/// What helps where an image cannot be used.
const IMAGE_HELP: &str = "name a PNG or JPEG image, or draw it: trace texture RECIPE.ron";

/// What helps where a model cannot be used and nothing more is known.
const MODEL_HELP: &str = "export it again from the program that made it";

/// A file that cannot be read as an image or a model is the scene file's fault: shown where the scene file names it, with `help` where the error
/// has none of its own.
fn at_its_place(page: &RonFile, literal: &str, help: &str, error: Error) -> Error {
    match error.place() {
        Some(Place { file, span: None }) if error.kind() == Kind::Input => {
            let name = file.file_name().unwrap_or_default().to_string_lossy();
            let message = format!("`{name}` cannot be used: {}", error.message());
            page.about(literal, message, error.advice().unwrap_or(help))
        }
        _ => error,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rationale: two species may share a picture and say different heights of its relief. Expected: heights in the ratio of what
    /// each says. Source: the meaning of `relief_range`.
    #[test]
    fn one_picture_has_the_relief_that_each_material_gives_it() {
        let page = RonFile::of("Species()");
        let mut library = Library::default();
        let mut highest = |range: f32| {
            let (cut, _) = library.picture(&page, "textures/leaf/sugar_beet.png", range).unwrap();
            cut.picture.maps.height.values().iter().fold(0.0_f32, |most, h| most.max(h.abs()))
        };
        let (low, high, again) = (highest(0.01), highest(0.04), highest(0.01));
        assert!(low > 0.0 && (high / low - 4.0).abs() < 0.1, "{low} {high}");
        assert_eq!(low, again);
    }

    /// Rationale: a scene file that is saved again and again must not decode its textures each time, and must never show an old one.
    /// Expected: the very same picture where the file's contents are what they were, another one where they are not; the same hash
    /// as a library that has read nothing before.
    #[test]
    fn what_did_not_change_is_not_decoded_again() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("leaf.png");
        let copy = |name: &str| std::fs::copy(format!("textures/leaf/{name}.png"), &path).unwrap();
        copy("sugar_beet");
        let page = RonFile { path: folder.path().join("page.ron"), text: "Species()".to_owned() };
        let read = |library: &mut Library| library.picture(&page, "leaf.png", 0.02).unwrap().0.picture;
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

    #[test]
    fn a_soil_photograph_without_a_height_map_gets_one() {
        let texel =
            |i: u32| if (i / 8 + i / 64 / 8).is_multiple_of(2) { [150, 120, 90, 255] } else { [90, 70, 50, 255] };
        let pixels: Vec<u8> = (0..64 * 64).flat_map(texel).collect();
        let height = read_off(&Texture::from_rgba8(64, 64, &pixels, ColorSpace::Srgb).wrapped(Wrap::Repeat));
        assert!(height.values().iter().all(|h| (0.0..=1.0).contains(h)));
        let (low, high) = height.values().iter().fold((1.0_f32, 0.0_f32), |(l, h), v| (l.min(*v), h.max(*v)));
        assert!(low < 0.35 && high > 0.65, "{low} to {high}: bright should stand up, dark lie low");
    }
}
