//! Boxes around the plants of an image, in the world and in the camera's frame.

use crate::model::box3::UprightBox;
use crate::model::sample::PlantBoxes;
use furrow_base::math::{DVec3, Vec3};
use furrow_field::Field;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Returns the boxes of these plants by number, around all vertices of their meshes.
pub fn boxes(field: &Field, plants: impl Iterator<Item = u32>) -> BTreeMap<u32, PlantBoxes> {
    let mut parts: BTreeMap<u32, Vec<usize>> = plants.map(|plant| (plant, Vec::new())).collect();
    for (i, part) in field.scene.parts.iter().enumerate() {
        if let Some(parts) = parts.get_mut(&part.tag.plant) {
            parts.push(i);
        }
    }
    let camera = field.scene.camera.record();
    let eye = DVec3::from_array(camera.position_m);
    let [right, down, forward] = camera.world_to_camera.map(DVec3::from_array);
    let of_plant = |(plant, parts): (u32, Vec<usize>)| {
        let points: Vec<DVec3> =
            parts.iter().flat_map(|part| field.scene.parts[*part].positions()).map(Vec3::as_dvec3).collect();
        // The third axis is that of the rotation: up in the world, down in the camera's frame.
        let in_camera = |p: &DVec3| {
            let at = *p - eye;
            DVec3::new(at.dot(right), at.dot(forward), at.dot(down))
        };
        let turned: Vec<DVec3> = points.iter().map(in_camera).collect();
        Some((plant, PlantBoxes { world: UprightBox::around(&points)?, camera: UprightBox::around(&turned)? }))
    };
    parts.into_par_iter().filter_map(of_plant).collect()
}
