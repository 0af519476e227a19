//! What a preview keeps of the field that it grew before: where a scene file is written, most of its field is what it was a moment ago.
//!
//! Nothing is taken from before unless all that it follows from is equal, so a preview is the field that one without a past would grow.

use super::earth::{Bed, Laid, Soil};
use super::grown::Grown;
use super::seedling::{Place, Seedling};
use crate::Result;
use crate::accel::{Before, EmbreeAccel};
use crate::geometry::{AlphaMask, Mesh};
use crate::math::Vec3;
use crate::model::Model;
use crate::scene::{Part, PlantRecord};
use std::collections::HashMap;
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// One look after the other at the fields of a scene file while it is written: what is kept of the last field.
#[derive(Clone, Default)]
pub struct Preview {
    kept: Arc<Mutex<Kept>>,
}

#[derive(Default)]
struct Kept {
    plants: HashMap<u32, Arc<Standing>>,
    counted: HashMap<u32, Counted>,
    /// By their places in the scene file.
    models: HashMap<usize, (Stood, Vec<Arc<Mesh>>)>,
    bed: Option<Arc<Bed>>,
    laid: Option<(Under, Arc<Laid>)>,
    built: Option<(Vec<Shape>, Arc<EmbreeAccel>)>,
}

/// A plant that has grown, and what it grew from.
pub(super) struct Standing {
    pub(super) seedling: Seedling,
    pub(super) place: Place,
    pub(super) record: PlantRecord,
    /// None where neither it nor its shadow reaches the view.
    pub(super) organs: Option<Vec<Grown>>,
}

/// Triangles and organs of a plant that was grown to know them, and what it grew from.
#[derive(Clone)]
pub(super) struct Counted {
    pub(super) seedling: Seedling,
    pub(super) cell: f32,
    pub(super) size: (f64, f64),
}

/// A model in its place: what its meshes follow from.
#[derive(Clone)]
pub(super) struct Stood {
    pub(super) model: Arc<Model>,
    /// Clockwise from above, radians.
    pub(super) turn: f32,
    pub(super) scale: f32,
    pub(super) foot: Vec3,
}

impl Stood {
    fn same(&self, other: &Self) -> bool {
        let place = |s: &Self| (s.turn, s.scale, s.foot);
        Arc::ptr_eq(&self.model, &other.model) && place(self) == place(other)
    }
}

/// What the ground's cover follows from: the ground and the plants over it.
#[derive(Clone)]
pub(super) struct Under {
    pub(super) bed: Arc<Bed>,
    pub(super) plants: Vec<Arc<Mesh>>,
}

impl Under {
    fn same(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.bed, &other.bed) && same(&self.plants, &other.plants, Arc::ptr_eq)
    }
}

/// What the BVH has of a part.
type Shape = (Arc<Mesh>, Option<Arc<AlphaMask>>);

fn shape(part: &Part) -> Shape {
    (part.mesh.clone(), part.mask.clone())
}

fn same<T>(a: &[T], b: &[T], equal: impl Fn(&T, &T) -> bool) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| equal(a, b))
}

impl fmt::Debug for Preview {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Preview").finish_non_exhaustive()
    }
}

impl Preview {
    fn lock(&self) -> MutexGuard<'_, Kept> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The plant that grew of such a seedling in such a place.
    pub(super) fn plant(&self, seedling: &Seedling, place: &Place) -> Option<Arc<Standing>> {
        let known = self.lock().plants.get(&seedling.id).cloned();
        known.filter(|known| known.place == *place && known.seedling == *seedling)
    }

    /// Keeps these plants and no others.
    pub(super) fn keep_plants(&self, plants: &[Arc<Standing>]) {
        self.lock().plants = plants.iter().map(|plant| (plant.seedling.id, plant.clone())).collect();
    }

    /// Triangles and organs of the plant that grew of such a seedling.
    pub(super) fn counted(&self, seedling: &Seedling, cell: f32) -> Option<(f64, f64)> {
        let known = self.lock().counted.get(&seedling.id).cloned();
        known.filter(|known| known.cell == cell && known.seedling == *seedling).map(|known| known.size)
    }

    /// Keeps these numbers and no others.
    pub(super) fn keep_counted(&self, counted: Vec<Counted>) {
        self.lock().counted = counted.into_iter().map(|counted| (counted.seedling.id, counted)).collect();
    }

    /// The meshes of model `k` of the scene file.
    pub(super) fn model(&self, k: usize, stood: &Stood) -> Option<Vec<Arc<Mesh>>> {
        self.lock().models.get(&k).filter(|(known, _)| known.same(stood)).map(|(_, meshes)| meshes.clone())
    }

    /// Keeps them in place of those of before.
    pub(super) fn keep_model(&self, k: usize, stood: &Stood, meshes: &[Arc<Mesh>]) {
        self.lock().models.insert(k, (stood.clone(), meshes.to_vec()));
    }

    /// The ground that such a soil made.
    pub(super) fn bed(&self, soil: &Soil) -> Option<Arc<Bed>> {
        self.lock().bed.clone().filter(|bed| bed.soil == *soil)
    }

    /// What lay on the ground under these plants.
    pub(super) fn laid(&self, under: &Under) -> Option<Arc<Laid>> {
        self.lock().laid.as_ref().filter(|(known, _)| known.same(under)).map(|(_, laid)| laid.clone())
    }

    /// Keeps this ground and what lies on it.
    pub(super) fn keep_ground(&self, under: Under, laid: &Arc<Laid>) {
        let mut kept = self.lock();
        kept.bed = Some(under.bed.clone());
        kept.laid = Some((under, laid.clone()));
    }

    /// The BVH over these parts: the one that was built before, if it was over the very same; `build` is told which of them are.
    pub(crate) fn geometry(
        &self,
        parts: &[Part],
        build: impl FnOnce(Option<&Before<'_>>) -> Result<EmbreeAccel>,
    ) -> Result<Arc<EmbreeAccel>> {
        let of: Vec<Shape> = parts.iter().map(shape).collect();
        let address = |(mesh, mask): &Shape| (Arc::as_ptr(mesh), mask.as_ref().map(Arc::as_ptr));
        let Some((known, built)) = self.lock().built.clone() else {
            return Ok(self.keep_built(of, build(None)?));
        };
        if same(&known, &of, |a, b| address(a) == address(b)) {
            return Ok(built);
        }
        let places: HashMap<_, usize> = known.iter().enumerate().map(|(i, shape)| (address(shape), i)).collect();
        let places: Vec<Option<usize>> = of.iter().map(|shape| places.get(&address(shape)).copied()).collect();
        let built = build(Some(&Before { accel: &built, places: &places }))?;
        Ok(self.keep_built(of, built))
    }

    fn keep_built(&self, of: Vec<Shape>, built: EmbreeAccel) -> Arc<EmbreeAccel> {
        let built = Arc::new(built);
        self.lock().built = Some((of, built.clone()));
        built
    }
}
