//! Point cloud sampled uniformly from a scene's surfaces, including hidden ones, as PLY, LAS and LAZ.
//!
//! A part of area A gets n = ⌊A d⌋ or ⌈A d⌉ points, d points/m² on average. Point i is placed at the fraction (i + ξ)/n
//! of the part's area, in triangle order, so neighbouring triangles have neither gaps nor clusters. Within the triangle
//! it is uniform: (1 − √ξ₁, √ξ₁ ξ₂) (Turk 1990, "Generating random points in triangles", Graphics Gems). Points that a
//! mask cuts out are dropped.
//!
//! Colours are reflectances of the upper side seen along its normal, averaged over the mean distance between points, as
//! 8-bit sRGB codes; near infrared is encoded with the same curve.

use super::las::{self, Extra, Las};
use super::{Export, write_atomically};
use furrow_base::geometry::Hit;
use furrow_base::math::{RoundTo, ToFloat, ToInt, Vec3};
use furrow_base::sampling::{Purpose, Stream};
use furrow_base::{Error, Result};
use furrow_field::Field;
use furrow_optics::texture::ColorSpace;
use furrow_render::scene::Part;
use furrow_render::scene::tag::Class;
use std::path::Path;

/// Types and names of a point's properties, in file order. Whole numbers are `uchar` or `int`: Open3D drops `ushort` and
/// `uint`.
const PROPERTIES: [(&str, &str); 14] = [
    ("float", "x"),
    ("float", "y"),
    ("float", "z"),
    ("float", "nx"),
    ("float", "ny"),
    ("float", "nz"),
    ("uchar", "red"),
    ("uchar", "green"),
    ("uchar", "blue"),
    ("uchar", "nir"),
    ("uchar", "class"),
    ("uchar", "part"),
    ("int", "plant"),
    ("int", "leaf"),
];

/// Largest number of points in a file, 3.8 GB.
const MOST_POINTS: f64 = 1e8;

/// Properties of one point.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    /// Position, metres, world.
    pub at: [f32; 3],
    /// Unit normal.
    pub normal: [f32; 3],
    /// 8-bit sRGB.
    pub rgb: [u8; 3],
    /// 8-bit near infrared.
    pub nir: u8,
    /// Class, and part kind as its index in [`PartKind::NUMBERED`](furrow_field::PartKind::NUMBERED).
    pub kind: [u8; 2],
    /// Plant number.
    pub plant: u32,
    /// Leaf number within the plant.
    pub leaf: u16,
}

/// Additional property of a cloud's points besides those of a [`Point`].
#[derive(Clone, Copy, Debug)]
pub struct Column {
    kind: &'static str,
    name: &'static str,
}

impl Column {
    /// Creates a single-precision property.
    pub const fn float(name: &'static str) -> Self {
        Self { kind: "float", name }
    }

    /// Creates a double-precision property, which holds every unsigned 32-bit integer.
    pub const fn double(name: &'static str) -> Self {
        Self { kind: "double", name }
    }

    /// Creates a signed 32-bit integer property.
    pub const fn int(name: &'static str) -> Self {
        Self { kind: "int", name }
    }

    /// Creates an unsigned 8-bit integer property.
    pub const fn uchar(name: &'static str) -> Self {
        Self { kind: "uchar", name }
    }
}

/// Value of a point in a [`Column`] of the same type.
#[derive(Clone, Copy, Debug)]
pub enum Value {
    /// Single-precision number.
    Float(f32),
    /// Double-precision number.
    Double(f64),
    /// Signed 32-bit integer.
    Int(i32),
    /// Unsigned 8-bit integer.
    Uchar(u8),
}

impl Value {
    fn kind(self) -> &'static str {
        match self {
            Self::Float(_) => "float",
            Self::Double(_) => "double",
            Self::Int(_) => "int",
            Self::Uchar(_) => "uchar",
        }
    }
}

/// Builder of a binary, little-endian PLY file of points. Source: Turk 1994, "The PLY Polygon File Format".
#[derive(Default)]
pub struct Cloud {
    columns: &'static [Column],
    comments: Vec<String>,
    bytes: Vec<u8>,
    points: u64,
    of_soil: u64,
}

impl Cloud {
    /// Creates a cloud whose points have additional properties.
    pub fn with(columns: &'static [Column]) -> Self {
        Self { columns, ..Self::default() }
    }

    /// Adds comment lines to the file's header.
    pub fn comment(&mut self, text: &str) {
        self.comments.extend(text.lines().map(str::to_owned));
    }

    /// Adds a point with its values of the additional columns, in order.
    pub fn add_with(&mut self, point: &Point, values: &[Value]) {
        debug_assert!(values.iter().map(|v| v.kind()).eq(self.columns.iter().map(|c| c.kind)));
        self.add(point);
        for value in values {
            match value {
                Value::Float(v) => self.bytes.extend(v.to_le_bytes()),
                Value::Double(v) => self.bytes.extend(v.to_le_bytes()),
                Value::Int(v) => self.bytes.extend(v.to_le_bytes()),
                Value::Uchar(v) => self.bytes.push(*v),
            }
        }
    }

    /// Adds a point.
    pub fn add(&mut self, point: &Point) {
        let Point { at, normal, rgb, nir, kind, plant, leaf } = point;
        self.bytes.extend(at.iter().chain(normal).flat_map(|number| number.to_le_bytes()));
        self.bytes.extend(rgb);
        self.bytes.push(*nir);
        self.bytes.extend(kind);
        // At most `MOST_PLANTS`, 2²⁴ − 1, so the sign bit is never set.
        self.bytes.extend(plant.to_le_bytes());
        self.bytes.extend(i32::from(*leaf).to_le_bytes());
        self.points += 1;
        self.of_soil += u64::from(kind[0] == Class::Soil as u8);
    }

    /// Returns the number of points.
    #[must_use]
    pub fn points(&self) -> u64 {
        self.points
    }

    /// Returns the number of points of the class soil.
    #[must_use]
    pub fn of_soil(&self) -> u64 {
        self.of_soil
    }

    /// Returns the file's bytes, with `version` as the generating program's version in the header.
    #[must_use]
    pub fn file(self, version: &str) -> Vec<u8> {
        let further = self.columns.iter().map(|Column { kind, name }| (*kind, *name));
        let properties = PROPERTIES.into_iter().chain(further).map(|(kind, name)| format!("property {kind} {name}\n"));
        let properties: String = properties.collect();
        let comments: String = self.comments.iter().flat_map(|line| ["comment ", line.as_str(), "\n"]).collect();
        let points = self.points;
        let mut file = format!(
            "ply\nformat binary_little_endian 1.0\ncomment furrow {version}; world coordinates, metres, z up\n{comments}element vertex {points}\n{properties}end_header\n"
        )
        .into_bytes();
        file.extend(self.bytes);
        file
    }
}

/// Writes `points.ply` into `folder`, with `density` points per square metre on all surfaces of a field.
pub fn write(folder: &Path, field: &Field, density: f64) -> Result<Export> {
    let cloud = sample(field, density)?;
    let (points, of_soil) = (cloud.points(), cloud.of_soil());
    let path = folder.join("points.ply");
    let file = cloud.file(env!("CARGO_PKG_VERSION"));
    write_atomically(&path, &file)?;
    let amount = format!("{points} points, {of_soil} of them soil, {:.1} MB,", file.len().to_f64() * 1e-6);
    Ok(Export { paths: vec![path], warnings: Vec::new(), amount: Some(amount) })
}

/// Extra attributes of a cloud's points in LAS files.
const EXTRA: [Extra; 6] = [
    Extra::long("plant_id", "identity of the plant, 0 none"),
    Extra::long("plant", "number of the plant, 0 none"),
    Extra::short("leaf", "number of the leaf, 0 none"),
    Extra::float("nx", "normal, east"),
    Extra::float("ny", "normal, north"),
    Extra::float("nz", "normal, up"),
];

/// Writes `points.las`, or `points.laz` if `compressed`, into `folder`, with `density` points per square metre on all
/// surfaces of a field. Each point is the only return of its pulse, without an intensity.
pub fn write_las(folder: &Path, field: &Field, density: f64, compressed: bool) -> Result<Export> {
    let ids = field.identities();
    let (mut las, mut points) = (Las::new(&EXTRA, true), 0_u64);
    each(field, density, &mut |point| {
        let [r, g, b] = point.rgb;
        let written = las::Point {
            at: Vec3::from_array(point.at),
            intensity: 0.0,
            returns: [1, 1],
            kind: point.kind,
            azimuth_deg: 0.0,
            time_s: 0.0,
            colors: Some([r, g, b, point.nir]),
        };
        let id = ids.get(&point.plant).copied().unwrap_or(0);
        let mut extra = [id.to_le_bytes(), point.plant.to_le_bytes()].concat();
        extra.extend(point.leaf.to_le_bytes());
        extra.extend(point.normal.map(f32::to_le_bytes).as_flattened());
        las.add(&written, &extra);
        points += 1;
    })?;
    let path = folder.join(if compressed { "points.laz" } else { "points.las" });
    let file = las.file("sampled surfaces", env!("CARGO_PKG_VERSION"), compressed)?;
    write_atomically(&path, &file)?;
    let amount = format!("{points} points, {:.1} MB,", file.len().to_f64() * 1e-6);
    Ok(Export { paths: vec![path], warnings: Vec::new(), amount: Some(amount) })
}

/// Samples `density` points per square metre on all surfaces of a field. Returns an error if there are too many.
pub fn sample(field: &Field, density: f64) -> Result<Cloud> {
    let mut cloud = Cloud::default();
    each(field, density, &mut |point| cloud.add(point))?;
    Ok(cloud)
}

/// Calls `add` with `density` points per square metre on all surfaces of a field. Returns an error if there are too many.
fn each(field: &Field, density: f64, add: &mut dyn FnMut(&Point)) -> Result<()> {
    let area: f64 = field.scene.parts.iter().map(|part| areas(part).last().copied().unwrap_or(0.0)).sum();
    if area * density > MOST_POINTS {
        let words = format!("{:.0} points on {area:.1} m² are more than {MOST_POINTS:.0}", area * density);
        let help = format!("use a density of at most {:.0} points/m²", (MOST_POINTS / area).floor());
        return Err(Error::input(words).help(help));
    }
    for k in 0..field.scene.parts.len() {
        let mut stream = Stream::of(field.seed, field.index, Purpose::Cloud, k.to_u64());
        on_part(field, k, density, &mut stream, add);
    }
    Ok(())
}

/// Returns the cumulative area of a part's triangles, m².
fn areas(part: &Part) -> Vec<f64> {
    let mut sum = 0.0;
    let triangles = 0..part.mesh.triangles.len().to_u32();
    let add = |i: u32| {
        let [a, b, c] = part.corners(i);
        sum += 0.5 * f64::from((b - a).cross(c - a).length());
        sum
    };
    triangles.map(add).collect()
}

fn on_part(field: &Field, k: usize, density: f64, stream: &mut Stream, add: &mut dyn FnMut(&Point)) {
    let part = &field.scene.parts[k];
    let areas = areas(part);
    let Some(area) = areas.last().copied().filter(|area| *area > 0.0) else { return };
    let wanted = area * density;
    let count = wanted.floor_to::<u64>() + u64::from(stream.chance(wanted.fract()));
    let material = &field.scene.materials[part.material.to_usize()];
    let apart = density.sqrt().recip().to_f32();
    let kind = [part.tag.class as u8, field.kinds[k].number()];
    for i in 0..count {
        let share = (i.to_f64() + stream.uniform()) / count.to_f64();
        let (root, along) = (stream.uniform32().sqrt(), stream.uniform32());
        let triangle = areas.partition_point(|sum| *sum <= share * area).min(areas.len() - 1).to_u32();
        let hit = Hit { part: k.to_u32(), triangle, u: 1.0 - root, v: root * along, t: 0.0 };
        let at = part.interaction(&hit, apart);
        if part.mask.as_ref().is_some_and(|mask| !mask.opaque_at(at.uv)) {
            continue;
        }
        let colors = material.scatter(&at, at.ng).0.reflectance(1.0).to_array();
        let [r, g, b, nir] = colors.map(|linear| ColorSpace::Srgb.encode(linear));
        add(&Point {
            at: at.p.to_array(),
            normal: at.ns.to_array(),
            rgb: [r, g, b],
            nir,
            kind,
            plant: part.tag.plant,
            leaf: part.tag.leaf,
        });
    }
}
