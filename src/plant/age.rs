//! How old each leaf of a plant is, what its colour follows from; and when each comes out.

use super::desc::{PlantDesc, Stage};
use super::growth::{Growth, growth};
use super::stage::BUD;
use super::stems;
use crate::math::lerp;
use crate::sampling::Stream;
use std::collections::BTreeMap;

/// How old one leaf is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeafAge {
    /// Length of the longest of it and all younger blades over that of the plant's longest: near 0 in the heart, 1 of all leaves that have
    /// grown as long as they will.
    pub unfolded: f32,
    /// Days since it could first be seen.
    pub days: f32,
}

/// A leaf over time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeafLife {
    /// Age of the plant when it comes out of the bud, days.
    pub appears_days: f32,
    /// Length of its blade when it is largest, metres.
    pub blade: f32,
    /// The blade's width then, metres.
    pub width: f32,
}

/// The ages of all leaves of the main shoot, by their numbers; where several stems rise from one place, those of all.
pub(super) fn ages(growth: &Growth<'_>) -> BTreeMap<u16, LeafAge> {
    let longest = growth.leaves.iter().map(|l| l.blade).fold(BUD, f32::max);
    let mut younger = 0.0_f32;
    let mut ages = BTreeMap::new();
    for leaf in growth.leaves.iter().rev() {
        younger = younger.max(leaf.blade);
        let days = (growth.age_days - born(growth, leaf.layer)).max(0.0);
        ages.insert(leaf.number, LeafAge { unfolded: younger / longest, days });
    }
    for stem in stems::others(growth) {
        let leaves = growth.leaves.iter().filter_map(|leaf| stem.leaf(leaf, growth));
        let own: Vec<_> = leaves.map(|leaf| (leaf.number, ages[&(leaf.number - stem.above)])).collect();
        ages.extend(own);
    }
    ages
}

/// Day on which a layer could first be seen: half-way to the first stage that has it.
fn born(growth: &Growth<'_>, layer: usize) -> f32 {
    let stages = &growth.desc.stages;
    let Some(first) = stages.iter().position(|s| s.layers.len() > layer) else { return growth.age_days };
    match first.checked_sub(1) {
        Some(before) => 0.5 * (stages[before].days.f32() + stages[first].days.f32()),
        None => 0.0,
    }
}

/// When the leaves of the plant of `stream` come out, and how large they become, all sizes times `vigour`: those of its main shoot, and of
/// all stems where several rise from one place.
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
