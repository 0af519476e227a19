//! Species whose plants are all one individual: one shape and one age for the whole species.

use crate::desc::SpeciesDesc;
use furrow_base::math::{Mat3, Vec3};
use furrow_base::sampling::rng::mix;
use furrow_base::sampling::{Purpose, Stream};
use furrow_grow::plant::{self, GrowOptions, Plant, Stage};

/// Random streams of the one individual that all plants of a species are.
#[derive(Clone, PartialEq)]
pub(super) struct Individual {
    /// Stream of the age; differs from field to field.
    age: Stream,
    /// Stream of the shape; the same in all fields of a seed.
    shape: Stream,
}

impl Individual {
    /// Returns the individual of a species in field `index` of `seed`; `None` unless the plants of the species are alike.
    pub(super) fn of(desc: &SpeciesDesc, (seed, index): (u64, u64)) -> Option<Self> {
        // Keyed by name, so that two entries of a scene file with the same species share one individual.
        let key = desc.name.bytes().fold(0, |key, byte| mix(key ^ u64::from(byte)));
        let stream = |index| Stream::of(seed, index, Purpose::Plant, key);
        desc.alike.then(|| Self { age: stream(index).child(Purpose::Page, 0), shape: stream(0) })
    }

    /// Returns a copy of the stream that the age is drawn from.
    pub(super) fn age(&self) -> Stream {
        self.age.clone()
    }

    /// Returns the stream that the shape is drawn from.
    pub(super) fn shape(&self) -> &Stream {
        &self.shape
    }

    /// Grows the individual to `stage`, and rotates it to the azimuth that the plant with stream `own` would have.
    pub(super) fn plant(&self, desc: &SpeciesDesc, stage: Stage, own: &Stream, options: &GrowOptions<'_>) -> Plant {
        let mut plant = plant::grow_with(&desc.plant, stage, &self.shape, options);
        // Azimuths run clockwise when seen from above.
        let turn = Mat3::from_rotation_z(plant::turn(&self.shape) - plant::turn(own));
        for organ in &mut plant.organs {
            organ.mesh.transform(turn, Vec3::ZERO);
            organ.axis = organ.axis.take().map(|axis| axis.moved(|p| turn * p));
        }
        plant.rig = plant.rig.iter().map(|joint| joint.moved(|p| turn * p)).collect();
        plant
    }
}
