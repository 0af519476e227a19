//! Sensors by their names. Each has a camera of the same name, with its pixels, lens and shutter.

use super::adc::AdcDesc;
use super::balance::WhiteBalanceDesc;
use super::bayer::{Demosaic, MosaicDesc, Pattern};
use super::jpeg::JpegDesc;
use super::matrix::MatrixDesc;
use super::noise::NoiseDesc;
use super::psf::PsfDesc;
use super::settings::SensorDesc;
use super::sharpen::SharpenDesc;
use super::tone::Tone;
use crate::ron_file::{Num, Vary};

/// What [`sensor`] knows.
pub(super) const NAMES: [&str; 3] = ["JaiAd130", "Phone", "MachineVision"];

/// A sensor by its name.
pub(super) fn sensor(name: &str) -> Option<SensorDesc> {
    match name {
        "JaiAd130" => Some(jai_ad130()),
        "Phone" => Some(phone()),
        "MachineVision" => Some(machine_vision()),
        _ => None,
    }
}

/// A blur of so many pixels, and red and blue beside their places in the corners.
fn psf(color: f64, nir: f64, red: f64, blue: f64) -> PsfDesc {
    PsfDesc {
        color_px: Vary::fixed(color),
        nir_px: Vary::fixed(nir),
        red_shift_px: Vary::fixed(red),
        blue_shift_px: Vary::fixed(blue),
    }
}

const fn bits(bits: f64) -> AdcDesc {
    AdcDesc::Bits { bits: Num::new(bits), black: Num::new(0.032), kept: false }
}

/// The JAI AD-130GE: two CCDs of Sony's ICX445 class behind a prism, 10 bits. Signal to noise 52 dB in colour and 54 dB in NIR, from its data
/// sheet, give the read noise; dark current, non-uniformities and the point spread are estimates for its class.
fn jai_ad130() -> SensorDesc {
    SensorDesc {
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

/// The main camera of a phone: 12 million pixels of 1.4 µm, whose pictures are made to please: more contrast and colour, sharpened, JPEG.
/// Estimates for its class; without an infrared filter NIR would be the same sensor's.
fn phone() -> SensorDesc {
    SensorDesc {
        // The fall of light towards the corners is taken out before anybody sees it.
        natural_vignetting: false,
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

/// A colour camera of machine vision with Sony's IMX250: 5 million pixels of 3.45 µm, global shutter, 12 bits, little processing. Full well
/// and read noise as makers of cameras with this chip state by EMVA 1288; the rest are estimates for its class.
fn machine_vision() -> SensorDesc {
    SensorDesc {
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
