//! What is wrong with a place of a leaf, as labels tell it.

/// Shares of a place of a leaf, 0 to 1, as its light is made of them; what chlorosis and necrosis leave is healthy.
///
/// A place is first made yellow by `y`, then mixed with the reddish rim of a spot by r and with dead tissue by b
/// ([`super::ConditionOptics`]), so necrosis is 1 − (1 − r) (1 − b) and chlorosis y (1 − r) (1 − b).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Damage {
    /// Degree to which living tissue has lost its green, times its share.
    pub chlorosis: f32,
    /// Dead tissue and the rims of spots.
    pub necrosis: f32,
    /// Dust and splashed soil on what is seen; none on the lower side.
    pub soil: f32,
    /// Whether it lies within the rim of a hole, a bite or a tear.
    pub edge: bool,
}
