//! Which number a leaf bears: the same on all days, whatever else comes out before it.
//!
//! The leaves of the main shoot are counted first, in order of appearance. Every other shoot has as many numbers as the main one has leaves at
//! its last stage, and every flowering axis as many as its species file lets it bear leaves; those of what is not there stay free.

use super::desc::{Form, PlantDesc};
use super::inflorescence::check;
use super::stage::{MOST_SHOOTS, StageDesc};

/// The blocks of numbers of one species.
#[derive(Clone, Debug)]
pub(super) struct Numbers {
    /// Leaves of the main shoot.
    each: usize,
    /// Side shoots, and side shoots of each.
    shoots: usize,
    branches: usize,
    /// Of each sort of flowering axes: its first number, the most axes, and the leaves of one.
    sorts: Vec<Sort>,
}

#[derive(Clone, Debug)]
struct Sort {
    first: usize,
    axes: usize,
    /// Numbers that its rows of leaves begin with, and at the end how many one axis has.
    rows: Vec<usize>,
}

impl Numbers {
    pub(super) fn of(desc: &PlantDesc) -> Self {
        let stages = || desc.stages.iter();
        let most =
            |pick: fn(&StageDesc) -> f64| (stages().map(pick).fold(0.0, f64::max).round() as usize).min(MOST_SHOOTS);
        let branching = matches!(desc.form, Form::Runner | Form::Whorl);
        let last = desc.stages.last();
        let each = last.map_or(0, |stage| stage.layers.iter().map(|layer| layer.leaves.get() as usize).sum());
        let mut numbers = Self {
            each,
            shoots: most(|stage| stage.tillers.largest()),
            branches: if branching { most(|stage| stage.branches.largest()) } else { 0 },
            sorts: Vec::new(),
        };
        let mut first = each * (1 + numbers.shoots * (1 + numbers.branches));
        for k in 0..last.map_or(0, |stage| stage.inflorescences.len()) {
            let axes = stages().filter_map(|stage| check::axes(stage).get(k).copied()).fold(0.0, f64::max) as usize;
            // Side shoots of side shoots have tips too.
            let axes = axes * (1 + numbers.branches);
            let rows = stages().filter_map(|stage| stage.inflorescences.get(k)).map(|axis| axis.leaves.len()).max();
            let mut ends = vec![0];
            for row in 0..rows.unwrap_or(0) {
                let leaves = stages().filter_map(|stage| stage.inflorescences.get(k)?.leaves.get(row));
                let count = leaves.map(|leaves| leaves.count.largest().round()).fold(0.0, f64::max) as usize;
                ends.push(ends[row] + count);
            }
            let of_one = ends[ends.len() - 1];
            numbers.sorts.push(Sort { first, axes, rows: ends });
            first += axes * of_one;
        }
        numbers
    }

    /// What is added to the number of a leaf of the main shoot for the k-th side shoot; `None` where sixteen bits do not hold it.
    pub(super) fn side(&self, k: usize) -> Option<u16> {
        self.shoot(k * (1 + self.branches))
    }

    /// The same for the m-th side shoot of the k-th.
    pub(super) fn branch(&self, k: usize, m: usize) -> Option<u16> {
        if m < self.branches { self.shoot(k * (1 + self.branches) + 1 + m) } else { None }
    }

    fn shoot(&self, slot: usize) -> Option<u16> {
        let above = (1 + slot) * self.each;
        // With all of its own.
        u16::try_from(above + self.each).ok()?;
        u16::try_from(above).ok()
    }

    /// The number of the i-th leaf of a row of leaves on an axis of a sort; `None` beyond what the species file lets there be.
    pub(super) fn on_axis(&self, sort: usize, axis: usize, row: usize, i: usize) -> Option<u16> {
        let Sort { first, axes, rows } = self.sorts.get(sort)?;
        let (start, end, all) = (*rows.get(row)?, *rows.get(row + 1)?, *rows.last()?);
        let number = 1 + first + axis * all + start + i;
        if axis < *axes && start + i < end { u16::try_from(number).ok() } else { None }
    }
}
