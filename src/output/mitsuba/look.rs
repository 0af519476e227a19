//! A material written down: its scattering sampled over its texture, or at the corners of a mesh.
//!
//! What a [`Material`] is made of is its own affair; here it is asked, point by point on a flat patch, how it scatters: at each
//! texel of the one level that its pictures are read on, see [`super::level`].

use crate::bsdf::microfacet::Ggx;
use crate::bsdf::{Bsdf, OrenNayar, Rough, SurfaceLayer, Wet};
use crate::geometry::{Hit, Interaction, Mesh};
use crate::material::{Material, Varies};
use crate::math::{Spectrum, Vec2, Vec3, vec2};
use crate::optics::Shadowing;

/// What does not vary over a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    /// Opaque and rough, part of it perhaps under a film of water.
    Soil {
        /// A and B of Oren and Nayar.
        shape: [f32; 2],
        /// The film's surface.
        film: Option<Ggx>,
        /// What relief that is too fine to be made hides.
        shadowing: Option<Shadowing>,
    },
    /// A thin sheet with a coat on its upper and lower side, or none.
    Sheet {
        /// The coats.
        coats: [Option<Ggx>; 2],
        /// Hairs and bloom.
        layers: [Option<SurfaceLayer>; 2],
    },
}

/// What may vary.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Texel {
    /// Diffuse reflectance of the upper and lower side, without the coat's own.
    pub(super) reflect: [Spectrum; 2],
    /// Transmittance.
    pub(super) transmit: Spectrum,
    /// Share under water.
    pub(super) film: f32,
    /// Shading normal in the frame of ∂p/∂u, its normal to the side, and the surface's normal.
    pub(super) normal: Vec3,
}

/// A material's scattering over an image of `width` × `height` texels; one texel where it varies nowhere.
#[derive(Clone, Debug)]
pub(super) struct Look {
    pub(super) kind: Kind,
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) texels: Vec<Texel>,
}

impl Look {
    /// Samples `material`, whose pictures are read on one level.
    pub(super) fn of(material: &Material) -> Self {
        let (width, height) = match material.varies() {
            Varies::Picture(w, h) | Varies::Raster(w, h) => (w, h),
            Varies::Nowhere | Varies::Place => (1, 1),
        };
        let flat = patch(Vec3::ZERO, Vec3::Z);
        let mut kind = None;
        let mut texels = Vec::with_capacity((width * height) as usize);
        for y in 0..height {
            for x in 0..width {
                let uv = vec2((x as f32 + 0.5) / width as f32, (y as f32 + 0.5) / height as f32);
                let (of, texel) = at(material, &flat, uv);
                kind = Some(kind.map_or(of, |known: Kind| known.and(of)));
                texels.push(texel);
            }
        }
        let kind = kind.unwrap_or(Kind::Sheet { coats: [None; 2], layers: [None; 2] });
        Self { kind, width, height, texels }
    }

    /// Whether the shading normal is anywhere another than the mesh's.
    pub(super) fn has_relief(&self) -> bool {
        self.texels.iter().any(|t| t.normal.x != 0.0 || t.normal.y != 0.0)
    }

    /// The mean share under water.
    pub(super) fn mean_film(&self) -> f32 {
        self.texels.iter().map(|t| t.film).sum::<f32>() / self.texels.len().max(1) as f32
    }

    /// The one value of `what` where it is the same in all texels.
    pub(super) fn constant<T: PartialEq>(&self, what: impl Fn(&Texel) -> T) -> Option<T> {
        let first = what(self.texels.first()?);
        self.texels.iter().all(|t| what(t) == first).then_some(first)
    }
}

impl Kind {
    /// What holds for texels of both kinds: some of a ground may lie under water, some of a leaf's wax under soil.
    fn and(self, other: Self) -> Self {
        match (self, other) {
            (Self::Soil { shape, film: None, shadowing }, Self::Soil { film, .. }) => {
                Self::Soil { shape, film, shadowing }
            }
            (Self::Sheet { coats: [a, b], layers: [v, w] }, Self::Sheet { coats: [c, d], layers: [x, y] }) => {
                Self::Sheet { coats: [a.or(c), b.or(d)], layers: [v.or(x), w.or(y)] }
            }
            (known, _) => known,
        }
    }
}

/// Reflectances of a material that varies over the world, at each corner of a mesh.
pub(super) fn colors(material: &Material, mesh: &Mesh) -> Vec<Spectrum> {
    let corner = |(p, n): (&Vec3, &Vec3)| at(material, &patch(*p, *n), Vec2::ZERO).1.reflect[0];
    mesh.positions.iter().zip(&mesh.normals).map(corner).collect()
}

/// The shading normal at a point of a material's texture, in the frame of ∂p/∂u, its normal to the side, and the surface's normal: where pictures
/// are read on one level the one that is written.
pub(super) fn relief(material: &Material, uv: Vec2) -> Vec3 {
    at(material, &patch(Vec3::ZERO, Vec3::Z), uv).1.normal
}

/// A triangle at `p` with the unit normal `n` whose barycentrics are the texture coordinates, on which an image is 1 m high.
fn patch(p: Vec3, n: Vec3) -> Mesh {
    let (right, up) = if n == Vec3::Z { (Vec3::X, Vec3::Y) } else { n.any_orthonormal_pair() };
    Mesh {
        positions: vec![p, p - up, p + right],
        normals: vec![n; 3],
        uvs: vec![Vec2::ZERO, Vec2::Y, Vec2::X],
        triangles: vec![[0, 1, 2]],
        weights: Vec::new(),
    }
}

/// The scattering at one point of a patch, seen along its normal by a ray as wide as its image: what varies nowhere is what it is on
/// the mean.
fn at(material: &Material, patch: &Mesh, uv: Vec2) -> (Kind, Texel) {
    let point = Interaction::new(patch, &Hit { part: 0, triangle: 0, u: uv.y, v: uv.x, t: 0.0 }, 1.0);
    let (bsdf, frame) = material.scatter(&point, patch.normals[0]);
    let opaque =
        |albedo: Spectrum, film: f32| Texel { reflect: [albedo; 2], transmit: Spectrum::ZERO, film, normal: frame.z };
    let dry =
        |b: &OrenNayar, shadowing| (Kind::Soil { shape: b.shape(), film: None, shadowing }, opaque(b.albedo(), 0.0));
    let wet = |b: &Wet, shadowing| {
        let kind = Kind::Soil { shape: b.base().shape(), film: Some(b.coat()), shadowing };
        (kind, opaque(b.base().albedo(), b.film()))
    };
    match bsdf {
        Bsdf::OrenNayar(b) => dry(&b, None),
        Bsdf::Shadowed(b) => match b.base() {
            Rough::Dry(base) => dry(base, Some(*b.shadowing())),
            Rough::Wet(base) => wet(base, Some(*b.shadowing())),
        },
        Bsdf::Wet(b) => wet(&b, None),
        Bsdf::Leaf(b) => {
            let [upper, lower] = b.both_sides();
            let reflect = [upper.diffuse(), lower.diffuse()];
            let texel = Texel { reflect, transmit: b.transmittance(), film: 0.0, normal: frame.z };
            let kind = Kind::Sheet { coats: [upper.coat(), lower.coat()], layers: [upper.layer(), lower.layer()] };
            (kind, texel)
        }
    }
}
