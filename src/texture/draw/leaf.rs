//! A leaf drawn from a recipe. What is painted is pigment: every place gets a chlorophyll content, and the leaf model turns
//! it into colour, so that what the texture reflects, transmits and sends back in the near infrared belongs together.
//! Relief is written apart, as height: no shading is painted in.

use super::canvas::Canvas;
use super::cells::{Cells, unit};
use super::shape::{Margin, Shape};
use super::veins::{self, Segment, Veins};
use super::{Drawn, Grey};
use crate::error::{Error, Result};
use crate::geometry::outline::{MARGIN, Outline};
use crate::math::{Vec2, Vec3, lerp, smoothstep, vec2};
use crate::optics::{LeafOptics, Pigments};
use crate::sampling::rng::{Purpose, Stream, mix};
use crate::sampling::vary::{Count, Fraction, NonNegative, Num, Positive, PositiveCount};
use crate::texture::noise::Tiling;
use crate::texture::srgb::ColorSpace;
use serde::{Deserialize, Serialize};

/// A leaf to draw.
///
/// ```
/// use furrow::texture::draw::LeafRecipe;
/// let recipe: LeafRecipe = ron::from_str("(
///     seed: 3, size: 256, length_mm: 60, aspect: 0.6,
///     outline: Power(a: 0.55, b: 1.0),
///     veins: Pinnate(pairs: 7, angle_deg: 55, midrib: 0.03, fine: 300),
///     pigments: (chlorophyll: 45),
/// )").unwrap();
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LeafRecipe {
    /// What all randomness flows from.
    pub seed: Num<Count>,
    /// Height of the image, pixels.
    pub size: Num<PositiveCount>,
    /// Length of the blade, mm: sets the size of its areoles and spots.
    pub length_mm: Num<Positive>,
    /// Width over length.
    pub aspect: Num<Positive>,
    /// The outline; the species' page names the same.
    pub outline: Outline,
    /// Teeth or lobes.
    #[serde(default)]
    pub margin: Margin,
    /// Depth of a notch in the tip, of the length.
    #[serde(default)]
    pub notch: Option<Num<Fraction>>,
    /// The veins.
    pub veins: Veins,
    /// The blade's pigments.
    pub pigments: Pigments,
    /// What varies over the blade.
    #[serde(default)]
    pub look: Look,
    /// Relief; without it no height is drawn.
    #[serde(default)]
    pub relief: Option<Relief>,
}

/// What varies over a blade. Shares are of the blade's chlorophyll unless stated.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Look {
    /// Chlorophyll left in the midrib, in secondaries and in finer veins.
    pub veins: (Num<Fraction>, Num<Fraction>, Num<Fraction>),
    /// Areoles, the cells between the finest veins: their size in mm, and how pale their borders are.
    pub areoles: (Num<Positive>, Num<Fraction>),
    /// Mottling between veins.
    pub mottle: Num<Fraction>,
    /// Chlorophyll lost at the very margin.
    pub pale_margin: Num<Fraction>,
    /// Chlorophyll lost at the base (young tissue grows there); negative values are not needed: the tip is the reference.
    pub pale_base: Num<Fraction>,
    /// Share of red (anthocyanin) tissue along margin and midrib foot.
    pub red: Num<Fraction>,
    /// Cover of white meal (bladder hairs), densest at the base.
    pub meal: Num<Fraction>,
    /// Mean number of yellowish blotches.
    pub blotches: Num<NonNegative>,
    /// Mean number of small brown spots.
    pub spots: Num<NonNegative>,
    /// Specks finer than an areole.
    pub speckle: Num<Fraction>,
}

impl Default for Look {
    fn default() -> Self {
        let f = Num::new;
        Self {
            veins: (f(0.2), f(0.5), f(0.78)),
            areoles: (Num::new(1.6), f(0.14)),
            mottle: f(0.12),
            pale_margin: f(0.2),
            pale_base: f(0.1),
            red: f(0.0),
            meal: f(0.0),
            blotches: Num::new(0.0),
            spots: Num::new(0.0),
            speckle: f(0.03),
        }
    }
}

/// Relief of the upper side, mm.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Relief {
    /// Height that white stands for; all the rest must fit in.
    pub range_mm: Num<Positive>,
    /// Depth of the furrow over the midrib; secondaries lie at half, finer veins at a fifth of it.
    pub furrow_mm: Num<NonNegative>,
    /// Height of the blisters between veins.
    pub blister_mm: Num<NonNegative>,
}

/// Draws the leaf.
pub(super) fn draw(recipe: &LeafRecipe) -> Result<Drawn> {
    if let Outline::Power { a, b } = recipe.outline
        && !(a > 0.0 && b > 0.0 && a < 20.0 && b < 20.0)
    {
        return Err(Error::Scene(format!("outline Power(a: {a}, b: {b}): both must be above 0 and below 20")));
    }
    let height = recipe.size.get() as usize;
    let width = (height as f64 * recipe.aspect.get()).round().max(1.0) as usize;
    if height.max(width) > 4096 {
        return Err(Error::Scene(format!("a leaf of {width} × {height} pixels: at most 4096 can be drawn")));
    }
    Ok(Painter::new(recipe, width, height).paint())
}

/// Everything drawn before the pigments are.
struct Painter<'a> {
    recipe: &'a LeafRecipe,
    width: usize,
    height: usize,
    shape: Shape,
    stream: Stream,
    /// Pixels in the leaf's length.
    scale: f32,
    /// How much of a vein is seen at each pixel, by order.
    veins: [Canvas; 3],
    /// Distance to the margin, mm.
    to_margin: Canvas,
}

impl<'a> Painter<'a> {
    fn new(recipe: &'a LeafRecipe, width: usize, height: usize) -> Self {
        let seed = recipe.seed.get() as u64;
        let stream = Stream::of(seed, 0, Purpose::Texture, 0);
        let notch = recipe.notch.map_or(0.0, Num::f32);
        let shape = Shape::new(recipe.outline, recipe.aspect, recipe.margin, notch, seed);
        let scale = height as f32 / (1.0 + 2.0 * MARGIN);
        let lobed = matches!(recipe.margin, Margin::Lobed { .. });
        let segments = veins::grow(&recipe.veins, &shape, recipe.aspect.f32(), lobed, &stream);
        let mut painter = Self {
            recipe,
            width,
            height,
            shape,
            stream,
            scale,
            veins: std::array::from_fn(|_| Canvas::new(width, height, 0.0)),
            to_margin: Canvas::new(0, 0, 0.0),
        };
        painter.ink(&segments);
        let mut outside = Canvas::new(width, height, 0.0);
        for y in 0..height {
            for x in 0..width {
                let p = painter.place(x as f32 + 0.5, y as f32 + 0.5);
                outside.values[y * width + x] = f32::from(u8::from(painter.shape.inside(p) < 0.0));
            }
        }
        let mm = recipe.length_mm.f32() / scale;
        painter.to_margin = outside.distance_to(0.5);
        painter.to_margin.values.iter_mut().for_each(|d| *d *= mm);
        painter
    }

    /// The leaf's coordinates (lengths) of a place in the image (pixels).
    fn place(&self, x: f32, y: f32) -> Vec2 {
        vec2((x - 0.5 * self.width as f32) / self.scale, (self.height as f32 - y) / self.scale - MARGIN)
    }

    fn ink(&mut self, segments: &[Segment]) {
        let pixel = |p: Vec2| {
            vec2(p.x * self.scale + 0.5 * self.width as f32, self.height as f32 - (p.y + MARGIN) * self.scale)
        };
        for g in segments {
            let canvas = &mut self.veins[usize::from(g.order) - 1];
            canvas.stroke(pixel(g.from), pixel(g.to), g.radius.0 * self.scale, g.radius.1 * self.scale, 1.0);
        }
    }

    fn paint(&self) -> Drawn {
        let r = self.recipe;
        let (width, height) = (self.width, self.height);
        let optics = LeafOptics::new(&r.pigments);
        let red = LeafOptics::new(&Pigments {
            anthocyanin: Num::new(r.pigments.anthocyanin.get() + 14.0),
            chlorophyll: r.pigments.chlorophyll,
            ..r.pigments
        });
        let brown = Pigments {
            n: Num::new(2.0),
            chlorophyll: Num::new(1.0),
            carotenoid: Num::new(2.0),
            brown: Num::new(1.1),
            water: Num::new(0.004),
            ..r.pigments
        }
        .bands()
        .reflectance
        .0
        .truncate();
        let base = r.pigments.chlorophyll.f32();
        let look = Surface::new(r, &self.stream);
        let mut rgba = vec![0u8; width * height * 4];
        for y in 0..height {
            for x in 0..width {
                let alpha = self.coverage(x, y);
                if alpha == 0 {
                    continue;
                }
                let i = y * width + x;
                let p = self.place(x as f32 + 0.5, y as f32 + 0.5);
                let veins = [self.veins[0].values[i], self.veins[1].values[i], self.veins[2].values[i]];
                let tissue = look.at(p, veins, self.to_margin.values[i], &self.shape);
                let green = optics.with_chlorophyll(base * tissue.chlorophyll).reflectance.0.truncate();
                let reddish = red.with_chlorophyll(base * tissue.chlorophyll).reflectance.0.truncate();
                let mut colour = green.lerp(reddish, tissue.red);
                colour = colour.lerp(brown * tissue.shade, tissue.brown);
                colour = (colour * tissue.shade).lerp(Vec3::new(0.56, 0.57, 0.54), tissue.meal);
                for k in 0..3 {
                    rgba[i * 4 + k] = ColorSpace::Srgb.encode(colour[k]);
                }
                rgba[i * 4 + 3] = alpha;
            }
        }
        let relief = r.relief.map(|relief| self.relief(&relief));
        Drawn { width: width as u32, height: height as u32, rgba, opaque: false, relief }
    }

    /// Opacity of a pixel, 0..255: the share of nine points that lie in the leaf. Where the margin is entire the mesh cuts
    /// the shape, and the image reaches two pixels further, so that its alpha never nibbles at the mesh.
    fn coverage(&self, x: usize, y: usize) -> u8 {
        let entire = matches!(self.recipe.margin, Margin::Entire) && self.recipe.notch.is_none();
        let grow = if entire { 2.2 / self.scale } else { 0.0 };
        let centre = self.shape.inside(self.place(x as f32 + 0.5, y as f32 + 0.5)) + grow;
        let pixel = 1.0 / self.scale;
        if centre.abs() > 4.0 * pixel {
            return if centre > 0.0 { 255 } else { 0 };
        }
        let mut hits = 0;
        for k in 0..16 {
            let at = |i: usize| (i as f32 + 0.5) / 4.0;
            let p = self.place(x as f32 + at(k % 4), y as f32 + at(k / 4));
            hits += u32::from(self.shape.inside(p) + grow > 0.0);
        }
        (hits * 255 / 16) as u8
    }

    /// Heights, half the image's size: relief is smoother than colour.
    fn relief(&self, relief: &Relief) -> Grey {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let mm = self.recipe.length_mm.f32() / self.scale;
        let mut ink = self.veins[0].clone();
        for (v, (a, b)) in ink.values.iter_mut().zip(self.veins[1].values.iter().zip(&self.veins[2].values)) {
            *v = v.max(*a).max(b * 0.9);
        }
        let to_vein = ink.distance_to(0.45);
        let widened = |order: usize, radius: usize| {
            let c = &self.veins[order];
            let size = (c.width, c.height);
            let wrap = crate::texture::Wrap::Clamp;
            let once = crate::texture::maps::blur(&c.values, size, radius, wrap);
            crate::texture::maps::blur(&once, size, radius, wrap)
        };
        let unit = self.scale / 700.0;
        let furrows = [
            widened(0, (4.0 * unit).round() as usize),
            widened(1, (3.0 * unit).round() as usize),
            widened(2, (2.0 * unit).round() as usize),
        ];
        let noise = Tiling::new(self.stream.clone().seed32().into());
        let (furrow, blister) = (relief.furrow_mm.f32(), relief.blister_mm.f32());
        let mut heights = Vec::with_capacity(width * height);
        for y in 0..height {
            for x in 0..width {
                let i = (y * 2).min(self.height - 1) * self.width + (x * 2).min(self.width - 1);
                let p = self.place(x as f32 * 2.0 + 0.5, y as f32 * 2.0 + 0.5);
                let away = to_vein.values[i].min(1e4) * mm / self.recipe.length_mm.f32();
                // Blisters rise from the veins and flatten a fortieth of a length away.
                let dome = 1.0 - (-away * 45.0).exp();
                let swell = 1.0 + 0.35 * noise.fbm(p.x * 14.0 + 100.0, p.y * 14.0 + 100.0, 4096, 3, 0.5);
                let grain = 0.012 * noise.fbm(p.x * 160.0 + 900.0, p.y * 160.0 + 900.0, 4096, 2, 0.5);
                let h = blister * (dome * swell + grain)
                    - furrow * (furrows[0][i] + 0.5 * furrows[1][i] + 0.2 * furrows[2][i]).min(1.0);
                heights.push(h + furrow);
            }
        }
        Grey::from_mm(width as u32, height as u32, &heights, relief.range_mm.f32())
    }
}

/// What a place of the blade is made of.
struct Tissue {
    /// Share of the blade's chlorophyll.
    chlorophyll: f32,
    red: f32,
    brown: f32,
    meal: f32,
    /// A factor on the colour: the epidermis' fine grain.
    shade: f32,
}

struct Surface<'a> {
    look: &'a Look,
    length_mm: f32,
    aspect: f32,
    noise: Tiling,
    areoles: Cells,
    areole: f32,
    blotches: Vec<(Vec2, f32, f32)>,
    spots: Vec<(Vec2, f32, f32)>,
    seed: u64,
}

impl<'a> Surface<'a> {
    fn new(recipe: &'a LeafRecipe, stream: &Stream) -> Self {
        let length_mm = recipe.length_mm.f32();
        let aspect = recipe.aspect.f32();
        let mut s = stream.child(Purpose::Texture, 3);
        let mut marks = |mean: f64, lo: f32, hi: f32| -> Vec<(Vec2, f32, f32)> {
            (0..s.poisson(mean))
                .map(|_| {
                    let p = vec2(s.range32(-0.5, 0.5) * aspect, s.range32(0.05, 0.97));
                    (p, s.range32(lo, hi) / length_mm, s.range32(0.35, 1.0))
                })
                .collect()
        };
        let blotches = marks(recipe.look.blotches.get(), 2.5, 9.0);
        let spots = marks(recipe.look.spots.get(), 0.15, 0.5);
        let seed = s.seed32();
        Self {
            look: &recipe.look,
            length_mm,
            aspect,
            noise: Tiling::new(seed.into()),
            areoles: Cells::new(u64::from(seed) + 1, (8192, 8192), 0.85),
            areole: recipe.look.areoles.0.f32() / length_mm,
            blotches,
            spots,
            seed: u64::from(seed),
        }
    }

    fn at(&self, p: Vec2, veins: [f32; 3], to_margin_mm: f32, shape: &Shape) -> Tissue {
        let look = self.look;
        let far = vec2(64.0, 64.0);
        let noise = |q: Vec2, octaves: u32| self.noise.fbm(q.x, q.y, 8192, octaves, 0.55);
        let across = (p.x.abs() / shape.half_width(p.y).max(1e-4)).min(1.0);

        let mottle = look.mottle.f32();
        let mut c = 1.0 + mottle * 1.4 * noise(p * 5.0 + far, 5) + mottle * 0.55 * noise(p * 55.0 + far * 2.0, 3);
        c *= 1.0 - look.pale_base.f32() * (1.0 - smoothstep(0.0, 0.55, p.y));
        c *= 1.0 - look.pale_margin.f32() * (-to_margin_mm / (0.016 * self.length_mm)).exp();

        // Three generations of areoles, their borders bent by noise: the inner ones are paler lines still.
        let bend = vec2(noise(p * 40.0 + far * 3.0, 2), noise(p * 40.0 + far * 5.0, 2));
        let mut net = 0.0f32;
        for (k, (size, weight)) in [(4.2, 1.35), (1.8, 1.0), (0.75, 0.55)].into_iter().enumerate() {
            let cell = self.areoles.at(p / (self.areole * size) + bend * 0.35 + far * (k + 7) as f32);
            let line = 1.0 - smoothstep(0.02, 0.02 + 0.15 / (size * 0.55_f32).max(1.0), cell.border);
            net = net.max(line * weight);
            c *= 1.0 + mottle * 0.8 * (cell.own - 0.5);
        }
        let fades = 1.0 - 0.35 * across;
        c *= 1.0 - look.areoles.1.f32() * net * fades;
        let mut kept = 1.0f32;
        let keeps = [look.veins.0.f32(), look.veins.1.f32(), look.veins.2.f32()];
        for (order, keep) in keeps.into_iter().enumerate().rev() {
            // The midrib greens toward the tip, where it is thin and the blade lies over it.
            let keep = if order == 0 {
                lerp(keep, 0.62, smoothstep(0.2, 1.0, p.y))
            } else {
                lerp(keep, 0.85, 0.4 * across * across)
            };
            kept = kept.min(1.0 - (1.0 - keep) * veins[order]);
        }
        c *= kept;
        for (q, radius, depth) in &self.blotches {
            let ragged = radius * (1.0 + 0.5 * noise((p - *q) * 30.0 + far * 9.0, 3));
            c *= 1.0 - 0.5 * depth * (1.0 - smoothstep(0.2, 1.0, p.distance(*q) / ragged.max(1e-5)));
        }
        let mut brown = 0.0f32;
        for (q, radius, depth) in &self.spots {
            let d = p.distance(*q) / (radius * (1.0 + 0.4 * noise((p - *q) * 200.0 + far * 11.0, 2))).max(1e-5);
            brown = brown.max(depth * (1.0 - smoothstep(0.6, 1.0, d)));
            c *= 1.0 - 0.35 * (1.0 - smoothstep(0.8, 2.2, d));
        }
        let rim = (-to_margin_mm / (0.010 * self.length_mm)).exp();
        let foot = veins[0] * (1.0 - smoothstep(0.0, 0.45, p.y));
        let red =
            look.red.f32() * (rim + foot).min(1.0) * (0.7 + 0.6 * noise(p * 16.0 + far * 13.0, 3)).clamp(0.0, 1.0);

        let meal = self.meal(p);
        let hash = unit(mix(
            self.seed ^ (u64::from((p.x * 6000.0 + 9e5) as u32) << 32 | u64::from((p.y * 6000.0 + 9e5) as u32))
        ));
        let shade = 1.0 + look.speckle.f32() * (noise(p * 230.0 + far * 17.0, 2) + 0.8 * (hash - 0.5));
        Tissue { chlorophyll: c.max(0.02), red, brown, meal, shade }
    }

    /// Grains of meal: small round bladders, crowded at the base and along the middle.
    fn meal(&self, p: Vec2) -> f32 {
        let cover = self.look.meal.f32();
        if cover == 0.0 {
            return 0.0;
        }
        let size = 0.32 / self.length_mm;
        let across = (p.x.abs() / (0.5 * self.aspect)).min(1.0);
        let place = (1.25 - 1.05 * smoothstep(0.0, 0.8, p.y)) * (1.0 - 0.35 * across);
        let patch = (1.0 + 1.3 * self.noise.fbm(p.x * 9.0 + 31.0, p.y * 9.0 + 77.0, 8192, 4, 0.55)).max(0.0);
        let cell = self.areoles.at(p / size + vec2(501.0, 203.0));
        let grain = smoothstep(0.05, 0.42, cell.border) * smoothstep(0.25, 0.95, cell.own);
        (cover * place * patch * (0.35 + 1.5 * grain)).clamp(0.0, 0.85)
    }
}
