//! Damage labels of leaf tissue.

/// Damaged fractions of a point on a leaf, 0 to 1, consistent with its shading. The remainder is healthy.
///
/// Tissue is first yellowed by `y`, then mixed with the reddish rim of a spot by r and with dead tissue by b
/// ([`super::ConditionOptics`]). So necrosis is 1 − (1 − r) (1 − b) and chlorosis is y (1 − r) (1 − b).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Damage {
    /// Degree of chlorophyll loss in living tissue, times the fraction of living tissue.
    pub chlorosis: f32,
    /// Fraction of dead tissue and spot rims.
    pub necrosis: f32,
    /// Cover of dust and splashed soil on the visible side; none on the lower side.
    pub soil: f32,
    /// `true` inside the rim of a hole, a bite or a tear.
    pub edge: bool,
}
