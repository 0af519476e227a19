//! Sampling of a material for export: its scattering at each texel of its texture, or at the vertices of a mesh.
//!
//! The inner structure of a [`Material`] is not used. Its BSDF is evaluated point by point on a flat patch, at each
//! texel of the level to which its textures are fixed, see [`super::level`].

use furrow_base::geometry::{Hit, Interaction, Mesh};
use furrow_base::math::{Spectrum, ToFloat, ToInt, Vec2, Vec3, vec2};
use furrow_optics::bsdf::microfacet::Ggx;
use furrow_optics::bsdf::{Bsdf, Form, SurfaceLayer};
use furrow_optics::optics::Shadowing;
use furrow_render::material::{Material, Varies};

/// Properties that are constant over a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    /// Opaque and rough surface, parts of which may be under a film of water.
    Soil {
        /// Oren–Nayar's A and B.
        shape: [f32; 2],
        /// Surface of the film.
        film: Option<Ggx>,
        /// Shadowing by fine relief that is not meshed.
        shadowing: Option<Shadowing>,
    },
    /// Thin sheet with an optional coat on either side.
    Sheet {
        /// Coats of the upper and the lower side.
        coats: [Option<Ggx>; 2],
        /// Hairs and wax bloom on the upper and the lower side.
        layers: [Option<SurfaceLayer>; 2],
    },
}

/// Properties that may vary over a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Texel {
    /// Diffuse reflectance of the upper and lower side, without that of the coat.
    pub(super) reflect: [Spectrum; 2],
    /// Transmittance.
    pub(super) transmit: Spectrum,
    /// Fraction under water.
    pub(super) film: f32,
    /// Shading normal in the frame of ∂p/∂u, its perpendicular in the surface, and the surface's normal.
    pub(super) normal: Vec3,
}

/// Scattering of a material over an image of `width` × `height` texels; a single texel if it is constant.
#[derive(Clone, Debug)]
pub(super) struct ScatteringMap {
    pub(super) kind: Kind,
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) texels: Vec<Texel>,
    /// `true` if the format represents the scattering; otherwise the texels are those of a Lambertian replacement.
    pub(super) held: bool,
}

impl ScatteringMap {
    /// Samples a material whose textures are fixed to one level.
    pub(super) fn of(material: &Material) -> Self {
        let (width, height) = match material.varies() {
            Varies::Texture(w, h) | Varies::Raster(w, h) => (w, h),
            Varies::Nowhere | Varies::Place => (1, 1),
        };
        let flat = patch(Vec3::ZERO, Vec3::Z);
        let (mut kind, mut held) = (None, true);
        let mut texels = Vec::with_capacity((width * height).to_usize());
        for y in 0..height {
            for x in 0..width {
                let uv = vec2((x.to_f32() + 0.5) / width.to_f32(), (y.to_f32() + 0.5) / height.to_f32());
                let (of, texel, own) = at(material, &flat, uv);
                held &= own;
                kind = Some(kind.map_or(of, |known: Kind| known.and(of)));
                texels.push(texel);
            }
        }
        let kind = kind.unwrap_or(Kind::Sheet { coats: [None; 2], layers: [None; 2] });
        Self { kind, width, height, texels, held }
    }

    /// Returns `true` if the shading normal differs anywhere from the mesh's.
    pub(super) fn has_relief(&self) -> bool {
        self.texels.iter().any(|t| t.normal.x != 0.0 || t.normal.y != 0.0)
    }

    /// Returns the mean fraction under water.
    pub(super) fn mean_film(&self) -> f32 {
        self.texels.iter().map(|t| t.film).sum::<f32>() / self.texels.len().max(1).to_f32()
    }

    /// Returns the value of `what` if it is the same in all texels.
    pub(super) fn constant<T: PartialEq>(&self, what: impl Fn(&Texel) -> T) -> Option<T> {
        let first = what(self.texels.first()?);
        self.texels.iter().all(|t| what(t) == first).then_some(first)
    }
}

impl Kind {
    /// Merges the kinds of two texels: only some of the ground may be under water, or only some of a leaf may have wax
    /// under soil.
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

/// Returns the reflectances at each vertex of a mesh, for a material that varies in world space.
pub(super) fn colors(material: &Material, mesh: &Mesh) -> Vec<Spectrum> {
    let corner = |(p, n): (&Vec3, &Vec3)| at(material, &patch(*p, *n), Vec2::ZERO).1.reflect[0];
    mesh.positions.iter().zip(&mesh.normals).map(corner).collect()
}

/// Returns the shading normal at a point of a material's texture, in the frame of ∂p/∂u, its perpendicular in the
/// surface, and the surface's normal. If textures are fixed to one level, it equals the exported normal.
pub fn relief(material: &Material, uv: Vec2) -> Vec3 {
    at(material, &patch(Vec3::ZERO, Vec3::Z), uv).1.normal
}

/// Returns a triangle at `p` with the unit normal `n` whose barycentric coordinates are the texture coordinates, with
/// images 1 m high.
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

/// Returns the scattering at one point of a patch, seen along its normal by a ray with the footprint of the whole
/// image, so that constant properties are averages; and whether it is that of the material, not a replacement.
fn at(material: &Material, patch: &Mesh, uv: Vec2) -> (Kind, Texel, bool) {
    let point = Interaction::new(patch, &Hit { part: 0, triangle: 0, u: uv.y, v: uv.x, t: 0.0 }, 1.0);
    let (bsdf, frame) = material.scatter(&point, patch.normals[0]);
    split(bsdf.form(), &bsdf, frame.z)
}

/// Splits the form of a BSDF into constant properties and those of a texel with this shading normal. Returns `false` as
/// well if there is no form: the result is then the Lambertian surface of the same reflectance and transmittance.
fn split(form: Form, bsdf: &Bsdf, normal: Vec3) -> (Kind, Texel, bool) {
    match form {
        Form::Rough { albedo, shape, film, shadowing } => {
            let kind = Kind::Soil { shape, film: film.map(|film| film.coat), shadowing };
            let film = film.map_or(0.0, |film| film.share);
            (kind, Texel { reflect: [albedo; 2], transmit: Spectrum::ZERO, film, normal }, true)
        }
        Form::Sheet { sides, transmittance } => {
            let kind = Kind::Sheet { coats: sides.map(|side| side.coat), layers: sides.map(|side| side.layer) };
            let reflect = sides.map(|side| side.diffuse);
            (kind, Texel { reflect, transmit: transmittance, film: 0.0, normal }, true)
        }
        Form::Unsupported => {
            let kind = if bsdf.transmits() {
                Kind::Sheet { coats: [None; 2], layers: [None; 2] }
            } else {
                Kind::Soil { shape: [1.0, 0.0], film: None, shadowing: None }
            };
            let reflect = [bsdf.reflectance(1.0), bsdf.reflectance(-1.0)];
            (kind, Texel { reflect, transmit: bsdf.transmittance(), film: 0.0, normal }, false)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rationale: a BSDF without a form must not vanish from an export. Expected: a Lambertian surface of the same
    /// reflectance and transmittance replaces it; a form is kept.
    #[test]
    fn what_has_no_form_becomes_lambertian() {
        for (name, bsdf) in Bsdf::examples() {
            assert!(split(bsdf.form(), &bsdf, Vec3::Z).2, "{name}");
            let (kind, texel, held) = split(Form::Unsupported, &bsdf, Vec3::Z);
            assert!(!held && texel.film == 0.0 && texel.transmit == bsdf.transmittance(), "{name}");
            assert_eq!(texel.reflect[0], bsdf.reflectance(1.0), "{name}");
            let sheet = Kind::Sheet { coats: [None; 2], layers: [None; 2] };
            let soil = Kind::Soil { shape: [1.0, 0.0], film: None, shadowing: None };
            assert_eq!(kind, if bsdf.transmits() { sheet } else { soil }, "{name}");
        }
    }
}
