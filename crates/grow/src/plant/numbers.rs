//! Leaf numbers: a leaf keeps its number at every age, whatever else appears before it.
//!
//! The leaves of the main shoot are numbered first, in order of appearance. Every side shoot then reserves a block as
//! large as the number of leaves of the main shoot at its last stage. Every flowering axis reserves a block for the
//! largest number of leaves that its species file allows. Numbers of leaves that do not exist stay unused.

use super::desc::{Form, PlantDesc};
use super::inflorescence_check;
use super::stage::{MOST_SHOOTS, StageDesc};
use furrow_base::math::RoundTo;

/// Blocks of leaf numbers of one species.
#[derive(Clone, Debug)]
pub(super) struct Numbers {
    /// Number of leaves of the main shoot.
    each: usize,
    /// Largest number of side shoots, and of side shoots of each of them.
    shoots: usize,
    branches: usize,
    /// One entry for each kind of flowering axis.
    sorts: Vec<Sort>,
}

#[derive(Clone, Debug)]
struct Sort {
    first: usize,
    axes: usize,
    /// Offset of the first number of each row of leaves; the last entry is the number of leaves of one axis.
    rows: Vec<usize>,
}

impl Numbers {
    pub(super) fn of(desc: &PlantDesc) -> Self {
        let stages = || desc.stages.iter();
        let most =
            |pick: fn(&StageDesc) -> f64| stages().map(pick).fold(0.0, f64::max).round_to::<usize>().min(MOST_SHOOTS);
        let branching = matches!(desc.form, Form::Runner | Form::Whorl);
        let last = desc.stages.last();
        let each =
            last.map_or(0, |stage| stage.layers.iter().map(|layer| layer.leaves.get().trunc_to::<usize>()).sum());
        let mut numbers = Self {
            each,
            shoots: most(|stage| stage.tillers.largest()),
            branches: if branching { most(|stage| stage.branches.largest()) } else { 0 },
            sorts: Vec::new(),
        };
        let mut first = each * (1 + numbers.shoots * (1 + numbers.branches));
        for k in 0..last.map_or(0, |stage| stage.inflorescences.len()) {
            let axes = stages()
                .filter_map(|stage| inflorescence_check::axes(stage).get(k).copied())
                .fold(0.0, f64::max)
                .trunc_to::<usize>();
            // Side shoots of second order have tips too.
            let axes = axes * (1 + numbers.branches);
            let rows = stages().filter_map(|stage| stage.inflorescences.get(k)).map(|axis| axis.leaves.len()).max();
            let mut ends = vec![0];
            for row in 0..rows.unwrap_or(0) {
                let leaves = stages().filter_map(|stage| stage.inflorescences.get(k)?.leaves.get(row));
                let count = leaves.map(|leaves| leaves.count.largest().round()).fold(0.0, f64::max).trunc_to::<usize>();
                ends.push(ends[row] + count);
            }
            let of_one = ends[ends.len() - 1];
            numbers.sorts.push(Sort { first, axes, rows: ends });
            first += axes * of_one;
        }
        numbers
    }

    /// Returns the offset from a leaf number of the main shoot to that of the k-th side shoot; `None` if the numbers
    /// exceed 16 bits.
    pub(super) fn side(&self, k: usize) -> Option<u16> {
        self.shoot(k * (1 + self.branches))
    }

    /// Returns the same offset for the m-th side shoot of the k-th side shoot.
    pub(super) fn branch(&self, k: usize, m: usize) -> Option<u16> {
        if m < self.branches { self.shoot(k * (1 + self.branches) + 1 + m) } else { None }
    }

    fn shoot(&self, slot: usize) -> Option<u16> {
        let above = (1 + slot) * self.each;
        // The whole block of the shoot must fit.
        u16::try_from(above + self.each).ok()?;
        u16::try_from(above).ok()
    }

    /// Returns the number of the i-th leaf in a row of leaves on an axis of a kind; `None` beyond the maximum that the
    /// species file allows.
    pub(super) fn on_axis(&self, sort: usize, axis: usize, row: usize, i: usize) -> Option<u16> {
        let Sort { first, axes, rows } = self.sorts.get(sort)?;
        let (start, end, all) = (*rows.get(row)?, *rows.get(row + 1)?, *rows.last()?);
        let number = 1 + first + axis * all + start + i;
        if axis < *axes && start + i < end { u16::try_from(number).ok() } else { None }
    }
}
