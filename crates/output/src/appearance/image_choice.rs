//! Choice of the image of a surface: that of the species, or one of its own.
//!
//! The condition of a leaf gives every texel another colour, so each leaf would need its own images: thousands in one
//! field, which take minutes to compute and more memory than viewers have. Most conditions are, within a few percent, a
//! factor on the image of the species. Such leaves share that image, and the factor becomes part of the material. The
//! mean colour of each leaf is then exact, and single marks are missing. Leaves with stronger marks, and leaves with
//! holes, whose opacity is their own, share images with few others (`variants`).

use furrow_base::geometry::AlphaMask;
use furrow_base::math::{ToInt, Vec3};
use furrow_optics::texture::ColorSpace;
use furrow_render::material::Material;
use furrow_render::material::swatch::{Swatch, Tone};

/// Number of points per side of the grid on which images are compared.
const GRID: u32 = 32;
/// Largest root mean square difference between a leaf and its species' image times a factor, in 8-bit sRGB values.
const TOLERANCE: f32 = 6.0;
/// Largest difference of the diffuse transmission factor f. Programs without transmission show 1 / (1 − f) of a leaf's
/// brightness.
pub(super) const SHARE_TOLERANCE: f32 = 0.04;
/// Largest factor on an image. A larger one would exceed 1 on the brightest texels.
pub(super) const LARGEST_FACTOR: f32 = 2.0;
/// Mean reflectance or transmittance below which a band counts as black and has no factor.
const BLACK: f32 = 1e-3;

/// Images of a material.
pub(super) struct ImageChoice<'a> {
    /// Colours: the swatch of the material, or that of its species with the factor of this leaf as tint.
    pub(super) swatch: Swatch<'a>,
    /// Relief, if it is not that of `swatch`: a leaf with colours of its own shares the relief of its species.
    relief: Option<Swatch<'a>>,
}

impl<'a> ImageChoice<'a> {
    /// Returns the images of a material, shared with other leaves of its species if they are similar enough; texels
    /// outside `mask` do not count.
    pub(super) fn of(material: &'a Material, mask: Option<&AlphaMask>) -> Self {
        let Self { swatch: own, relief } = Self::own(material);
        match relief {
            Some(mut species) if let Some([reflected, transmitted]) = factors(&own, &species, mask) => {
                (species.tint, species.tint_transmitted, species.mean) = (reflected, transmitted, own.mean);
                Self { swatch: species, relief: None }
            }
            relief => Self { swatch: own, relief },
        }
    }

    /// Returns the images of a material, with colours of its own.
    pub(super) fn own(material: &'a Material) -> Self {
        Self { swatch: material.swatch(), relief: material.healthy_swatch() }
    }

    /// Whether the material has colours of its own although its species has an image.
    pub(super) fn differs_from_species(&self) -> bool {
        self.relief.is_some()
    }

    /// Returns these images with the colours of another leaf of the species, times factors on reflected and transmitted
    /// R, G, B.
    pub(super) fn with_colors_of(self, mut other: Swatch<'a>, [reflected, transmitted]: [Vec3; 2]) -> Self {
        let own = self.swatch;
        (other.relief, other.roughness, other.back_paleness) = (own.relief, own.roughness, own.back_paleness);
        (other.tint, other.tint_transmitted, other.mean) = (reflected, transmitted, own.mean);
        Self { swatch: other, ..self }
    }

    /// Returns the swatch whose relief the material has.
    pub(super) fn relief(&self) -> &Swatch<'a> {
        self.relief.as_ref().unwrap_or(&self.swatch)
    }
}

/// Returns the factors on reflected and transmitted R, G, B of `species` that give the mean colours of `own`. `None` if
/// the images differ in more than these factors.
fn factors(own: &Swatch<'_>, species: &Swatch<'_>, mask: Option<&AlphaMask>) -> Option<[Vec3; 2]> {
    let (size, species_size) = (own.size?, species.size?);
    let mask_size = mask.map_or(species_size, AlphaMask::size);
    let texel = |(w, h): (u32, u32), i: u32, j: u32| [(i, w), (j, h)].map(|(k, n)| (2 * k + 1) * n / (2 * GRID));
    let places = (0..GRID * GRID).map(|k| (k % GRID, k / GRID)).filter(|&(i, j)| {
        let [x, y] = texel(mask_size, i, j);
        mask.is_none_or(|mask| mask.texel(x.to_i32(), y.to_i32()))
    });
    let pairs: Vec<[Tone; 2]> = places
        .map(|(i, j)| {
            let ([x, y], [sx, sy]) = (texel(size, i, j), texel(species_size, i, j));
            [own.texel(x, y), species.texel(sx, sy)]
        })
        .collect();
    let reflectances = pairs.iter().map(|pair| pair.map(|tone| tone.reflectance.0.truncate()));
    let transmittances = pairs.iter().map(|pair| pair.map(|tone| tone.transmittance.0.truncate()));
    let (reflected, transmitted) = (factor(reflectances.clone())?, factor(transmittances.clone())?);
    let [own, shared] = [0, 1].map(|k| {
        let factors = if k == 0 { [Vec3::ONE; 2] } else { [reflected, transmitted] };
        let largest = |of: &mut dyn Iterator<Item = [Vec3; 2]>| of.fold(Vec3::ZERO, |most, pair| most.max(pair[k]));
        transmission_share([
            largest(&mut reflectances.clone()) * factors[0],
            largest(&mut transmittances.clone()) * factors[1],
        ])
    });
    ((own - shared).abs() <= SHARE_TOLERANCE).then_some([reflected, transmitted])
}

/// Returns the diffuse transmission factor f of a material with these largest reflected and transmitted colours:
/// reflected colours are divided by 1 − f, transmitted ones by f.
pub(super) fn transmission_share([reflected, transmitted]: [Vec3; 2]) -> f32 {
    // If the brightest texels of both colours exceed one for every f, both are scaled down equally.
    let [reflected, transmitted] = [reflected, transmitted].map(Vec3::max_element);
    (transmitted / (reflected + transmitted).max(1.0)).min(0.9)
}

/// Returns the factor that gives the second colours of `pairs` the mean of the first ones. `None` if they still differ
/// by more than [`TOLERANCE`], or if the factor is too large.
fn factor(pairs: impl Iterator<Item = [Vec3; 2]> + Clone) -> Option<Vec3> {
    let (sums, count) =
        pairs.clone().fold(([Vec3::ZERO; 2], 0.0_f32), |([a, b], n), [own, species]| ([a + own, b + species], n + 1.0));
    let count = count.max(1.0);
    let black = (sums[1] / count).cmplt(Vec3::splat(BLACK));
    let factor = Vec3::select(black, Vec3::ONE, sums[0] / sums[1]);
    let code = |color: Vec3| Vec3::from_array(color.to_array().map(|c| f32::from(ColorSpace::Srgb.encode(c))));
    let squares: f32 = pairs.map(|[own, species]| (code(own) - code(species * factor)).length_squared() / 3.0).sum();
    let near = (squares / count).sqrt() <= TOLERANCE && factor.max_element() <= LARGEST_FACTOR;
    near.then_some(factor)
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::math::ToFloat;

    /// Expected: a uniform change of colour is a factor, and its mean is exact. Marks on a few texels are not, nor is a
    /// factor that would exceed 1 on bright texels.
    #[test]
    fn only_uniform_changes_are_factors() {
        let species: Vec<Vec3> = (0..100).map(|k| Vec3::new(0.05, 0.1, 0.03) * (1.0 + 0.01 * k.to_f32())).collect();
        let changed = |change: &dyn Fn(usize, Vec3) -> Vec3| {
            let own: Vec<Vec3> = species.iter().enumerate().map(|(k, color)| change(k, *color)).collect();
            factor(own.into_iter().zip(species.clone()).map(<[Vec3; 2]>::from))
        };
        let uniform = Vec3::new(1.5, 1.2, 0.7);
        let found = changed(&|_, color| color * uniform).unwrap();
        assert!((found - uniform).abs().max_element() < 1e-5, "{found}");
        let spots = |k: usize, color: Vec3| if k < 10 { Vec3::new(0.3, 0.2, 0.1) } else { color };
        assert_eq!(changed(&spots), None);
        assert_eq!(changed(&|_, color| color * 3.0), None);
        // Nearly black bands have no factor.
        let found = factor([[Vec3::splat(2e-4), Vec3::splat(1e-5)]].into_iter()).unwrap();
        assert_eq!(found, Vec3::ONE);
    }
}
