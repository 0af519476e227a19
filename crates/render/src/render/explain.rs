//! Text description of one pixel, printed by `--pixel x,y`.

use super::{Settings, label, pixel};
use crate::integrator::{Integrator, World};
use furrow_base::geometry::{Ray, Window};
use furrow_base::math::{Spectrum, ToInt};
use std::fmt::Write;

/// Describes a pixel: its label, the surface at its centre, and the radiance of its samples. `plant` describes a plant
/// by its label number.
pub fn explain(
    world: &World<'_>,
    plant: &dyn Fn(u32) -> Option<String>,
    integrator: &dyn Integrator,
    settings: &Settings,
    x: u32,
    y: u32,
) -> String {
    let scene = world.scene;
    let window = Window { x0: x, y0: y, x1: x + 1, y1: y + 1 };
    let tag = label(world.geometry, &scene.parts, &scene.camera, window).tags[0];
    let mut text = match tag.plant {
        0 => format!("pixel {x},{y}\n  label: {}, no plant", tag.class.name()),
        _ => format!("pixel {x},{y}\n  label: {} plant {} leaf {}", tag.class.name(), tag.plant, tag.leaf),
    };
    if let Some(description) = plant(tag.plant) {
        let _ = write!(text, "\n  plant: {description}");
    }
    let (origin, direction) = scene.camera.centre_ray(x, y);
    match world.interact(&Ray::new(origin, direction), 0.0, scene.camera.pixel_angle()) {
        None => text.push_str("\n  surface: none"),
        Some((hit, at)) => {
            let part = &scene.parts[hit.part.to_usize()];
            let (bsdf, frame) = scene.materials[part.material.to_usize()].scatter(&at, -direction);
            let cos = frame.to_local(-direction).z;
            let _ = write!(
                text,
                "\n  surface: part {} triangle {} at {:.4}, {:.4}, {:.4} m, {:.3} m away\n  texture: u {:.4} v {:.4}, {} side\n  reflectance: {}",
                hit.part,
                hit.triangle,
                at.p.x,
                at.p.y,
                at.p.z,
                hit.t,
                at.uv.x,
                at.uv.y,
                if at.ng.dot(-direction) >= 0.0 { "upper" } else { "lower" },
                bands(bsdf.reflectance(cos))
            );
        }
    }
    let seen = pixel(world, integrator, settings, x, y);
    let _ = write!(
        text,
        "\n  radiance: {}\n  standard error: {}",
        bands(seen.mean),
        // One sample gives no estimate.
        match settings.spp {
            1 => "unknown (1 sample)".to_owned(),
            spp => format!("{}  ({spp} samples)", bands(seen.variance.map(f32::sqrt))),
        }
    );
    text
}

fn bands(s: Spectrum) -> String {
    let all: Vec<String> = Spectrum::NAMES.iter().zip(s.to_array()).map(|(n, v)| format!("{n} {v:.4}")).collect();
    all.join("  ")
}
