//! Ages of the leaves of a plant, which determine their colour, and the days on which leaves appear.

use super::desc::{PlantDesc, Stage};
use super::growth::{Growth, growth};
use super::stage::{BUD, born};
use super::stems;
use furrow_base::math::lerp;
use furrow_base::sampling::Stream;
use std::collections::BTreeMap;

/// Age of one leaf.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeafAge {
    /// Length of the longest blade among this leaf and all younger ones, relative to the plant's longest blade: near 0
    /// in the heart, 1 for all leaves that have reached their full length.
    pub unfolded: f32,
    /// Days since the leaf could first be seen.
    pub days: f32,
}

/// Life of one leaf.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeafLife {
    /// Age of the plant when the leaf leaves the bud, days.
    pub appears_days: f32,
    /// Largest length of its blade, metres.
    pub blade: f32,
    /// Largest width of its blade, metres.
    pub width: f32,
}

/// Returns the ages of all leaves of the main shoot by leaf number; for a plant with several main stems, of all of
/// them.
pub(super) fn ages(growth: &Growth<'_>) -> BTreeMap<u16, LeafAge> {
    let longest = growth.leaves.iter().map(|l| l.blade).fold(BUD, f32::max);
    let mut younger = 0.0_f32;
    let mut ages = BTreeMap::new();
    for leaf in growth.leaves.iter().rev() {
        younger = younger.max(leaf.blade);
        let born = born(&growth.desc.stages, leaf.layer).unwrap_or(growth.age_days);
        let days = (growth.age_days - born).max(0.0);
        ages.insert(leaf.number, LeafAge { unfolded: younger / longest, days });
    }
    for stem in stems::others(growth) {
        let leaves = growth.leaves.iter().filter_map(|leaf| stem.leaf(leaf, growth));
        let own: Vec<_> = leaves.map(|leaf| (leaf.number, ages[&(leaf.number - stem.above)])).collect();
        ages.extend(own);
    }
    ages
}

/// Returns, by leaf number, when each leaf of the plant of `stream` appears and how large it becomes, with all sizes
/// multiplied by `vigour`. Covers the main shoot; for a plant with several main stems, all of them.
pub(super) fn leaf_lives(desc: &PlantDesc, stream: &Stream, vigour: f32) -> BTreeMap<u16, LeafLife> {
    let mut lives: BTreeMap<u16, LeafLife> = BTreeMap::new();
    let mut before = 0.0;
    for stage in &desc.stages {
        let days = stage.days.f32();
        let Some(now) = growth(desc, Stage::Age(days), stream, vigour) else { continue };
        let others = stems::others(&now);
        let leaves = others.iter().flat_map(|stem| now.leaves.iter().filter_map(|leaf| stem.leaf(leaf, &now)));
        for leaf in leaves.chain(now.leaves.iter().cloned()) {
            let appears_days = lerp(before, days, BUD / leaf.blade);
            let life = lives.entry(leaf.number).or_insert(LeafLife { appears_days, blade: 0.0, width: 0.0 });
            life.blade = life.blade.max(leaf.blade);
            life.width = life.width.max(leaf.width);
        }
        before = days;
    }
    lives
}
