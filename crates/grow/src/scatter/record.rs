//! Records of the drawn parameters of rows and weed patches.

use super::rows::Rows;
use serde::{Deserialize, Serialize};

/// Rows of one field.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RowsRecord {
    /// Distance between rows.
    pub spacing_m: f32,
    /// Distance between seeds in a row.
    pub in_row_m: f32,
    /// Direction of the rows, clockwise from north.
    pub azimuth_deg: f32,
    /// Distance of row 0 from the world's origin, towards the rows' right-hand side.
    pub offset_m: f32,
    /// Standard deviation of a seed's place across the row.
    pub jitter_across_m: f32,
    /// Standard deviation of a seed's place along the row.
    pub jitter_along_m: f32,
    /// Fraction of the seeds that emerged.
    pub emergence: f64,
    /// Fraction of the places with two seeds.
    pub doubles: f64,
}

impl Rows {
    /// Returns the record of the drawn parameters.
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
    /// Mean number of the distribution per m², not the number on this piece of ground.
    pub per_m2: f32,
    /// Aggregation: k of the negative binomial.
    pub k: f32,
    /// Size of the patches.
    pub range_m: f32,
    /// Fraction of the plants that are in clusters.
    pub clusters_share: f32,
    /// Mean number of plants in a cluster.
    pub clusters_plants: f32,
    /// Standard deviation of their distance from its centre.
    pub clusters_sd_m: f32,
    /// Minimum distance between two stems.
    pub min_distance_m: f32,
}
