//! Cache of a preview: while a scene file is edited, most of the field stays the same from one build to the next.
//!
//! A cached result is used only if all its inputs are equal, so a preview equals the field that a build without a cache would give.

use super::contents::Contents;
use super::earth::{BareGround, Soil};
use super::grown::GrownOrgan;
use super::seedling::{PlantSite, Seedling};
use crate::PlantRecord;
use furrow_base::Result;
use furrow_base::geometry::{AlphaMask, Mesh};
use furrow_base::math::Vec3;
use furrow_grow::model::Model;
use furrow_render::accel::{EmbreeAccel, PreviousBuild};
use furrow_render::scene::Part;
use std::collections::HashMap;
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Cache of the last field, for successive previews of a scene file that is being edited.
#[derive(Clone, Default)]
pub struct Preview {
    kept: Arc<Mutex<CacheEntries>>,
}

#[derive(Default)]
struct CacheEntries {
    plants: HashMap<u32, Arc<CachedPlant>>,
    counted: HashMap<u32, CountedPlant>,
    /// Meshes of models, by their index in the scene file.
    models: HashMap<usize, (PlacedModel, Vec<Arc<Mesh>>)>,
    bed: Option<Arc<BareGround>>,
    laid: Option<(CoverInputs, Arc<Contents>)>,
    built: Option<(Vec<Shape>, Arc<EmbreeAccel>)>,
}

/// A grown plant and its inputs.
pub(super) struct CachedPlant {
    pub(super) seedling: Seedling,
    pub(super) place: PlantSite,
    pub(super) record: PlantRecord,
    /// `None` if the plant has not emerged, or neither it nor its shadow reaches the view.
    pub(super) organs: Option<Vec<GrownOrgan>>,
}

/// Numbers of triangles and organs of a plant that was grown to count them, and its inputs.
#[derive(Clone)]
pub(super) struct CountedPlant {
    pub(super) seedling: Seedling,
    pub(super) cell: f32,
    pub(super) size: (f64, f64),
}

/// A placed model: the inputs of its meshes.
#[derive(Clone)]
pub(super) struct PlacedModel {
    pub(super) model: Arc<Model>,
    /// Rotation, clockwise when seen from above, radians.
    pub(super) turn: f32,
    pub(super) scale: f32,
    pub(super) foot: Vec3,
}

impl PlacedModel {
    fn same(&self, other: &Self) -> bool {
        let place = |s: &Self| (s.turn, s.scale, s.foot);
        Arc::ptr_eq(&self.model, &other.model) && place(self) == place(other)
    }
}

/// Inputs of the ground's cover: the ground and the plants above it.
#[derive(Clone)]
pub(super) struct CoverInputs {
    pub(super) bed: Arc<BareGround>,
    pub(super) plants: Vec<Arc<Mesh>>,
}

impl CoverInputs {
    fn same(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.bed, &other.bed) && same(&self.plants, &other.plants, Arc::ptr_eq)
    }
}

/// The data of a part that the BVH is built from.
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
    fn lock(&self) -> MutexGuard<'_, CacheEntries> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the cached plant, if it was grown from an equal seedling at an equal place.
    pub(super) fn plant(&self, seedling: &Seedling, place: &PlantSite) -> Option<Arc<CachedPlant>> {
        let known = self.lock().plants.get(&seedling.id).cloned();
        known.filter(|known| known.place == *place && known.seedling == *seedling)
    }

    /// Replaces the cached plants.
    pub(super) fn keep_plants(&self, plants: &[Arc<CachedPlant>]) {
        self.lock().plants = plants.iter().map(|plant| (plant.seedling.id, plant.clone())).collect();
    }

    /// Returns the cached numbers of triangles and organs of a plant, if it was grown from an equal seedling and cell length.
    pub(super) fn counted(&self, seedling: &Seedling, cell: f32) -> Option<(f64, f64)> {
        let known = self.lock().counted.get(&seedling.id).cloned();
        known.filter(|known| known.cell == cell && known.seedling == *seedling).map(|known| known.size)
    }

    /// Replaces the cached numbers.
    pub(super) fn keep_counted(&self, counted: Vec<CountedPlant>) {
        self.lock().counted = counted.into_iter().map(|counted| (counted.seedling.id, counted)).collect();
    }

    /// Returns the cached meshes of model `k` of the scene file, if it was placed in the same way.
    pub(super) fn model(&self, k: usize, stood: &PlacedModel) -> Option<Vec<Arc<Mesh>>> {
        self.lock().models.get(&k).filter(|(known, _)| known.same(stood)).map(|(_, meshes)| meshes.clone())
    }

    /// Replaces the cached meshes of model `k`.
    pub(super) fn keep_model(&self, k: usize, stood: &PlacedModel, meshes: &[Arc<Mesh>]) {
        self.lock().models.insert(k, (stood.clone(), meshes.to_vec()));
    }

    /// Returns the cached ground, if it was built from an equal soil.
    pub(super) fn bed(&self, soil: &Soil) -> Option<Arc<BareGround>> {
        self.lock().bed.clone().filter(|bed| bed.soil == *soil)
    }

    /// Returns the cached ground parts and cover, if the ground and the plants are the same.
    pub(super) fn laid(&self, under: &CoverInputs) -> Option<Arc<Contents>> {
        self.lock().laid.as_ref().filter(|(known, _)| known.same(under)).map(|(_, laid)| laid.clone())
    }

    /// Replaces the cached ground and its cover.
    pub(super) fn keep_ground(&self, under: CoverInputs, laid: &Arc<Contents>) {
        let mut kept = self.lock();
        kept.bed = Some(under.bed.clone());
        kept.laid = Some((under, laid.clone()));
    }

    /// Returns the BVH of these parts: the cached one if its parts are identical. Otherwise calls `build`, which gets the previous BVH
    /// and the index of each part in it.
    pub fn geometry(
        &self,
        parts: &[Part],
        build: impl FnOnce(Option<&PreviousBuild<'_>>) -> Result<EmbreeAccel>,
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
        let built = build(Some(&PreviousBuild { accel: &built, places: &places }))?;
        Ok(self.keep_built(of, built))
    }

    fn keep_built(&self, of: Vec<Shape>, built: EmbreeAccel) -> Arc<EmbreeAccel> {
        let built = Arc::new(built);
        self.lock().built = Some((of, built.clone()));
        built
    }
}
