//! Leaf textures generated from a recipe.
//!
//! The generator paints pigments: every pixel gets a chlorophyll content, and the leaf model converts it to colour. The
//! reflected, transmitted and near-infrared light of the texture are therefore consistent. Relief is a separate height
//! map; no shading is painted in.

use super::canvas::Canvas;
use super::cells::{Cells, MOST_CELLS};
use super::generated::{GeneratedTexture, HeightImage};
use super::leaf_recipe::{LeafRecipe, LeafRelief};
use super::lyrate::{self, Lyrate};
use super::shape::{Margin, Shape};
use super::tissue::Surface;
use super::veins::{self, Segment, Veins};
use crate::optics::{LeafOptics, Pigments};
use crate::texture::noise::Tiling;
use crate::texture::srgb::ColorSpace;
use furrow_base::error::{Error, Result};
use furrow_base::geometry::outline::{MARGIN, Outline};
use furrow_base::math::{RoundTo, ToFloat, ToInt, Vec2, Vec3, lerp, smoothstep, vec2};
use furrow_base::ron_file::Num;
use furrow_base::sampling::rng::{Purpose, Stream};

/// Largest number of teeth or lobes on a side, including teeth on lobes.
const MOST_CUTS: f64 = 200.0;

/// Generates the leaf texture.
pub(super) fn draw(recipe: &LeafRecipe) -> Result<GeneratedTexture> {
    if let Outline::Power { a, b } = recipe.outline
        && !(a > 0.0 && b > 0.0 && a < 20.0 && b < 20.0)
    {
        return Err(Error::input(format!("outline Power(a: {a}, b: {b}): both must be above 0 and below 20")));
    }
    let height = recipe.size.get().trunc_to::<usize>();
    let width = (height.to_f64() * recipe.aspect.get()).round().max(1.0).trunc_to::<usize>();
    if height.max(width) > 4096 {
        return Err(Error::input(format!("a leaf of {width} × {height} pixels: at most 4096 are supported")));
    }
    let (pairs, fine) = match recipe.veins {
        Veins::Pinnate { pairs, fine, .. } => (pairs.get(), fine.get()),
        Veins::Parallel { count, .. } => (count.get(), 0.0),
    };
    let cuts = match recipe.margin {
        Margin::Entire => 0.0,
        Margin::Toothed { count, .. } => count.get(),
        Margin::Lobed(plan) => plan.pairs.get(),
        Margin::Spined { lobes, .. } => lobes.get(),
        Margin::Lyrate(plan) => plan.pairs.get().max(plan.teeth.0.get()),
    };
    let (toothed, most_toothed) = match recipe.margin {
        Margin::Lyrate(Lyrate { pairs, lobe_teeth: Some((teeth, _)), .. }) => {
            (pairs.get(), (MOST_CUTS / (1.0 + 2.0 * teeth.get().min(lyrate::MOST_TEETH))).floor())
        }
        _ => (0.0, MOST_CUTS),
    };
    let longest = recipe.length_mm.get() * recipe.aspect.get().max(1.0);
    let marks = recipe.look.blotches.get().max(recipe.look.spots.get());
    for (what, asked, most) in [
        ("veins on a side", pairs, 200.0),
        ("points for fine veins", fine, 20_000.0),
        ("teeth or lobes on a side", cuts, MOST_CUTS),
        ("pairs of lobes with that many teeth", toothed, most_toothed),
        ("mm of length or width", longest, 1e5),
        ("areoles along the blade", longest / recipe.look.areoles.0.get(), MOST_CELLS),
        ("blotches or spots", marks, 2000.0),
    ] {
        if asked > most {
            return Err(Error::input(format!("{asked} {what}: at most {most} are supported")));
        }
    }
    Ok(LeafPainter::new(recipe, width, height).paint())
}

/// Geometry of the leaf, computed before its pigments.
struct LeafPainter<'a> {
    recipe: &'a LeafRecipe,
    width: usize,
    height: usize,
    shape: Shape,
    stream: Stream,
    /// Length of the leaf in pixels.
    scale: f32,
    /// Visibility of veins at each pixel, by vein order.
    veins: [Canvas; 3],
    /// Distance to the margin, mm.
    to_margin: Canvas,
}

impl<'a> LeafPainter<'a> {
    fn new(recipe: &'a LeafRecipe, width: usize, height: usize) -> Self {
        let seed = recipe.seed.get().trunc_to::<u64>();
        let stream = Stream::of(seed, 0, Purpose::Texture, 0);
        let notch = recipe.notch.map_or(0.0, Num::f32);
        let shape = Shape::new(recipe.outline, recipe.aspect, recipe.margin, notch, seed).with_sinus(recipe.sinus);
        let scale = height.to_f32() / (1.0 + 2.0 * MARGIN);

        let segments = veins::grow(&recipe.veins, &shape, recipe.aspect.f32(), recipe.margin, &stream);
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
                let p = painter.place(x.to_f32() + 0.5, y.to_f32() + 0.5);
                outside.values[y * width + x] = f32::from(u8::from(painter.shape.inside(p) < 0.0));
            }
        }
        let mm = recipe.length_mm.f32() / scale;
        painter.to_margin = outside.distance_to(0.5);
        painter.to_margin.values.iter_mut().for_each(|d| *d *= mm);
        painter
    }

    /// Converts an image position (pixels) to leaf coordinates (leaf lengths).
    fn place(&self, x: f32, y: f32) -> Vec2 {
        vec2((x - 0.5 * self.width.to_f32()) / self.scale, (self.height.to_f32() - y) / self.scale - MARGIN)
    }

    fn ink(&mut self, segments: &[Segment]) {
        let pixel = |p: Vec2| {
            vec2(p.x * self.scale + 0.5 * self.width.to_f32(), self.height.to_f32() - (p.y + MARGIN) * self.scale)
        };
        for g in segments {
            let canvas = &mut self.veins[usize::from(g.order) - 1];
            canvas.stroke(pixel(g.from), pixel(g.to), g.radius.0 * self.scale, g.radius.1 * self.scale, 1.0);
        }
    }

    fn paint(&self) -> GeneratedTexture {
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
        let opacity = self.opacity();
        for y in 0..height {
            for x in 0..width {
                let i = y * width + x;
                let alpha = opacity[i];
                if alpha == 0 {
                    continue;
                }
                let p = self.place(x.to_f32() + 0.5, y.to_f32() + 0.5);
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
        GeneratedTexture { width: width.to_u32(), height: height.to_u32(), rgba, opaque: false, relief }
    }

    /// Returns the opacity of each pixel, 0..255: the fraction of sixteen sample points inside the leaf. For an entire
    /// margin the mesh defines the shape, so the image extends two pixels further and its alpha never cuts into the
    /// mesh.
    fn opacity(&self) -> Vec<u8> {
        let pixel = 1.0 / self.scale;
        let mut cover = Canvas::new(self.width, self.height, 0.0);
        for (i, v) in cover.values.iter_mut().enumerate() {
            let (x, y) = ((i % self.width).to_f32(), (i / self.width).to_f32());
            let centre = self.shape.inside(self.place(x + 0.5, y + 0.5));
            *v = if centre.abs() > 6.0 * pixel {
                f32::from(u8::from(centre > 0.0))
            } else {
                let at = |k: usize| (k.to_f32() + 0.5) / 4.0;
                let inside = |k: usize| self.shape.inside(self.place(x + at(k % 4), y + at(k / 4))) > 0.0;
                (0..16).filter(|k| inside(*k)).count().to_f32() / 16.0
            };
        }
        if matches!(self.recipe.margin, Margin::Entire) && self.recipe.notch.is_none() && self.recipe.sinus.is_none() {
            let near = cover.distance_to(0.3);
            for (v, d) in cover.values.iter_mut().zip(near.values) {
                *v = v.max((2.7 - d).clamp(0.0, 1.0));
            }
        }
        cover.values.iter().map(|v| (v * 255.0 + 0.5).trunc_to::<u8>()).collect()
    }

    /// Computes the heights at half the image's size, because relief is smoother than colour.
    fn relief(&self, relief: &LeafRelief) -> HeightImage {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let mm = self.recipe.length_mm.f32() / self.scale;
        let mut ink = self.veins[0].clone();
        for (v, secondary) in ink.values.iter_mut().zip(&self.veins[1].values) {
            *v = v.max(*secondary);
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
            widened(0, (4.0 * unit).round_to::<usize>()),
            widened(1, (3.0 * unit).round_to::<usize>()),
            widened(2, (2.0 * unit).round_to::<usize>()),
        ];
        let noise = Tiling::new(self.stream.clone().seed32().into());
        let cells = Cells::new(u64::from(self.stream.clone().seed32()) + 5, (8192, 8192), 0.8);
        let (furrow, blister) = (relief.furrow_mm.f32(), relief.blister_mm.f32());
        let mut heights = Vec::with_capacity(width * height);
        for y in 0..height {
            for x in 0..width {
                let i = (y * 2).min(self.height - 1) * self.width + (x * 2).min(self.width - 1);
                let p = self.place(x.to_f32() * 2.0 + 0.5, y.to_f32() * 2.0 + 0.5);
                let away = to_vein.values[i].min(1e4) * mm / self.recipe.length_mm.f32();
                // The blade rises from the veins and flattens within a thirtieth of a leaf length. It also has
                // blisters, about a dozen along the leaf.
                let bend = vec2(
                    noise.fbm(p.x * 10.0 + 40.0, p.y * 10.0 + 40.0, 4096, 2, 0.5),
                    noise.fbm(p.x * 10.0 + 70.0, p.y * 10.0 + 40.0, 4096, 2, 0.5),
                );
                let blisters = smoothstep(0.0, 0.42, cells.at(p * 13.0 + bend * 0.4 + vec2(600.0, 600.0)).border);
                let dome = (1.0 - (-away * 30.0).exp()) * lerp(0.45, 1.0, blisters);
                let swell = 1.0 + 0.35 * noise.fbm(p.x * 8.0 + 100.0, p.y * 8.0 + 100.0, 4096, 3, 0.5);
                let grain = 0.010 * noise.fbm(p.x * 160.0 + 900.0, p.y * 160.0 + 900.0, 4096, 2, 0.5);
                let h = blister * (dome * swell + grain)
                    - furrow * (furrows[0][i] + 0.5 * furrows[1][i] + 0.2 * furrows[2][i]).min(1.0);
                heights.push(h + furrow);
            }
        }
        HeightImage::from_mm(width.to_u32(), height.to_u32(), &heights, relief.range_mm.f32())
    }
}
