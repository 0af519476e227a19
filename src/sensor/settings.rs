//! A sensor as a page writes it: each step of the camera chain with its switch, and cameras by their names.

use super::adc::{AdcDesc, Depth};
use super::balance::WhiteBalanceDesc;
use super::bayer::MosaicDesc;
use super::exposure::ExposureDesc;
use super::given::{Given, layered};
use super::jpeg::JpegDesc;
use super::matrix::MatrixDesc;
use super::noise::{NoiseDesc, NoiseWritten};
use super::preset;
use super::psf::{PsfDesc, PsfWritten};
use super::response::Sensor;
use super::sharpen::{SharpenDesc, SharpenWritten};
use super::tone::Tone;
use crate::ron_file::{self, Fraction, Num, Vary};
use crate::sampling::rng::{Purpose, Stream};
use serde::{Deserialize, Deserializer, Serialize};

layered! {
    /// A sensor, as it is written: `(…)` with every field as its default says, or a camera's name, whose values any field replaces.
    /// The steps behind the noise are off unless a page or a preset asks for them.
    ///
    /// ```
    /// use furrow::sampling::{Purpose, Stream};
    /// use furrow::sensor::SensorDesc;
    /// for page in [
    ///     "(
    ///         exposure: Auto(level: Uniform(0.15, 0.21)),
    ///         nir_exposure: White(level: 0.8),
    ///         white_balance: Fixed(red: 1.1, green: 1, blue: 1.4),
    ///         natural_vignetting: true,
    ///         corner_shading: 0.1,
    ///         noise: (on: false),
    ///         tone: Srgb,
    ///     )",
    ///     "(
    ///         psf: (color_px: 0.6, nir_px: 0.8, red_shift_px: 0.3),
    ///         noise: (full_well: 10000, read: 3, dark_current: 5, dsnu: 2, prnu: 0.01, body: 7),
    ///         mosaic: Bayer(pattern: Grbg, demosaic: MalvarHeCutler),
    ///         adc: Bits(bits: 12),
    ///         matrix: Rows((1.6, -0.5, -0.1), (-0.2, 1.5, -0.3), (0, -0.6, 1.6)),
    ///         tone: Gamma(2.2),
    ///         sharpen: (amount: 0.5, radius_px: 1),
    ///         bits: 12,
    ///         jpeg: On(quality: Uniform(70, 95)),
    ///     )",
    ///     "JaiAd130",
    ///     "Phone(jpeg: Off, matrix: Saturation(1.1), noise: (read: 5))",
    ///     "MachineVision(exposure: Auto(level: 0.12))",
    /// ] {
    ///     let desc: SensorDesc = ron::from_str(page)?;
    ///     let sensor = desc.build(&mut Stream::of(1, 0, Purpose::Sensor, 0));
    /// }
    /// assert_eq!(ron::from_str::<SensorDesc>("()")?, SensorDesc::default());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[derive(Clone, Debug, PartialEq, Serialize)]
    pub struct SensorDesc, Written = "SensorDesc" {
        /// Exposure of the colour image; default `Auto(level: 0.18)`.
        pub exposure: ExposureDesc = Given<ExposureDesc>,
        /// Exposure of the NIR image; default `Auto(level: 0.25)`.
        pub nir_exposure: ExposureDesc = Given<ExposureDesc>,
        /// White balance of the colour image; default `Reflector`.
        pub white_balance: WhiteBalanceDesc = Given<WhiteBalanceDesc>,
        /// Whether the image darkens by cos⁴ of the angle to the optical axis; default true.
        pub natural_vignetting: bool = Given<bool>,
        /// Share of the light lost in the corners beyond that, growing with the square of the distance; default 0.05.
        pub corner_shading: Vary<Fraction> = Given<Vary<Fraction>>,
        /// Blur of the optics; default none.
        pub psf: PsfDesc = PsfWritten,
        /// Shot and read noise, dark current, fixed pattern; default shot and read noise.
        pub noise: NoiseDesc = NoiseWritten,
        /// One colour a pixel; default `Off`. NIR has a sensor of its own, without a mosaic.
        pub mosaic: MosaicDesc = Given<MosaicDesc>,
        /// Whole numbers above a black level; default `Off`.
        pub adc: AdcDesc = Given<AdcDesc>,
        /// Colours of the filters to colours of a screen; default `Off`.
        pub matrix: MatrixDesc = Given<MatrixDesc>,
        /// Tone curve of both images; default `Film`.
        pub tone: Tone = Given<Tone>,
        /// Sharpening of the colour image; default none.
        pub sharpen: SharpenDesc = SharpenWritten,
        /// Bits of the pictures that `trace render` writes: above 8 it writes 16-bit files of so many steps beside the 8-bit ones;
        /// default 8.
        pub bits: Num<Depth> = Given<Num<Depth>>,
        /// Compression of the 8-bit colour image; default `Off`.
        pub jpeg: JpegDesc = Given<JpegDesc>,
    }
}

impl<'de> Deserialize<'de> for SensorDesc {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        ron_file::from_raw(deserializer, |raw| {
            let start = raw.len() - raw.trim_start().len();
            let len = raw[start..].find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(raw.len() - start);
            let name = &raw[start..start + len];
            if name.is_empty() || name == "SensorDesc" {
                return ron_file::parse_in(raw).map(|written: Written| written.over(Self::default()));
            }
            let Some(preset) = preset::sensor(name) else {
                let help = ron_file::choose("sensors", &preset::NAMES, name);
                return Err(ron_file::Fault {
                    end: start + len,
                    ..ron_file::whole(raw, format!("unknown sensor `{name}`"), help)
                });
            };
            // Spaces for the name keep the places of what follows.
            let fields = [" ".repeat(start + len).as_str(), &raw[start + len..]].concat();
            let written = if fields.trim().is_empty() { Written::default() } else { ron_file::parse_in(&fields)? };
            Ok(written.over(preset))
        })
    }
}

impl Default for SensorDesc {
    fn default() -> Self {
        Self {
            exposure: ExposureDesc::Auto { level: Vary::fixed(0.18) },
            nir_exposure: ExposureDesc::Auto { level: Vary::fixed(0.25) },
            white_balance: WhiteBalanceDesc::default(),
            natural_vignetting: true,
            corner_shading: Vary::fixed(0.05),
            psf: PsfDesc::default(),
            noise: NoiseDesc::default(),
            mosaic: MosaicDesc::default(),
            adc: AdcDesc::default(),
            matrix: MatrixDesc::default(),
            tone: Tone::default(),
            sharpen: SharpenDesc::default(),
            bits: Num::new(8.0),
            jpeg: JpegDesc::default(),
        }
    }
}

impl SensorDesc {
    /// Draws the sensor. What the later steps draw moves nothing of the first ones.
    pub fn build(&self, stream: &mut Stream) -> Sensor {
        let mut later = stream.child(Purpose::Chain, 0);
        Sensor {
            exposure: self.exposure.draw(stream),
            nir_exposure: self.nir_exposure.draw(stream),
            white_balance: self.white_balance.draw(stream),
            natural_vignetting: self.natural_vignetting,
            corner_shading: self.corner_shading.draw32(stream),
            psf: self.psf.draw(&mut later),
            noise: self.noise.build(),
            mosaic: self.mosaic,
            adc: self.adc.build(),
            matrix: self.matrix.draw(&mut later),
            tone: self.tone,
            sharpen: self.sharpen.draw(&mut later),
            bits: self.bits.get() as u32,
            jpeg: self.jpeg.draw(&mut later),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(page: &str) -> Result<SensorDesc, String> {
        ron::from_str(page)
            .map_err(|e| ron_file::Fault::parse(&e.code.to_string()).map_or_else(|| e.to_string(), |f| f.message))
    }

    /// Expected: a name alone, with nothing or with something in brackets; what is given replaces that value and no other, also
    /// within a step; what is printed reads as the same.
    #[test]
    fn a_sensor_has_a_name_and_what_differs_from_it() {
        for name in preset::NAMES {
            let plain = read(name).unwrap();
            assert_eq!(read(&format!("{name}()")).unwrap(), plain);
            assert_eq!(
                read(&format!(" {name} ( tone: Linear, )")).unwrap(),
                SensorDesc { tone: Tone::Linear, ..plain.clone() }
            );
            let louder = read(&format!("{name}(noise: (read: 99))")).unwrap();
            let noise = NoiseDesc { read: Num::new(99.0), ..plain.noise.clone() };
            assert_eq!(louder, SensorDesc { noise, ..plain.clone() });
            assert_eq!(read(&ron::to_string(&plain).unwrap()).unwrap(), plain);
            assert_ne!(plain, SensorDesc::default());
        }
        let wrong = |page: &str| read(page).unwrap_err();
        assert!(wrong("Fone()").contains("unknown sensor `Fone`"), "{}", wrong("Fone()"));
        assert!(wrong("Phone(jpg: Off)").contains("unknown field `jpg`"));
        assert!(wrong("(noise: (red: 3))").contains("unknown field `red`"));
        assert!(wrong("(jpeg: On(quality: 101))").contains("101"));
    }

    #[test]
    fn later_steps_draw_numbers_of_their_own() {
        let page = "exposure: Auto(level: Uniform(0.1, 0.2)), corner_shading: Uniform(0, 1)";
        let sensor =
            |more: &str| read(&format!("({page}{more})")).unwrap().build(&mut Stream::of(1, 0, Purpose::Sensor, 0));
        let (few, many) =
            (sensor(""), sensor(", psf: (color_px: Uniform(0.3, 0.9)), matrix: Saturation(Uniform(1, 2))"));
        assert_eq!((few.exposure, few.corner_shading), (many.exposure, many.corner_shading));
        assert!(many.psf.color > 0.3 && many.matrix.is_some());
    }
}
