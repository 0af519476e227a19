//! `trace species`, `trace cameras`, `trace soils`: list the names that scene files can use, one per line.

use furrow_base::Result;
use furrow_base::input::shipped;
use furrow_base::ron_file::RonFile;
use furrow_base::sampling::{Purpose, Stream};
use furrow_cli::cli;
use furrow_field::desc::Role;
use furrow_field::shipped::all_species;
use furrow_grow::soil::SoilColor;
use furrow_optics::sensor::{AdcDesc, CameraDesc, MosaicDesc, SensorDesc};
use std::path::PathBuf;

/// Lists the species: file, scientific and English name, EPPO code, role, growth stages, all other names that find it.
pub(crate) fn species() -> Result<Vec<PathBuf>> {
    let mut rows = Vec::new();
    let (all, faults) = all_species()?;
    for (_, fault) in faults {
        furrow_cli::message!("warning: {fault}");
    }
    for species in all {
        let desc = &species.desc;
        let codes = || desc.plant.stages.iter().map(|stage| stage.bbch).chain(desc.plant.cover_days.keys().copied());
        let role = if desc.role == Role::Crop { "crop" } else { "weed" };
        let stages = format!("BBCH {} to {}", codes().min().unwrap_or(0), codes().max().unwrap_or(0));
        let others = species.other_names().join(", ");
        rows.push([
            species.stem(),
            desc.scientific.clone(),
            desc.name.clone(),
            desc.eppo.clone(),
            role.into(),
            stages,
            others,
        ]);
    }
    cli::print_rows(&rows)?;
    Ok(Vec::new())
}

/// Lists the cameras: name, size, field of view, sensor.
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
    let any = "size, intrinsics, pose and sensor come from the scene file";
    rows.push(["Pinhole", "any size", "any field of view", "any sensor", any].map(str::to_owned));
    cli::print_rows(&rows)?;
    Ok(Vec::new())
}

/// Describes the sensor of a camera.
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

/// Lists the soils: measured colours with their reflectances, and layer textures.
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
