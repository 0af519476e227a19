//! Named sensors. Each has a camera of the same name that defines its pixels, lens and shutter.

use super::chip::{AdcDesc, Demosaic, LimitsDesc, MosaicDesc, NoiseDesc, Pattern};
use super::develop::{JpegDesc, MatrixDesc, SharpenDesc, Tone, WhiteBalanceDesc};
use super::given;
use super::lens::PsfDesc;
use super::settings::{SensorDesc, SensorWritten};
use furrow_base::ron_file::{self, Num, Vary};
use serde::{Deserialize, Deserializer};

/// Names of sensors, each also the name of a camera.
pub const PRESETS: [&str; 3] = ["JaiAd130", "Phone", "MachineVision"];

/// Returns the sensor of a name.
fn sensor(name: &str) -> Option<SensorDesc> {
    match name {
        "JaiAd130" => Some(jai_ad130()),
        "Phone" => Some(phone()),
        "MachineVision" => Some(machine_vision()),
        _ => None,
    }
}

/// Parses `(…)`, where missing fields have their defaults, or a sensor's name with fields that override its values.
impl<'de> Deserialize<'de> for SensorDesc {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        ron_file::from_raw(deserializer, |raw| {
            let preset = |name: &str| match name {
                "" | "SensorDesc" => Some(Self::default()),
                name => sensor(name),
            };
            let (preset, written) = given::over_a_name(raw, ("sensor", "sensors"), &PRESETS, preset)?;
            Ok(SensorWritten::over(written, preset))
        })
    }
}

/// Returns a point spread with fixed values: blur of colour and NIR, and shifts of red and blue in the corners, in
/// pixels.
fn psf(color: f64, nir: f64, red: f64, blue: f64) -> PsfDesc {
    PsfDesc {
        color_px: Vary::fixed(color),
        nir_px: Vary::fixed(nir),
        red_shift_px: Vary::fixed(red),
        blue_shift_px: Vary::fixed(blue),
    }
}

const fn limits(longest_ms: f64, gain_db: f64, f_number: f64, sensitivity: f64) -> LimitsDesc {
    LimitsDesc {
        on: true,
        longest_ms: Num::new(longest_ms),
        gain_db: Num::new(gain_db),
        f_number: Num::new(f_number),
        sensitivity: Num::new(sensitivity),
    }
}

const fn bits(bits: f64) -> AdcDesc {
    AdcDesc::Bits { bits: Num::new(bits), black: Num::new(0.032), kept: false }
}

/// Returns the JAI AD-130GE: two CCDs of Sony's ICX445 class behind a prism, 10 bits. The read noise follows from the
/// signal-to-noise ratios in its data sheet, 52 dB in colour and 54 dB in NIR; dark current, non-uniformities and point
/// spread are estimates for its class. The longest exposure is one frame of 31.76 ms (manual 1036E-1201, §11.1.2); its
/// largest gain is that of another prism camera of the maker, the SW-2001Q-CL (12 dB, manual §7.13). The sensitivity is
/// that of pixels of 3.75 µm behind a lens with a transmission of 0.9, with an integral of the quantum efficiency over
/// the green band of 39 nm.
fn jai_ad130() -> SensorDesc {
    SensorDesc {
        limits: limits(31.76, 12.0, 4.0, 1.04e9),
        corner_shading: Vary::fixed(0.1),
        psf: psf(0.6, 0.8, 0.15, -0.15),
        noise: NoiseDesc {
            full_well: Num::new(7000.0),
            read: Num::new(18.0),
            read_nir: Num::new(14.0),
            dark_current: Num::new(5.0),
            dsnu: Num::new(2.0),
            prnu: Num::new(0.01),
            ..NoiseDesc::default()
        },
        mosaic: MosaicDesc::Bayer { pattern: Pattern::Rggb, demosaic: Demosaic::Bilinear },
        adc: bits(10.0),
        ..SensorDesc::default()
    }
}

/// Returns the main camera of a phone: 12 million pixels of 1.4 µm, with processing for pleasing images: more contrast
/// and saturation, sharpening, JPEG. All values are estimates for its class. NIR is that of the same sensor without an
/// infrared filter.
fn phone() -> SensorDesc {
    SensorDesc {
        // Phones correct vignetting before they store an image.
        natural_vignetting: false,
        // 1/15 s by hand, ISO 1600; pixels of 1.4 µm with a quantum efficiency of 0.6 over 100 nm.
        limits: limits(67.0, 24.0, 1.8, 2.24e8),
        white_balance: WhiteBalanceDesc::GreyWorld { strength: Vary::fixed(0.6) },
        corner_shading: Vary::fixed(0.1),
        psf: psf(0.6, 0.8, 0.3, -0.3),
        noise: NoiseDesc {
            full_well: Num::new(6000.0),
            read: Num::new(3.0),
            read_nir: Num::new(3.0),
            dark_current: Num::new(10.0),
            dsnu: Num::new(1.0),
            prnu: Num::new(0.01),
            ..NoiseDesc::default()
        },
        mosaic: MosaicDesc::Bayer { pattern: Pattern::Rggb, demosaic: Demosaic::MalvarHeCutler },
        adc: bits(10.0),
        matrix: MatrixDesc::Saturation(Vary::fixed(1.25)),
        tone: Tone::SCurve,
        sharpen: SharpenDesc { amount: Vary::fixed(0.7), radius_px: Vary::fixed(1.0) },
        jpeg: JpegDesc::On { quality: Vary::fixed(90.0), full_color: false },
        ..SensorDesc::default()
    }
}

/// Returns a machine-vision colour camera with Sony's IMX250: 5 million pixels of 3.45 µm, global shutter, 12 bits,
/// little processing. Full well and read noise are the EMVA 1288 values published by makers of cameras with this chip;
/// the longest exposure is one frame at 30 frames per second, the largest gain the analog part (24 dB) of the sensor's
/// gain of 48 dB (Teledyne Genie Nano, manual, M2450). The others are estimates for its class.
fn machine_vision() -> SensorDesc {
    SensorDesc {
        limits: limits(33.0, 24.0, 4.0, 1.3e9),
        corner_shading: Vary::fixed(0.08),
        psf: psf(0.6, 0.8, 0.2, -0.2),
        noise: NoiseDesc {
            full_well: Num::new(10_400.0),
            read: Num::new(2.4),
            read_nir: Num::new(2.4),
            dark_current: Num::new(2.0),
            dsnu: Num::new(1.0),
            prnu: Num::new(0.006),
            ..NoiseDesc::default()
        },
        mosaic: MosaicDesc::Bayer { pattern: Pattern::Rggb, demosaic: Demosaic::MalvarHeCutler },
        adc: bits(12.0),
        tone: Tone::Srgb,
        bits: Num::new(12.0),
        ..SensorDesc::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::sampling::{Purpose, Stream};

    fn read(page: &str) -> Result<SensorDesc, String> {
        ron::from_str(page)
            .map_err(|e| ron_file::Fault::parse(&e.code.to_string()).map_or_else(|| e.to_string(), |f| f.message))
    }

    /// Expected: a name is valid alone and with empty or non-empty brackets; a given value replaces only that value,
    /// also within a step; the serialised form parses to the same value.
    #[test]
    fn a_sensor_has_a_name_and_what_differs_from_it() {
        for name in PRESETS {
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
