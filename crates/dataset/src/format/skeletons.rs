//! Skeletons of leaves: `skeletons/SPLIT/NAME.json`, the joints of each leaf's kinematic tree in the world and in the
//! image.
//!
//! ```text
//! { "plants": [ { "plant": 3, "id": 2711, "leaves": [ { "leaf": 1, "id": 93, "joints": [
//!     { "name": "ST1", "parent": null, "world_m": [x, y, z], "pixel": [u, v] }, … ] } ] } ] }
//! ```
//!
//! Names are those of Di Cicco et al. 2017: `ST1`… along the petiole, `B` the base of the blade, `VN1`… along the
//! midrib, `PK` its tip, and `STL1`, `STR1`… half-way out on the secondary veins left and right of `VN1`… `parent` is
//! an index in the same list. `pixel` is null behind the camera; it may be outside the image, and the joint may be
//! occluded. Plants and leaves are those of `record.json`.

use super::Format;
use crate::model::recipe::{Recipe, json};
use crate::model::sample::{Rendered, Sample};
use crate::File;
use furrow_grow::plant::PlacedJoint;
use furrow_base::Result;
use serde::Serialize;

pub(super) struct Writer;

const FOLDER: &str = "skeletons";

#[derive(Serialize)]
struct Skeletons {
    plants: Vec<PlantSkeleton>,
}

#[derive(Serialize)]
struct PlantSkeleton {
    plant: u32,
    id: Option<u32>,
    leaves: Vec<LeafSkeleton>,
}

#[derive(Serialize)]
struct LeafSkeleton {
    leaf: u16,
    id: Option<u32>,
    joints: Vec<JointRow>,
}

#[derive(Serialize)]
struct JointRow {
    name: String,
    parent: Option<u16>,
    world_m: [f32; 3],
    pixel: Option<[f32; 2]>,
}

impl Format for Writer {
    fn image(&self, _recipe: &Recipe, sample: &Sample) -> Result<Vec<File>> {
        let record = &sample.record;
        let rendered = sample.rendered(FOLDER)?;
        let plants = record.plants.iter().map(|plant| PlantSkeleton {
            plant: plant.number,
            id: plant.id,
            leaves: (plant.leaves.iter())
                .map(|leaf| LeafSkeleton {
                    leaf: leaf.number,
                    id: leaf.id,
                    joints: joints(rendered, plant.number, leaf.number).iter().map(|joint| row(rendered, joint)).collect(),
                })
                .collect(),
        });
        let bytes = json(&Skeletons { plants: plants.collect() })?;
        Ok(vec![File { path: format!("{FOLDER}/{}/{}.json", record.split.name(), record.name), bytes }])
    }

    fn needs_film(&self) -> bool {
        true
    }

    fn needs_photograph(&self) -> bool {
        false
    }
}

/// Returns the joints of a leaf; none for a leaf of a model.
fn joints(rendered: &Rendered, plant: u32, leaf: u16) -> &[PlacedJoint] {
    // Plants are sorted by number.
    let place = rendered.plants.binary_search_by_key(&plant, |grown| grown.number);
    let axis = place.ok().and_then(|place| rendered.plants.get(place)).and_then(|grown| grown.leaf_axes.iter().find(|axis| axis.leaf == leaf));
    axis.map_or(&[], |axis| &axis.joints)
}

fn row(rendered: &Rendered, joint: &PlacedJoint) -> JointRow {
    let pixel = rendered.camera.project(joint.at).map(|at| at.to_array());
    JointRow { name: joint.name.to_string(), parent: joint.parent, world_m: joint.at.to_array(), pixel }
}
