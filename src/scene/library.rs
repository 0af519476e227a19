//! Everything that scene files name, read once: species, pictures, soil layers.

use super::desc::{ModelDesc, SpeciesDesc};
use super::growing::Growing;
use crate::error::{Kind, Place};
use crate::geometry::{AlphaMask, Margin};
use crate::input::{self, Outside, Scope};
use crate::light::{Infrared, Table};
use crate::material::{LeafMaterial, Picture, Tones};
use crate::math::{Spectrum, Vec2};
use crate::model::{Model, Up};
use crate::optics::{Pigments, soil};
use crate::ron_file::{RENAMED, RonFile, Step, choose};
use crate::soil::{LayerDesc, LayerMaps};
use crate::texture::{ColorSpace, Height, HeightFromBrightness, Maps, Texture, Wrap};
use crate::{Error, Result};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

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
    environment_maps: BTreeMap<(PathBuf, Infrared), Arc<Table>>,
    /// Keywords of species files that were renamed, by file.
    renamed: BTreeMap<PathBuf, Vec<String>>,
    /// How species grow otherwise than their files say.
    pub(super) growing: Growing,
}

impl Library {
    /// One that reads nothing outside a scope, whatever its files name.
    pub(super) fn within(scope: Scope) -> Self {
        Self { scope, ..Self::default() }
    }

    /// Where a file lies that `page` names; an error about the page where it is not there or may not be read.
    fn need(&self, page: &RonFile, path: &str) -> Result<PathBuf> {
        let folder = page.path.parent().unwrap_or(Path::new(""));
        self.scope.resolve(folder, path).map_err(outside(page, path))?;
        page.need_file(path)
    }

    /// The scene file itself.
    pub(super) fn page(&mut self, path: &Path) -> Result<RonFile> {
        let page = RonFile::read(path)?;
        self.files.insert(path.into(), Sha256::digest(page.text.as_bytes()).into());
        Ok(page)
    }

    /// Everything that was read, in order.
    pub(super) fn files(&self) -> Vec<PathBuf> {
        self.files.keys().cloned().collect()
    }

    /// What to tell of the species files that were read, in the order of their paths.
    pub(super) fn warnings(&self) -> Vec<String> {
        self.renamed.values().flatten().cloned().collect()
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
        let full = self.need(page, path)?;
        if let Some(known) = self.species.get(&full) {
            return Ok(known.clone());
        }
        let own = self.page(&full)?;
        let mut desc: SpeciesDesc = own.parse()?;
        self.renamed.insert(full.clone(), own.renamed(RENAMED));
        for key in desc.plant.materials() {
            if !desc.materials.contains_key(&key) {
                let known: Vec<&str> = desc.materials.keys().map(String::as_str).collect();
                let message = format!("the plant uses a material \"{key}\", which `materials` does not have");
                let help = format!(
                    "add \"{key}\": Leaf(…) to `materials`, or name one of them; {}",
                    choose("materials", &known, &key)
                );
                // Where the key is written, or else the table that lacks it: some keys are defaults.
                return Err(if own.text.contains(&format!("\"{key}\"")) {
                    own.about(&key, message, help)
                } else {
                    own.blame(&[Step::Field("materials")], Error::input(message).help(help)).lasting()
                });
            }
        }
        let mut materials = BTreeMap::new();
        for (name, leaf) in &desc.materials {
            let choices = match &leaf.texture {
                None => {
                    let material = LeafMaterial::new(leaf, None);
                    vec![Choice { material, mask: None, margin: None, pictured: false, tones: OnceLock::new() }]
                }
                Some(of) => {
                    let mut choices = Vec::new();
                    for path in of.all() {
                        let Cut { picture, mask, margin } = self.picture(&own, path, leaf.relief_range.f32())?;
                        let material = LeafMaterial::new(leaf, Some(picture));
                        choices.push(Choice { material, mask, margin, pictured: true, tones: OnceLock::new() });
                    }
                    choices
                }
            };
            materials.insert(name.clone(), choices);
        }
        if let Some(change) = self.growing.species {
            change(&mut desc);
        }
        let species = Arc::new(Species { desc, materials });
        self.species.insert(full, species.clone());
        Ok(species)
    }

    fn picture(&mut self, page: &RonFile, path: &str, relief_range: f32) -> Result<Cut> {
        let full = self.need(page, path)?;
        let key = (full.clone(), relief_range.to_bits());
        if let Some(known) = self.pictures.get(&key) {
            return Ok(known.clone());
        }
        self.note(&full)?;
        let color = Texture::load(&full, ColorSpace::Srgb).map_err(|e| at_its_place(page, path, IMAGE_HELP, e))?;
        // A height map drawn or measured for the picture lies beside it; without one the relief is read off the colours.
        let beside = self.scope.check(full.with_extension("height.png")).map_err(outside(page, path))?;
        let maps = if beside.is_file() {
            self.note(&beside)?;
            Maps::from_height(Height::load(&beside, relief_range).map_err(|e| at_its_place(page, path, IMAGE_HELP, e))?)
        } else {
            Maps::derive(&color, &HeightFromBrightness::LEAF)
        };
        let mask = color.alpha_mask().map(Arc::new);
        let margin = mask.as_deref().map(|m| Arc::new(Margin::of(m)));
        let cut = Cut { picture: Arc::new(Picture { color, maps }), mask, margin };
        self.pictures.insert(key, cut.clone());
        Ok(cut)
    }

    /// The model that `page` names, with the files that it needs.
    pub(super) fn model(&mut self, page: &RonFile, desc: &ModelDesc) -> Result<Arc<Model>> {
        let path = desc.file.as_str();
        let full = self.need(page, path)?;
        let key = (full.clone(), desc.up == Up::Z, desc.allow_outside);
        if let Some(known) = self.models.get(&key) {
            return Ok(known.clone());
        }
        let lifted = desc.allow_outside.then_some(&self.scope);
        let model = Model::load_within(&full, desc.up, lifted).map_err(|e| at_its_place(page, path, MODEL_HELP, e))?;
        let model = Arc::new(model);
        for file in &model.files {
            self.note(file)?;
        }
        self.models.insert(key, model.clone());
        Ok(model)
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
        let table = Arc::new(Table::load(&full, infrared).map_err(|error| {
            let help = "name an equirectangular .exr or .hdr; `nir` says where near infrared comes from: Channel, Sky or OfRed(0.8)";
            at_its_place(page, path, help, error)
        })?);
        self.environment_maps.insert(key, table.clone());
        Ok(table)
    }

    /// A soil layer's textures.
    pub(super) fn layer(&mut self, page: &RonFile, desc: &LayerDesc) -> Result<Arc<Layer>> {
        let key = (desc.albedo.clone(), desc.height.clone());
        if let Some(known) = self.layers.get(&key) {
            return Ok(known.clone());
        }
        let mut need = |path: &Path| -> Result<(PathBuf, String)> {
            let text = path.to_string_lossy().into_owned();
            let full = self.need(page, &text)?;
            self.note(&full)?;
            Ok((full, text))
        };
        let (albedo, albedo_text) = need(&desc.albedo)?;
        let albedo =
            Texture::load(&albedo, ColorSpace::Srgb).map_err(|e| at_its_place(page, &albedo_text, IMAGE_HELP, e))?;
        let albedo = albedo.wrapped(Wrap::Repeat);
        let height = if desc.height.as_os_str().is_empty() {
            read_off(&albedo)
        } else {
            let (height, text) = need(&desc.height)?;
            Height::load(&height, 1.0).map_err(|e| at_its_place(page, &text, IMAGE_HELP, e))?
        };
        let layer = Arc::new(Layer { albedo, height: height.wrapped(Wrap::Repeat) });
        self.layers.insert(key, layer.clone());
        Ok(layer)
    }

    fn note(&mut self, path: &Path) -> Result<()> {
        let bytes = input::read(path, input::LARGEST).map_err(|refusal| refusal.into_error(path))?;
        self.files.insert(path.into(), Sha256::digest(&bytes).into());
        Ok(())
    }
}

/// A file that `page` names where none may lie.
fn outside(page: &RonFile, literal: &str) -> impl FnOnce(Outside) -> Error {
    move |outside| page.about(literal, outside.to_string(), outside.help)
}

/// Heights 0 to 1 read off a soil's brightness, for a photograph without a height map.
fn read_off(albedo: &Texture) -> Height {
    let height = Maps::derive(albedo, &HeightFromBrightness::SOIL).height;
    let (columns, rows) = height.size();
    let unit = |h: &f32| (0.5 + 0.5 * h / HeightFromBrightness::SOIL.amplitude).clamp(0.0, 1.0);
    Height::from_values(columns, rows, height.values().iter().map(unit).collect())
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

/// The textures of one soil layer.
pub(super) struct Layer {
    albedo: Texture,
    height: Height,
}

impl Layer {
    /// Mean colour of the dry soil, in four bands.
    pub(super) fn mean(&self) -> Spectrum {
        let [r, g, b, _] = self.albedo.sample(Vec2::splat(0.5), 32.0);
        soil::at([r, g, b], soil::LOESS)
    }
}

impl LayerMaps for Layer {
    fn height(&self, uv: Vec2) -> f32 {
        self.height.at(uv)
    }

    fn albedo(&self, uv: Vec2) -> [f32; 3] {
        let [r, g, b, _] = self.albedo.sample(uv, 0.0);
        [r, g, b]
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
            let cut = library.picture(&page, "textures/leaf/sugar_beet.png", range).unwrap();
            cut.picture.maps.height.values().iter().fold(0.0_f32, |most, h| most.max(h.abs()))
        };
        let (low, high, again) = (highest(0.01), highest(0.04), highest(0.01));
        assert!(low > 0.0 && (high / low - 4.0).abs() < 0.1, "{low} {high}");
        assert_eq!(low, again);
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
