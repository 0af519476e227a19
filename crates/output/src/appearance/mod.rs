//! Appearance of a scene's parts as images and factors, for formats that have both (glTF, USD).
//!
//! Each image is computed and encoded once, on all threads, however many parts share it. Leaves share the images of
//! their species if that is similar enough (`image_choice`).

mod image_choice;
mod images;
mod variants;

use furrow_base::Result;
use furrow_base::geometry::AlphaMask;
use furrow_base::math::{ToInt, Vec3};
use furrow_render::material::swatch::{Dye, Swatch, Tone};
use furrow_render::scene::{Part, Scene};
use image_choice::ImageChoice;
pub(crate) use images::Factors;
use images::{Colors, SharedColors};
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use variants::Sketch;

/// Identity of an image of colours. For a plain material, which has none, the number of the surface.
type ColorKey = [usize; 2];
/// Identity of an image of reflected colours: the colours, and the mask's address. All plain materials with one mask
/// share a white image.
type ReflectedKey = (ColorKey, usize);
/// Identity of a normal map: the relief, and the strength in it.
type ReliefKey = (usize, u32);

/// Appearance of all parts, as images and factors.
#[derive(Default)]
pub(crate) struct Appearance {
    /// Images: first those of reflected colours, then of transmitted ones, then normal maps.
    pub(crate) images: Vec<EncodedImage>,
    /// Surfaces by the numbers that [`Surfaces::add`] returned.
    pub(crate) surfaces: Vec<Surface>,
}

/// Image as a PNG file.
pub(crate) struct EncodedImage {
    pub(crate) bytes: Vec<u8>,
    /// `reflected`, `transmitted` or `relief`.
    pub(crate) content: &'static str,
    /// `true` if its opacity is a mask, which is read without filtering, as in this renderer.
    pub(crate) masked: bool,
}

/// Surface of parts with the same material, tint and mask.
pub(crate) struct Surface {
    pub(crate) factors: Factors,
    pub(crate) images: SurfaceImages,
    /// GGX roughness α.
    pub(crate) roughness: f32,
    /// Factor on the slopes of the normal map; 1 if they include it.
    pub(crate) relief: f32,
    /// Mean reflectance and transmittance.
    pub(crate) mean: Tone,
    /// `true` if the alpha channel of the reflected image is a mask.
    pub(crate) masked: bool,
}

/// Indices of a surface's images.
#[derive(Clone, Copy)]
pub(crate) struct SurfaceImages {
    pub(crate) reflected: Option<usize>,
    pub(crate) transmitted: Option<usize>,
    pub(crate) relief: Option<usize>,
}

/// Whether normal maps include the strength of their relief.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Strength {
    /// They do: surfaces of different strengths have different images.
    InImages,
    /// It is a factor of the surface.
    OfSurfaces,
}

/// Surfaces used by the parts, in order of first use.
pub(crate) struct Surfaces<'a> {
    scene: &'a Scene,
    strength: Strength,
    /// Material, tint and mask of each surface.
    used: Vec<MaterialVariant<'a>>,
    known: BTreeMap<(u32, [u32; 3], usize), usize>,
}

/// Material with a tint and a mask.
type MaterialVariant<'a> = (u32, Vec3, Option<&'a Arc<AlphaMask>>);

fn address(mask: Option<&Arc<AlphaMask>>) -> usize {
    mask.map_or(0, |m| Arc::as_ptr(m).addr())
}

impl<'a> Surfaces<'a> {
    pub(crate) fn new(scene: &'a Scene, strength: Strength) -> Self {
        Self { scene, strength, used: Vec::new(), known: BTreeMap::new() }
    }

    /// Returns the number of a part's surface.
    pub(crate) fn add(&mut self, part: &'a Part) -> usize {
        let (used, tint, mask) = (&mut self.used, part.tint(), part.mask.as_ref());
        let key = (part.material, tint.to_array().map(f32::to_bits), address(mask));
        *self.known.entry(key).or_insert_with(|| {
            used.push((part.material, tint, mask));
            used.len() - 1
        })
    }

    /// Computes the images and factors of all surfaces.
    pub(crate) fn draw(&self) -> Result<Appearance> {
        let choices = self.choices();
        let shared = self.shared(&choices);
        let mut images = Vec::new();
        let indices = self.draw_images(&choices, &shared, &mut images)?;
        let surface = |(i, (material, tint, mask)): (usize, &MaterialVariant<'a>)| {
            let (choice, dye) = (&choices[material], self.dye(&choices, *material, *tint));
            let key = color_key(&choice.swatch, i);
            let relief = indices.relief.get(&self.relief_key(choice)).copied();
            Surface {
                factors: shared[&key].factors(dye),
                images: SurfaceImages {
                    reflected: indices.reflected.get(&reflected_key(&choice.swatch, *mask)).copied(),
                    transmitted: indices.transmitted.get(&key).copied(),
                    relief: relief.filter(|_| choice.swatch.relief > 0.0),
                },
                roughness: choice.swatch.roughness,
                relief: if self.strength == Strength::InImages { 1.0 } else { choice.swatch.relief },
                mean: dye.mean,
                masked: mask.is_some(),
            }
        };
        let surfaces = self.used.iter().enumerate().map(surface).collect();
        Ok(Appearance { images, surfaces })
    }

    /// Returns the images of all materials in use.
    fn choices(&self) -> BTreeMap<u32, ImageChoice<'a>> {
        let mut masks: BTreeMap<u32, Option<&'a Arc<AlphaMask>>> = BTreeMap::new();
        let mut users: BTreeMap<usize, BTreeSet<u32>> = BTreeMap::new();
        for (material, _, mask) in &self.used {
            masks.entry(*material).or_insert(*mask);
            users.entry(address(*mask)).or_default().insert(*material);
        }
        let choice = |(material, mask): (u32, Option<&'a Arc<AlphaMask>>)| {
            let of = &self.scene.materials[material.to_usize()];
            // Opacity and colour are one image, so a leaf with a mask of its own has no image to share.
            let choice = if users[&address(mask)].len() > 1 {
                ImageChoice::of(of, mask.map(|m| &**m))
            } else {
                ImageChoice::own(of)
            };
            (material, choice)
        };
        let choices: BTreeMap<u32, ImageChoice<'a>> = masks.par_iter().map(|(k, mask)| choice((*k, *mask))).collect();
        self.with_variants(choices, &masks)
    }

    /// Limits the number of leaves of each species that have colours of their own.
    fn with_variants(
        &self,
        choices: BTreeMap<u32, ImageChoice<'a>>,
        masks: &BTreeMap<u32, Option<&'a Arc<AlphaMask>>>,
    ) -> BTreeMap<u32, ImageChoice<'a>> {
        let mut species: BTreeMap<usize, Vec<u32>> = BTreeMap::new();
        for (material, choice) in choices.iter().filter(|(_, choice)| choice.differs_from_species()) {
            species.entry(choice.relief().relief_key).or_default().push(*material);
        }
        let sketch = |material: u32| Sketch::of(&choices[&material].swatch, masks[&material].map(|mask| &**mask));
        // Material of the leaf whose colours each later leaf has, and factors on them.
        let mut shared: BTreeMap<u32, (u32, [Vec3; 2])> = BTreeMap::new();
        for leaves in species.into_values() {
            let (first, later) = leaves.split_at(leaves.len().min(variants::MOST));
            let sketches: Vec<Sketch> = first.par_iter().map(|material| sketch(*material)).collect();
            let found = later.par_iter().filter_map(|material| {
                let (k, factors) = variants::nearest(&sketch(*material), sketches.iter())?;
                Some((*material, (first[k], factors)))
            });
            shared.par_extend(found);
        }
        let chosen = choices.into_iter().map(|(material, choice)| match shared.get(&material) {
            Some((other, factors)) => {
                let other = self.scene.materials[other.to_usize()].swatch();
                (material, choice.with_colors_of(other, *factors))
            }
            None => (material, choice),
        });
        chosen.collect()
    }

    fn dye(&self, choices: &BTreeMap<u32, ImageChoice<'a>>, material: u32, tint: Vec3) -> Dye {
        choices[&material].swatch.dyed(self.scene.materials[material.to_usize()].tint_factors(tint))
    }

    fn relief_key(&self, choice: &ImageChoice<'_>) -> ReliefKey {
        (choice.relief().relief_key, self.strength_in_image(choice).to_bits())
    }

    /// Returns the factor on the slopes in a normal map.
    fn strength_in_image(&self, choice: &ImageChoice<'_>) -> f32 {
        if self.strength == Strength::InImages { choice.swatch.relief } else { 1.0 }
    }

    /// Collects the images of colours with the tints of all their users.
    fn shared<'b>(&self, choices: &'b BTreeMap<u32, ImageChoice<'a>>) -> BTreeMap<ColorKey, SharedColors<'b>> {
        let mut shared: BTreeMap<ColorKey, SharedColors<'b>> = BTreeMap::new();
        for (i, (material, tint, _)) in self.used.iter().enumerate() {
            let (choice, dye) = (&choices[material], self.dye(choices, *material, *tint));
            let key = color_key(&choice.swatch, i);
            shared.entry(key).or_insert_with(|| SharedColors::new(&choice.swatch)).add_user(dye);
        }
        shared
    }

    /// Computes all images and appends them in the order of the surfaces, not of addresses, which differ from run to
    /// run.
    fn draw_images<'b>(
        &self,
        choices: &'b BTreeMap<u32, ImageChoice<'a>>,
        shared: &BTreeMap<ColorKey, SharedColors<'b>>,
        into: &mut Vec<EncodedImage>,
    ) -> Result<ImageIndices> {
        let mut colors: Ordered<ColorKey, &SharedColors<'b>> = Ordered::default();
        let mut reflected: Ordered<ReflectedKey, (ColorKey, Option<&AlphaMask>)> = Ordered::default();
        let mut reliefs: Ordered<ReliefKey, (&Swatch<'a>, f32)> = Ordered::default();
        for (i, (material, _, mask)) in self.used.iter().enumerate() {
            let choice = &choices[material];
            let key = color_key(&choice.swatch, i);
            colors.add(key, || &shared[&key]);
            reflected.add(reflected_key(&choice.swatch, *mask), || (key, mask.map(|m| &**m)));
            if choice.swatch.relief > 0.0 {
                reliefs.add(self.relief_key(choice), || (choice.relief(), self.strength_in_image(choice)));
            }
        }
        let drawn: Vec<Option<Colors>> = colors.items.par_iter().map(|(_, of)| of.draw()).collect::<Result<_>>()?;
        let encode = |(_, (key, mask)): &(ReflectedKey, (ColorKey, Option<&AlphaMask>))| {
            images::reflected(drawn[colors.places[key]].as_ref(), *mask)
        };
        let encoded: Vec<Option<Vec<u8>>> = reflected.items.par_iter().map(encode).collect::<Result<_>>()?;
        let relief = |(_, (swatch, strength)): &(ReliefKey, (&Swatch<'a>, f32))| images::relief(swatch, *strength);
        let normals: Vec<Option<Vec<u8>>> = reliefs.items.par_iter().map(relief).collect::<Result<_>>()?;
        let mut indices = ImageIndices::default();
        let mut add = |bytes: Vec<u8>, content: &'static str, masked: bool| {
            into.push(EncodedImage { bytes, content, masked });
            into.len() - 1
        };
        for ((key, (_, mask)), bytes) in reflected.items.into_iter().zip(encoded) {
            indices.reflected.extend(bytes.map(|bytes| (key, add(bytes, "reflected", mask.is_some()))));
        }
        for ((key, _), of) in colors.items.into_iter().zip(drawn) {
            let bytes = of.and_then(|of| of.transmitted);
            indices.transmitted.extend(bytes.map(|bytes| (key, add(bytes, "transmitted", false))));
        }
        for ((key, _), bytes) in reliefs.items.into_iter().zip(normals) {
            indices.relief.extend(bytes.map(|bytes| (key, add(bytes, "relief", false))));
        }
        Ok(indices)
    }
}

/// Distinct items in the order of their addition.
struct Ordered<K, V> {
    items: Vec<(K, V)>,
    places: BTreeMap<K, usize>,
}

impl<K, V> Default for Ordered<K, V> {
    fn default() -> Self {
        Self { items: Vec::new(), places: BTreeMap::new() }
    }
}

impl<K: Copy + Ord, V> Ordered<K, V> {
    /// Adds an item unless one with this key is there.
    fn add(&mut self, key: K, item: impl FnOnce() -> V) {
        let items = &mut self.items;
        self.places.entry(key).or_insert_with(|| {
            items.push((key, item()));
            items.len() - 1
        });
    }
}

/// Index of each image.
#[derive(Default)]
struct ImageIndices {
    reflected: BTreeMap<ReflectedKey, usize>,
    transmitted: BTreeMap<ColorKey, usize>,
    relief: BTreeMap<ReliefKey, usize>,
}

/// Returns the key of a material's colours. Plain materials do not share them: their colour is a factor.
fn color_key(swatch: &Swatch<'_>, number: usize) -> ColorKey {
    if swatch.size.is_some() { swatch.key } else { [0, number] }
}

fn reflected_key(swatch: &Swatch<'_>, mask: Option<&Arc<AlphaMask>>) -> ReflectedKey {
    (if swatch.size.is_some() { swatch.key } else { [0; 2] }, address(mask))
}
