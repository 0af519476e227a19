//! Plants that are all alike: one shape and age for a whole species.

use crate::math::{Mat3, Vec3};
use crate::plant::{self, GrowOptions, Plant, Stage};
use crate::sampling::rng::mix;
use crate::sampling::{Purpose, Stream};
use crate::scene::desc::SpeciesDesc;

/// The one plant that all of a species are.
#[derive(Clone, PartialEq)]
pub(super) struct Individual {
    /// The field's: how old it is.
    age: Stream,
    /// The same in all fields of a seed.
    shape: Stream,
}

impl Individual {
    /// That of a species whose plants are alike, in field `index` of `seed`.
    pub(super) fn of(desc: &SpeciesDesc, (seed, index): (u64, u64)) -> Option<Self> {
        // By name, so that a species that stands in two places of a scene file is one all the same.
        let key = desc.name.bytes().fold(0, |key, byte| mix(key ^ u64::from(byte)));
        let stream = |index| Stream::of(seed, index, Purpose::Plant, key);
        desc.alike.then(|| Self { age: stream(index).child(Purpose::Page, 0), shape: stream(0) })
    }

    /// What its growth is drawn from.
    pub(super) fn age(&self) -> Stream {
        self.age.clone()
    }

    /// Its shape.
    pub(super) fn shape(&self) -> &Stream {
        &self.shape
    }

    /// Grows it to this stage, with these options, turned as the plant of `own` would be.
    pub(super) fn plant(&self, desc: &SpeciesDesc, stage: Stage, own: &Stream, options: &GrowOptions<'_>) -> Plant {
        let mut plant = plant::grow_with(&desc.plant, stage, &self.shape, options);
        // Azimuths run clockwise seen from above.
        let turn = Mat3::from_rotation_z(plant::turn(&self.shape) - plant::turn(own));
        for organ in &mut plant.organs {
            organ.mesh.transform(turn, Vec3::ZERO);
            organ.axis = organ.axis.take().map(|axis| axis.moved(|p| turn * p));
        }
        plant.rig = plant.rig.iter().map(|joint| joint.moved(|p| turn * p)).collect();
        plant
    }
}
