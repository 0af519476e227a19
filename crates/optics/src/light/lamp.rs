//! Lamps: rectangles and discs that emit on one side, with the same radiance at every point and in every direction.
//!
//! Points are sampled uniformly on the area A. Seen from a distance d at an angle θ to the lamp's axis, the density per
//! solid angle is d² / (A cos θ). Lamps are not geometry: a ray intersects them through [`Emitter::hit`], and they cast
//! no shadow.
//!
//! Colours are band irradiances relative to G. Each is the signal of a white reflector under the lamp in the JAI
//! AD-130's channels, divided by the signal under ASTM G173 global sunlight and multiplied by that sunlight's band
//! irradiances. For the halogen lamp, Planck's law at 3000 K agrees within 1 %.

use super::described::{Described, Open, Recorded};
use super::form::{Form, Outline, Portable};
use super::sample::{Emitter, LampHit, LightSample};
use furrow_base::math::{Frame, Spectrum, ToFloat, Vec2, Vec3, vec3};
use furrow_base::ron_file::{NonNegative, Positive, Signed, Vary};
use furrow_base::sampling::rng::Stream;
use furrow_base::sampling::warp;
use furrow_base::{Error, Result};
use serde::{Deserialize, Serialize};
use std::f32::consts::PI;

/// Halogen lamp, 3000 K.
const HALOGEN: Spectrum = Spectrum::new(1.59, 1.0, 0.556, 2.64);

/// White light-emitting diode, with almost no NIR.
const WHITE_LED: Spectrum = Spectrum::new(0.951, 1.0, 0.426, 0.0022);

/// Infrared light-emitting diode, 810 to 850 nm, relative to NIR.
const NIR_LED: Spectrum = Spectrum::new(0.0, 0.0, 0.0, 1.0);

/// Flat area that emits on the side of its frame's z axis.
#[derive(Clone, Copy, Debug)]
pub struct Lamp {
    outline: Outline,
    centre: Vec3,
    frame: Frame,
    radiance: Spectrum,
    area: f32,
    /// Radius of the bounding sphere.
    reach: f32,
    /// Irradiance per radiance of a horizontal plane at the world's origin. Stored because it is read often and is a
    /// sum of thousands of terms.
    below: f32,
}

impl Lamp {
    /// Creates a lamp centred at `centre` (metres) that emits along `frame.z`; a rectangle's width is along `frame.x`.
    pub fn new(outline: Outline, centre: Vec3, frame: Frame, radiance: Spectrum) -> Self {
        let (area, reach) = match outline {
            Outline::Rectangle(half) => (4.0 * half.x * half.y, half.length()),
            Outline::Disc(radius) => (PI * radius * radius, radius),
        };
        let lamp = Self { outline, centre, frame, radiance, area, reach, below: 0.0 };
        Self { below: lamp.form_factor(Vec3::ZERO, Vec3::Z), ..lamp }
    }

    /// Returns the point of the area for `u` in [0, 1)².
    #[inline]
    fn point(&self, u: [f32; 2]) -> Vec3 {
        let local = match self.outline {
            Outline::Rectangle(half) => Vec2::new(2.0 * u[0] - 1.0, 2.0 * u[1] - 1.0) * half,
            Outline::Disc(radius) => warp::disc(u) * radius,
        };
        self.centre + self.frame.x * local.x + self.frame.y * local.y
    }

    /// Returns the irradiance per radiance at `p` on a plane of unit normal `n`, by the midpoint rule over the area.
    fn form_factor(&self, p: Vec3, n: Vec3) -> f32 {
        const SIDE: usize = 64;
        let mut sum = 0.0_f64;
        for k in 0..SIDE * SIDE {
            let at = |i: usize| (i.to_f32() + 0.5) / SIDE.to_f32();
            let to = self.point([at(k % SIDE), at(k / SIDE)]) - p;
            let d2 = to.length_squared();
            let cosines = to.dot(n).max(0.0) * (-to.dot(self.frame.z)).max(0.0);
            if d2 > 0.0 {
                sum += f64::from(cosines / (d2 * d2));
            }
        }
        (sum * f64::from(self.area) / (SIDE * SIDE).to_f64()).to_f32()
    }
}

impl Emitter for Lamp {
    #[inline]
    fn sample_li(&self, p: Vec3, u: [f32; 2]) -> Option<LightSample> {
        let to = self.point(u) - p;
        let d2 = to.length_squared();
        let distance = d2.sqrt();
        let wi = to / distance;
        let cos = -wi.dot(self.frame.z);
        let pdf = d2 / (self.area * cos);
        (cos > 0.0 && pdf > 0.0 && pdf.is_finite()).then_some(LightSample {
            wi,
            distance,
            radiance: self.radiance,
            pdf,
        })
    }

    #[inline]
    fn pdf_li(&self, p: Vec3, wi: Vec3) -> f32 {
        self.hit(p, wi).map_or(0.0, |hit| hit.pdf)
    }

    #[inline]
    fn le(&self, _dir: Vec3) -> Spectrum {
        Spectrum::ZERO
    }

    #[inline]
    fn hit(&self, origin: Vec3, dir: Vec3) -> Option<LampHit> {
        let cos = -dir.dot(self.frame.z);
        let height = (origin - self.centre).dot(self.frame.z);
        if cos <= 0.0 || height <= 0.0 {
            return None;
        }
        let distance = height / cos;
        let at = origin + dir * distance - self.centre;
        let local = Vec2::new(at.dot(self.frame.x), at.dot(self.frame.y));
        let inside = match self.outline {
            Outline::Rectangle(half) => local.abs().cmple(half).all(),
            Outline::Disc(radius) => local.length_squared() <= radius * radius,
        };
        let pdf = distance * distance / (self.area * cos);
        (inside && pdf > 0.0 && pdf.is_finite()).then_some(LampHit { distance, radiance: self.radiance, pdf })
    }

    /// Returns radiance × area × cosines / distance².
    ///
    /// Seen from `p`, the receiver's cosine varies over the lamp by ± `spread` about its value at the centre. The mean
    /// of its positive part is used, so that a lamp half behind the plane still counts.
    #[inline]
    fn importance(&self, p: Vec3, n: Vec3, two_sided: bool) -> f32 {
        let to = self.centre - p;
        let height = -to.dot(self.frame.z);
        if height <= 0.0 {
            return 0.0;
        }
        let distance = to.length();
        let spread = (self.reach / distance).min(1.0);
        let cos = to.dot(n) / distance;
        let above = |cos: f32| {
            if cos >= spread {
                cos
            } else if cos > -spread {
                (cos + spread) * (cos + spread) / (4.0 * spread)
            } else {
                0.0
            }
        };
        let mut seen = above(cos) + if two_sided { above(-cos) } else { 0.0 };
        if spread >= 1.0 {
            // Inside the lamp's bounding sphere every direction may hit a part of it.
            seen = seen.max(0.1);
        }
        self.radiance.mean() * (self.area * height / (distance * distance * distance)).min(PI) * seen
    }

    fn horizontal_irradiance(&self) -> Spectrum {
        self.radiance * self.below
    }

    #[inline]
    fn is_narrow(&self) -> bool {
        true
    }

    #[inline]
    fn is_infinite(&self) -> bool {
        false
    }
}

impl Portable for Lamp {
    fn form(&self) -> Form {
        let Self { outline, centre, frame, radiance, area, .. } = *self;
        Form::Area { outline, centre, frame, radiance, area }
    }

    /// Scales the outline at constant power.
    fn shrunk(&self, by: f32) -> Option<Self> {
        let outline = match self.outline {
            Outline::Rectangle(half) => Outline::Rectangle(half * by),
            Outline::Disc(radius) => Outline::Disc(radius * by),
        };
        Some(Self::new(outline, self.centre, self.frame, self.radiance / (by * by)))
    }
}

/// Outline of a lamp.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum ShapeDesc {
    /// Rectangle with a horizontal width.
    Rectangle {
        /// Horizontal side, metres.
        #[schemars(extend("x-example" = "0.3"))]
        width_m: Vary<Positive<100>>,
        /// Other side, metres.
        #[schemars(extend("x-example" = "0.12"))]
        height_m: Vary<Positive<1000>>,
    },
    /// Disc.
    Disc {
        /// Radius, metres.
        #[schemars(extend("x-example" = "0.05"))]
        radius_m: Vary<Positive<100>>,
    },
}

/// Brightness and colour of a lamp.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum GlowDesc {
    /// Radiance in R, G, B, NIR, W·m⁻²·sr⁻¹·nm⁻¹.
    Radiance(
        Vary<NonNegative<1_000_000_000>>,
        Vary<NonNegative<1_000_000_000>>,
        Vary<NonNegative<1_000_000_000>>,
        Vary<NonNegative<1_000_000_000>>,
    ),
    /// Halogen lamp, 3000 K, given by the G irradiance of a plane that faces the lamp at a distance on its axis.
    Halogen {
        /// Irradiance in G, W·m⁻²·nm⁻¹; that of the noon sun is 1.4.
        #[schemars(extend("x-example" = "Uniform(0.2, 0.7)"))]
        irradiance: Vary<NonNegative<1_000_000_000>>,
        /// Distance of that plane, metres.
        #[schemars(extend("x-example" = "0.8"))]
        at_m: Vary<Positive<1000>>,
    },
    /// White light-emitting diode, given by the G irradiance of a plane that faces the lamp at a distance on its axis.
    WhiteLed {
        /// Irradiance in G, W·m⁻²·nm⁻¹.
        #[schemars(extend("x-example" = "Uniform(0.2, 0.7)"))]
        irradiance: Vary<NonNegative<1_000_000_000>>,
        /// Distance of that plane, metres.
        #[schemars(extend("x-example" = "0.8"))]
        at_m: Vary<Positive<1000>>,
    },
    /// Infrared light-emitting diode, 810 to 850 nm, given by the NIR irradiance of a plane that faces the lamp at a
    /// distance on its axis.
    NirLed {
        /// Irradiance in NIR, W·m⁻²·nm⁻¹.
        #[schemars(extend("x-example" = "Uniform(0.2, 0.7)"))]
        irradiance: Vary<NonNegative<1_000_000_000>>,
        /// Distance of that plane, metres.
        #[schemars(extend("x-example" = "0.8"))]
        at_m: Vary<Positive<1000>>,
    },
}

/// Point with coordinates in metres.
pub type PointDesc = (Vary<Signed<1000>>, Vary<Signed<1000>>, Vary<Signed<1000>>);

fn origin() -> PointDesc {
    (Vary::fixed(0.0), Vary::fixed(0.0), Vary::fixed(0.0))
}

/// Fields of `Lamp`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename = "Lamp")]
#[schemars(inline)]
pub struct LampDesc {
    /// Outline of the area.
    pub shape: ShapeDesc,
    /// Centre, metres.
    #[schemars(extend("x-example" = "(-0.35, 0.2, 1)"))]
    pub position_m: PointDesc,
    /// Point that the lamp faces, metres; default the origin.
    #[serde(default = "origin")]
    pub look_at_m: PointDesc,
    /// Brightness and colour.
    pub glow: GlowDesc,
}

/// Sampled values of `Lamp`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LampRecord {
    /// Horizontal and other side of a rectangle; twice the radius for a disc.
    pub size_m: [f32; 2],
    /// `true` for a disc.
    pub round: bool,
    /// Centre of the area.
    pub position_m: [f32; 3],
    /// Unit direction of emission.
    pub direction: [f32; 3],
    /// Radiance.
    pub radiance_w_m2_sr_nm: Spectrum,
    /// Total emitted power: π times radiance times area.
    pub power_w_nm: Spectrum,
    /// Irradiance of the ground.
    pub irradiance_w_m2_nm: Spectrum,
}

impl LampRecord {
    fn of(lamp: &Lamp) -> Self {
        let (size_m, round) = match lamp.outline {
            Outline::Rectangle(half) => ((half * 2.0).to_array(), false),
            Outline::Disc(radius) => ([2.0 * radius; 2], true),
        };
        Self {
            size_m,
            round,
            position_m: lamp.centre.to_array(),
            direction: lamp.frame.z.to_array(),
            radiance_w_m2_sr_nm: lamp.radiance,
            power_w_nm: lamp.radiance * (PI * lamp.area),
            irradiance_w_m2_nm: lamp.horizontal_irradiance(),
        }
    }
}

impl Recorded for LampRecord {
    fn irradiance_w_m2_nm(&self) -> Spectrum {
        self.irradiance_w_m2_nm
    }
}

impl Described for LampDesc {
    type Record = LampRecord;
    type Sources = Option<Lamp>;

    /// Returns a [`Kind::Input`](furrow_base::error::Kind::Input) error if position and target are equal.
    fn draw(&self, stream: &mut Stream, _: &mut Open<'_>) -> Result<(LampRecord, Option<Lamp>)> {
        let Self { shape, position_m, look_at_m, glow } = self;
        let outline = match shape {
            ShapeDesc::Rectangle { width_m, height_m } => {
                Outline::Rectangle(Vec2::new(width_m.draw32(stream), height_m.draw32(stream)) * 0.5)
            }
            ShapeDesc::Disc { radius_m } => Outline::Disc(radius_m.draw32(stream)),
        };
        let mut point = |at: &PointDesc| vec3(at.0.draw32(stream), at.1.draw32(stream), at.2.draw32(stream));
        let centre = point(position_m);
        let axis = (point(look_at_m) - centre).try_normalize().ok_or_else(|| {
            Error::input("the lamp looks at its own position, so it has no direction")
                .help("set look_at_m to another point")
        })?;
        let level = Vec3::Z.cross(axis);
        let frame = Frame::with_tangent(axis, if level.length() > 1e-6 { level } else { Vec3::X });
        let lamp = Lamp::new(outline, centre, frame, Spectrum::ONE);
        let per_irradiance = |at: f32| 1.0 / lamp.form_factor(centre + axis * at, -axis).max(f32::MIN_POSITIVE);
        let radiance = match glow {
            GlowDesc::Radiance(r, g, b, nir) => {
                Spectrum::new(r.draw32(stream), g.draw32(stream), b.draw32(stream), nir.draw32(stream))
            }
            GlowDesc::Halogen { irradiance, at_m } => {
                HALOGEN * (irradiance.draw32(stream) * per_irradiance(at_m.draw32(stream)))
            }
            GlowDesc::WhiteLed { irradiance, at_m } => {
                WHITE_LED * (irradiance.draw32(stream) * per_irradiance(at_m.draw32(stream)))
            }
            GlowDesc::NirLed { irradiance, at_m } => {
                NIR_LED * (irradiance.draw32(stream) * per_irradiance(at_m.draw32(stream)))
            }
        };
        let lamp = Lamp { radiance, ..lamp };
        Ok((LampRecord::of(&lamp), Some(lamp)))
    }

    fn examples() -> Vec<(&'static str, Option<Lamp>)> {
        let radiance = Spectrum::new(2.0, 3.0, 1.0, 0.5);
        let lamp = |outline, centre: Vec3, axis: Vec3| {
            Some(Lamp::new(outline, centre, Frame::about(axis.normalize()), radiance))
        };
        vec![
            ("rectangle above", lamp(Outline::Rectangle(Vec2::new(0.3, 0.1)), vec3(0.1, 0.2, 0.9), -Vec3::Z)),
            ("disc aside", lamp(Outline::Disc(0.15), vec3(0.5, -0.3, 0.6), vec3(-0.5, 0.3, -0.6))),
            ("large near rectangle", lamp(Outline::Rectangle(Vec2::ONE), vec3(0.0, 0.0, 0.4), vec3(0.2, 0.1, -1.0))),
        ]
    }
}
