//! Builds one field from a scene file, a seed and an index.

mod bank;
mod builder;
mod census;
mod condition;
mod earth;
mod estimate;
mod expected;
mod field;
mod ground;
mod ground_view;
mod grown;
mod identity;
mod individual;
mod known;
mod lighting;
mod member;
mod models;
mod options;
mod preview;
mod progress;
pub mod record;
mod rig;
mod scanner;
mod season;
mod seedling;
mod stand;
mod terrain;
mod today;
mod unlikely;
mod view;

use super::desc::{Detail, FieldDesc, Growth};
use super::estimate::{Estimate, usual_memory};
pub use super::growing::Growing;
use super::library::{Library, Species};
use super::{PartKind, PlantRecord};
use builder::{Builder, Floor, PLANT_MARGIN};
use census::{Census, Members, Population};
pub use field::Field;
use furrow_base::input::Scope;
use furrow_base::math::{Spectrum, Vec2, vec2};
use furrow_base::ron_file::{RonFile, Step, Vary};
use furrow_base::sampling::{Purpose, Stream};
use furrow_base::{Error, Result};
use furrow_grow::plant::GrowOptions;
use furrow_grow::scatter::{self, Disc, Spot};
use furrow_grow::soil::Rect;
use furrow_optics::light::LightDesc;
use furrow_optics::optics::soil::LOESS;
use furrow_optics::sensor::Camera;
use furrow_render::material::Material;
use furrow_render::scene::Scene;
use individual::Individual;
pub use lighting::Lighting;
use lighting::Listed;
pub use options::{Options, Scanner};
pub use preview::Preview;
pub use progress::BuildProgress;
pub use progress::Stage;
use record::Conditions;
pub use season::Season;
use seedling::Seedling;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};
use today::Today;
use view::View;

/// Random stream address of the season, beyond those of any number of lights.
const SEASON: u64 = 1 << 32;
/// First random stream address for the choice of a `OneOf` list; one stream for each index among the scene file's lights.
const LIGHTING: u64 = 2 << 32;
/// Random stream address for the choice of the sown crop.
const SOWN: u64 = 3 << 32;
/// Maximum number of lights of a field: each is evaluated at every hit point of a ray.
const MOST_LIGHTS: usize = 256;

/// Builds field `options.index` of the scene file at `path`.
pub fn field(path: &Path, options: &Options) -> Result<Field> {
    Source::open(path)?.field(options)
}

/// Builds a field from the text of a scene file. Paths are relative to the working directory.
pub fn field_of(text: &str, options: &Options) -> Result<Field> {
    Source::of(RonFile::of(text), Library::default())?.field(options)
}

/// A scene file with a cache of the files that its fields have read, so that the next field does not read them again. Several fields may
/// be built concurrently.
pub struct Source {
    page: RonFile,
    desc: FieldDesc,
    days: Vec<u32>,
    library: Mutex<Library>,
}

impl Source {
    /// Reads a scene file, which may name files anywhere.
    pub fn open(path: &Path) -> Result<Self> {
        Self::open_within(path, Scope::Anywhere)
    }

    /// Reads a scene file. Neither it nor the files that it names may be outside `scope`.
    pub fn open_within(path: &Path, scope: Scope) -> Result<Self> {
        let path = scope.check(path.into())?;
        let mut library = Library::within(scope);
        let page = library.page(&path)?;
        Self::of(page, library)
    }

    /// Returns `true` if any model of the scene file may name files outside the model's own folder.
    pub fn allows_outside(&self) -> bool {
        self.desc.models.iter().any(|model| model.allow_outside)
    }

    /// Reads the scene file again from disk, or takes `text` instead. Cached data of files that did not change is kept.
    pub fn reread(&self, text: Option<&str>) -> Result<Self> {
        let mut library = self.library.lock().unwrap_or_else(PoisonError::into_inner).clone().renewed();
        let page = match text {
            None => library.page(&self.page.path)?,
            Some(text) => library.page_of(&self.page.path, text),
        };
        let growing = library.growing;
        Ok(Self::of(page, library)?.growing(growing))
    }

    fn of(page: RonFile, library: Library) -> Result<Self> {
        let desc: FieldDesc = page.parse_all()?;
        let days = match &desc.days {
            Some(days) => days.list().map_err(|e| page.blame(&[Step::Field("days")], e))?,
            None => Vec::new(),
        };
        Ok(Self { page, desc, days, library: Mutex::new(library) })
    }

    /// Applies an experiment's changes to the descriptions of field and species.
    #[must_use]
    pub fn growing(mut self, growing: Growing) -> Self {
        if let Some(change) = growing.page {
            change(&mut self.desc);
        }
        self.library.get_mut().unwrap_or_else(PoisonError::into_inner).growing = growing;
        self
    }

    /// Returns the days on which images are taken; empty if the scene file has no `days`.
    pub fn days(&self) -> &[u32] {
        &self.days
    }

    /// Returns the number of images per field and day: frames times cameras.
    pub fn captures(&self) -> u64 {
        let frames = self.desc.drive.as_ref().map_or(1, |drive| drive.frames.get() as u64);
        frames * (1 + self.desc.cameras.len() as u64)
    }

    /// Builds field `options.index`. Call it inside a thread pool.
    pub fn field(&self, options: &Options) -> Result<Field> {
        let held = || self.library.lock().unwrap_or_else(PoisonError::into_inner);
        // The clone shares all data by reference; fields that are built concurrently do not wait for each other.
        let library = held().clone();
        let desc = scanner::grown(&self.desc, options.scan.as_ref());
        let (field, library) = Builder::new(&self.page, &desc, options, library)?.build()?;
        *held() = library;
        Ok(field)
    }

    /// Estimates memory and time of field `options.index` without building it.
    pub fn estimate(&self, options: &Options) -> Result<Estimate> {
        self.ask(options, |builder| {
            let view = builder.looked_at()?;
            builder.estimate(view)
        })
    }
}

impl<'a> Builder<'a> {
    fn new(page: &'a RonFile, desc: &'a FieldDesc, options: &'a Options, mut library: Library) -> Result<Self> {
        library.counted.begin(options.memory);
        let (seed, index) = (options.seed.unwrap_or(desc.seed), options.index);
        let mut stream = Stream::of(seed, index, Purpose::Page, 0);
        let camera = rig::first(page, desc, (options.width, options.height), &mut stream)?;
        let season = Season::draw(page, desc, &mut Stream::of(seed, index, Purpose::Page, SEASON))?;
        let sown = desc.sown.draw(desc.crops.len(), &mut Stream::of(seed, index, Purpose::Page, SOWN));
        let today = Today::of((page, desc), &mut library, options.day, (sown.clone(), season.place()))?;
        let daily = |address| {
            let stream = Stream::of(seed, index, Purpose::Page, address);
            today.as_ref().map_or_else(|| stream.clone(), |today| today.stream(&stream))
        };
        let (mut lights, mut light_records) = (Vec::new(), Vec::new());
        let lists = |place| daily(LIGHTING + place as u64);
        let (lighting, listed) = Lighting::draw(page, &desc.lights, lists)?;
        if listed.len() > MOST_LIGHTS {
            let fault = Error::input(format!("{} lights: a field may have at most {MOST_LIGHTS}", listed.len()))
                .help("remove some; one Daylight is both sun and sky");
            return Err(page.blame(&[Step::Field("lights")], fault));
        }
        // Note the files of all lists, so that all fields have the same scene hash whichever list each of them draws.
        for file in desc.lights.iter().flat_map(LightDesc::files) {
            library.environment_map_file(page, file)?;
        }
        for (i, Listed { desc: light, at }) in listed.into_iter().enumerate() {
            let mut open = |file: &str, infrared| library.environment_map(page, file, infrared);
            let drawn = light.draw(&mut daily(1 + i as u64), &mut open);
            let (record, drawn) = drawn.map_err(|e| page.blame(&at, e))?;
            light_records.push(record);
            lights.extend(drawn);
        }
        let mut warnings = Vec::new();
        // A LiDAR is its own light source.
        if lights.is_empty() && options.scan.is_none() {
            warnings.push("no light in the scene: the image will be black".into());
        }
        let scene = Scene { parts: Vec::new(), materials: Vec::new(), lights, camera, filter: desc.filter.footprint() };
        let captures = rig::captures(page, desc, &mut library, camera, sown.clone(), &|purpose, k| {
            Stream::of(seed, index, purpose, k)
        })?;
        let scene = Scene { camera: captures.first().map_or(camera, |first| first.camera), ..scene };
        let scanners = scanner::at_frames(page, desc, options.scan.as_ref(), (&camera, &captures), (seed, index))?;
        Ok(Self {
            page,
            desc,
            options,
            library,
            seed,
            index,
            season,
            today,
            sown,
            lights: light_records,
            lighting,
            scene,
            captures,
            scanners,
            seen: Vec::new(),
            ground: Vec::new(),
            organs: Vec::new(),
            things: Vec::new(),
            warnings,
        })
    }

    fn stream(&self, purpose: Purpose, index: u64) -> Stream {
        Stream::of(self.seed, self.index, purpose, index)
    }

    /// Returns the memory limit of the field, bytes.
    fn memory(&self) -> u64 {
        self.options.memory.unwrap_or_else(usual_memory)
    }

    /// Returns the smallest ground footprint of a centre pixel over all cameras, metres; 1 mm if no camera looks down.
    /// For a scan, the spacing of the LiDAR's rays.
    fn ground_pixel(&self) -> f32 {
        if let Some(spacing) = self.scanned_ground() {
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
    fn cell(&self, at: Vec2) -> f32 {
        let usual = GrowOptions::default().cell;
        let by_pixel = match self.desc.detail {
            _ if self.options.preview.is_some() => 4.0 * self.ground_pixel(),
            Detail::ByPixel | Detail::Instanced => 1.5 * self.pixel_at(at),
            Detail::Full => 0.0,
        };
        usual.max(by_pixel)
    }

    /// Returns the smallest pixel footprint on a plant at `at` over all images, metres, perpendicular to the line of sight.
    fn pixel_at(&self, at: Vec2) -> f32 {
        self.scanned_at(at).unwrap_or_else(|| self.camera_pixel_at(at))
    }

    /// Returns the smallest camera pixel footprint on a plant at `at`, metres, even for a scan. It decides which plants share meshes, so
    /// a LiDAR meets the same plants that the cameras see.
    fn camera_pixel_at(&self, at: Vec2) -> f32 {
        let side = |camera: &Camera| {
            let distance = camera.pose().position.distance(at.extend(0.0)) - PLANT_MARGIN;
            distance.max(0.0) * camera.pixel_angle()
        };
        self.captures.iter().map(|capture| side(&capture.camera)).reduce(f32::min).unwrap_or(1e-3)
    }

    /// Returns the smallest pixel footprint on the ground over all images, metres; 1 mm if no camera looks down.
    /// For a scan, the spacing of the LiDAR's rays.
    fn finest_pixel(&self) -> f32 {
        if let Some(spacing) = self.scanned_ground() {
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

    fn material(&mut self, material: Material) -> u32 {
        self.scene.materials.push(material);
        self.scene.materials.len() as u32 - 1
    }

    /// Builds the field. Also returns the library with the files that were read for it.
    fn build(mut self) -> Result<(Field, Library)> {
        self.options.progress.enter(Stage::Estimate);
        let view = self.looked_at()?;
        self.estimate(view)?.check(self.memory()).map_err(|(at, error)| self.page.blame(&at, error))?;
        let shown = self.has_ground().then_some(view.area);
        self.warn_of_camera();
        self.warn_of_plants()?;
        let desc = self.desc;
        let (mut plants, soil) = match &desc.soil {
            None => {
                let (seedlings, _) = self.seedlings(view.area.grown(PLANT_MARGIN), &[])?;
                (self.populate(&seedlings, None, shown)?, None)
            }
            Some(soil) => {
                self.options.progress.enter(Stage::Ground);
                let (plants, record) = self.cultivate(soil, view, shown)?;
                (plants, Some(record))
            }
        };
        let (species, models) = (self.species()?, self.model_names()?);
        known::number_kinds(&mut plants, &species);
        self.warn_of_view(&plants, shown);
        let conditions = Conditions {
            camera: self.scene.camera.record(),
            sensor: self.desc.sensor.build(&mut self.stream(Purpose::Sensor, 0)).record(),
            lights: std::mem::take(&mut self.lights),
            lighting: std::mem::take(&mut self.lighting),
            soil,
            crops: self.crop_records()?,
            weeds: self.weed_records()?,
            season: self.season,
        };
        // Part order: ground, plants, models.
        let mut kinds = self.ground;
        kinds.extend(self.organs.into_iter().map(PartKind::Organ));
        kinds.extend(self.things);
        self.warnings.extend(self.library.warnings());
        let field = Field {
            scene: self.scene,
            captures: self.captures,
            scanners: self.scanners,
            day: self.today.map(|today| today.day),
            capture: 0,
            kinds,
            plants,
            species,
            models,
            conditions,
            files: self.library.files(),
            shipped: self.library.shipped(),
            text: self.page.text.clone(),
            sensor: self.desc.sensor.clone(),
            hash: self.library.hash(),
            seed: self.seed,
            index: self.index,
            warnings: self.warnings,
        };
        Ok((field, self.library))
    }

    /// Returns `true` if the scene has ground, crops or weeds, so that its extent depends on the view.
    fn has_ground(&self) -> bool {
        self.desc.soil.is_some() || !self.desc.crops.is_empty() || !self.desc.weeds.is_empty()
    }

    /// Returns the ground in view, or [`View::NONE`] for a scene of single plants and models.
    fn looked_at(&mut self) -> Result<View> {
        if self.has_ground() { self.view() } else { Ok(View::NONE) }
    }

    /// Adds plants and models to the scene, and returns their records.
    fn populate(
        &mut self,
        seedlings: &[Seedling],
        floor: Option<Floor<'_>>,
        shown: Option<Rect>,
    ) -> Result<Vec<PlantRecord>> {
        let mut plants = self.plant(seedlings, floor, shown)?;
        plants.extend(self.models(seedlings.len(), floor)?);
        identity::settle(&mut plants);
        if floor.is_some() {
            self.options.progress.enter(Stage::Cover);
        }
        Ok(plants)
    }

    /// Returns the plants to be grown, and the range of each population among them. Adding a species at the end of the scene file does
    /// not change the order of the others.
    fn seedlings(&mut self, area: Rect, stones: &[Disc]) -> Result<(Vec<Seedling>, Vec<Members>)> {
        let mut all = Vec::new();
        let area = area.corners();
        let (desc, page) = (self.desc, self.page);
        let mut census = Census::new(page, desc.detail != Detail::Full, self.memory());
        for k in self.sown.clone() {
            let crop = &desc.crops[k];
            let species = self.library.species(page, &crop.species)?;
            let places = scatter::rows_looked_at(&crop.rows, area, &self.stream(Purpose::Scatter, k as u64));
            census.open(Population::Crop(k), places, all.len())?;
            for spot in scatter::rows(&crop.rows, area, stones, &self.stream(Purpose::Scatter, k as u64)) {
                if !self.may_be_seen(spot.at) {
                    continue;
                }
                census.close(all.len())?;
                let seedling = self.seedling(&species, &crop.growth, spot, 1 + k as u64);
                all.push(seedling.tended(&crop.vigour, crop.condition.as_ref()));
            }
        }
        for (k, weed) in desc.weeds.iter().enumerate() {
            let species = self.library.species(page, &weed.species)?;
            let places = scatter::weeds_looked_at(&weed.spread, area, &self.stream(Purpose::Scatter, 1000 + k as u64));
            census.open(Population::Weed(k), places, all.len())?;
            for spot in scatter::weeds(&weed.spread, area, stones, &self.stream(Purpose::Scatter, 1000 + k as u64)) {
                if !self.may_be_seen(spot.at) {
                    continue;
                }
                census.close(all.len())?;
                let seedling = self.seedling(&species, &weed.growth, spot, 1001 + k as u64);
                all.push(seedling.tended(&weed.vigour, weed.condition.as_ref()));
            }
        }
        census.open(Population::Placed, 0.0, all.len())?;
        for (k, placed) in desc.plants.iter().enumerate() {
            let species = self.library.species(page, &placed.species)?;
            let mut stream = self.stream(Purpose::Scatter, 2000 + k as u64);
            let position = vec2(placed.position_m.0.draw32(&mut stream), placed.position_m.1.draw32(&mut stream));
            let seedling = Seedling {
                species: species.clone(),
                growth: placed.growth.clone(),
                season: self.season.place(),
                today: self.today.clone(),
                position,
                turn: placed.turn_deg.draw32(&mut stream).to_radians(),
                only_leaf: placed.only_leaf.map(|l| l.get() as u16),
                stream: stream.child(Purpose::Plant, 0),
                individual: Individual::of(&species.desc, (self.seed, self.index)),
                vigour: placed.vigour.clone(),
                condition: species.desc.condition.clone(),
                id: identity::of(self.seed, self.index, identity::PLACED, k as u64),
                member: None,
            };
            all.push(seedling.tended(&placed.vigour, placed.condition.as_ref()));
        }
        census.close(all.len())?;
        let populations = census.populations(all.len());
        Ok((all, populations))
    }

    fn seedling(&self, species: &Arc<Species>, growth: &Growth, spot: Spot, population: u64) -> Seedling {
        let stream = self.stream(Purpose::Plant, population).child(Purpose::Plant, spot.key);
        Seedling {
            species: species.clone(),
            growth: growth.clone(),
            season: self.season.place(),
            today: self.today.clone(),
            position: spot.at,
            turn: 0.0,
            only_leaf: None,
            member: self.member(population, &stream, spot.at),
            stream,
            individual: Individual::of(&species.desc, (self.seed, self.index)),
            vigour: Vary::fixed(1.0),
            condition: species.desc.condition.clone(),
            id: identity::of(self.seed, self.index, population, spot.key),
        }
    }

    /// Returns the reflectance of the dry soil that covers leaves as dust.
    fn dust(&mut self) -> Result<Spectrum> {
        match self.desc.soil.as_ref().and_then(|soil| soil.layers.first()) {
            Some(layer) => Ok(self.library.layer(self.page, layer)?.mean()),
            None => Ok(LOESS),
        }
    }
}
