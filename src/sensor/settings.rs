//! A sensor as a scene file writes it: each step of the camera chain with its switch, and cameras by their names.

use super::chain::Sensor;
use super::chip::{AdcDesc, Depth, ExposureDesc, MosaicDesc, NoiseDesc, NoiseWritten};
use super::develop::{JpegDesc, MatrixDesc, SharpenDesc, SharpenWritten, Tone, WhiteBalanceDesc};
use super::given::{Given, layered};
use super::lens::{PsfDesc, PsfWritten};
use crate::ron_file::{Fraction, Num, Vary};
use crate::sampling::rng::{Purpose, Stream};
use serde::Serialize;

layered! {
    /// A sensor: `(…)` with every field as its default says, or a camera's name, whose values any field replaces.
    /// The steps behind the noise are off unless a scene file or a preset asks for them.
    ///
    /// ```
    /// use furrow::sampling::{Purpose, Stream};
    /// use furrow::sensor::SensorDesc;
    /// for text in [
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
    ///     let desc: SensorDesc = ron::from_str(text)?;
    ///     let sensor = desc.build(&mut Stream::of(1, 0, Purpose::Sensor, 0));
    /// }
    /// assert_eq!(ron::from_str::<SensorDesc>("()")?, SensorDesc::default());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[derive(Clone, Debug, PartialEq, Serialize, schemars::JsonSchema)]
    #[schemars(default)]
    pub struct SensorDesc, SensorWritten = "SensorDesc" {
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
