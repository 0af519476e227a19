//! `scan.ply`: LiDAR measurements of a field, with the properties of a [cloud](super::cloud) and additional ones.

use super::cloud::{Cloud, Column, Point, Value};
use super::{las, write_together};
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

/// Writes `scan.ply` into `folder`, and `scan.las` if `las` is set; otherwise removes the one of an earlier scan.
pub fn write(folder: &Path, field: &Field, lidar: &Lidar, echoes: &[Echo], las: bool) -> Result<Vec<PathBuf>> {
    let version = env!("CARGO_PKG_VERSION");
    let file = cloud(field, lidar, echoes).file(version);
    let other = folder.join("scan.las");
    let paths = write_together(folder, |together| {
        together.add(&folder.join("scan.ply"), &file)?;
        if las {
            together.add(&other, &las::file(field, echoes, version))?;
        }
        Ok(())
    })?;
    match if las { Ok(()) } else { fs::remove_file(&other) } {
        Err(error) if error.kind() != ErrorKind::NotFound => Err(Error::io(&other)(error)),
        _ => Ok(paths),
    }
}
