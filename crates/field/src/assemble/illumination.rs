//! Light of a field, and what follows from it: lights, exposure times of moving cameras, and the sensor.
//!
//! A field has any number of lights. Number 0 is its own; each further number draws all this anew from the scene file,
//! from children of the same random streams. Everything else of the field is the same under all of them: plants, ground
//! and its moisture, poses of cameras, samples of pixels, labels.

use super::field_day::FieldDay;
use super::lighting::{Lighting, SceneLight};
use crate::desc::FieldDesc;
use crate::drive::Capture;
use crate::library::Library;
use furrow_base::math::{Spectrum, ToInt};
use furrow_base::ron_file::{RonFile, Step};
use furrow_base::sampling::{Purpose, Stream};
use furrow_base::{Error, Result};
use furrow_optics::light::{Light, LightDesc, LightRecord};
use furrow_optics::sensor::{Sensor, SensorDesc};

/// First random stream address for the choice of a `OneOf` list; one stream for each index among the scene file's lights.
const LIGHTING: u64 = 2 << 32;
/// Maximum number of lights of a field: each is evaluated at every hit point of a ray.
const MOST_LIGHTS: usize = 256;
/// Warning about a field without light.
pub(super) const DARK: &str = "no light in the scene: the image will be black";

/// Seed, index and number of the light of a field.
#[derive(Clone, Copy)]
pub(crate) struct LightAddress {
    pub(crate) seed: u64,
    pub(crate) index: u64,
    /// Number of the light, 0 for the field's own.
    pub(crate) light: u64,
}

impl LightAddress {
    /// Returns the stream for a purpose and an address under this light.
    pub(crate) fn stream(self, purpose: Purpose, address: u64) -> Stream {
        self.relit(Stream::of(self.seed, self.index, purpose, address))
    }

    /// Returns the child of a stream of the field under this light; the stream itself under its own light.
    fn relit(self, stream: Stream) -> Stream {
        if self.light == 0 { stream } else { stream.child(Purpose::Relight, self.light) }
    }

    /// Returns the stream for an address under this light, on a day if the field has days.
    fn daily(self, today: Option<&FieldDay>, address: u64) -> Stream {
        let stream = Stream::of(self.seed, self.index, Purpose::Page, address);
        self.relit(today.map_or_else(|| stream.clone(), |today| today.stream(&stream)))
    }

    /// Draws the sensor.
    pub(super) fn sensor(self, desc: &SensorDesc) -> Sensor {
        desc.build(&mut self.stream(Purpose::Sensor, 0))
    }
}

/// Lights that a caller needs of a field.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum LightsWanted {
    /// All lights with their records.
    All,
    /// Those that determine exposure times of moving cameras, or none. The sky of a daylight takes 40 ms of computing.
    ForExposure,
}

/// The lights that a field draws.
#[derive(Default)]
pub(super) struct DrawnLights {
    pub(super) lights: Vec<Light>,
    pub(super) records: Vec<LightRecord>,
    pub(super) lighting: Vec<Lighting>,
}

impl DrawnLights {
    /// Draws the lights at an address, on a day if the field has days.
    pub(super) fn draw(
        page: &RonFile,
        desc: &FieldDesc,
        library: &mut Library,
        at: LightAddress,
        today: Option<&FieldDay>,
    ) -> Result<Self> {
        let (mut lights, mut records) = (Vec::new(), Vec::new());
        let (lighting, listed) = Self::listed(page, desc, library, at, today)?;
        for (i, SceneLight { desc: light, at: place }) in listed.into_iter().enumerate() {
            let mut open = |file: &str, infrared| library.environment_map(page, file, infrared);
            let drawn = light.draw(&mut at.daily(today, 1 + i.to_u64()), &mut open);
            let (record, drawn) = drawn.map_err(|e| page.blame(&place, e))?;
            records.push(record);
            lights.extend(drawn);
        }
        Ok(Self { lights, records, lighting })
    }

    /// Returns the errors of [`Self::draw`] that are found without computing a sky or decoding an environment map, and otherwise no
    /// lights.
    pub(super) fn check(
        page: &RonFile,
        desc: &FieldDesc,
        library: &mut Library,
        at: LightAddress,
        today: Option<&FieldDay>,
    ) -> Result<Self> {
        let (_, listed) = Self::listed(page, desc, library, at, today)?;
        for (i, SceneLight { desc: light, at: place }) in listed.into_iter().enumerate() {
            light.check(&mut at.daily(today, 1 + i.to_u64())).map_err(|e| page.blame(&place, e))?;
            for file in light.files() {
                library.check_environment_map(page, file)?;
            }
        }
        Ok(Self::default())
    }

    /// Draws the lists of lights, and notes the files of all lists.
    fn listed<'a>(
        page: &RonFile,
        desc: &'a FieldDesc,
        library: &mut Library,
        at: LightAddress,
        today: Option<&FieldDay>,
    ) -> Result<(Vec<Lighting>, Vec<SceneLight<'a>>)> {
        let lists = |place: usize| at.daily(today, LIGHTING + place.to_u64());
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
        Ok((lighting, listed))
    }

    /// Returns the warning about a field without light.
    pub(super) fn warning(&self) -> Option<String> {
        self.lights.is_empty().then(|| DARK.to_owned())
    }

    /// Sets the exposure times of cameras that blur.
    pub(super) fn expose(&self, desc: &SensorDesc, at: LightAddress, captures: &mut [Capture]) {
        if !captures.iter().any(|capture| capture.camera.blurs()) {
            return;
        }
        // The time is that of a meter: the image that would give it is not rendered yet.
        let sensor = at.sensor(desc);
        let illuminant = self.lights.iter().fold(Spectrum::ZERO, |sum, light| sum + light.horizontal_irradiance());
        for capture in captures {
            capture.camera = capture.camera.with_metered(sensor.metered_s(illuminant, &capture.camera));
        }
    }
}
