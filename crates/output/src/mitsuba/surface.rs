//! Export of a material's scattering with Mitsuba's own plugins or with Furrow's.
//!
//! | this renderer | Mitsuba's own plugins | agreement |
//! |---|---|---|
//! | Lambert | `diffuse` | exact |
//! | sheet without coats | blend of `diffuse` on either side and `principledthin` that only transmits | exact |
//! | Oren–Nayar | `diffuse` with k times the albedo, k by [`Directions`] | equal brightness on average over the scene's light and view |
//! | hairs and bloom | part of the `diffuse` below them | equal brightness on average over the scene's light and view |
//! | coats, films of water | blend with `roughplastic` without a base | Mitsuba's Smith masking is uncorrelated |
//! | surface below a film of water | included in k | equal brightness on average over the scene's light and view |
//! | tissue below a leaf's coat | Lambert | equal brightness on average over the leaves in view |
//! | anisotropic coats | `roughplastic` with the geometric mean of the roughnesses | equal brightness, other shape of the highlight |
//! | relief | `normalmap` | in the frame of the mesh's normal, not added to its slope; equal brightness of the ground, through k |
//!
//! (`roughplastic` with a base would darken the base towards the horizon, but its model of internal reflection loses 30
//! %.)
//!
//! A blend weights its parts with constants that sum to one and are also their sampling probabilities. Every part is
//! divided by its weight, so the images contain more than the reflectance. With Furrow's plugins (`furrow_soil`,
//! `furrow_leaf`, see `tests/mitsuba/bsdfs.py`) everything is exact; they read the same images and take the factors as
//! parameters.

use super::files::{Band, Files, Plugins};
use super::mean::{Averages, Cover, Directions};
use super::scattering::{Kind, ScatteringMap, Texel};
use super::xml::Element;
use furrow_base::math::{Spectrum, Vec3};
use furrow_base::{Error, Result};
use furrow_optics::bsdf::microfacet::Ggx;
use std::collections::BTreeSet;

/// Weight of transmission in the blend of a sheet.
const THROUGH: f32 = 0.4;
/// Weight of the coat within a side's reflection.
const COAT: f32 = 0.2;
/// Divisor of the optical depth of hairs and bloom in the file, because Mitsuba rejects colours above 1.
const DEEPEST_LAYER: f32 = 16.0;
/// Weight of a film of water over soil.
const FILM: f32 = 0.1;

/// Quantity over a surface: a constant, or the stem of its images.
#[derive(Clone, Debug, PartialEq)]
enum Paint {
    /// The same value everywhere.
    Plain(Spectrum),
    /// `STEM.exr` holds R, G, B and `STEM-nir.exr` the near infrared.
    Texture(String),
    /// The values are attributes of the mesh's vertices.
    Corners,
}

/// Reflectance of the upper and lower side, and transmittance.
#[derive(Clone, Debug)]
struct Reflectances {
    reflect: [Paint; 2],
    transmit: Option<Paint>,
}

/// Scattering of a surface, with its images written.
#[derive(Clone, Debug)]
pub(super) struct Surface {
    kind: Kind,
    /// `false` for a Lambertian replacement of scattering that the format does not represent.
    held: bool,
    /// Diffuse reflectance of both sides times `factor`, and transmittance times `through`, of the tissue alone.
    bare: Reflectances,
    factor: [f32; 2],
    through: f32,
    /// The same with hairs and bloom included, for Mitsuba's own plugins.
    covered: Option<Reflectances>,
    /// Fraction under water divided by its weight, as an image's path.
    film: Option<String>,
    /// Shading normals, as an image's path.
    normal: Option<String>,
    /// Opacity, as an image's path.
    mask: Option<String>,
}

impl Reflectances {
    /// Writes the images of varying quantities.
    fn write(look: &ScatteringMap, factor: [f32; 2], through: f32, stem: &str, files: &mut Files<'_>) -> Result<Self> {
        let mut paint = |what: &str, scale: f32, of: &dyn Fn(usize) -> Spectrum| -> Result<Paint> {
            let all: Vec<Spectrum> = (0..look.texels.len()).map(|i| of(i) * scale).collect();
            match all.first() {
                // Mitsuba rejects colours above 1, but not in images.
                Some(first) if first.max() <= 1.0 && all.iter().all(|s| s == first) => Ok(Paint::Plain(*first)),
                _ => {
                    let stem = format!("textures/{stem}-{what}");
                    Ok(Paint::Texture(files.spectra(&stem, (look.width, look.height), &all)?))
                }
            }
        };
        let upper = paint("upper", factor[0], &|i| look.texels[i].reflect[0])?;
        let same = factor[0] == factor[1] && look.texels.iter().all(|t| t.reflect[0] == t.reflect[1]);
        let lower = if same { upper.clone() } else { paint("lower", factor[1], &|i| look.texels[i].reflect[1])? };
        let transmit = match look.kind {
            Kind::Soil { .. } => None,
            Kind::Sheet { .. } => Some(paint("through", through, &|i| look.texels[i].transmit)?),
        };
        Ok(Self { reflect: [upper, lower], transmit })
    }
}

impl Surface {
    /// Writes the images of a look; their names start with `stem`.
    pub(super) fn write(
        look: &ScatteringMap,
        stem: &str,
        mask: Option<String>,
        mean: &mut Averages<'_>,
        files: &mut Files<'_>,
    ) -> Result<Self> {
        let (factor, through) = match look.kind {
            Kind::Soil { .. } => ([Self::corner_factor(look, mean.directions); 2], 0.0),
            Kind::Sheet { coats, .. } => {
                let mut side =
                    |c: Option<Ggx>| mean.coats([c; 2], false) / ((1.0 - THROUGH) * c.map_or(1.0, |_| 1.0 - COAT));
                (coats.map(&mut side), mean.coats(coats, true) / THROUGH)
            }
        };
        let bare = Reflectances::write(look, factor, through, stem, files)?;
        let covered = match look.kind {
            Kind::Sheet { layers, coats } if layers.iter().any(Option::is_some) => {
                let mut cover = mean.cover(layers);
                // Hairs are on top of the coat, which does not attenuate their light.
                for (side, coat) in cover.sides.iter_mut().zip(coats) {
                    side.1 *= 1.0 / mean.coats([coat; 2], false);
                }
                let texels = look.texels.iter().map(|texel| under(texel, &cover)).collect();
                let below = ScatteringMap { texels, ..look.clone() };
                Some(Reflectances::write(&below, factor, through, &format!("{stem}-covered"), files)?)
            }
            _ => None,
        };
        let size = (look.width, look.height);
        let film = if let Some(0.0) = look.constant(|t| t.film) {
            None
        } else {
            let values: Vec<f32> = look.texels.iter().map(|t| t.film / FILM).collect();
            Some(files.numbers(&format!("textures/{stem}-film.exr"), size, &["Y"], &values)?)
        };
        let normal = if look.has_relief() {
            // The vectors are not normalised, so that slopes, not directions, are interpolated linearly between texels.
            let slope = |n: Vec3, k: usize| 0.5 * n[k] / n.z.max(0.02) + 0.5;
            let axes = (0..3).flat_map(|k| look.texels.iter().map(move |t| slope(t.normal, k)));
            let values: Vec<f32> = axes.collect();
            Some(files.numbers(&format!("textures/{stem}-normal.exr"), size, &["R", "G", "B"], &values)?)
        } else {
            None
        };
        Ok(Self { kind: look.kind, held: look.held, bare, factor, through, covered, film, normal, mask })
    }

    /// Creates a rough surface whose reflectance, times [`Surface::corner_factor`], is stored at the mesh's vertices,
    /// with a uniform film of water.
    pub(super) fn of_corners(
        look: &ScatteringMap,
        stem: &str,
        mean: &Directions,
        files: &mut Files<'_>,
    ) -> Result<Self> {
        let kind = look.kind;
        let share = look.texels.first().map_or(0.0, |t| t.film);
        let write = || files.numbers(&format!("textures/{stem}-film.exr"), (1, 1), &["Y"], &[share / FILM]);
        let film = (share > 0.0).then(write).transpose()?;
        Ok(Self {
            kind,
            held: look.held,
            bare: Reflectances { reflect: [Paint::Corners, Paint::Corners], transmit: None },
            factor: [Self::corner_factor(look, mean); 2],
            through: 0.0,
            covered: None,
            film,
            normal: None,
            mask: None,
        })
    }

    /// Returns the factor on reflectances at a mesh's vertices.
    pub(super) fn corner_factor(look: &ScatteringMap, mean: &Directions) -> f32 {
        match look.kind {
            Kind::Soil { shape, film, shadowing } => {
                let below = film.map(|coat| (coat, look.mean_film()));
                mean.soil(shape, below, shadowing, look.has_relief()) / film.map_or(1.0, |_| 1.0 - FILM)
            }
            Kind::Sheet { .. } => 1.0,
        }
    }

    /// Collects warnings about properties that Mitsuba's own plugins cannot represent.
    pub(super) fn warnings(&self, name: &str, warnings: &mut BTreeSet<(&'static str, String)>) {
        let mut warn = |what| {
            warnings.insert((what, name.to_owned()));
        };
        if !self.held {
            warn("its scattering cannot be represented and is exported as Lambert");
        }
        match self.kind {
            Kind::Soil { shape: [_, b], film, shadowing } => {
                if shadowing.is_some() {
                    warn("shadowing by relief that is not meshed is preserved on average over light and view");
                }
                if b > 0.0 {
                    warn("Oren–Nayar is exported as Lambert, equal on average over light and view");
                }
                if film.is_some() {
                    warn("the film of water is approximate");
                }
            }
            Kind::Sheet { coats, layers } => {
                if layers.iter().flatten().count() > 0 {
                    warn("hairs and bloom are exported as part of the tissue, equal on average over light and view");
                }
                if coats.iter().flatten().count() > 0 {
                    warn("leaf coats are approximate");
                }
                if coats.iter().flatten().any(|c| c.alpha[0] != c.alpha[1]) {
                    warn("anisotropic coats are exported with one roughness");
                }
            }
        }
        if self.bare.reflect[0] == Paint::Corners {
            warn("the grain of stones, straw and wood is sampled at the vertices of their meshes");
        }
        if self.normal.is_some() {
            warn("relief is approximate");
        }
    }

    /// Returns the `<bsdf>` element with this name.
    pub(super) fn element(&self, name: &str, band: Band, plugins: Plugins) -> Element {
        let bare = match plugins {
            Plugins::BuiltIn => {
                let inner = match self.kind {
                    Kind::Soil { film, .. } => self.soil(film, band),
                    Kind::Sheet { coats, .. } => self.sheet(coats, band),
                };
                match &self.normal {
                    // This renderer does not darken light that both the relief and the mesh see, unlike Conty Estevez
                    // et al. 2019.
                    Some(normal) => Element::plugin("bsdf", "normalmap")
                        .boolean("use_shadowing_function", false)
                        .inside([picture("normalmap", normal, "bilinear"), inner]),
                    None => inner,
                }
            }
            Plugins::Own => self.own(band),
        };
        let whole = match &self.mask {
            Some(mask) => Element::plugin("bsdf", "mask").inside([picture("opacity", mask, "nearest"), bare]),
            None => bare,
        };
        whole.with("id", name)
    }

    fn soil(&self, film: Option<Ggx>, band: Band) -> Element {
        let diffuse = Element::plugin("bsdf", "diffuse").inside([paint("reflectance", &self.bare.reflect[0], band)]);
        let inner = match (&self.film, film) {
            (Some(share), Some(coat)) => Element::plugin("bsdf", "blendbsdf")
                .float("weight", FILM)
                .inside([diffuse, gloss(coat, picture("specular_reflectance", share, "bilinear"))]),
            _ => diffuse,
        };
        Element::plugin("bsdf", "twosided").inside([inner])
    }

    fn sheet(&self, coats: [Option<Ggx>; 2], band: Band) -> Element {
        let shares = self.covered.as_ref().unwrap_or(&self.bare);
        let side = |i: usize| {
            let base = Element::plugin("bsdf", "diffuse").inside([paint("reflectance", &shares.reflect[i], band)]);
            let Some(coat) = coats[i] else { return base };
            let weight = Element::property("float", "specular_reflectance", 1.0 / ((1.0 - THROUGH) * COAT));
            Element::plugin("bsdf", "blendbsdf").float("weight", COAT).inside([base, gloss(coat, weight)])
        };
        let through = shares.transmit.clone().unwrap_or(Paint::Plain(Spectrum::ZERO));
        Element::plugin("bsdf", "blendbsdf").float("weight", THROUGH).inside([
            Element::plugin("bsdf", "twosided").inside([side(0), side(1)]),
            Element::plugin("bsdf", "principledthin").float("diff_trans", 2.0).inside([paint(
                "base_color",
                &through,
                band,
            )]),
        ])
    }

    fn own(&self, band: Band) -> Element {
        let mut own = match self.kind {
            Kind::Soil { shape: [a, b], film, .. } => {
                let soil = Element::plugin("bsdf", "furrow_soil")
                    .float("a", a)
                    .float("b", b)
                    .float("scale", 1.0 / self.factor[0])
                    .inside([paint("reflectance", &self.bare.reflect[0], band)]);
                match (&self.film, film) {
                    (Some(share), Some(coat)) => soil
                        .float("film_alpha", coat.alpha[0])
                        .float("film_ior", coat.ior)
                        .float("film_scale", FILM)
                        .inside([picture("film", share, "bilinear")]),
                    _ => soil,
                }
            }
            Kind::Sheet { coats, layers } => {
                let mut leaf = Element::plugin("bsdf", "furrow_leaf");
                for (i, side) in ["upper", "lower"].into_iter().enumerate() {
                    if let Some(coat) = coats[i] {
                        leaf = leaf
                            .float(&format!("{side}_alpha_u"), coat.alpha[0])
                            .float(&format!("{side}_alpha_v"), coat.alpha[1])
                            .float(&format!("{side}_ior"), coat.ior);
                    }
                    if let Some(layer) = layers[i] {
                        let depth = band.rgb(&format!("{side}_layer"), layer.depth() / DEEPEST_LAYER);
                        leaf = leaf.float(&format!("{side}_layer_scale"), DEEPEST_LAYER).inside([depth]);
                    }
                    leaf = leaf.float(&format!("{side}_scale"), 1.0 / self.factor[i]).inside([paint(
                        side,
                        &self.bare.reflect[i],
                        band,
                    )]);
                }
                let through = self.bare.transmit.clone().unwrap_or(Paint::Plain(Spectrum::ZERO));
                leaf.float("through_scale", 1.0 / self.through).inside([paint("through", &through, band)])
            }
        };
        if let Some(normal) = &self.normal {
            own = own.inside([picture("normal", normal, "bilinear")]);
        }
        own
    }
}

/// Merges the cover into the diffuse reflectance and transmittance of a texel.
fn under(texel: &Texel, cover: &Cover) -> Texel {
    let side = |i: usize| texel.reflect[i] * cover.sides[i].0 + cover.sides[i].1;
    Texel { reflect: [side(0), side(1)], transmit: texel.transmit * cover.across, ..*texel }
}

/// Returns a coat without a base, with its reflectance multiplied by `weight`.
fn gloss(coat: Ggx, weight: Element) -> Element {
    Element::plugin("bsdf", "roughplastic")
        .string("distribution", "ggx")
        .float("alpha", (coat.alpha[0] * coat.alpha[1]).sqrt())
        .float("int_ior", coat.ior)
        .float("ext_ior", 1.0)
        .float("diffuse_reflectance", 0.0)
        .inside([weight])
}

fn paint(name: &str, paint: &Paint, band: Band) -> Element {
    match (paint, band) {
        (Paint::Plain(s), _) => band.rgb(name, *s),
        (Paint::Texture(stem), Band::Color) => picture(name, &format!("{stem}.exr"), "bilinear"),
        (Paint::Texture(stem), Band::Nir) => picture(name, &format!("{stem}-nir.exr"), "bilinear"),
        (Paint::Corners, band) => {
            let attribute = if band == Band::Color { "vertex_color" } else { "vertex_nir" };
            Element::plugin("texture", "mesh_attribute").with("name", name).string("name", attribute)
        }
    }
}

/// Returns a raw image texture, clamped at its edges.
fn picture(name: &str, path: &str, filter: &str) -> Element {
    Element::plugin("texture", "bitmap")
        .with("name", name)
        .string("filename", path)
        .string("filter_type", filter)
        .string("wrap_mode", "clamp")
        .boolean("raw", true)
}

/// Returns the properties that distinguish surfaces with vertex colours: roughness, and the coverage and gloss of their
/// film, as bits. Returns an error if a material varies in world space in another way.
pub(super) fn rough(look: &ScatteringMap) -> Result<[u32; 4]> {
    match look.kind {
        Kind::Soil { shape: [a, b], film, .. } => {
            let share = look.texels.first().map_or(0.0, |t| t.film);
            Ok([a, b, share, film.map_or(0.0, |coat| coat.alpha[0])].map(f32::to_bits))
        }
        Kind::Sheet { .. } => Err(Error::input("a sheet whose colour varies in world space cannot be exported")),
    }
}
