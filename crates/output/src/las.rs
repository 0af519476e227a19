//! LAS files of points, for programs that read no PLY, and LAZ files, their compressed form.
//!
//! LAS 1.4 with point format 6, or 8 if the points have colours, and extra bytes. Coordinates are those of the field, in
//! metres, stored in steps of 0.1 mm; the coordinate system is a local one without a place on the Earth.
//!
//! | field | contents |
//! |---|---|
//! | classification | 2 (ground) for soil, 64 for crop, 65 for weed: numbers from 64 are free for users |
//! | user data | organ or object, numbered as `part` in PLY files |
//!
//! Sources: ASPRS 2019, "LAS Specification 1.4 - R15", tables 2, 15 to 19 and 24; OGC 01-009, "Coordinate Transformation
//! Services", 7.2, for the text of the coordinate system. LAZ is written by the crate `laz`.

use furrow_base::math::{RoundTo, ToInt, Vec3};
use furrow_base::{Error, Result};
use furrow_render::scene::tag::Class;
use laz::{LasZipCompressor, LasZipError, LazItemRecordBuilder, LazVlr};
use std::io::{Cursor, Seek, SeekFrom};

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
/// Global encoding: the coordinate reference system is text, which formats from 6 on demand.
const WKT: u16 = 1 << 4;
/// Coordinate system of a field.
const SYSTEM: &str = "LOCAL_CS[\"Furrow field\",LOCAL_DATUM[\"Origin of the field\",0],UNIT[\"metre\",1],\
                      AXIS[\"X\",EAST],AXIS[\"Y\",NORTH],AXIS[\"Z\",UP]]\0";
/// Largest return number of these formats.
const MOST_RETURNS: u8 = 15;
/// Bit of the format's number that marks compressed points.
const COMPRESSED: u8 = 1 << 7;

/// Extra attribute of a point.
pub(super) struct Extra {
    /// Type as in table 24.
    kind: u8,
    size: u16,
    name: &'static str,
    about: &'static str,
}

impl Extra {
    /// Creates a 16-bit attribute.
    pub(super) const fn short(name: &'static str, about: &'static str) -> Self {
        Self { kind: 3, size: 2, name, about }
    }

    /// Creates a 32-bit attribute.
    pub(super) const fn long(name: &'static str, about: &'static str) -> Self {
        Self { kind: 5, size: 4, name, about }
    }

    /// Creates a single-precision attribute.
    pub(super) const fn float(name: &'static str, about: &'static str) -> Self {
        Self { kind: 9, size: 4, name, about }
    }
}

/// A point, without its extra attributes.
pub(super) struct Point {
    /// Position, metres.
    pub(super) at: Vec3,
    /// Intensity from 0 to 1.
    pub(super) intensity: f32,
    /// Number of the return, from 1, and number of returns of the pulse.
    pub(super) returns: [u8; 2],
    /// Class, and organ or object, as in [`cloud::Point`](super::cloud::Point).
    pub(super) kind: [u8; 2],
    /// Scan angle.
    pub(super) azimuth_deg: f32,
    /// Seconds.
    pub(super) time_s: f64,
    /// 8-bit red, green, blue and near infrared, for points with colours.
    pub(super) colors: Option<[u8; 4]>,
}

/// Builder of a file.
pub(super) struct Las {
    extra: &'static [Extra],
    colored: bool,
    points: Vec<u8>,
    /// Points by their return number.
    returns: [u64; 15],
    /// Smallest and largest coordinates, in steps.
    bounds: Option<[[i32; 3]; 2]>,
}

impl Las {
    /// Creates a file of points with these extra attributes, with or without colours.
    pub(super) fn new(extra: &'static [Extra], colored: bool) -> Self {
        Self { extra, colored, points: Vec::new(), returns: [0; 15], bounds: None }
    }

    /// Adds a point with the bytes of its extra attributes.
    pub(super) fn add(&mut self, point: &Point, extra: &[u8]) {
        let at = point.at.to_array().map(|metres| (f64::from(metres) / STEP).round_to::<i32>());
        let [low, high] = self.bounds.unwrap_or([at; 2]);
        self.bounds =
            Some([[0, 1, 2].map(|axis| low[axis].min(at[axis])), [0, 1, 2].map(|axis| high[axis].max(at[axis]))]);
        let [number, count] = point.returns.map(|number| number.clamp(1, MOST_RETURNS));
        self.returns[usize::from(number) - 1] += 1;
        let (begin, length) = (self.points.len(), usize::from(self.length()));
        let out = &mut self.points;
        out.extend(at.map(i32::to_le_bytes).as_flattened());
        out.extend((point.intensity * f32::from(u16::MAX)).round_to::<u16>().to_le_bytes());
        out.push(number | count << 4);
        out.extend([0, class(point.kind[0]), point.kind[1]]);
        out.extend((wrapped(point.azimuth_deg) / ANGLE_STEP).round_to::<i16>().to_le_bytes());
        out.extend([0; 2]);
        out.extend(point.time_s.to_le_bytes());
        // 255 of 8 bits is 65535 of 16.
        out.extend(point.colors.iter().flatten().flat_map(|color| (u16::from(*color) * 257).to_le_bytes()));
        out.extend(extra);
        debug_assert_eq!(out.len() - begin, length);
    }

    /// Returns the number of the point format.
    fn format(&self) -> u8 {
        if self.colored { 8 } else { 6 }
    }

    /// Returns the bytes of the extra attributes of a point.
    fn extra_length(&self) -> u16 {
        self.extra.iter().map(|extra| extra.size).sum()
    }

    /// Returns the bytes of a point.
    fn length(&self) -> u16 {
        (if self.colored { 38 } else { 30 }) + self.extra_length()
    }

    /// Returns the file as LAS, or with `compressed` as LAZ, with `source` as the system and `version` as that of the
    /// generating program.
    pub(super) fn file(&self, source: &str, version: &str, compressed: bool) -> Result<Vec<u8>> {
        let mut records = vec![(("LASF_Projection", 2112, "coordinate system"), SYSTEM.as_bytes().to_vec())];
        records.push((("LASF_Spec", 4, "extra bytes"), self.extra.iter().flat_map(described).collect()));
        let packing = if compressed { Some(self.packing()?) } else { None };
        if let Some(packing) = &packing {
            let mut bytes = Vec::new();
            packing.write_to(&mut bytes).map_err(failed)?;
            records.push(((LazVlr::USER_ID, LazVlr::RECORD_ID, "points compressed by LASzip"), bytes));
        }
        let length: usize = records.iter().map(|(_, bytes)| usize::from(RECORD_HEADER) + bytes.len()).sum();
        let mut out = self.header(source, version, [records.len(), usize::from(HEADER) + length], compressed);
        for ((user, number, about), bytes) in records {
            out.extend([0; 2]);
            out.extend(text::<16>(user));
            out.extend(u16::to_le_bytes(number));
            out.extend(bytes.len().to_u16().to_le_bytes());
            out.extend(text::<32>(about));
            out.extend(bytes);
        }
        match packing {
            Some(packing) => packed(out, &self.points, packing).map_err(failed),
            None => Ok([out, self.points.clone()].concat()),
        }
    }

    /// Returns the header for a number of records, and points that begin at byte `begin`.
    fn header(&self, source: &str, version: &str, [records, begin]: [usize; 2], compressed: bool) -> Vec<u8> {
        let mut out = Vec::with_capacity(begin);
        out.extend(b"LASF");
        out.extend([0; 2]);
        out.extend(WKT.to_le_bytes());
        out.extend([0; 16]);
        out.extend([1, 4]);
        out.extend(text::<32>(source));
        out.extend(text::<32>(&format!("furrow {version}")));
        // No date: equal points have equal files.
        out.extend([0; 4]);
        out.extend(HEADER.to_le_bytes());
        out.extend(begin.to_u32().to_le_bytes());
        out.extend(records.to_u32().to_le_bytes());
        out.push(self.format() | if compressed { COMPRESSED } else { 0 });
        out.extend(self.length().to_le_bytes());
        // Numbers of points of earlier versions.
        out.extend([0; 4 * 6]);
        out.extend([STEP; 3].map(f64::to_le_bytes).as_flattened());
        out.extend([0.0_f64; 3].map(f64::to_le_bytes).as_flattened());
        let [low, high] = self.bounds.unwrap_or_default();
        for (low, high) in low.into_iter().zip(high) {
            out.extend([high, low].map(|at| (f64::from(at) * STEP).to_le_bytes()).as_flattened());
        }
        // No waveforms and no extended records.
        out.extend([0; 8 + 8 + 4]);
        out.extend(self.returns.iter().sum::<u64>().to_le_bytes());
        out.extend(self.returns.map(u64::to_le_bytes).as_flattened());
        out
    }

    /// Returns the description of the compression.
    fn packing(&self) -> Result<LazVlr> {
        let items = LazItemRecordBuilder::default_for_point_format_id(self.format(), self.extra_length());
        Ok(LazVlr::from_laz_items(items.map_err(failed)?))
    }
}

/// Appends compressed points to the beginning of a file.
fn packed(begin: Vec<u8>, points: &[u8], packing: LazVlr) -> Result<Vec<u8>, LasZipError> {
    let mut out = Cursor::new(begin);
    out.seek(SeekFrom::End(0))?;
    let mut compressor = LasZipCompressor::new(&mut out, packing)?;
    compressor.compress_many(points)?;
    compressor.done()?;
    drop(compressor);
    Ok(out.into_inner())
}

fn failed(error: impl std::fmt::Display) -> Error {
    Error::failed(format!("cannot compress points: {error}"))
}

/// Returns the description of an extra attribute, with neither limits nor a scale.
fn described(extra: &Extra) -> Vec<u8> {
    let mut out = vec![0, 0, extra.kind, 0];
    out.extend(text::<32>(extra.name));
    out.resize(usize::from(DESCRIPTION) - 32, 0);
    out.extend(text::<32>(extra.about));
    out
}

/// Returns an angle between -180 and 180 degrees.
fn wrapped(degrees: f32) -> f32 {
    degrees - 360.0 * (degrees / 360.0).round()
}

/// Returns the classification of a class.
fn class(number: u8) -> u8 {
    if number == Class::Soil as u8 { 2 } else { 63 + number }
}

/// Returns a text filled up with zeros, or cut to `N` bytes.
fn text<const N: usize>(words: &str) -> [u8; N] {
    let mut bytes = [0; N];
    bytes.iter_mut().zip(words.bytes()).for_each(|(to, byte)| *to = byte);
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::math::vec3;

    const EXTRA: [Extra; 2] = [Extra::long("plant_id", "identity"), Extra::short("leaf", "leaf")];

    fn las(colored: bool, count: u32) -> Las {
        let mut las = Las::new(&EXTRA, colored);
        for k in 0..count {
            let along = f64::from(k).round_to::<u8>();
            let point = Point {
                at: vec3(f32::from(along) * 0.01, -2.0, 0.5),
                intensity: 0.25,
                returns: [1 + along % 2, 2],
                kind: [along % 3, along],
                azimuth_deg: 350.0,
                time_s: f64::from(k) * 1e-3,
                colors: colored.then_some([along, 10, 255, 0]),
            };
            las.add(&point, &[&k.to_le_bytes()[..], &[7, 0]].concat());
        }
        las
    }

    /// Expected: header, three records and points; the compressed points of both formats are those of LAS, also of none
    /// and of more than one chunk. Source: `laz`, which reads the files of LASzip.
    #[test]
    fn compressed_points_are_those_of_las() {
        for (colored, count) in [(false, 0), (false, 200), (true, 200), (true, 50_100)] {
            let las = las(colored, count);
            let plain = las.file("test", "1", false).unwrap();
            let begin = u32::from_le_bytes(plain[96..100].try_into().unwrap()).to_usize();
            assert_eq!((plain[104], &plain[begin..]), (las.format(), &las.points[..]));
            assert_eq!((plain[100], plain[6] & 16), (2, 16), "two records, one of them the coordinate system");
            let packed = las.file("test", "1", true).unwrap();
            let begin = u32::from_le_bytes(packed[96..100].try_into().unwrap()).to_u64();
            assert_eq!((packed[104], packed[100]), (las.format() | 128, 3));
            assert!(count < 200 || packed.len() * 2 < plain.len(), "{} of {}", packed.len(), plain.len());
            let mut file = Cursor::new(&packed);
            file.set_position(begin);
            let mut points = vec![0; las.points.len()];
            let mut reader = laz::LasZipDecompressor::new(file, las.packing().unwrap()).unwrap();
            reader.decompress_many(&mut points).unwrap();
            assert_eq!(points, las.points, "{colored} {count}");
        }
    }

    /// Expected: the bytes of a point, written by hand after tables 15 and 19; 350° is -10°.
    #[test]
    fn a_point_has_the_fields_of_its_format() {
        let las = las(true, 3);
        let point = &las.points[2 * 44..];
        assert_eq!(point[..4], 200_i32.to_le_bytes());
        assert_eq!(point[4..8], (-20_000_i32).to_le_bytes());
        assert_eq!(point[12..18], [0, 64, 1 | 2 << 4, 0, 65, 2]);
        assert_eq!(i16::from_le_bytes([point[18], point[19]]), -1667);
        assert_eq!(point[30..38], [2, 2, 10, 10, 255, 255, 0, 0]);
        assert_eq!(point[38..], [2, 0, 0, 0, 7, 0]);
        assert_eq!(las.bounds, Some([[0, -20_000, 5000], [200, -20_000, 5000]]));
    }
}
