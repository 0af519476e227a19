//! A species with its materials, and the leaf images that these are made of.
//!
//! A scene file may name many more species than a field grows. Naming one reads its images only for their hashes; they
//! are decoded when the first field grows it, and kept for later fields.

use super::desc::SpeciesDesc;
use super::image_memory::ImageKey;
use super::named_file::{IMAGE_HELP, at_its_place, digest};
use super::species_text::SpeciesFile;
use furrow_base::geometry::{AlphaMask, Margin};
use furrow_base::math::ToFloat;
use furrow_base::{Error, Result};
use furrow_optics::optics::Pigments;
use furrow_optics::texture::{ColorSpace, Height, HeightFromBrightness, Maps, Texture};
use furrow_render::material::{LeafDesc, LeafMaterial, LeafTexture, Tones};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

/// A file and the SHA-256 of the contents that it had when it was named.
type HashedFile = (PathBuf, [u8; 32]);

/// A leaf image, decoded on first use.
pub(super) struct LeafImage {
    color: HashedFile,
    /// Height map beside the image; without one the relief is derived from brightness.
    height: Option<HashedFile>,
    /// Height of white in the height map, in the unit of `relief_range`.
    relief_range: f32,
    decoded: OnceLock<MaskedImage>,
}

/// A decoded leaf image with its opacity mask.
#[derive(Clone)]
pub(super) struct MaskedImage {
    pub(super) picture: Arc<LeafTexture>,
    pub(super) mask: Option<Arc<AlphaMask>>,
    margin: Option<Arc<Margin>>,
}

impl LeafImage {
    /// Creates an image from the hashed files of colour and height.
    pub(super) fn new(color: HashedFile, height: Option<HashedFile>, relief_range: f32) -> Self {
        Self { color, height, relief_range, decoded: OnceLock::new() }
    }

    /// Returns the decoded image. Errors are about the files, which must be unchanged since they were hashed.
    pub(super) fn decoded(&self) -> Result<&MaskedImage> {
        if let Some(known) = self.decoded.get() {
            return Ok(known);
        }
        let image = self.decode()?;
        Ok(self.decoded.get_or_init(|| image))
    }

    fn decode(&self) -> Result<MaskedImage> {
        std::iter::once(&self.color).chain(&self.height).try_for_each(unchanged)?;
        let color = || Texture::load(&self.color.0, ColorSpace::Srgb);
        let (color, maps) = if let Some((height, _)) = &self.height {
            let maps = || Height::load(height, self.relief_range).map(Maps::from_height);
            let (color, maps) = rayon::join(color, maps);
            (color?, maps?)
        } else {
            let color = color()?;
            let maps = Maps::derive(&color, &HeightFromBrightness::LEAF);
            (color, maps)
        };
        let mask = color.alpha_mask().map(Arc::new);
        let margin = mask.as_deref().map(|m| Arc::new(Margin::of(m)));
        Ok(MaskedImage { picture: Arc::new(LeafTexture { color, maps }), mask, margin })
    }
}

/// Returns an error if the contents of a file differ from those that were hashed: the scene's hash would not be theirs.
fn unchanged((file, hashed): &HashedFile) -> Result<()> {
    if digest(file)? == *hashed {
        return Ok(());
    }
    Err(Error::input("this image has changed since the scene file was opened").help("start again").in_file(file))
}

/// One variant of a material: the leaf image that a plant's organ may get, or none.
pub(super) struct Choice {
    pub(super) material: LeafMaterial,
    /// Opacity mask of the blade; `None` if the image is fully opaque or there is none.
    pub(super) mask: Option<Arc<AlphaMask>>,
    /// Distance of each point of the blade from the edge of the mask.
    pub(super) margin: Option<Arc<Margin>>,
    /// Whether the variant has an image.
    pub(super) pictured: bool,
    tones: OnceLock<Arc<Tones>>,
}

impl Choice {
    fn new(desc: &LeafDesc, image: Option<&MaskedImage>) -> Self {
        Self {
            material: LeafMaterial::new(desc, image.map(|image| image.picture.clone())),
            mask: image.and_then(|image| image.mask.clone()),
            margin: image.and_then(|image| image.margin.clone()),
            pictured: image.is_some(),
            tones: OnceLock::new(),
        }
    }

    /// Returns the optics of yellowed and dead tissue, computed on first use. `pigments` must be those of this material.
    pub(super) fn tones(&self, pigments: &Pigments) -> Arc<Tones> {
        self.tones.get_or_init(|| Arc::new(Tones::new(pigments))).clone()
    }
}

/// A material of a species file, and its images with the paths by which the file names them.
pub(super) struct NamedMaterial {
    pub(super) name: String,
    pub(super) desc: LeafDesc,
    pub(super) images: Vec<(String, Arc<LeafImage>)>,
}

impl NamedMaterial {
    /// Creates one variant for each image, or a single one without an image. Errors point into the species file.
    fn choices(&self, file: &SpeciesFile) -> Result<Vec<Choice>> {
        if self.images.is_empty() {
            return Ok(vec![Choice::new(&self.desc, None)]);
        }
        let choice = |(path, image): &(String, Arc<LeafImage>)| {
            let image =
                image.decoded().map_err(|error| file.locate(at_its_place(file.page(), path, IMAGE_HELP, error)))?;
            Ok(Choice::new(&self.desc, Some(image)))
        };
        self.images.par_iter().map(choice).collect()
    }
}

/// Variants of each material, by the material's name.
pub(super) type Materials = BTreeMap<String, Vec<Choice>>;

/// A species. Its materials are created when a field first grows it.
pub(super) struct Species {
    pub(super) desc: SpeciesDesc,
    /// Images of its leaves, as counted by [`ImageMemory`](super::image_memory::ImageMemory).
    pub(super) pictures: Vec<ImageKey>,
    file: Arc<SpeciesFile>,
    named: Vec<NamedMaterial>,
    materials: OnceLock<Materials>,
}

/// Compares by address: two species read from the same path may differ, because the file may have changed in between.
impl PartialEq for Species {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::eq(self, other)
    }
}

impl Species {
    /// Creates a species from its file. `desc` may differ from the file, which the materials keep to.
    pub(super) fn new(
        desc: SpeciesDesc,
        file: &Arc<SpeciesFile>,
        named: Vec<NamedMaterial>,
        pictures: Vec<ImageKey>,
    ) -> Self {
        Self { desc, pictures, file: file.clone(), named, materials: OnceLock::new() }
    }

    /// Decodes the images and creates the materials, unless an earlier field did.
    pub(super) fn open(&self) -> Result<()> {
        if self.materials.get().is_none() {
            let made = |named: &NamedMaterial| Ok((named.name.clone(), named.choices(&self.file)?));
            let all = self.named.par_iter().map(made).collect::<Result<Materials>>()?;
            // A field that is built at the same time may have been first; its materials are equal.
            let _ = self.materials.set(all);
        }
        Ok(())
    }

    /// Returns the materials; an error if the species was not [opened](Self::open).
    pub(super) fn materials(&self) -> Result<&Materials> {
        self.materials.get().ok_or_else(|| Error::failed(format!("the images of {} were not decoded", self.desc.name)))
    }

    /// Returns whether the materials exist.
    #[cfg(test)]
    pub(super) fn is_open(&self) -> bool {
        self.materials.get().is_some()
    }
}

/// Minimum share of a blade image's opaque pixels that must be connected to the leaf base; the rest are specks.
const WHOLE: f64 = 0.95;

/// Returns a warning if a leaf image has no transparent pixels, or if too few opaque pixels are connected to the leaf base.
pub(super) fn unlikely(path: &str, mask: Option<&AlphaMask>) -> Option<String> {
    let Some(mask) = mask else {
        return Some(format!(
            "{path} has no transparent pixels, so the blade is the whole rectangle; cut the leaf out"
        ));
    };
    let share = mask.hanging().count().to_f64() / mask.count().max(1).to_f64();
    (share < WHOLE).then(|| {
        format!(
            "{path}: {:.0} % of its opaque pixels are not connected to the leaf base in the middle of the lower edge; \
             use one leaf per image, with its base at the bottom",
            100.0 * (1.0 - share)
        )
    })
}
