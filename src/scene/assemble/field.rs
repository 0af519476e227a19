//! What is built: one field, and its photograph.

use crate::film::Film;
use crate::math::Spectrum;
use crate::sampling::rng::mix;
use crate::sampling::{Purpose, Stream};
use crate::scene::drive::Capture;
use crate::scene::record::{Conditions, SpeciesRecord};
use crate::scene::{PartKind, PlantRecord, Scene};
use crate::sensor::{Lidar, Linear, Photograph, SensorDesc};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// One field, ready to be rendered, and what is known of it.
pub struct Field {
    /// What is out there.
    pub scene: Scene,
    /// The images that are taken of it as it is, one at least.
    pub captures: Vec<Capture>,
    /// The LiDAR at each frame, where it was grown for a scan.
    pub scanners: Vec<Lidar>,
    /// The day on which it is as it is, where it has days.
    pub day: Option<u32>,
    /// Place of the one whose camera the scene has.
    pub capture: usize,
    /// What the scene's parts are, in their order.
    pub kinds: Vec<PartKind>,
    /// Its plants, in the order of their numbers.
    pub plants: Vec<PlantRecord>,
    /// How its film becomes a picture.
    pub sensor: SensorDesc,
    /// SHA-256 of everything that was read, hex.
    pub hash: String,
    /// Seed.
    pub seed: u64,
    /// Which field of the distribution.
    pub index: u64,
    /// Every species that its scene file can draw, in the scene file's order: the same for all indices.
    pub species: Vec<SpeciesRecord>,
    /// Names that its scene file gives to models from disk, by their numbers among the [`PartKind::Named`]: the same for all indices.
    pub models: Vec<String>,
    /// What was drawn for it.
    pub conditions: Conditions,
    /// Every file that was read for it, in order.
    pub files: Vec<PathBuf>,
    /// Names in its scene file that stand for files that ship with the program, and those files.
    pub shipped: BTreeMap<String, PathBuf>,
    /// Its scene file.
    pub text: String,
    /// What the user should know.
    pub warnings: Vec<String>,
}

impl Field {
    /// The same field as another of its images has it; `capture` is below the number of [`Self::captures`].
    pub fn take(&mut self, capture: usize) {
        self.capture = capture;
        self.scene.camera = self.captures[capture].camera;
        self.conditions.camera = self.scene.camera.record();
    }

    /// Seed of the samples: a field of its own noise for every image.
    pub fn sample_seed(&self) -> u64 {
        let first = mix(mix(self.seed) ^ self.index);
        if self.shot() == 0 { first } else { mix(first ^ self.shot()) }
    }

    /// Number of the image among all that may be taken of the field, on any day.
    fn shot(&self) -> u64 {
        self.day.map_or(0, |day| (1 + u64::from(day)) << 32) + self.capture as u64
    }

    /// The LiDAR at the frame of the image, and the random numbers of its scan.
    pub fn scanner(&self) -> Option<(&Lidar, Stream)> {
        let frame = self.captures.get(self.capture)?.frame;
        let day = self.day.map_or(0, |day| (1 + u64::from(day)) << 32);
        let stream = Stream::of(self.seed, self.index, Purpose::Lidar, day + u64::from(frame));
        Some((self.scanners.get(frame as usize)?, stream))
    }

    /// Where the field came from, one `key: value` a line: program, scene files, seed, index.
    pub fn provenance(&self) -> String {
        let Self { hash, seed, index, .. } = self;
        format!("program: furrow {}\nscene: sha256 {hash}\nseed: {seed}\nindex: {index}", env!("CARGO_PKG_VERSION"))
    }

    /// Takes the photograph of a film of this field.
    pub fn photograph(&self, film: &Film) -> Photograph {
        let stream = |k| Stream::of(self.seed, self.index, Purpose::Sensor, k);
        // One sensor for all images of a field, noise of its own for each.
        let noise = 1 + self.shot();
        let illuminant = self.scene.lights.iter().fold(Spectrum::ZERO, |sum, l| sum + l.horizontal_irradiance());
        let pixels: Vec<Spectrum> = film.pixels.iter().map(|p| p.mean).collect();
        let window = film.window;
        let linear = Linear { pixels: &pixels, width: window.width(), left: window.x0, top: window.y0 };
        self.sensor.build(&mut stream(0)).expose(linear, &self.scene.camera, illuminant, &stream(noise))
    }
}
