//! `trace species`, `trace cameras`, `trace soils`: what a scene file may name, one a line.

use furrow::input::shipped;
use furrow::ron_file::RonFile;
use furrow::sampling::{Purpose, Stream};
use furrow::scene::desc::Role;
use furrow::scene::shipped::all_species;
use furrow::sensor::{AdcDesc, CameraDesc, MosaicDesc, SensorDesc};
use furrow::soil::SoilColor;
use furrow::{Result, cli};
use std::path::PathBuf;

/// Species: file, scientific and English name, EPPO code, role, growth stages.
pub(crate) fn species() -> Result<Vec<PathBuf>> {
    let mut rows = Vec::new();
    let (all, faults) = all_species()?;
    for (_, fault) in faults {
        furrow::tell!("warning: {fault}");
    }
    for species in all {
        let desc = &species.desc;
        let codes = || desc.plant.stages.iter().map(|stage| stage.bbch).chain(desc.plant.cover_days.keys().copied());
        let role = if desc.role == Role::Crop { "crop" } else { "weed" };
        let stages = format!("BBCH {} to {}", codes().min().unwrap_or(0), codes().max().unwrap_or(0));
        rows.push([species.stem(), desc.scientific.clone(), desc.name.clone(), desc.eppo.clone(), role.into(), stages]);
    }
    cli::print_rows(&rows)?;
    Ok(Vec::new())
}

/// Cameras: name, size, field of view, sensor.
pub(crate) fn cameras() -> Result<Vec<PathBuf>> {
    let mut rows = Vec::new();
    for (name, model) in CameraDesc::NAMED {
        let desc: CameraDesc = RonFile::of(&format!("{name}()")).parse()?;
        let camera = desc.build(&mut Stream::of(0, 0, Purpose::Page, 0))?;
        let [fx, fy, ..] = camera.intrinsics();
        let (width, height) = (f64::from(model.size.0), f64::from(model.size.1));
        let degrees = |pixels: f64, focal: f64| 2.0 * (0.5 * pixels / focal).atan().to_degrees();
        let mm = |pixels: f64| pixels * model.pixel_um * 1e-3;
        rows.push([
            (*name).to_owned(),
            format!("{width} × {height} pixels"),
            format!("{:.1}° × {:.1}°", degrees(width, fx), degrees(height, fy)),
            format!("{:.2} × {:.2} mm, pixels of {} µm", mm(width), mm(height), model.pixel_um),
            chip(&RonFile::of(name).parse()?, model.readout_ms),
        ]);
    }
    let any = "the scene file says size, intrinsics, pose and sensor";
    rows.push(["Pinhole", "any size", "any field of view", "any sensor", any].map(str::to_owned));
    cli::print_rows(&rows)?;
    Ok(Vec::new())
}

/// What the sensor of a camera does, in words.
fn chip(sensor: &SensorDesc, readout_ms: f64) -> String {
    let shutter =
        if readout_ms > 0.0 { format!("rolling shutter of {readout_ms} ms") } else { "global shutter".to_owned() };
    let mosaic = if matches!(sensor.mosaic, MosaicDesc::Off) { "no mosaic" } else { "Bayer mosaic" };
    let bits = match &sensor.adc {
        AdcDesc::Bits { bits, .. } => format!("{} bits", bits.get()),
        AdcDesc::Off => "no quantization".to_owned(),
    };
    format!("{mosaic}, {bits}, {shutter}")
}

/// Soils: measured colours with their reflectances, and pictures of layers.
pub(crate) fn soils() -> Result<Vec<PathBuf>> {
    let mut rows: Vec<[String; 3]> = Vec::new();
    for color in SoilColor::ALL {
        let [r, g, b, nir] = color.reflectance(&mut |_| unreachable!("soils that ship name no file"))?.to_array();
        let reflectance = format!("reflectance R {r:.3}, G {g:.3}, B {b:.3}, NIR {nir:.3}");
        rows.push([format!("{color:?}"), format!("colors: [{color:?}]"), reflectance]);
    }
    for albedo in shipped::soil_textures()? {
        let name = albedo.file_stem().unwrap_or_default().to_string_lossy();
        let layer = format!("layers: [(albedo: \"{name}.png\", height: \"{name}.height.png\", …)]");
        rows.push([name.to_string(), layer, albedo.display().to_string()]);
    }
    cli::print_rows(&rows)?;
    Ok(Vec::new())
}
