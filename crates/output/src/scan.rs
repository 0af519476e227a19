//! `scan.ply`: LiDAR measurements of a field, with the properties of a [cloud](super::cloud) and additional ones; and the
//! same points as LAS and LAZ.

use super::cloud::{Cloud, Column, Point, Value};
use super::las::{self, Extra, Las};
use super::write_together;
use furrow_base::math::{ToInt, Vec3};
use furrow_base::{Error, Result};
use furrow_field::Field;
use furrow_optics::sensor::Lidar;
use furrow_optics::texture::ColorSpace;
use furrow_render::render::Echo;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// Additional properties of a scan's points.
const COLUMNS: [Column; 9] = [
    Column::float("range"),
    Column::float("intensity"),
    Column::float("reflectance"),
    Column::float("azimuth"),
    Column::float("time"),
    Column::int("beam"),
    Column::uchar("return_number"),
    Column::uchar("number_of_returns"),
    Column::double("plant_id"),
];

/// Returns the points of a scan of a field.
pub fn cloud(field: &Field, lidar: &Lidar, echoes: &[Echo]) -> Cloud {
    let mut cloud = Cloud::with(&COLUMNS);
    cloud.comment(&field.provenance());
    let vector = |name: &str, v: Vec3| format!("lidar {name}: {} {} {}", v.x, v.y, v.z);
    cloud.comment(&vector("position_m", lidar.position));
    for (name, axis) in [("right", lidar.axes.x_axis), ("ahead", lidar.axes.y_axis), ("up", lidar.axes.z_axis)] {
        cloud.comment(&vector(name, axis));
    }
    cloud.comment(&vector("velocity_m_s", lidar.velocity));
    let ids = field.identities();
    for echo in echoes {
        let part = &field.scene.parts[echo.part.to_usize()];
        let [r, g, b, nir] = echo.reflectance.to_array().map(|linear| ColorSpace::Srgb.encode(linear));
        let point = Point {
            at: echo.at().to_array(),
            normal: echo.normal.to_array(),
            rgb: [r, g, b],
            nir,
            kind: [part.tag.class as u8, field.kinds[echo.part.to_usize()].number()],
            plant: part.tag.plant,
            leaf: part.tag.leaf,
        };
        let pulse = &echo.pulse;
        cloud.add_with(
            &point,
            &[
                Value::Float(echo.range),
                Value::Float(echo.intensity),
                Value::Float(echo.apparent_reflectance()),
                Value::Float(pulse.azimuth_deg),
                Value::Float(pulse.time_s),
                Value::Int(pulse.beam.into()),
                Value::Uchar(echo.number),
                Value::Uchar(echo.count),
                Value::Double(ids.get(&part.tag.plant).copied().unwrap_or(0).into()),
            ],
        );
    }
    cloud
}

/// Extra attributes of a scan's points in LAS files.
const EXTRA: [Extra; 3] = [
    Extra::long("plant_id", "identity of the plant, 0 none"),
    Extra::short("leaf", "number of the leaf, 0 none"),
    Extra::short("beam", "number of the beam, from 0"),
];

/// Returns the points of a scan as LAS. The intensity is the apparent reflectance, the scan angle the azimuth of the pulse,
/// the time that since the start of the rotation.
fn las(field: &Field, echoes: &[Echo]) -> Las {
    let mut las = Las::new(&EXTRA, false);
    let ids = field.identities();
    for echo in echoes {
        let part = echo.part.to_usize();
        let tag = field.scene.parts[part].tag;
        let pulse = &echo.pulse;
        let point = las::Point {
            at: echo.at(),
            intensity: echo.apparent_reflectance(),
            returns: [echo.number, echo.count],
            kind: [tag.class as u8, field.kinds[part].number()],
            azimuth_deg: pulse.azimuth_deg,
            time_s: pulse.time_s.into(),
            colors: None,
        };
        let id = ids.get(&tag.plant).copied().unwrap_or(0);
        las.add(&point, &[&id.to_le_bytes()[..], &tag.leaf.to_le_bytes(), &pulse.beam.to_le_bytes()].concat());
    }
    las
}

/// Further files of a scan.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Further {
    /// Whether `scan.las` is written.
    pub las: bool,
    /// Whether `scan.laz` is written.
    pub laz: bool,
}

/// Writes `scan.ply` into `folder`, and the further files; removes those of an earlier scan.
pub fn write(folder: &Path, field: &Field, lidar: &Lidar, echoes: &[Echo], further: Further) -> Result<Vec<PathBuf>> {
    let version = env!("CARGO_PKG_VERSION");
    let file = cloud(field, lidar, echoes).file(version);
    let points = (further != Further::default()).then(|| las(field, echoes));
    let others = [("scan.las", further.las), ("scan.laz", further.laz)].map(|(name, is)| (folder.join(name), is));
    let paths = write_together(folder, |together| {
        together.add(&folder.join("scan.ply"), &file)?;
        for (compressed, (path, wanted)) in [false, true].into_iter().zip(&others) {
            if let Some(points) = points.as_ref().filter(|_| *wanted) {
                together.add(path, &points.file("simulated LiDAR", version, compressed)?)?;
            }
        }
        Ok(())
    })?;
    for (path, _) in others.iter().filter(|(_, wanted)| !wanted) {
        match fs::remove_file(path) {
            Err(error) if error.kind() != ErrorKind::NotFound => return Err(Error::io(path)(error)),
            _ => {}
        }
    }
    Ok(paths)
}
