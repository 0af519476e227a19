//! Many pairs: means over pairs with equal weight, and their confidence intervals.

use super::figures::{Band, Compared, Region, RegionFigures, psnr_db};
use furrow_base::math::{ToFloat, ToInt};
use furrow_base::sampling::bootstrap::{self, Interval};

/// Mean over pairs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mean {
    /// The mean.
    pub mean: f64,
    /// 95 % bootstrap interval over pairs; `None` for a single pair.
    pub interval: Option<Interval>,
}

/// Measures of one band over one region, as means over the pairs that have it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Summary {
    /// The band.
    pub band: Band,
    /// The region.
    pub region: Region,
    /// Number of pairs that have it.
    pub pairs: u64,
    /// Mean squared error of values between 0 and 1.
    pub mse: Mean,
    /// SSIM.
    pub ssim: Option<Mean>,
    /// FLIP.
    pub flip: Option<Mean>,
    /// ΔE₀₀.
    pub ciede2000: Option<Mean>,
}

impl Summary {
    /// Returns the PSNR in dB of the mean MSE, because a mean of PSNR would be infinite for one equal pair. `None`, for
    /// infinity, if all pairs are equal.
    pub fn psnr_db(&self) -> Option<Mean> {
        let bounds = self.mse.interval.and_then(|i| Some(Interval { low: psnr_db(i.high)?, high: psnr_db(i.low)? }));
        Some(Mean { mean: psnr_db(self.mse.mean)?, interval: bounds })
    }
}

/// Returns the measures of every band and region that a pair has. All intervals use the same resamples.
pub(super) fn summaries(pairs: &[Compared]) -> Vec<Summary> {
    let kinds = [Band::Rgb, Band::Nir].into_iter().flat_map(|band| Region::ALL.map(|region| (band, region)));
    kinds.filter_map(|(band, region)| summary(pairs, band, region)).collect()
}

fn summary(pairs: &[Compared], band: Band, region: Region) -> Option<Summary> {
    let rows: Vec<&RegionFigures> = pairs.iter().filter_map(|pair| pair.figures.of(band, region)).collect();
    if rows.is_empty() {
        return None;
    }
    let values: Vec<[Option<f64>; 4]> = rows.iter().map(|r| [Some(r.mse), r.ssim, r.flip, r.ciede2000]).collect();
    let means = |drawn: &[usize]| -> Vec<Option<f64>> {
        let mean = |k: usize| {
            let known: Vec<f64> = drawn.iter().filter_map(|place| values[*place][k]).collect();
            (!known.is_empty()).then(|| known.iter().sum::<f64>() / known.len().to_f64())
        };
        (0..4).map(mean).collect()
    };
    let all: Vec<usize> = (0..rows.len()).collect();
    let intervals = bootstrap::intervals(rows.len(), 0, means);
    let means = means(&all);
    let mean = |k: usize| Some(Mean { mean: means[k]?, interval: intervals[k] });
    Some(Summary {
        band,
        region,
        pairs: rows.len().to_u64(),
        mse: mean(0)?,
        ssim: mean(1),
        flip: mean(2),
        ciede2000: mean(3),
    })
}
