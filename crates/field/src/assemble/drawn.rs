//! Values that a field draws from its scene file before anything is built: the input of every later step.

use super::detail::MeshDetail;
use super::extent::PLANT_MARGIN;
use super::field_day::FieldDay;
use super::illumination::{DrawnLights, LightAddress, LightsWanted};
use super::options::Options;
use super::season::Season;
use super::{lidar, rig, seed_rows};
use crate::desc::FieldDesc;
use crate::drive::Capture;
use crate::estimate::usual_memory;
use crate::layer::Layer;
use crate::library::Library;
use furrow_base::Result;
use furrow_base::math::Vec2;
use furrow_base::ron_file::RonFile;
use furrow_base::sampling::{Purpose, Stream};
use furrow_grow::plant::GrowOptions;
use furrow_grow::soil::{Envelope, Ground, SeedRows, Stance};
use furrow_optics::sensor::{Camera, Lidar};
use std::ops::Range;
use std::sync::Arc;

/// Random stream address of the season, beyond those of any number of lights.
const SEASON: u64 = 1 << 32;
/// Random stream address for the choice of the sown crop.
const SOWN: u64 = 3 << 32;

/// Values that a field draws from its scene file.
pub(super) struct Drawn<'a> {
    pub(super) page: &'a RonFile,
    pub(super) desc: &'a FieldDesc,
    pub(super) options: &'a Options,
    pub(super) seed: u64,
    pub(super) index: u64,
    pub(super) season: Season,
    /// Day of the field; `None` if it has no days.
    pub(super) today: Option<FieldDay>,
    /// Indices of the scene file's crops that this field has.
    pub(super) sown: Range<usize>,
    /// Camera of the first image.
    pub(super) camera: Camera,
    /// Level of geometric detail.
    pub(super) detail: MeshDetail,
    /// Images to be taken of the field.
    pub(super) captures: Vec<Capture>,
    /// LiDAR at each frame of a scan; empty for images.
    pub(super) scanners: Vec<Lidar>,
}

/// Draws the season, and the scene file's crops that are sown.
fn grown_on(page: &RonFile, desc: &FieldDesc, (seed, index): (u64, u64)) -> Result<(Season, Range<usize>)> {
    let season = Season::draw(page, desc, &mut Stream::of(seed, index, Purpose::Page, SEASON))?;
    let sown = desc.sown.draw(desc.crops.len(), &mut Stream::of(seed, index, Purpose::Page, SOWN));
    Ok((season, sown))
}

/// Returns the day of a field; `None` if it has no days.
pub(super) fn day(
    page: &RonFile,
    desc: &FieldDesc,
    library: &mut Library,
    options: &Options,
    address: (u64, u64),
) -> Result<Option<FieldDay>> {
    let (season, sown) = grown_on(page, desc, address)?;
    FieldDay::of((page, desc), library, options.day, (sown, season.place()))
}

impl<'a> Drawn<'a> {
    /// Draws season, day, crops, the field's own lights, cameras and LiDAR. Also returns warnings about them. With
    /// [`LightsWanted::ForExposure`] the lights are empty unless a camera needs them.
    pub(super) fn draw(
        page: &'a RonFile,
        desc: &'a FieldDesc,
        options: &'a Options,
        library: &mut Library,
        wanted: LightsWanted,
    ) -> Result<(Self, DrawnLights, Vec<String>)> {
        library.counted.begin(options.memory);
        if let Some(horizon) = &desc.horizon {
            horizon.check(page, desc.reach_m.f32())?;
        }
        let (seed, index) = (options.seed.unwrap_or(desc.seed), options.index);
        let mut stream = Stream::of(seed, index, Purpose::Page, 0);
        let camera = rig::first(page, desc, library, (options.width, options.height), &mut stream)?;
        let (season, sown) = grown_on(page, desc, (seed, index))?;
        let today = FieldDay::of((page, desc), library, options.day, (sown.clone(), season.place()))?;
        let at = LightAddress { seed, index, light: 0 };
        let mut lit = match wanted {
            LightsWanted::All => DrawnLights::draw(page, desc, library, at, today.as_ref())?,
            LightsWanted::ForExposure => DrawnLights::check(page, desc, library, at, today.as_ref())?,
        };
        // A LiDAR is its own light source.
        let dark = lit.warning().filter(|_| wanted == LightsWanted::All && options.scan.is_none());
        let warnings = dark.into_iter().collect();
        let mut captures = rig::captures(page, desc, library, &camera, sown.clone(), &|purpose, k| {
            Stream::of(seed, index, purpose, k)
        })?;
        if wanted == LightsWanted::ForExposure && captures.iter().any(|capture| capture.camera.blurs()) {
            lit = DrawnLights::draw(page, desc, library, at, today.as_ref())?;
        }
        lit.expose(&desc.sensor, at, &mut captures);
        let scanners = lidar::at_frames(page, desc, options.scan.as_ref(), (&camera, &captures), (seed, index))?;
        let detail = MeshDetail::of(desc, options.scan.is_some(), &captures);
        let camera = captures.first().map_or(camera, |first| first.camera);
        let drawn = Self { page, desc, options, seed, index, season, today, sown, camera, detail, captures, scanners };
        Ok((drawn, lit, warnings))
    }

    pub(super) fn stream(&self, purpose: Purpose, index: u64) -> Stream {
        Stream::of(self.seed, self.index, purpose, index)
    }

    /// Returns the memory limit of the field, bytes.
    pub(super) fn memory(&self) -> u64 {
        self.options.memory.unwrap_or_else(usual_memory)
    }

    /// Returns the smallest ground footprint of a centre pixel over all cameras, metres; 1 mm if no camera looks down.
    /// For a scan, the spacing of the LiDAR's rays.
    pub(super) fn ground_pixel(&self) -> f32 {
        if let Some(spacing) = lidar::spacing_on_ground(&self.scanners) {
            return spacing;
        }
        let side = |camera: &Camera| {
            let (origin, direction) = camera.centre_ray(camera.width() / 2, camera.height() / 2);
            (direction.z < -0.05).then(|| origin.z / -direction.z * camera.pixel_angle())
        };
        // The first frame of each camera is enough: later frames have about the same height.
        let first = self.captures.iter().take_while(|capture| capture.frame == 0);
        first.filter_map(|capture| side(&capture.camera)).reduce(f32::min).unwrap_or(1e-3)
    }

    /// Returns the minimum cell length of the mesh of a plant at `at`, metres. A preview uses four pixels, the ratio that the default
    /// cell has to the pixels of a field camera.
    pub(super) fn cell(&self, at: Vec2) -> f32 {
        let usual = GrowOptions::default().cell;
        let by_pixel = match self.detail {
            _ if self.options.preview.is_some() => 4.0 * self.ground_pixel(),
            MeshDetail::ByPixel | MeshDetail::Instanced => 1.5 * self.pixel_at(at),
            MeshDetail::Full => 0.0,
        };
        usual.max(by_pixel)
    }

    /// Returns the smallest pixel footprint on a plant at `at` over all images, metres, perpendicular to the line of sight.
    pub(super) fn pixel_at(&self, at: Vec2) -> f32 {
        lidar::spacing_at(&self.scanners, at).unwrap_or_else(|| self.camera_pixel_at(at))
    }

    /// Returns the smallest camera pixel footprint on a plant at `at`, metres, even for a scan. It decides which plants share meshes, so
    /// a LiDAR meets the same plants that the cameras see.
    pub(super) fn camera_pixel_at(&self, at: Vec2) -> f32 {
        let side = |camera: &Camera| {
            let distance = camera.pose().position.distance(at.extend(0.0)) - PLANT_MARGIN;
            distance.max(0.0) * camera.pixel_angle()
        };
        self.captures.iter().map(|capture| side(&capture.camera)).reduce(f32::min).unwrap_or(1e-3)
    }

    /// Returns the smallest pixel footprint on the ground over all images, metres; 1 mm if no camera looks down.
    /// For a scan, the spacing of the LiDAR's rays.
    pub(super) fn finest_pixel(&self) -> f32 {
        if let Some(spacing) = lidar::spacing_on_ground(&self.scanners) {
            return spacing;
        }
        let finest = |camera: &Camera| {
            let corner = |k: u32| (k % 3 * (camera.width() - 1) / 2, k / 3 * (camera.height() - 1) / 2);
            let rays = (0..9).map(corner).map(|(x, y)| camera.centre_ray(x, y));
            let sides = rays.filter(|(_, direction)| direction.z < -0.05);
            sides.map(|(origin, direction)| origin.z / -direction.z * camera.pixel_angle()).reduce(f32::min)
        };
        self.captures.iter().filter_map(|capture| finest(&capture.camera)).reduce(f32::min).unwrap_or(1e-3)
    }

    /// Returns the seed rows of the first crop, or else of the first model in rows, which shape the ground; `None` without rows.
    pub(super) fn seed_rows(&self) -> Option<SeedRows> {
        let rows = seed_rows::first_rows(self.desc, self.sown.clone(), &|purpose, k| self.stream(purpose, k));
        rows.map(|rows| SeedRows { spacing_m: rows.spacing_m, azimuth: rows.azimuth, offset_m: rows.offset_m })
    }

    /// Returns the bounds of the ground's height.
    pub(super) fn envelope(&self) -> Envelope {
        let soil = self.desc.soil.as_ref();
        soil.map_or(Envelope::LEVEL, |soil| Envelope::of(soil, self.seed_rows(), &self.stream(Purpose::Soil, 0)))
    }
}

/// Radius of the plane fit that gives the ground's normal at a plant, metres.
const STANCE: f32 = 0.02;

/// The ground that plants and models are placed on.
#[derive(Clone, Copy)]
pub(super) struct Floor<'a> {
    pub(super) ground: &'a Ground,
    /// Textures of the ground's layers.
    pub(super) maps: &'a [Arc<Layer>],
    /// Whether the ground is the plane z = 0. Plants then still lean as on the ground with its heights.
    pub(super) flat: bool,
}

impl Floor<'_> {
    /// Returns the height of the ground at a point, metres.
    pub(super) fn height(&self, x: f32, y: f32) -> f32 {
        if self.flat { 0.0 } else { self.ground.height(x, y) }
    }

    /// Returns height and orientation of the ground below a plant.
    pub(super) fn stance(&self, x: f32, y: f32) -> Stance {
        let stance = self.ground.stance(self.maps, x, y, STANCE);
        if self.flat { Stance { height: 0.0, rise: 0.0, ..stance } } else { stance }
    }
}

/// A query about a field that is not built, and its context.
pub(super) struct Asked<'a> {
    pub(super) drawn: &'a Drawn<'a>,
    pub(super) library: &'a mut Library,
    pub(super) warnings: &'a mut Vec<String>,
}

#[cfg(test)]
mod tests {
    use crate::assemble::{self, Options};

    /// Expected: a moving camera blurs for as long as its sensor is exposed: half the light, twice the time, up to the
    /// sensor's longest time; a time in the scene file stays.
    #[test]
    fn a_moving_camera_blurs_while_it_is_exposed() {
        let exposure = |light: f32, more: &str| {
            let camera = "Pinhole(size: (8, 8), intrinsics: FieldOfView(horizontal_deg: 40), pose: Nadir(height_m: 1)";
            let text = format!(
                "Field(camera: {camera}, motion: (speed_m_s: 1{more})), sensor: (limits: (longest_ms: 20)), \
                 lights: [Constant(radiance: ({light}, {light}, {light}, {light}))])"
            );
            assemble::field_of(&text, &Options::default()).unwrap().scene.camera.exposure()
        };
        let sunny = exposure(0.2, "");
        assert!(sunny > 1e-4 && sunny < 5e-3, "{sunny}");
        assert!((exposure(0.1, "") / sunny - 2.0).abs() < 1e-3);
        assert!((exposure(1e-3, "") - 0.02).abs() < 1e-6);
        assert!((exposure(1e-3, ", exposure_ms: 3") - 3e-3).abs() < 1e-6 && exposure(0.1, ", exposure_ms: 0") == 0.0);
    }
}
