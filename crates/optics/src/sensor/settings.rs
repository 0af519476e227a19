//! Sensor description in a scene file: the steps of the camera chain with their settings, and named cameras.

use super::chain::Sensor;
use super::chip::{AdcDesc, Depth, ExposureDesc, LimitsDesc, LimitsWritten, MosaicDesc, NoiseDesc, NoiseWritten};
use super::develop::{JpegDesc, MatrixDesc, SharpenDesc, SharpenWritten, Tone, WhiteBalanceDesc};
use super::given::{Given, layered};
use super::lens::{PsfDesc, PsfWritten};
use furrow_base::math::RoundTo;
use furrow_base::ron_file::{Fraction, Num, Vary};
use furrow_base::sampling::rng::{Purpose, Stream};
use serde::Serialize;

layered! {
    /// Sensor: `(…)`, where missing fields have their defaults, or a camera's name with fields that override its
    /// values. The steps after the noise are off unless a scene file or a preset enables them.
    ///
    /// ```
    /// use furrow_base::sampling::{Purpose, Stream};
    /// use furrow_optics::sensor::SensorDesc;
    /// for text in [
    ///     "(
    ///         exposure: Auto(level: Uniform(0.15, 0.21)),
    ///         nir_exposure: White(level: 0.8),
    ///         limits: (longest_ms: 10, gain_db: 18, f_number: 5.6),
    ///         white_balance: Fixed(red: 1.1, green: 1, blue: 1.4),
    ///         natural_vignetting: true,
    ///         corner_shading: 0.1,
    ///         noise: (on: false),
    ///         tone: Srgb,
    ///     )",
    ///     "(
    ///         psf: (color_px: 0.6, nir_px: 0.8, red_shift_px: 0.3),
    ///         glare: Uniform(0.01, 0.05),
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
        /// Limits of both exposures; the default is that of the JAI AD-130.
        pub limits: LimitsDesc = LimitsWritten,
        /// White balance of the colour image; default `Reflector`.
        pub white_balance: WhiteBalanceDesc = Given<WhiteBalanceDesc>,
        /// Whether natural vignetting, cos⁴ of the angle to the optical axis, is applied; default true.
        pub natural_vignetting: bool = Given<bool>,
        /// Additional fraction of the light lost in the corners, growing with the square of the distance from the
        /// centre; default 0.05.
        pub corner_shading: Vary<Fraction> = Given<Vary<Fraction>>,
        /// Blur of the optics; default none.
        pub psf: PsfDesc = PsfWritten,
        /// Fraction of the light that lens and housing scatter evenly over the image (veiling glare, ISO 9358): 0.01 to
        /// 0.05 for clean lenses, above 0.1 for dusty ones and against the sun; default 0.
        pub glare: Vary<Fraction> = Given<Vary<Fraction>>,
        /// Shot and read noise, dark current, fixed pattern; default shot and read noise.
        pub noise: NoiseDesc = NoiseWritten,
        /// Colour filter mosaic; default `Off`. NIR has its own sensor, without a mosaic.
        pub mosaic: MosaicDesc = Given<MosaicDesc>,
        /// Analogue-to-digital conversion above a black level; default `Off`.
        pub adc: AdcDesc = Given<AdcDesc>,
        /// Matrix from the filters' colours to display colours; default `Off`.
        pub matrix: MatrixDesc = Given<MatrixDesc>,
        /// Tone curve of both images; default `Film`.
        pub tone: Tone = Given<Tone>,
        /// Sharpening of the colour image; default none.
        pub sharpen: SharpenDesc = SharpenWritten,
        /// Bits per channel of the images written by `trace render`. Above 8, 16-bit files with that many bits are
        /// written in addition to the 8-bit ones; default 8.
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
            limits: LimitsDesc::default(),
            white_balance: WhiteBalanceDesc::default(),
            natural_vignetting: true,
            corner_shading: Vary::fixed(0.05),
            psf: PsfDesc::default(),
            glare: Vary::fixed(0.0),
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
    /// Samples the sensor. Random numbers for later steps do not affect those of the first ones.
    pub fn build(&self, stream: &mut Stream) -> Sensor {
        let mut later = stream.child(Purpose::Chain, 0);
        Sensor {
            exposure: self.exposure.draw(stream),
            nir_exposure: self.nir_exposure.draw(stream),
            limits: self.limits.build(self.noise.full_well.f32()),
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
            bits: self.bits.get().trunc_to::<u32>(),
            jpeg: self.jpeg.draw(&mut later),
            glare: self.glare.draw32(&mut later),
        }
    }
}
