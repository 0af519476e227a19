//! Limits of a field's extent.

/// Maximum coordinate of a model or a camera along an axis, metres. Single precision resolves 0.06 mm there.
pub(super) const FARTHEST: f32 = 1000.0;

/// Width of the planted margin around the view, metres: plants in it may lean or cast shadows into the view.
pub(super) const PLANT_MARGIN: f32 = 0.35;

/// Maximum value of `reach_m`, metres.
pub(super) const LONGEST_REACH: f32 = 100.0;
