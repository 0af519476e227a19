//! Steps of the ground generation; each changes heights and colours over the whole tile. See [`super::soil`].

use super::generated::{GeneratedTexture, HeightImage};
use super::soil_recipe::{Litter, SoilRecipe};
use super::stamp::Stamp;
use crate::texture::noise::Tiling;
use crate::texture::srgb::ColorSpace;
use furrow_base::math::{RoundTo, ToFloat, ToInt, Vec2, Vec3, lerp, smoothstep, vec2, vec3};
use furrow_base::ron_file::Num;
use furrow_base::sampling::rng::{Purpose, Stream};

/// Changes of the reflectance in R, G, B by one standard deviation of iron oxides and of organic coatings. Crumbs then vary by
/// 1.3 in a* and 2 in b*; photographs of sugar beet fields vary by 1.5 and 2.1 (docs/results/ground.md).
const IRON: Vec3 = vec3(0.035, -0.02, -0.04);
const COATING: Vec3 = vec3(0.0, 0.0, -0.08);
/// Standard deviation of [`Tile::noise`] with two octaves; an estimate.
const NOISE_SD: f32 = 0.3;
/// Colours of loose mineral grains and their fractions: quartz, feldspar, dark minerals.
const GRAINS: [(Vec3, f32); 3] =
    [(vec3(0.42, 0.38, 0.32), 0.6), (vec3(0.40, 0.29, 0.21), 0.25), (vec3(0.09, 0.085, 0.08), 0.15)];

/// Returns factors on the reflectance of soil of another hue, from iron oxides and coatings in standard deviations from the mean.
fn hue(iron: f32, coating: f32) -> Vec3 {
    Vec3::ONE + IRON * iron + COATING * coating
}

/// Ground during generation.
pub(super) struct Tile {
    pub(super) size: usize,
    /// Pixels per millimetre.
    pub(super) scale: f32,
    pub(super) period_mm: f32,
    pub(super) stream: Stream,
    noise: Tiling,
    pub(super) spread: f32,
    /// Heights, mm.
    pub(super) height: Vec<f32>,
    pub(super) colour: Vec<Vec3>,
    pub(super) albedo: Vec3,
}

impl Tile {
    pub(super) fn new(recipe: &SoilRecipe, size: usize) -> Self {
        let stream = Stream::of(recipe.seed.get().trunc_to::<u64>(), 0, Purpose::Texture, 1);
        let period_mm = recipe.period_mm.f32();
        let albedo = Vec3::from(recipe.albedo.map(Num::f32));
        Self {
            size,
            scale: size.to_f32() / period_mm,
            period_mm,
            noise: Tiling::new(stream.child(Purpose::Texture, 1).seed32().into()),
            stream,
            spread: recipe.spread.f32(),
            height: vec![0.0; size * size],
            colour: vec![albedo; size * size],
            albedo,
        }
    }

    /// Returns periodic noise over the tile whose first octave has features of size `mm`.
    pub(super) fn noise(&self, x: f32, y: f32, mm: f32, octaves: u32, layer: u64) -> f32 {
        let period = (self.period_mm / mm).round().max(1.0);
        let k = period / self.size.to_f32();
        let noise = Tiling::new(layer * 7919 + u64::from(self.noise.at(0.5, 0.5, 4).to_bits()));
        noise.fbm(x * k, y * k, period.trunc_to::<u32>(), octaves, 0.55)
    }

    /// Recomputes every pixel: `f` returns height and colour from the position and the pixel index.
    pub(super) fn each(&mut self, mut f: impl FnMut(&Self, f32, f32, usize) -> (f32, Vec3)) {
        let (mut height, mut colour) = (vec![0.0; self.height.len()], vec![Vec3::ZERO; self.colour.len()]);
        for y in 0..self.size {
            for x in 0..self.size {
                let i = y * self.size + x;
                (height[i], colour[i]) = f(self, x.to_f32(), y.to_f32(), i);
            }
        }
        (self.height, self.colour) = (height, colour);
    }

    /// Returns the factors of the hue of grains at a pixel.
    pub(super) fn grain_hue(&self, x: f32, y: f32) -> Vec3 {
        let [iron, coating] = [40, 41].map(|layer| self.noise(x, y, 1.6, 2, layer) / NOISE_SD);
        hue(iron, coating)
    }

    /// Generates the fine earth between crumbs.
    pub(super) fn matrix(&mut self) {
        let albedo = self.albedo;
        self.each(|t, x, y, _| {
            let swell = t.noise(x, y, t.period_mm / 5.0, 5, 1);
            let grain = t.noise(x, y, 2.4, 3, 2);
            let stain = t.noise(x, y, t.period_mm / 6.0, 5, 3);
            let warm = t.noise(x, y, t.period_mm / 9.0, 4, 4);
            let shade = 0.9 * (1.0 + 0.10 * stain + 0.16 * grain);
            (2.6 + 2.4 * swell + 0.5 * grain, albedo * shade * hue(warm, warm))
        });
    }

    /// Applies a stamp; ground that is higher stays.
    pub(super) fn stamp(&mut self, stamp: &Stamp, paint: impl Fn(Vec2, f32, Vec3) -> Vec3, rough: f32) {
        let reach = stamp.axes.max_element().ceil_to::<i32>() + 1;
        let (cx, cy) = (stamp.centre.x.floor_to::<i32>(), stamp.centre.y.floor_to::<i32>());
        let n = self.size.to_i32();
        for y in cy - reach..=cy + reach {
            for x in cx - reach..=cx + reach {
                let offset = vec2(x.to_f32() + 0.5, y.to_f32() + 0.5) - stamp.centre;
                let Some(h) = stamp.at(offset) else { continue };
                let i = y.rem_euclid(n).to_usize() * self.size + x.rem_euclid(n).to_usize();
                let bump = if rough > 0.0 {
                    1.0 + rough * self.noise.at(x.to_f32() * 0.37 + 7.0, y.to_f32() * 0.37, 65536)
                } else {
                    1.0
                };
                let top = stamp.bottom + stamp.dome * h * bump;
                if top > self.height[i] {
                    self.height[i] = top;
                    self.colour[i] = paint(offset, h, self.colour[i]);
                }
            }
        }
    }

    pub(super) fn surface(&self, p: Vec2) -> f32 {
        let n = self.size;
        self.height[p.y.trunc_to::<usize>().min(n - 1) * n + p.x.trunc_to::<usize>().min(n - 1)]
    }

    pub(super) fn somewhere(&self, s: &mut Stream) -> Vec2 {
        vec2(s.range32(0.0, self.size.to_f32()), s.range32(0.0, self.size.to_f32()))
    }

    /// Samples sizes from the power law until their areas cover the fraction `cover` of the ground; returned from large
    /// to small.
    pub(super) fn sizes(&self, cover: f32, low: f32, high: f32, power: f32, s: &mut Stream) -> Vec<f32> {
        let mut left = cover * self.period_mm * self.period_mm;
        let cut = (low / high).powf(power);
        let mut sizes = Vec::new();
        while left > 0.0 {
            let l = low * (1.0 - s.uniform32() * (1.0 - cut)).powf(-1.0 / power);
            left -= std::f32::consts::FRAC_PI_4 * 0.77 * l * l;
            sizes.push(l);
        }
        sizes.sort_by(|a, b| b.total_cmp(a));
        sizes
    }

    pub(super) fn crumbs(&mut self, recipe: &SoilRecipe) {
        let c = &recipe.crumbs;
        let mut s = self.stream.child(Purpose::Texture, 2);
        let ground = self.height.clone();
        let n = self.size;
        for l in self.sizes(c.cover.f32().min(4.0), c.smallest_mm.f32(), c.largest_mm.f32(), c.power.f32(), &mut s) {
            let centre = self.somewhere(&mut s);
            let dome = 0.55 * l * s.range32(0.75, 1.05);
            let sunk = dome * s.range32(0.25, 0.5);
            let earth = ground[centre.y.trunc_to::<usize>().min(n - 1) * n + centre.x.trunc_to::<usize>().min(n - 1)];
            // Small crumbs settle in gaps more often than on top of large ones.
            let bottom = lerp(earth, self.surface(centre), s.range32(0.1, 0.45)) - sunk;
            let axes = vec2(0.5, 0.5 * s.range32(0.66, 0.9)) * l * self.scale;
            let axes = axes.max(Vec2::splat(0.6));
            let stamp = Stamp::new(centre, axes, bottom, dome, s.range32(0.2, 0.9), &mut s);
            // Crumbs vary in brightness: some broke from deeper, moister soil.
            let bright = (f64::from(self.spread) * s.normal()).exp().to_f32() * 1.03;
            let own = self.albedo * bright * hue(s.normal().to_f32(), s.normal().to_f32());
            self.stamp(&stamp, |_, h, _| own * (0.97 + 0.06 * h), (0.05 * l).clamp(0.10, 0.18));
        }
    }

    /// Brightens raised parts, as dry dust does, and darkens gaps, as moisture does.
    pub(super) fn dust(&mut self) {
        let mean = self.height.iter().sum::<f32>() / self.height.len().to_f32();
        let soft = crate::texture::maps::blur(
            &self.height,
            (self.size, self.size),
            (4.0 * self.scale).trunc_to::<usize>(),
            crate::texture::Wrap::Repeat,
        );
        self.each(|t, x, y, i| {
            let stands = ((t.height[i] - soft[i]) * 0.5).clamp(-1.0, 1.0);
            let high = ((t.height[i] - mean) * 0.15).clamp(-1.0, 1.0);
            let fine = t.noise(x, y, 1.4, 2, 5);
            (t.height[i], t.colour[i] * (1.0 + 0.10 * stands + 0.06 * high + 0.06 * fine) * t.grain_hue(x, y))
        });
    }

    pub(super) fn litter(&mut self, litter: &Litter) {
        let mut s = self.stream.child(Purpose::Texture, 4);
        let area = f64::from(self.period_mm * self.period_mm) * 1e-6;
        for _ in 0..s.poisson(litter.grains.get() * area) {
            let mut pick = s.uniform32();
            let kind = GRAINS.into_iter().find(|(_, share)| {
                pick -= share;
                pick < 0.0
            });
            let mineral = kind.unwrap_or(GRAINS[0]).0 * s.range32(0.75, 1.35);
            self.bit(s.range32(0.5, 1.5), 0.9, mineral, &mut s);
        }
        for _ in 0..s.poisson(litter.humus.get() * area) {
            let dark = vec3(0.075, 0.048, 0.030).lerp(vec3(0.20, 0.085, 0.040), s.uniform32().powi(2));
            let length = 0.8 * (1.0 - s.uniform32()).powf(-0.55);
            self.bit(length.min(7.0), s.range32(0.25, 0.6), dark * s.range32(0.8, 1.3), &mut s);
        }
        for _ in 0..s.poisson(litter.fibres.get() * area) {
            let straw = vec3(0.38, 0.30, 0.17).lerp(vec3(0.22, 0.15, 0.09), s.uniform32()) * s.range32(0.8, 1.25);
            self.fibre(s.range32(3.0, 16.0), s.range32(0.35, 0.8), straw, &mut s);
        }
    }

    fn bit(&mut self, length: f32, slim: f32, colour: Vec3, s: &mut Stream) {
        let centre = self.somewhere(s);
        let axes = (vec2(0.5, 0.5 * slim) * length * self.scale).max(Vec2::splat(0.75));
        let dome = 0.35 * length * slim;
        let stamp = Stamp::new(centre, axes, self.surface(centre) - 0.2 * dome, dome + 0.15, 0.8, s);
        self.stamp(&stamp, |_, h, under| under.lerp(colour, smoothstep(0.0, 0.35, h)), 0.0);
    }

    /// Adds a thin, slightly bent fibre on the ground.
    fn fibre(&mut self, length: f32, width: f32, colour: Vec3, s: &mut Stream) {
        let mut p = self.somewhere(s);
        let (mut heading, bend) = (s.range32(0.0, std::f32::consts::TAU), s.range32(-0.06, 0.06));
        let steps = (length * self.scale / 0.5).trunc_to::<usize>();
        let n = self.size.to_f32();
        for k in 0..steps {
            let ends = smoothstep(0.0, 0.15, k.to_f32() / steps.to_f32())
                * (1.0 - smoothstep(0.85, 1.0, k.to_f32() / steps.to_f32()));
            let radius = (0.5 * width * self.scale * lerp(0.5, 1.0, ends)).max(0.62);
            let q = vec2(p.x.rem_euclid(n), p.y.rem_euclid(n));
            let stamp = Stamp {
                centre: q,
                axes: Vec2::splat(radius),
                turn: vec2(1.0, 0.0),
                bottom: self.surface(q) - 0.02,
                dome: 0.12,
                facets: [(Vec2::ZERO, 0.0, 9.0); 6],
                sharp: 0.0,
            };
            self.stamp(&stamp, |_, h, under| under.lerp(colour, smoothstep(0.0, 0.6, h)), 0.0);
            heading += bend * 0.25 + s.range32(-0.05, 0.05);
            p += vec2(heading.cos(), heading.sin()) * 0.5;
        }
    }

    pub(super) fn stones(&mut self, cover: f32, low: f32, high: f32) {
        // Rock colours and their fractions: grey limestone, ochre, reddish sandstone, slate, flint, quartz.
        let kinds = [
            (vec3(0.29, 0.25, 0.20), 0.32),
            (vec3(0.29, 0.215, 0.135), 0.24),
            (vec3(0.26, 0.165, 0.115), 0.14),
            (vec3(0.19, 0.18, 0.165), 0.14),
            (vec3(0.11, 0.10, 0.095), 0.08),
            (vec3(0.42, 0.385, 0.33), 0.08),
        ];
        let mut s = self.stream.child(Purpose::Texture, 5);
        for l in self.sizes(cover, low, high, 2.2, &mut s) {
            let centre = self.somewhere(&mut s);
            let mut pick = s.uniform32();
            let (mut rock, mut index) = (kinds[0].0, 0);
            for (k, (colour, share)) in kinds.into_iter().enumerate() {
                if pick >= 0.0 {
                    (rock, index) = (colour, k);
                }
                pick -= share;
            }
            let rock = rock * (0.16 * s.normal()).exp().to_f32();
            let axes = (vec2(0.5, 0.5 * s.range32(0.6, 0.92)) * l * self.scale).max(Vec2::splat(0.8));
            let dome = 0.5 * l * s.range32(0.6, 0.9);
            let bottom = self.surface(centre).min(4.5) - dome * s.range32(0.2, 0.5);
            let sharp = if index >= 3 { s.range32(0.5, 0.9) } else { s.range32(0.0, 0.6) };
            let stamp = Stamp::new(centre, axes, bottom, dome, sharp, &mut s);
            let (noise, soil) = (self.noise, self.albedo);
            let (vein, shift) = (s.range32(0.0, 1.0), s.range32(0.0, 900.0));
            let turn = stamp.turn;
            let scale = self.scale;
            let paint = move |offset: Vec2, h: f32, _: Vec3| {
                let q = offset / scale + shift;
                let fleck = noise.fbm(q.x * 1.1, q.y * 1.1, 65536, 3, 0.6);
                // Some stones are banded.
                let band = if vein > 0.7 {
                    (offset.dot(turn) / scale * 1.3 + 2.0 * noise.at(q.x * 0.3, q.y * 0.3, 65536)).sin()
                } else {
                    0.0
                };
                let cloud = noise.fbm(q.x * 0.25, q.y * 0.25, 65536, 3, 0.5);
                let bare = rock * (1.0 + 0.16 * fleck + 0.08 * band + 0.12 * cloud);
                // Soil sticks to the foot of a stone, dust to its hollows.
                let dust = (1.0 - smoothstep(0.05, 0.5, h)).max(0.5 * smoothstep(0.1, 0.5, cloud));
                bare.lerp(soil, 0.65 * dust)
            };
            self.stamp(&stamp, paint, 0.02);
        }
    }

    /// Scales the colours so that their mean is the soil's albedo.
    pub(super) fn balance(&mut self, albedo: Vec3) {
        let sum = self
            .colour
            .iter()
            .fold([0.0f64; 3], |s, c| [s[0] + f64::from(c.x), s[1] + f64::from(c.y), s[2] + f64::from(c.z)]);
        let n = self.colour.len().to_f64();
        let mean = Vec3::from(sum.map(|s| (s / n).to_f32()));
        let factor = albedo / mean.max(Vec3::splat(1e-4));
        self.colour.iter_mut().for_each(|c| *c *= factor);
    }

    pub(super) fn finish(self, range_mm: f32) -> GeneratedTexture {
        let n = self.size.to_u32();
        let rgba = self
            .colour
            .iter()
            .flat_map(|c| {
                let code = |v: f32| ColorSpace::Srgb.encode(v.clamp(0.0, 0.9));
                [code(c.x), code(c.y), code(c.z), 255]
            })
            .collect();
        let relief = Some(HeightImage::from_mm(n, n, &self.height, range_mm));
        GeneratedTexture { width: n, height: n, rgba, opaque: true, relief }
    }
}
