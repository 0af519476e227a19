//! Large-scale shape of the ground: tilt, the profile along seed rows, and fractional Brownian motion.
//!
//! Tilled soil is a single-scale surface with self-affine roughness on top (Davidson et al. 2000). Octaves of Perlin
//! noise from the longest wavelength down, each with 2^−H times the amplitude of the one before, give both.

use super::record::{ReliefRecord, RowReliefRecord};
use super::tool::Tool;
use super::wheel::Wheel;
use super::{ReliefDesc, Site};
use furrow_base::math::{RoundTo, ToFloat, ToInt, Vec2, smoothstep, vec2};
use furrow_base::sampling::{Purpose, Stream};
use furrow_optics::texture::noise::Perlin;

/// Standard deviation of one octave of [`Perlin::at2`] over the plane; a test checks it.
const PERLIN_SD: f32 = 0.43;

/// Limits of the noise, in standard deviations, that 1–2 % of a ground's points exceed: on open ground, in furrows (a
/// tenth of the ground) and in wheel tracks (where the noise is pressed flat). The percentage refers to the whole
/// ground in each case.
const EXTREME: f32 = 2.5;
const EXTREME_IN_FURROW: f32 = 1.3;
const EXTREME_IN_TRACK: f32 = 0.4;
/// Ratio of a furrow's depth at its deep places to the requested depth, and ratio of its shoulders' height to its
/// depth.
const DEEP: f32 = 1.25;
const SHOULDER: f32 = 0.2;

/// Wavelength below which rain smooths the relief, metres.
const SLAKED_M: f32 = 0.05;

/// Shortest wavelength that contributes to the height, so that the requested height means the same at every grid
/// spacing.
const SHORTEST_M: f32 = 0.001;

/// Relief of one ground.
#[derive(Clone, Debug)]
pub(super) struct Relief {
    noise: Perlin,
    amplitude: f32,
    gain: f32,
    longest: f32,
    tilt: Vec2,
    /// Distance from the origin up to which it is tilted, metres; level beyond.
    level_m: f32,
    rows: Option<Rows>,
    wheels: Vec<Wheel>,
    tools: Vec<Tool>,
    /// Effect of rain since the last tillage, 0..1.
    slaked: f32,
    /// Record of the drawn parameters.
    pub(super) record: ReliefRecord,
}

#[derive(Clone, Debug)]
struct Rows {
    across: Vec2,
    offset: f32,
    spacing: f32,
    depth: f32,
    half_width: f32,
    ridge: f32,
    /// Fraction of roughness and clods that is pressed flat in the furrow.
    pressed: f32,
    /// Factor on the wandering of the edges: 1, or 0 to test the profile.
    wander: f32,
}

/// Position relative to the nearest seed row.
#[derive(Clone, Copy)]
struct Aside {
    /// Distance from its line, metres.
    distance: f32,
    /// Degree to which the press wheel has pressed the ground: 1 on the furrow's floor, 0 outside.
    print: f32,
}

impl Relief {
    /// Draws the relief of a ground; `slaked` is the effect of rain since the last tillage, 0..1.
    pub(super) fn new(desc: &ReliefDesc, slaked: f32, Site { rows, level_m, .. }: Site, stream: &Stream) -> Self {
        let child = |k| stream.child(Purpose::Soil, k);
        let hurst = desc.hurst.draw32(&mut child(1));
        let gain = 2f32.powf(-hurst);
        let longest = desc.longest_m.draw32(&mut child(2));
        let octaves = (longest / SHORTEST_M).log2().max(0.0).trunc_to::<i32>() + 1;
        let energy: f32 = (0..octaves).map(|k| gain.powi(2 * k)).sum();
        let mut side = child(3);
        let tilt_deg = desc.tilt_deg.draw32(&mut side);
        let tilt = Vec2::from_angle(side.range32(0.0, std::f32::consts::TAU)) * tilt_deg.to_radians().tan();
        let rms_mm = desc.rms_mm.draw32(&mut child(4));
        let seeded = rows.filter(|r| r.spacing_m > 0.0);
        let row = seeded.map(|_| RowReliefRecord {
            depth_mm: desc.row.depth_mm.draw32(&mut child(5)),
            width_mm: desc.row.width_mm.draw32(&mut child(6)),
            ridge_mm: desc.row.ridge_mm.draw32(&mut child(7)),
            pressed: desc.row.pressed.draw32(&mut child(8)),
        });
        let (across, offset) = rows.map_or((Vec2::X, 0.0), |r| (vec2(r.azimuth.cos(), -r.azimuth.sin()), r.offset_m));
        let wheels: Vec<Wheel> = (desc.wheels.iter().enumerate())
            .map(|(k, wheel)| Wheel::draw(wheel, across, offset, &mut child(50 + k.to_u64())))
            .collect();
        let tools: Vec<Tool> = (desc.tools.iter().enumerate())
            .map(|(k, tool)| Tool::draw(tool, across, &mut child(80 + k.to_u64())))
            .collect();
        Self {
            noise: Perlin::new(child(0).seed32()),
            amplitude: rms_mm * 1e-3 / (PERLIN_SD * energy.sqrt()),
            gain,
            longest,
            tilt,
            level_m,
            rows: seeded.zip(row.as_ref()).map(|(r, row)| Rows {
                across: vec2(r.azimuth.cos(), -r.azimuth.sin()),
                offset: r.offset_m,
                spacing: r.spacing_m,
                depth: row.depth_mm * 1e-3,
                half_width: row.width_mm * 0.5e-3,
                wander: 1.0,
                ridge: row.ridge_mm * 1e-3,
                pressed: row.pressed,
            }),
            record: ReliefRecord {
                rms_mm,
                hurst,
                longest_m: longest,
                tilt_deg,
                tilt_azimuth_deg: tilt.x.atan2(tilt.y).to_degrees().rem_euclid(360.0),
                wheels: wheels.iter().map(Wheel::record).collect(),
                tools: tools.iter().map(Tool::record).collect(),
                row,
            },
            wheels,
            tools,
            slaked,
        }
    }

    /// Returns the slope towards the east and the north.
    pub(super) fn tilt(&self) -> Vec2 {
        self.tilt
    }

    /// Returns the depth below and the height above the tilted plane through the world's origin, metres, that 1–2 % of
    /// the points exceed.
    pub(super) fn departs(&self) -> (f32, f32) {
        let sd = 1e-3 * self.record.rms_mm;
        let (mut below, mut above) = (EXTREME * sd, EXTREME * sd);
        if let Some(rows) = &self.rows {
            below = below.max(DEEP * rows.depth + EXTREME_IN_FURROW * sd);
            let shoulder = SHOULDER * rows.depth + EXTREME_IN_FURROW * sd;
            above = above.max(shoulder) + rows.ridge;
        }
        for (groove, ridge) in self.tools.iter().map(Tool::departs) {
            below += groove;
            above += ridge;
        }
        for (track, rim) in self.wheels.iter().map(Wheel::departs) {
            below = below.max(track + EXTREME_IN_TRACK * sd);
            above = above.max(rim + EXTREME * sd);
        }
        (below, above)
    }

    /// Returns the height at `p`, without wavelengths shorter than two cells.
    pub(super) fn height(&self, p: Vec2, cell: f32) -> f32 {
        let tracks: f32 = self.wheels.iter().map(|w| w.height(p)).sum();
        let tilted = p * (self.level_m / p.length().max(f32::MIN_POSITIVE)).min(1.0);
        let aside = self.rows.as_ref().map(|rows| (rows, self.aside(rows, p)));
        let tools: f32 = self.tools.iter().map(|tool| tool.height(p, cell)).sum();
        let flat = aside.map_or(1.0, |(rows, aside)| 1.0 - rows.pressed * aside.print);
        let rough = self.tools.iter().map(Tool::left).product::<f32>() * self.fbm(p, cell) + tools;
        let row = aside.map_or(0.0, |(rows, aside)| self.row(rows, aside, p));
        self.tilt.dot(tilted) + self.wheels_left(p) * (flat * rough + row) + tracks
    }

    /// Returns the fraction of roughness and clods that wheels, press wheels and tools have left.
    pub(super) fn left(&self, p: Vec2) -> f32 {
        let pressed = self.rows.as_ref().filter(|rows| rows.pressed > 0.0);
        let row = pressed.map_or(1.0, |rows| 1.0 - rows.pressed * self.aside(rows, p).print);
        self.wheels_left(p) * row * self.tools.iter().map(Tool::left).product::<f32>()
    }

    fn wheels_left(&self, p: Vec2) -> f32 {
        self.wheels.iter().map(|w| w.left(p)).product()
    }

    fn fbm(&self, p: Vec2, cell: f32) -> f32 {
        let shortest = (2.0 * cell).max(SHORTEST_M);
        let (mut sum, mut amplitude, mut wavelength, mut shift) = (0.0, self.amplitude, self.longest, 0.31);
        while wavelength >= shortest {
            let at = |c: f32, by: f64| f64::from(c) / f64::from(wavelength) + by;
            let kept = 1.0 - self.slaked * (-wavelength / SLAKED_M).exp();
            sum += amplitude * kept * self.noise.at2(at(p.x, shift), at(p.y, -shift)).to_f32();
            amplitude *= self.gain;
            wavelength *= 0.5;
            shift += 17.31;
        }
        sum
    }

    /// Returns noise of the wavelength at a point, by which rows wander.
    fn wander(&self, p: Vec2, wavelength: f32, shift: f64) -> f32 {
        let at = |c: f32, by: f64| f64::from(c / wavelength) + by;
        self.noise.at2(at(p.x, shift), at(p.y, -shift)).to_f32()
    }

    fn aside(&self, rows: &Rows, p: Vec2) -> Aside {
        // The edges wander by a few millimetres.
        let wander = 0.012 * self.wander(p, 0.07, 201.7) + 0.006 * self.wander(p, 0.025, 307.1);
        let d = (p.dot(rows.across) - rows.offset + rows.wander * wander) / rows.spacing;
        let distance = (d - d.round()).abs() * rows.spacing;
        // Imprint of the press wheel: a flat floor with soft shoulders.
        Aside { distance, print: 1.0 - smoothstep(0.1 * rows.half_width, 1.1 * rows.half_width, distance) }
    }

    fn row(&self, rows: &Rows, Aside { distance, print }: Aside, p: Vec2) -> f32 {
        // A little soil is pushed up beside the furrow.
        let shoulder = (-((distance - 1.3 * rows.half_width) / (0.4 * rows.half_width)).powi(2)).exp();
        let ridge = 0.5 + 0.5 * (std::f32::consts::TAU * distance / rows.spacing).cos();
        // The depth varies along the row.
        let depth = rows.depth * (1.0 + 0.5 * rows.wander * self.wander(p, 0.15, 401.3));
        depth * (SHOULDER * shoulder - print) + rows.ridge * ridge
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::soil::{Rect, RowReliefDesc, SeedRows};
    use furrow_base::ron_file::Vary;

    fn desc(rms_mm: f64) -> ReliefDesc {
        ReliefDesc {
            rms_mm: Vary::fixed(rms_mm),
            hurst: Vary::fixed(0.7),
            tilt_deg: Vary::fixed(0.0),
            row: RowReliefDesc { depth_mm: Vary::fixed(10.0), ..RowReliefDesc::default() },
            ..ReliefDesc::default()
        }
    }

    fn site(rows: Option<SeedRows>) -> Site {
        let area = Rect::new(0.0, 0.0, 1.0, 1.0);
        Site { area, grid_m: 0.001, margin_m: 0.0, growth: 1.3, level_m: f32::INFINITY, smallest_mm: 0.0, rows }
    }

    #[test]
    fn rms_height_is_the_one_asked_for() {
        for (seed, rms) in [(1, 4.0), (2, 9.0), (3, 30.0)] {
            let relief = Relief::new(&desc(rms), 0.0, site(None), &Stream::of(seed, 0, Purpose::Test, 0));
            let heights: Vec<f32> = (0..40_000)
                .map(|k| relief.height(vec2((k % 200).to_f32() * 0.0437, (k / 200).to_f32() * 0.0391), 0.0005))
                .collect();
            let mean = heights.iter().sum::<f32>() / heights.len().to_f32();
            let sd = (heights.iter().map(|h| (h - mean).powi(2)).sum::<f32>() / heights.len().to_f32()).sqrt();
            assert!((sd * 1e3 / rms.to_f32() - 1.0).abs() < 0.06, "{} mm for {rms}", sd * 1e3);
        }
    }

    #[test]
    fn the_seed_row_lies_deeper_than_its_shoulders() {
        let rows = SeedRows { spacing_m: 0.5, azimuth: 0.3, offset_m: 0.1 };
        let mut relief = Relief::new(&desc(0.0), 0.0, site(Some(rows)), &Stream::of(1, 0, Purpose::Test, 0));
        relief.rows.iter_mut().for_each(|r| r.wander = 0.0);
        let across = vec2(rows.azimuth.cos(), -rows.azimuth.sin());
        for row in -3..3 {
            let centre = across * (rows.offset_m + row.to_f32() * rows.spacing_m);
            assert!((relief.height(centre, 0.001) + 0.010).abs() < 1e-4);
            assert!(relief.height(centre + across * 0.06, 0.001) > -0.001);
            assert!(relief.height(centre + across * 0.25, 0.001).abs() < 1e-4);
        }
    }
}
