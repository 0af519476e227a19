//! LAS files of LiDAR scans, for programs that read no PLY.
//!
//! LAS 1.4 with point format 6, and the extra bytes `plant_id`, `leaf` and `beam`. Coordinates are those of the field,
//! in metres, stored in steps of 0.1 mm.
//!
//! | field | contents |
//! |---|---|
//! | intensity | apparent reflectance, intensity · range²; 65535 is that of a white, matt surface at normal incidence |
//! | classification | 2 (ground) for soil, 64 for crop, 65 for weed: numbers from 64 are free for users |
//! | user data | organ or object, numbered as `part` in `scan.ply` |
//! | scan angle | azimuth of the pulse from the LiDAR's front, in steps of 0.006° |
//! | GPS time | seconds since the start of the rotation |
//!
//! Source: ASPRS 2019, "LAS Specification 1.4 - R15", tables 2, 15, 16 and 24.

use furrow_base::math::{RoundTo, ToInt, Vec3};
use furrow_field::Field;
use furrow_render::render::Echo;
use furrow_render::scene::tag::Class;

/// Metres per step of a coordinate.
const STEP: f64 = 1e-4;
/// Degrees per step of a scan angle.
const ANGLE_STEP: f32 = 0.006;
/// Bytes of the header.
const HEADER: u16 = 375;
/// Bytes of the header of a variable length record.
const RECORD_HEADER: u16 = 54;
/// Bytes of the description of one extra attribute.
const DESCRIPTION: u16 = 192;
/// Bytes of a point of format 6.
const POINT: u16 = 30;
/// Global encoding: coordinate reference systems are WKT, which format 6 demands. There is none.
const WKT: u16 = 1 << 4;
/// Largest return number of format 6.
const MOST_RETURNS: u8 = 15;
/// Extra attributes of a point: type as in table 24, size in bytes, name and description.
const EXTRA: [(u8, u16, &str, &str); 3] = [
    (5, 4, "plant_id", "identity of the plant, 0 none"),
    (3, 2, "leaf", "number of the leaf, 0 none"),
    (3, 2, "beam", "number of the beam, from 0"),
];

/// Returns the file of a scan of a field, with `version` as that of the generating program.
pub(super) fn file(field: &Field, echoes: &[Echo], version: &str) -> Vec<u8> {
    let extra: u16 = EXTRA.iter().map(|(_, size, ..)| size).sum();
    let described = DESCRIPTION * EXTRA.len().to_u16();
    let begin = u32::from(HEADER + RECORD_HEADER + described);
    let mut returns = [0_u64; 15];
    for echo in echoes {
        returns[usize::from(return_number(echo.number)) - 1] += 1;
    }
    let places = echoes.iter().map(|echo| steps(echo.at()));
    let [lo, hi] = places.clone().fold([[i32::MAX; 3], [i32::MIN; 3]], |[lo, hi], at| {
        [0, 1].map(|end| [0, 1, 2].map(|axis| if end == 0 { at[axis].min(lo[axis]) } else { at[axis].max(hi[axis]) }))
    });
    let bounds = if echoes.is_empty() { [[0; 3]; 2] } else { [lo, hi] };

    let mut out = Vec::new();
    out.extend(b"LASF");
    out.extend(0_u16.to_le_bytes());
    out.extend(WKT.to_le_bytes());
    out.extend([0; 16]);
    out.extend([1, 4]);
    out.extend(text::<32>("simulated LiDAR"));
    out.extend(text::<32>(&format!("furrow {version}")));
    // No date: equal scans have equal files.
    out.extend([0; 4]);
    out.extend(HEADER.to_le_bytes());
    out.extend(begin.to_le_bytes());
    out.extend(1_u32.to_le_bytes());
    out.push(6);
    out.extend((POINT + extra).to_le_bytes());
    // Numbers of points of earlier versions.
    out.extend([0; 4 * 6]);
    out.extend([STEP; 3].map(f64::to_le_bytes).concat());
    out.extend([0.0_f64; 3].map(f64::to_le_bytes).concat());
    for (low, high) in bounds[0].into_iter().zip(bounds[1]) {
        out.extend([high, low].map(|at| (f64::from(at) * STEP).to_le_bytes()).concat());
    }
    // No waveforms and no extended records.
    out.extend([0; 8 + 8 + 4]);
    out.extend(echoes.len().to_u64().to_le_bytes());
    out.extend(returns.map(u64::to_le_bytes).concat());

    out.extend([0; 2]);
    out.extend(text::<16>("LASF_Spec"));
    out.extend(4_u16.to_le_bytes());
    out.extend(described.to_le_bytes());
    out.extend(text::<32>("extra bytes"));
    for (kind, _, name, words) in EXTRA {
        out.extend([0, 0, kind, 0]);
        out.extend(text::<32>(name));
        // Neither limits nor a scale.
        out.extend([0; 4 + 5 * 24]);
        out.extend(text::<32>(words));
    }

    let ids = field.identities();
    for echo in echoes {
        let part = echo.part.to_usize();
        let tag = field.scene.parts[part].tag;
        let pulse = &echo.pulse;
        out.extend(steps(echo.at()).map(i32::to_le_bytes).concat());
        out.extend((echo.apparent_reflectance() * f32::from(u16::MAX)).round_to::<u16>().to_le_bytes());
        out.push(return_number(echo.number) | return_number(echo.count) << 4);
        out.extend([0, class(tag.class), field.kinds[part].number()]);
        out.extend((wrapped(pulse.azimuth_deg) / ANGLE_STEP).round_to::<i16>().to_le_bytes());
        out.extend(0_u16.to_le_bytes());
        out.extend(f64::from(pulse.time_s).to_le_bytes());
        out.extend(ids.get(&tag.plant).copied().unwrap_or(0).to_le_bytes());
        out.extend(tag.leaf.to_le_bytes());
        out.extend(pulse.beam.to_le_bytes());
    }
    out
}

/// Returns a position in steps.
fn steps(at: Vec3) -> [i32; 3] {
    at.to_array().map(|metres| (f64::from(metres) / STEP).round_to::<i32>())
}

/// Returns a return number within the range of the format.
fn return_number(number: u8) -> u8 {
    number.clamp(1, MOST_RETURNS)
}

/// Returns an angle between -180 and 180 degrees.
fn wrapped(degrees: f32) -> f32 {
    degrees - 360.0 * (degrees / 360.0).round()
}

/// Returns the classification of a class.
fn class(class: Class) -> u8 {
    match class {
        Class::Soil => 2,
        Class::Crop => 64,
        Class::Weed => 65,
    }
}

/// Returns a text filled up with zeros, or cut to `N` bytes.
fn text<const N: usize>(words: &str) -> [u8; N] {
    let mut bytes = [0; N];
    bytes.iter_mut().zip(words.bytes()).for_each(|(to, byte)| *to = byte);
    bytes
}
