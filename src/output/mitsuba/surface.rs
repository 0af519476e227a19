//! How a material's scattering is written: with Mitsuba's own plugins, or with ours.
//!
//! | ours | Mitsuba's own | agreement |
//! |---|---|---|
//! | Lambert | `diffuse` | exact |
//! | Oren–Nayar | `diffuse` of A times the albedo | exact seen along the normal, no retroreflection elsewhere |
//! | film of water | `blendbsdf` with `roughplastic` | Smith's masking is uncorrelated there, the film's darkening rough |
//! | sheet without coats | `blendbsdf` of `diffuse` on either side and `principledthin` that only transmits | exact |
//! | coats | `roughplastic` over the reflection, none over the transmission | as the film; across and along alike |
//! | relief | `normalmap` | in the frame of the mesh's normal, not added to its slope |
//!
//! The halves of a blend weigh ½ each, so pictures of sheets hold twice the reflectance, and those under a coat are
//! divided by 1 − F₀ as `roughplastic` wants it. With our own plugins (`furrow_soil`, `furrow_leaf`, see
//! `tests/mitsuba/bsdfs.py`) everything is exact; they read the same pictures and are told the factor.

use super::look::{Kind, Look};
use super::xml::Element;
use super::{Band, Files, Plugins};
use crate::bsdf::fresnel;
use crate::bsdf::microfacet::Ggx;
use crate::math::Spectrum;
use crate::{Error, Result};
use std::collections::BTreeSet;

/// A quantity over a surface: one value, or the stem of the pictures that hold it.
#[derive(Clone, Debug, PartialEq)]
enum Paint {
    /// The same everywhere.
    Plain(Spectrum),
    /// `STEM.exr` holds R, G, B and `STEM-nir.exr` the near infrared.
    Picture(String),
    /// The mesh's corners hold it.
    Corners,
}

/// A surface's scattering, its pictures written.
#[derive(Clone, Debug)]
pub(super) struct Surface {
    kind: Kind,
    /// Diffuse reflectance, upper and lower, times `factor`.
    reflect: [Paint; 2],
    /// What `reflect` was multiplied by, so that the blend's halves and the coats give the right sum.
    factor: [f32; 2],
    /// Transmittance times two.
    transmit: Option<Paint>,
    /// Share under water, a picture's stem.
    film: Option<String>,
    /// Shading normals, a picture's stem.
    normal: Option<String>,
    /// Opacity, a picture's path.
    mask: Option<String>,
}

impl Surface {
    /// Writes the pictures of a look, their names beginning with `stem`.
    pub(super) fn write(look: &Look, stem: &str, mask: Option<String>, files: &mut Files<'_>) -> Result<Self> {
        let factor = match look.kind {
            Kind::Soil { .. } => [1.0; 2],
            Kind::Sheet { coats } => coats.map(|c| 2.0 / c.map_or(1.0, |c| 1.0 - fresnel::dielectric(1.0, c.ior))),
        };
        let mut paint = |what: &str, scale: f32, of: &dyn Fn(usize) -> Spectrum| -> Result<Paint> {
            let all: Vec<Spectrum> = (0..look.texels.len()).map(|i| of(i) * scale).collect();
            match all.first() {
                // Numbers above 1 are refused as colours, but not in pictures.
                Some(first) if first.max() <= 1.0 && all.iter().all(|s| s == first) => Ok(Paint::Plain(*first)),
                _ => {
                    let stem = format!("textures/{stem}-{what}");
                    files.spectra(&stem, look.width, look.height, &all)?;
                    Ok(Paint::Picture(stem))
                }
            }
        };
        let upper = paint("upper", factor[0], &|i| look.texels[i].reflect[0])?;
        let same = factor[0] == factor[1] && look.texels.iter().all(|t| t.reflect[0] == t.reflect[1]);
        let lower = if same { upper.clone() } else { paint("lower", factor[1], &|i| look.texels[i].reflect[1])? };
        let transmit = match look.kind {
            Kind::Soil { .. } => None,
            Kind::Sheet { .. } => Some(paint("through", 2.0, &|i| look.texels[i].transmit)?),
        };
        let film = match look.constant(|t| t.film) {
            Some(0.0) => None,
            _ => Some(format!("textures/{stem}-film")),
        };
        if let Some(film) = &film {
            let values = look.texels.iter().map(|t| t.film).collect();
            files.numbers(&format!("{film}.exr"), look.width, look.height, &[("Y", values)])?;
        }
        let flat = look.texels.iter().all(|t| t.normal.x == 0.0 && t.normal.y == 0.0);
        let normal = (!flat).then(|| format!("textures/{stem}-normal"));
        if let Some(normal) = &normal {
            let axis = |k: usize| look.texels.iter().map(|t| 0.5 * t.normal[k] + 0.5).collect::<Vec<f32>>();
            let channels = [("R", axis(0)), ("G", axis(1)), ("B", axis(2))];
            files.numbers(&format!("{normal}.exr"), look.width, look.height, &channels)?;
        }
        Ok(Self { kind: look.kind, reflect: [upper, lower], factor, transmit, film, normal, mask })
    }

    /// A rough surface whose reflectance the mesh's corners hold.
    pub(super) fn of_corners(kind: Kind) -> Self {
        let reflect = [Paint::Corners, Paint::Corners];
        Self { kind, reflect, factor: [1.0; 2], transmit: None, film: None, normal: None, mask: None }
    }

    /// What Mitsuba's own plugins cannot hold of it.
    pub(super) fn warnings(&self, name: &str, warnings: &mut BTreeSet<(&'static str, String)>) {
        let mut warn = |what| {
            warnings.insert((what, name.to_owned()));
        };
        match self.kind {
            Kind::Soil { shape: [_, b], film } => {
                if b > 0.0 {
                    warn("Oren–Nayar is written as Lambert, equal seen along the normal");
                }
                if film.is_some() {
                    warn("the film of water is written as `roughplastic`, about equal");
                }
            }
            Kind::Sheet { coats } => {
                if coats.iter().flatten().count() > 0 {
                    warn("coats are written as `roughplastic`, about equal");
                }
                if coats.iter().flatten().any(|c| c.alpha[0] != c.alpha[1]) {
                    warn("coats rougher across than along are written with one roughness");
                }
            }
        }
        if self.reflect[0] == Paint::Corners {
            warn("the grain of stones, straw and wood is sampled at the corners of their meshes");
        }
        if self.normal.is_some() {
            warn("relief is written as `normalmap`, about equal");
        }
    }

    /// The `<bsdf>` element of this name.
    pub(super) fn element(&self, name: &str, band: Band, plugins: Plugins) -> Element {
        let bare = match plugins {
            Plugins::BuiltIn => {
                let inner = match self.kind {
                    Kind::Soil { shape, film } => self.soil(shape, film, band),
                    Kind::Sheet { coats } => self.sheet(coats, band),
                };
                match &self.normal {
                    Some(normal) => Element::plugin("bsdf", "normalmap")
                        .inside([picture("normalmap", &format!("{normal}.exr"), "bilinear"), inner]),
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

    fn soil(&self, [a, b]: [f32; 2], film: Option<Ggx>, band: Band) -> Element {
        // A albedo: what Oren–Nayar is seen along the normal.
        let dry = match (&self.reflect[0], b > 0.0) {
            (Paint::Plain(albedo), true) => Paint::Plain(*albedo * a),
            (paint, _) => paint.clone(),
        };
        let diffuse = Element::plugin("bsdf", "diffuse").inside([paint("reflectance", &dry, band)]);
        let inner = match (&self.film, film) {
            (Some(share), Some(coat)) => Element::plugin("bsdf", "blendbsdf").inside([
                picture("weight", &format!("{share}.exr"), "bilinear"),
                diffuse,
                plastic(coat, paint("diffuse_reflectance", &dry, band), 1.0),
            ]),
            _ => diffuse,
        };
        Element::plugin("bsdf", "twosided").inside([inner])
    }

    fn sheet(&self, coats: [Option<Ggx>; 2], band: Band) -> Element {
        let side = |i: usize| match coats[i] {
            Some(coat) => plastic(coat, paint("diffuse_reflectance", &self.reflect[i], band), 2.0),
            None => Element::plugin("bsdf", "diffuse").inside([paint("reflectance", &self.reflect[i], band)]),
        };
        let through = self.transmit.clone().unwrap_or(Paint::Plain(Spectrum::ZERO));
        Element::plugin("bsdf", "blendbsdf").float("weight", 0.5).inside([
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
            Kind::Soil { shape: [a, b], film } => {
                let soil = Element::plugin("bsdf", "furrow_soil").float("a", a).float("b", b).inside([paint(
                    "reflectance",
                    &self.reflect[0],
                    band,
                )]);
                match (&self.film, film) {
                    (Some(share), Some(coat)) => soil.float("film_alpha", coat.alpha[0]).inside([picture(
                        "film",
                        &format!("{share}.exr"),
                        "bilinear",
                    )]),
                    _ => soil,
                }
            }
            Kind::Sheet { coats } => {
                let mut leaf = Element::plugin("bsdf", "furrow_leaf");
                for (i, side) in ["upper", "lower"].into_iter().enumerate() {
                    if let Some(coat) = coats[i] {
                        leaf = leaf
                            .float(&format!("{side}_alpha_u"), coat.alpha[0])
                            .float(&format!("{side}_alpha_v"), coat.alpha[1])
                            .float(&format!("{side}_ior"), coat.ior);
                    }
                    leaf = leaf.float(&format!("{side}_scale"), 1.0 / self.factor[i]).inside([paint(
                        side,
                        &self.reflect[i],
                        band,
                    )]);
                }
                let through = self.transmit.clone().unwrap_or(Paint::Plain(Spectrum::ZERO));
                leaf.float("through_scale", 0.5).inside([paint("through", &through, band)])
            }
        };
        if let Some(normal) = &self.normal {
            own = own.inside([picture("normal", &format!("{normal}.exr"), "bilinear")]);
        }
        own
    }
}

/// `roughplastic` over a diffuse base; its gloss times `gloss`.
fn plastic(coat: Ggx, base: Element, gloss: f32) -> Element {
    Element::plugin("bsdf", "roughplastic")
        .string("distribution", "ggx")
        .float("alpha", (coat.alpha[0] * coat.alpha[1]).sqrt())
        .float("int_ior", coat.ior)
        .float("ext_ior", 1.0)
        .float("specular_reflectance", gloss)
        .inside([base])
}

fn paint(name: &str, paint: &Paint, band: Band) -> Element {
    match (paint, band) {
        (Paint::Plain(s), _) => band.rgb(name, *s),
        (Paint::Picture(stem), Band::Color) => picture(name, &format!("{stem}.exr"), "bilinear"),
        (Paint::Picture(stem), Band::Nir) => picture(name, &format!("{stem}-nir.exr"), "bilinear"),
        (Paint::Corners, band) => {
            let attribute = if band == Band::Color { "vertex_color" } else { "vertex_nir" };
            Element::plugin("texture", "mesh_attribute").with("name", name).string("name", attribute)
        }
    }
}

/// A picture of plain numbers, clamped at its edges.
fn picture(name: &str, path: &str, filter: &str) -> Element {
    Element::plugin("texture", "bitmap")
        .with("name", name)
        .string("filename", path)
        .string("filter_type", filter)
        .string("wrap_mode", "clamp")
        .boolean("raw", true)
}

/// The kind of surfaces whose corners hold their colour, or an error where a material varies over the world in another way.
pub(super) fn rough(kind: Kind) -> Result<[f32; 2]> {
    match kind {
        Kind::Soil { shape, film: None } => Ok(shape),
        _ => Err(Error::Scene("a sheet whose colour varies over the world cannot be exported".into())),
    }
}
