//! Rows and patches as they were drawn.

use super::rows::Rows;
use serde::{Deserialize, Serialize};

/// The rows of one field.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RowsRecord {
    /// From row to row.
    pub spacing_m: f32,
    /// From seed to seed.
    pub in_row_m: f32,
    /// Direction of the rows, clockwise from north.
    pub azimuth_deg: f32,
    /// Distance of row 0 from the world's origin, towards the rows' right-hand side.
    pub offset_m: f32,
    /// Standard deviation of a seed's place across the row.
    pub jitter_across_m: f32,
    /// Standard deviation of a seed's place along the row.
    pub jitter_along_m: f32,
    /// Share of the seeds that emerged.
    pub emergence: f64,
    /// Share of the places that got two seeds.
    pub doubles: f64,
}

impl Rows {
    /// The numbers that were drawn.
    pub fn record(&self) -> RowsRecord {
        RowsRecord {
            spacing_m: self.spacing_m,
            in_row_m: self.in_row_m,
            azimuth_deg: self.azimuth.to_degrees(),
            offset_m: self.offset_m,
            jitter_across_m: self.jitter.x,
            jitter_along_m: self.jitter.y,
            emergence: self.emergence,
            doubles: self.doubles,
        }
    }
}

/// One species of weed in one field.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WeedsRecord {
    /// Mean number of the distribution, not of this piece of ground.
    pub per_m2: f32,
    /// Aggregation: k of the negative binomial.
    pub k: f32,
    /// Size of the patches.
    pub range_m: f32,
    /// Share of the plants that stand in clusters.
    pub clusters_share: f32,
    /// Mean number of plants in a cluster.
    pub clusters_plants: f32,
    /// Standard deviation of their distance from its centre.
    pub clusters_sd_m: f32,
    /// No two stems stand closer.
    pub min_distance_m: f32,
}
