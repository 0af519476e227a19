//! Everything that pages name, read once: species, pictures, soil layers.

use super::desc::SpeciesDesc;
use crate::geometry::AlphaMask;
use crate::material::{LeafMaterial, Picture};
use crate::math::Vec2;
use crate::page::Page;
use crate::sampling::fault::choose;
use crate::sampling::place::Step;
use crate::soil::{LayerDesc, LayerMaps};
use crate::texture::{ColorSpace, Height, Maps, Relief, Texture, Wrap};
use crate::{Error, Result};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A picture with the mask that it cuts.
pub(super) type Cut = (Arc<Picture>, Option<Arc<AlphaMask>>);

/// A skin's choices, each with its mask.
pub(super) type Choices = Vec<(LeafMaterial, Option<Arc<AlphaMask>>)>;

/// A species with its materials ready.
pub(super) struct Species {
    pub(super) desc: SpeciesDesc,
    /// By the skin's name.
    pub(super) skins: BTreeMap<String, Choices>,
}

/// What was read so far. Every file's bytes go into the hash in the order of their paths.
#[derive(Default)]
pub(super) struct Library {
    files: BTreeMap<PathBuf, [u8; 32]>,
    pictures: BTreeMap<PathBuf, Cut>,
    species: BTreeMap<PathBuf, Arc<Species>>,
}

impl Library {
    /// The page itself.
    pub(super) fn page(&mut self, path: &Path) -> Result<Page> {
        let page = Page::read(path)?;
        self.files.insert(path.into(), Sha256::digest(page.text.as_bytes()).into());
        Ok(page)
    }

    /// SHA-256 over the contents of everything that was read, in hex: contents, not names, so a moved project keeps it.
    pub(super) fn hash(&self) -> String {
        let mut all = Sha256::new();
        for digest in self.files.values() {
            all.update(digest);
        }
        let mut hex = String::new();
        for byte in all.finalize() {
            let _ = write!(hex, "{byte:02x}");
        }
        hex
    }

    /// The species page that `page` names.
    pub(super) fn species(&mut self, page: &Page, path: &str) -> Result<Arc<Species>> {
        let full = page.need_file(path)?;
        if let Some(known) = self.species.get(&full) {
            return Ok(known.clone());
        }
        let own = self.page(&full)?;
        let desc: SpeciesDesc = own.parse()?;
        for key in desc.plant.skins() {
            if !desc.skins.contains_key(&key) {
                let known: Vec<&str> = desc.skins.keys().map(String::as_str).collect();
                let message = format!("the plant uses a skin \"{key}\", which `skins` does not have");
                let help = format!(
                    "add \"{key}\": Leaf(…) to `skins`, or name one of them; {}",
                    choose("skins", &known, &key)
                );
                // Where the key is written, or else the table that lacks it: some keys are defaults.
                return Err(if own.text.contains(&format!("\"{key}\"")) {
                    own.about(&key, message, help)
                } else {
                    own.blame(&[Step::Field("skins")], Error::Scene(format!("{message}\n help: {help}")))
                });
            }
        }
        let mut skins = BTreeMap::new();
        for (name, skin) in &desc.skins {
            let choices = match &skin.texture {
                None => vec![(LeafMaterial::new(skin, None), None)],
                Some(of) => {
                    let mut choices = Vec::new();
                    for path in of.all() {
                        let (picture, mask) = self.picture(&own, path, skin.relief_range.f32())?;
                        choices.push((LeafMaterial::new(skin, Some(picture)), mask));
                    }
                    choices
                }
            };
            skins.insert(name.clone(), choices);
        }
        let species = Arc::new(Species { desc, skins });
        self.species.insert(full, species.clone());
        Ok(species)
    }

    fn picture(&mut self, page: &Page, path: &str, relief_range: f32) -> Result<Cut> {
        let full = page.need_file(path)?;
        if let Some(known) = self.pictures.get(&full) {
            return Ok(known.clone());
        }
        self.note(&full)?;
        let color = Texture::load(&full, ColorSpace::Srgb).map_err(|e| at_its_place(page, path, e))?;
        // A height map drawn or measured for the picture lies beside it; without one the relief is read off the colours.
        let beside = full.with_extension("height.png");
        let maps = if beside.is_file() {
            self.note(&beside)?;
            Maps::from_height(Height::load(&beside, relief_range).map_err(|e| at_its_place(page, path, e))?)
        } else {
            Maps::derive(&color, &Relief::LEAF)
        };
        let mask = color.alpha_mask().map(Arc::new);
        let cut = (Arc::new(Picture { color, maps }), mask);
        self.pictures.insert(full, cut.clone());
        Ok(cut)
    }

    /// A soil layer's textures.
    pub(super) fn layer(&mut self, page: &Page, desc: &LayerDesc) -> Result<Layer> {
        let mut need = |path: &Path| -> Result<(PathBuf, String)> {
            let text = path.to_string_lossy().into_owned();
            let full = page.need_file(&text)?;
            self.note(&full)?;
            Ok((full, text))
        };
        let (albedo, albedo_text) = need(&desc.albedo)?;
        let (height, height_text) = need(&desc.height)?;
        let albedo = Texture::load(&albedo, ColorSpace::Srgb).map_err(|e| at_its_place(page, &albedo_text, e))?;
        let height = Height::load(&height, 1.0).map_err(|e| at_its_place(page, &height_text, e))?;
        Ok(Layer { albedo: albedo.wrapped(Wrap::Repeat), height: height.wrapped(Wrap::Repeat) })
    }

    fn note(&mut self, path: &Path) -> Result<()> {
        let bytes = std::fs::read(path).map_err(Error::io(path))?;
        self.files.insert(path.into(), Sha256::digest(&bytes).into());
        Ok(())
    }
}

/// A file that cannot be read as an image is the page's fault: shown where the page names it.
fn at_its_place(page: &Page, literal: &str, error: Error) -> Error {
    match error {
        Error::Image { path, what } => {
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            page.about(
                literal,
                format!("`{name}` cannot be used: {what}"),
                "name a PNG or JPEG image, or draw it: trace texture RECIPE.ron",
            )
        }
        other => other,
    }
}

/// The textures of one soil layer.
pub(super) struct Layer {
    albedo: Texture,
    height: Height,
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
