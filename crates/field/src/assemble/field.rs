//! The built field: scene, records, captures, and conversion of its films to images.

use super::illumination::LightAddress;
use super::record::{Conditions, SpeciesRecord};
use crate::drive::Capture;
use crate::{PartKind, PlantRecord};
use furrow_base::math::{Spectrum, ToInt};
use furrow_base::sampling::rng::mix;
use furrow_base::sampling::{Purpose, Stream};
use furrow_optics::sensor::{Lidar, Linear, Photograph, SensorDesc};
use furrow_render::film::Film;
use furrow_render::scene::Scene;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// One field, ready to be rendered, with its ground truth and records.
pub struct Field {
    /// Parts, materials, lights and the current camera.
    pub scene: Scene,
    /// Images taken of the field on its day; at least one.
    pub captures: Vec<Capture>,
    /// LiDAR at each frame; empty unless the field was built for a scan.
    pub scanners: Vec<Lidar>,
    /// Day of the field, counted from the emergence of its first crop; `None` if it has no days.
    pub day: Option<u32>,
    /// Index in `captures` of the image whose camera the scene has.
    pub capture: usize,
    /// Kind of each part of the scene, in the order of the parts.
    pub kinds: Vec<PartKind>,
    /// Plants, ordered by number.
    pub plants: Vec<PlantRecord>,
    /// Sensor that converts a film to an image.
    pub sensor: SensorDesc,
    /// SHA-256 of the contents of all files that were read, in hex.
    pub hash: String,
    /// Random seed.
    pub seed: u64,
    /// Index of the field in the distribution that the scene file describes.
    pub index: u64,
    /// Number of the light, 0 for the field's own. The others draw lights, exposure and sensor anew.
    pub light: u64,
    /// All species that the scene file can place, in the scene file's order; the same for all indices.
    pub species: Vec<SpeciesRecord>,
    /// Names of models from disk; [`PartKind::Named`] is an index into this list. The same for all indices.
    pub models: Vec<String>,
    /// Conditions drawn for the field.
    pub conditions: Conditions,
    /// Paths of all files that were read, sorted.
    pub files: Vec<PathBuf>,
    /// Names in the scene file that refer to files shipped with the program, with the paths of those files.
    pub shipped: BTreeMap<String, PathBuf>,
    /// Text of the scene file, with the assigned values.
    pub text: String,
    /// Values that were assigned to the scene file, each `PATH=VALUE`.
    pub assigned: Vec<String>,
    /// Warnings for the user.
    pub warnings: Vec<String>,
}

impl Field {
    /// Switches the scene to the camera of image `capture`, an index into [`Self::captures`].
    pub fn take(&mut self, capture: usize) {
        self.capture = capture;
        self.scene.camera = self.captures[capture].camera;
        self.conditions.camera = self.scene.camera.record();
    }

    /// Returns the address of the field's current light.
    pub(super) fn light_address(&self) -> LightAddress {
        LightAddress { seed: self.seed, index: self.index, light: self.light }
    }

    /// Returns the seed of the samples. Every image of the field has its own, so their noise is independent; images of the same view
    /// under other lights have the same.
    pub fn sample_seed(&self) -> u64 {
        let first = mix(mix(self.seed) ^ self.index);
        if self.shot() == 0 { first } else { mix(first ^ self.shot()) }
    }

    /// Returns the number of the image among all images of the field on all days.
    fn shot(&self) -> u64 {
        self.day.map_or(0, |day| (1 + u64::from(day)) << 32) + self.capture.to_u64()
    }

    /// Returns the LiDAR at the frame of the current image and the random stream of its scan; `None` if the field was not built for a scan.
    pub fn scanner(&self) -> Option<(&Lidar, Stream)> {
        let frame = self.captures.get(self.capture)?.frame;
        let day = self.day.map_or(0, |day| (1 + u64::from(day)) << 32);
        let stream = Stream::of(self.seed, self.index, Purpose::Lidar, day + u64::from(frame));
        Some((self.scanners.get(frame.to_usize())?, stream))
    }

    /// Returns the identities of the plants by their numbers in label maps.
    pub fn identities(&self) -> BTreeMap<u32, u32> {
        self.plants.iter().map(|plant| (plant.number, plant.id)).collect()
    }

    /// Returns the field's provenance, one `key: value` per line: program, hash of the scene files, seed, index, and the light unless it
    /// is the field's own.
    pub fn provenance(&self) -> String {
        let Self { hash, seed, index, .. } = self;
        let light = if self.light == 0 { String::new() } else { format!("\nlight: {}", self.light) };
        format!(
            "program: furrow {}\nscene: sha256 {hash}\nseed: {seed}\nindex: {index}{light}",
            env!("CARGO_PKG_VERSION")
        )
    }

    /// Converts a film of this field to an image with the field's sensor model.
    pub fn photograph(&self, film: &Film) -> Photograph {
        let stream = |k| self.light_address().stream(Purpose::Sensor, k);
        // One sensor for all images of a field under the same light, independent noise for each image.
        let noise = 1 + self.shot();
        let illuminant = self.scene.lights.iter().fold(Spectrum::ZERO, |sum, l| sum + l.horizontal_irradiance());
        let pixels: Vec<Spectrum> = film.pixels.iter().map(|p| p.mean).collect();
        let window = film.window;
        let linear = Linear { pixels: &pixels, width: window.width(), left: window.x0, top: window.y0 };
        self.light_address().sensor(&self.sensor).expose(linear, &self.scene.camera, illuminant, &stream(noise))
    }
}
