//! Progress of fields under construction: updated by the threads that build them, read by the display. No output depends on it.

use std::fmt;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// Current stage of a field's construction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Files are read, and memory and time are estimated.
    Estimate,
    /// Ground and stones are built.
    Ground,
    /// Bank plants, which others will be instances of, are grown.
    Shared,
    /// All plants are grown, or placed as instances.
    Plants,
    /// Clods and litter are placed among the plants, and the textures of the ground are baked.
    Cover,
    /// The bounding volume hierarchy (BVH) is built.
    Bvh,
}

/// Progress of one field or several. Displays as text such as `growing: plants 12000 of 103874`; as nothing before the start and after
/// the end.
#[derive(Debug, Default)]
pub struct BuildProgress {
    stage: Mutex<Option<Stage>>,
    pub(super) shared: Count,
    pub(super) plants: Count,
}

impl BuildProgress {
    /// Sets the current stage. At [`Stage::Estimate`], resets the plant counts, unless plants of another field are still being grown.
    pub fn enter(&self, stage: Stage) {
        if stage == Stage::Estimate {
            self.shared.begin();
            self.plants.begin();
        }
        *self.stage.lock().unwrap_or_else(PoisonError::into_inner) = Some(stage);
    }

    /// Marks the end of a field's construction.
    pub fn leave(&self) {
        *self.stage.lock().unwrap_or_else(PoisonError::into_inner) = None;
    }
}

impl fmt::Display for BuildProgress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let stage = *self.stage.lock().unwrap_or_else(PoisonError::into_inner);
        match stage {
            None => Ok(()),
            Some(Stage::Estimate) => f.write_str("growing: files and estimate"),
            Some(Stage::Ground) => f.write_str("growing: ground"),
            Some(Stage::Shared) => write!(f, "growing: plants for instances {}", self.shared),
            Some(Stage::Plants) => write!(f, "growing: plants {}", self.plants),
            Some(Stage::Cover) => f.write_str("growing: clods, litter and texture of the ground"),
            Some(Stage::Bvh) => f.write_str("building the BVH"),
        }
    }
}

/// Number of completed items and of expected items.
#[derive(Debug, Default)]
pub(super) struct Count {
    done: AtomicUsize,
    of: AtomicUsize,
}

impl Count {
    /// Resets both numbers, unless some items are still to be done.
    fn begin(&self) {
        let (done, of) = (self.done.load(Ordering::Relaxed), self.of.load(Ordering::Relaxed));
        if done == of {
            self.done.fetch_sub(done, Ordering::Relaxed);
            self.of.fetch_sub(of, Ordering::Relaxed);
        }
    }

    /// Adds `more` expected items.
    pub(super) fn expect(&self, more: usize) {
        self.of.fetch_add(more, Ordering::Relaxed);
    }

    /// Adds one completed item.
    pub(super) fn add(&self) {
        self.done.fetch_add(1, Ordering::Relaxed);
    }
}

impl fmt::Display for Count {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} of {}", self.done.load(Ordering::Relaxed), self.of.load(Ordering::Relaxed))
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Options, field_of};
    use super::*;

    /// Returns a scene file with beets in rows below a camera at this height.
    fn page(height_m: f32) -> String {
        let camera = format!(
            "Pinhole(size: (320, 240), intrinsics: FieldOfView(horizontal_deg: 20), pose: Nadir(height_m: {height_m}))"
        );
        let species = "species: \"sugar_beet.ron\", growth: AgeDays(20)";
        let crops = format!("({species}, rows: (spacing_m: 0.25, in_row_m: 0.2))");
        format!("Field(\n  detail: Instanced,\n  camera: {camera},\n  soil: (),\n  crops: [{crops}],\n)")
    }

    /// Rationale: a field that takes a minute to build must show what it is doing. Expected: no text before the start; every sown plant
    /// is counted once, and bank plants are counted if plants are far away; the cover of the ground is the last stage.
    #[test]
    fn plants_are_counted_as_they_grow() {
        for (height_m, instances) in [(1.0, false), (12.0, true)] {
            let options = Options::default();
            let BuildProgress { shared, plants, .. } = &*options.progress;
            assert_eq!(options.progress.to_string(), "");
            let field = field_of(&page(height_m), &options).unwrap();
            assert_eq!(options.progress.to_string(), "growing: clods, litter and texture of the ground");
            let number = |count: &AtomicUsize| count.load(Ordering::Relaxed);
            assert!(!field.plants.is_empty() && number(&plants.of) >= field.plants.len());
            for count in [plants, shared] {
                assert_eq!(number(&count.done), number(&count.of));
            }
            assert_eq!(number(&shared.of) > 0, instances);
        }
    }

    #[test]
    fn it_says_what_is_under_way() {
        let progress = BuildProgress::default();
        progress.plants.expect(103_874);
        progress.plants.add();
        for (stage, words) in [
            (Stage::Ground, "growing: ground"),
            (Stage::Shared, "growing: plants for instances 0 of 0"),
            (Stage::Plants, "growing: plants 1 of 103874"),
            (Stage::Bvh, "building the BVH"),
        ] {
            progress.enter(stage);
            assert_eq!(progress.to_string(), words);
        }
        progress.leave();
        assert_eq!(progress.to_string(), "");
        // Another field while the first is being built, and one after it.
        progress.enter(Stage::Estimate);
        progress.enter(Stage::Plants);
        assert_eq!(progress.to_string(), "growing: plants 1 of 103874");
        (1..103_874).for_each(|_| progress.plants.add());
        progress.enter(Stage::Estimate);
        progress.enter(Stage::Plants);
        assert_eq!(progress.to_string(), "growing: plants 0 of 0");
    }
}
