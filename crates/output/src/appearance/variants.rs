//! Images of leaves whose colours differ from those of their species in more than a factor: the first leaves of a species
//! have images of their own, and each later one has the most similar of these, times a factor.
//!
//! A field has thousands of leaves with spots. Without sharing, their images would take minutes to compute and most of
//! the file. The mean colour of each leaf is exact; its spots are at the places of another leaf's.

use super::image_choice::{LARGEST_FACTOR, SHARE_TOLERANCE, transmission_share};
use furrow_base::geometry::AlphaMask;
use furrow_base::math::{ToFloat, ToInt, Vec3};
use furrow_render::material::swatch::{Swatch, Tone};

/// Number of leaves of a species that have images of their own.
pub(super) const MOST: usize = 16;
/// Mean reflectance or transmittance below which a band of both leaves is black and has no factor: they differ by less than 1/255
/// in sRGB.
const BLACK: f32 = 3e-4;
/// Number of points per side of the grid on which leaves are compared.
const GRID: u32 = 16;

/// Colours of a leaf on a grid of points.
pub(super) struct Sketch {
    /// Reflected and transmitted R, G, B.
    colors: Vec<[Vec3; 2]>,
    /// Their square roots, on which the differences of colours are about as visible as they are large.
    roots: Vec<[Vec3; 2]>,
    /// Whether each point is on the leaf.
    inside: Vec<bool>,
}

impl Sketch {
    /// Samples a swatch; points outside `mask` are not on the leaf.
    pub(super) fn of(swatch: &Swatch<'_>, mask: Option<&AlphaMask>) -> Self {
        let size = swatch.size.unwrap_or((1, 1));
        let texel =
            |(w, h): (u32, u32), k: u32| [(k % GRID, w), (k / GRID, h)].map(|(i, n)| (2 * i + 1) * n / (2 * GRID));
        let color = |k: u32| {
            let [x, y] = texel(size, k);
            let Tone { reflectance, transmittance } = swatch.texel(x, y);
            [reflectance, transmittance].map(|s| s.0.truncate())
        };
        let is_inside = |k: u32| {
            mask.is_none_or(|mask| {
                let [x, y] = texel(mask.size(), k);
                mask.texel(x.to_i32(), y.to_i32())
            })
        };
        let colors: Vec<[Vec3; 2]> = (0..GRID * GRID).map(color).collect();
        let root = |v: Vec3| v.max(Vec3::ZERO).map(f32::sqrt);
        let roots = colors.iter().map(|pair| pair.map(root)).collect();
        Self { colors, roots, inside: (0..GRID * GRID).map(is_inside).collect() }
    }

    /// Returns the factors on reflected and transmitted colours of `other` that give the mean colours of this leaf, and the
    /// difference that is left. `None` if a factor or the difference of the diffuse transmission factor is too large.
    fn match_with(&self, other: &Self) -> Option<([Vec3; 2], f32)> {
        let on_leaf = |colors: &[[Vec3; 2]]| {
            let pairs = colors.iter().zip(&self.inside).filter(|(_, inside)| **inside);
            pairs.fold([Vec3::ZERO; 4], |[a, b, c, d], ([r, t], _)| [a + *r, b + *t, c.max(*r), d.max(*t)])
        };
        let count = self.inside.iter().filter(|inside| **inside).count().max(1).to_f32();
        let (own, others) = (on_leaf(&self.colors), on_leaf(&other.colors));
        let factors = [0, 1].map(|k| {
            let is_black = (own[k].max(others[k]) / count).cmplt(Vec3::splat(BLACK));
            Vec3::select(is_black, Vec3::ONE, own[k] / others[k].max(Vec3::splat(f32::MIN_POSITIVE)))
        });
        if factors.iter().any(|factor| factor.max_element() > LARGEST_FACTOR) {
            return None;
        }
        let share = transmission_share([own[2], own[3]]);
        let shared = transmission_share([others[2] * factors[0], others[3] * factors[1]]);
        if (share - shared).abs() > SHARE_TOLERANCE {
            return None;
        }
        let roots = factors.map(|factor| factor.map(f32::sqrt));
        let pairs = self.roots.iter().zip(&other.roots).zip(&self.inside).filter(|(_, inside)| **inside);
        let difference = |((own, other), _): ((&[Vec3; 2], &[Vec3; 2]), &bool)| -> f32 {
            (0..2).map(|k| (own[k] - other[k] * roots[k]).length_squared()).sum()
        };
        Some((factors, pairs.map(difference).sum()))
    }
}

/// Returns the index of the most similar of `others` and the factors on its reflected and transmitted colours; `None` if
/// none is similar enough.
pub(super) fn nearest<'a>(own: &Sketch, others: impl Iterator<Item = &'a Sketch>) -> Option<(usize, [Vec3; 2])> {
    let matches = others.enumerate().filter_map(|(k, other)| Some((k, own.match_with(other)?)));
    matches.min_by(|(_, (_, a)), (_, (_, b))| a.total_cmp(b)).map(|(k, (factors, _))| (k, factors))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn leaf(of: impl Fn(usize) -> Vec3) -> Sketch {
        let colors: Vec<[Vec3; 2]> = (0..256).map(|k| [of(k), of(k) * 0.5]).collect();
        let roots = colors.iter().map(|pair| pair.map(|v| v.map(f32::sqrt))).collect();
        Sketch { colors, roots, inside: (0..256).map(|k| k >= 16).collect() }
    }

    /// Expected: a leaf with spots takes the image of the leaf with spots at the same places, and the factor restores its
    /// own brightness; the rows outside the mask do not count. A leaf three times as bright is not similar.
    #[test]
    fn the_most_similar_leaf_is_found_with_its_factor() {
        let green = Vec3::new(0.05, 0.12, 0.04);
        let spots = |of: usize, factor: f32| {
            leaf(move |k| if k < 16 { Vec3::ONE } else { factor * if k % 7 == of { green * 2.0 } else { green } })
        };
        let others = [spots(1, 1.0), spots(4, 1.0)];
        let (k, factors) = nearest(&spots(4, 0.8), others.iter()).unwrap();
        assert_eq!(k, 1);
        assert!(factors.iter().all(|f| (*f - Vec3::splat(0.8)).abs().max_element() < 1e-5), "{factors:?}");
        assert!(nearest(&spots(4, 3.0), others.iter()).is_none());
    }
}
