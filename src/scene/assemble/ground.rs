//! The ground of a field: broken, covered with what lies on it, and laid as parts.

use super::builder::{Builder, Floor};
use crate::Result;
use crate::geometry::Cost;
use crate::material::{BakedGround, Ground as GroundMaterial, Material, Solid};
use crate::math::Spectrum;
use crate::ron_file::Step;
use crate::sampling::Purpose;
use crate::sampling::rng::mix;
use crate::scatter::Rows;
use crate::scene::PartKind;
use crate::scene::library::Layer;
use crate::soil::{
    self, Canopy, Clods, Debris, DebrisKind, Expected, Ground, Pile, Rect, SeedRows, Site, SoilDesc, SoilRecord,
};
use std::sync::Arc;

/// Room around the view with fine ground.
const GROUND_MARGIN: f32 = 0.04;
/// How far the coarse ground goes on.
const GROUND_REACH: f32 = 2.5;
/// How far it goes on where the camera sees ground beyond the planted area: to what is nearly the horizon.
const OPEN_REACH: f32 = 200.0;
/// About the most cells of the fine ground: a larger view has larger ones.
const MOST_CELLS: f32 = 1.5e7;
/// About the most texels of the ground's maps: a larger view has larger ones.
const MOST_TEXELS: f32 = 2.4e8;
/// Addresses of what lies on the ground.
const STONES: u64 = 0;
const LITTER: u64 = 1;
/// Slope angle of the facets of stones, straw and wood, radians.
const DEBRIS_SIGMA: f32 = 0.3;

/// Largest patches of straw, wood and dead leaves, metres.
const MOTTLE: f32 = 2e-3;

/// Patches of soil on stones, straw and wood, metres.
const DUST_PATCH: f32 = 3e-3;
/// Steps of moisture from air-dry to saturated that pieces are told apart by.
const MOISTURE_STEPS: f32 = 12.0;

/// The ground while it is being covered.
pub(super) struct Earth {
    pub(super) ground: Ground,
    pub(super) maps: Vec<Arc<Layer>>,
    pub(super) pile: Pile,
    pub(super) stones: Vec<Debris>,
}

/// What the ground shows, and what its clods show: dry ones and damp ones.
pub(super) struct BakedGrounds {
    pub(super) ground: Arc<BakedGround>,
    pub(super) clods: [Arc<BakedGround>; 2],
    /// Reflectance of the dry soil that lies on stones and straw.
    pub(super) dust: Spectrum,
}

impl Builder<'_> {
    /// The ground and the stones in it: what must be known before plants can be placed.
    pub(super) fn break_ground(&mut self, desc: &SoilDesc, view: Rect, open: bool) -> Result<Earth> {
        let mut maps: Vec<Arc<Layer>> = Vec::new();
        for layer in &desc.layers {
            maps.push(self.library.layer(self.page, layer)?);
        }
        let mut read = |file: &str| self.library.soil_spectrum(self.page, file);
        let colors = desc.colors.iter().map(|color| color.reflectance(&mut read)).collect::<Result<Vec<Spectrum>>>()?;
        let site = self.site(view, open);
        let ground = Ground::new(desc, &colors, &maps, &site, &self.stream(Purpose::Soil, 0))
            .map_err(|e| self.page.blame(&[Step::Field("soil")], e))?;
        self.options.wanted()?;
        let mut pile = Pile::new(&ground).until(self.options.preview.as_ref());
        let stones = soil::stones(&desc.stones, &ground, &mut pile, &self.stream(Purpose::Debris, STONES));
        Ok(Earth { ground, maps, pile, stones })
    }

    /// Which piece of ground is made, and how finely.
    pub(super) fn site(&self, view: Rect, open: bool) -> Site {
        let pixel = self.ground_pixel();
        let rows = self.sown.clone().next().map(|k| {
            let rows = Rows::draw(&self.desc.crops[k].rows, &self.stream(Purpose::Scatter, k as u64));
            SeedRows { spacing_m: rows.spacing_m, azimuth: rows.azimuth, offset_m: rows.offset_m }
        });
        Site {
            area: view.grown(GROUND_MARGIN),
            grid_m: (2.5 * pixel).clamp(8e-4, 4e-3).max((view.area() / MOST_CELLS).sqrt()),
            margin_m: if open { OPEN_REACH } else { GROUND_REACH },
            rows,
        }
    }

    /// Side of a texel of the ground's maps, metres.
    pub(super) fn texel(&self, view: Rect) -> f32 {
        (0.9 * self.ground_pixel()).clamp(2e-4, 2e-3).max((view.area() / MOST_TEXELS).sqrt())
    }

    /// What the ground and each thing on it take, before any of it is made.
    pub(super) fn expected_soil(&self, desc: &SoilDesc, view: Rect, open: bool) -> (Cost, Vec<Expected>) {
        let streams = [(Purpose::Soil, 0), (Purpose::Debris, STONES), (Purpose::Debris, LITTER)];
        let streams = streams.map(|(purpose, index)| self.stream(purpose, index));
        soil::expected(desc, &self.site(view, open), self.texel(view), streams.each_ref())
    }

    /// The ground as it was drawn.
    pub(super) fn soil_record(&self, desc: &SoilDesc, ground: &Ground) -> SoilRecord {
        ground.record(desc, &self.stream(Purpose::Debris, STONES), &self.stream(Purpose::Debris, LITTER))
    }

    /// Clods under the plants, and litter, which joins the `debris`.
    pub(super) fn cover(
        &self,
        desc: &SoilDesc,
        ground: &Ground,
        pile: &mut Pile,
        debris: &mut Vec<Debris>,
    ) -> Vec<Clods> {
        let mut canopy = Canopy::none(ground);
        for part in self.scene.parts.iter().filter(|_| !desc.flat) {
            canopy.add(&part.mesh);
        }
        let clods = soil::clods(ground, pile, &canopy);
        debris.extend(soil::litter(&desc.litter, ground, pile, &self.stream(Purpose::Debris, LITTER)));
        if !desc.flat {
            return clods;
        }
        for thing in debris {
            thing.lower(ground);
        }
        Vec::new()
    }

    /// Makes parts of everything of the ground; they come before those of the plants.
    pub(super) fn lay(&mut self, floor: Floor<'_>, clods: Vec<Clods>, debris: Vec<Debris>, baked: &BakedGrounds) {
        let plants = std::mem::take(&mut self.scene.parts);
        let material = self.material(Material::Ground(GroundMaterial::new(baked.ground.clone())));
        let mesh = if floor.flat { floor.ground.levelled().mesh() } else { floor.ground.mesh() };
        self.part(mesh, material, PartKind::Soil);
        for group in clods {
            let maps = baked.clods[usize::from(group.damp)].clone();
            let material = self.material(Material::Ground(GroundMaterial::clods(maps, group.tint)));
            self.part(group.mesh, material, PartKind::Soil);
        }
        for (i, thing) in debris.into_iter().enumerate() {
            let solid = Solid::new(thing.albedo * thing.tint, DEBRIS_SIGMA);
            // A stone is of a piece; dead matter is mottled by what eats it.
            let patch = 0.5 * thing.radius.max(1e-3);
            let patch = if thing.kind == DebrisKind::Stone { patch } else { patch.min(MOTTLE) };
            let solid = solid.with_grain(mix(i as u64) as u32, patch, 0.35);
            let solid = solid.with_dust(baked.dust, thing.dust, DUST_PATCH);
            // In steps, so that pieces of the same film can be exported as one.
            let moisture = floor.ground.moisture(thing.centre.x, thing.centre.y);
            let solid = solid.moist((moisture * MOISTURE_STEPS).round() / MOISTURE_STEPS);
            let material = self.material(Material::Solid(solid));
            self.part(thing.mesh, material, PartKind::Debris(thing.kind));
        }
        self.scene.parts.extend(plants);
    }
}
