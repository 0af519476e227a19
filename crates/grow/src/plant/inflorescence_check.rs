//! Consistency checks of flowering axes.

use super::flower_desc::FlowerDesc;
use super::inflorescence_desc::{InflorescenceDesc, MOST_AXES, MOST_FLOWERS, Seat};
use super::kind::LeafKind;
use super::stage::StageDesc;
use furrow_base::math::ToFloat;
use furrow_base::ron_file::{Step, choose};
use std::collections::BTreeMap;

/// Error: place in the plant's description, message, hint.
type PathError = (Vec<Step<'static>>, String, String);

/// Checks the flowering axes of stage `i`.
pub(super) fn stage(
    (flowers, kinds): (&BTreeMap<String, FlowerDesc>, &BTreeMap<String, LeafKind>),
    stages: &[StageDesc],
    i: usize,
) -> Result<(), PathError> {
    use Step::{Field, Item};
    let before = i.checked_sub(1).map(|b| &stages[b].inflorescences);
    let stage = &stages[i];
    let place = |k: usize| vec![Field("stages"), Item(i), Field("inflorescences"), Item(k)];
    let names = |all: Vec<&String>| all.into_iter().map(|s| format!("\"{s}\"")).collect::<Vec<_>>();
    for (k, axis) in stage.inflorescences.iter().enumerate() {
        if let Seat::On { axis: on, .. } = &axis.at
            && !stage.inflorescences[..k].iter().any(|before| before.name == *on)
        {
            let at = [place(k), vec![Field("at")]].concat();
            let message = format!("no flowering axis before this one is called \"{on}\"");
            return Err((at, message, "write the axis that bears it first, with this name".into()));
        }
        if let Seat::Axils { first, last } = axis.at
            && (first == 0 || last < first)
        {
            let at = [place(k), vec![Field("at")]].concat();
            let message = format!("leaves {first} to {last}: leaves count from 1, and `first` is the lowest");
            return Err((at, message, "write Axils(first: 5, last: 9)".into()));
        }
        if let Some(j) = axis.flowers.iter().position(|f| !flowers.contains_key(&f.kind)) {
            let at = [place(k), vec![Field("flowers"), Item(j), Field("kind")]].concat();
            let kind = &axis.flowers[j].kind;
            let known: Vec<&str> = flowers.keys().map(String::as_str).collect();
            return Err((at, format!("no flower is called \"{kind}\""), choose("flowers", &known, kind)));
        }
        if let Some(j) = axis.leaves.iter().position(|l| !kinds.contains_key(&l.kind)) {
            let at = [place(k), vec![Field("leaves"), Item(j), Field("kind")]].concat();
            let kind = &axis.leaves[j].kind;
            let known: Vec<&str> = kinds.keys().map(String::as_str).collect();
            return Err((at, format!("no kind of leaf is called \"{kind}\""), choose("kinds", &known, kind)));
        }
    }
    let at = vec![Field("stages"), Item(i), Field("inflorescences")];
    let numbers = axes(stage);
    let count = |f: fn(&InflorescenceDesc) -> f64| {
        numbers.iter().zip(&stage.inflorescences).map(|(n, axis)| n * f(axis)).sum::<f64>()
    };
    let leaves: f64 = count(|axis| axis.leaves.iter().map(|l| l.count.largest().ceil()).sum());
    let leaves = leaves + stage.layers.iter().map(|l| l.leaves.get()).sum::<f64>();
    if leaves > 1000.0 {
        let message = format!("{leaves} leaves at BBCH {}: a plant may have at most 1000", stage.bbch);
        return Err((at, message, "write fewer axes, or fewer leaves on each".into()));
    }
    let number = count(|axis| axis.flowers.iter().map(|f| f.count.largest().ceil()).sum());
    if number > MOST_FLOWERS.to_f64() || numbers.iter().sum::<f64>() > MOST_AXES.to_f64() {
        let axes: f64 = numbers.iter().sum();
        let message = format!("up to {axes} flowering axes with {number} flowers at BBCH {}", stage.bbch);
        let help = format!("a plant has at most {MOST_AXES} flowering axes and {MOST_FLOWERS} flowers");
        return Err((at, message, help));
    }
    if let Some(before) = before {
        if before.len() > stage.inflorescences.len() {
            let message = format!("at BBCH {}: flowering axes are lost", stage.bbch);
            return Err((at, message, "write count: 0 for one that has died".into()));
        }
        for (k, (from, to)) in before.iter().zip(&stage.inflorescences).enumerate() {
            let flowers = |axis: &InflorescenceDesc| axis.flowers.iter().map(|f| f.kind.clone()).collect::<Vec<_>>();
            let leaves = |axis: &InflorescenceDesc| axis.leaves.iter().map(|l| l.kind.clone()).collect::<Vec<_>>();
            let kept = to.name == from.name
                && flowers(to).starts_with(&flowers(from))
                && leaves(to).starts_with(&leaves(from));
            if !kept {
                let has =
                    names(from.flowers.iter().map(|f| &f.kind).chain(from.leaves.iter().map(|l| &l.kind)).collect());
                let message = format!("at BBCH {}: a flowering axis changes its name or what it bears", stage.bbch);
                let help = format!("keep {} in their order and add new ones after them", has.join(", "));
                return Err((place(k), message, help));
            }
        }
    }
    Ok(())
}

/// Returns the maximum number of axes of each kind that a plant can have at a stage.
pub(super) fn axes(stage: &StageDesc) -> Vec<f64> {
    let mut by_name: BTreeMap<&str, f64> = BTreeMap::new();
    let mut all = Vec::with_capacity(stage.inflorescences.len());
    for axis in &stage.inflorescences {
        let places = match &axis.at {
            Seat::Tip => 1.0,
            Seat::Tips => 1.0 + stage.tillers.largest().round(),
            Seat::Axils { first, last } => f64::from(*last) - f64::from(*first) + 1.0,
            Seat::On { axis, .. } => by_name.get(axis.as_str()).copied().unwrap_or(0.0),
        };
        let number = places * axis.count.largest().round();
        by_name.insert(&axis.name, number);
        all.push(number);
    }
    all
}
