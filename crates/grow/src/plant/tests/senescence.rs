//! Senescence: how leaves yellow, dry, droop and fall.

use super::*;

/// Returns the length along the midrib of a leaf from its joints, metres.
fn midrib(axis: &LeafAxis) -> f32 {
    let nearest = |p: Vec3| {
        let far = |k: &usize| axis.joints[*k].at.distance(p);
        (0..axis.joints.len()).min_by(|a, b| far(a).total_cmp(&far(b))).unwrap()
    };
    let (mut at, base, mut length) = (nearest(axis.tip), nearest(axis.base), 0.0);
    while let Some(parent) = axis.joints[at].parent.filter(|_| at != base) {
        length += axis.joints[at].at.distance(axis.joints[usize::from(parent)].at);
        at = usize::from(parent);
    }
    length
}

/// Rationale: seed leaves lose water, they do not shrink. Expected: from the first yellow to the fall a cotyledon's
/// midrib and its length change by less than 20 %; senescence only increases, over 9 to 13 days; a cotyledon that has
/// fallen stays away, and none is left at the stage of the species file without it. Source: the species files, and those
/// of `crates/grow/src/plant/senescence.rs`.
#[test]
fn cotyledons_wither_at_their_length_and_fall() {
    for (eppo, last) in [("BEAVX", 43), ("CHEAL", 40), ("GLXMA", 28)] {
        let desc = page(eppo);
        for seed in 0..4 {
            let stream = stream(seed);
            let (mut withering, mut fallen) = (Vec::new(), None);
            for quarter in 4 * (last - 20)..=4 * last {
                let day = quarter.to_f32() / 4.0;
                let plant = grow(&desc, Stage::Age(day), &stream);
                let cotyledon = plant.organs.iter().find(|o| o.leaf == 1 && o.axis.is_some());
                let Some(organ) = cotyledon else {
                    fallen.get_or_insert(day);
                    continue;
                };
                assert!(fallen.is_none(), "{eppo}: a cotyledon has come back on day {day}");
                if organ.senescence > 0.0 {
                    let axis = organ.axis.as_ref().unwrap();
                    withering.push([organ.senescence, axis.size.length, midrib(axis)]);
                }
            }
            let fallen = fallen.unwrap_or_else(|| panic!("{eppo}: no cotyledon falls"));
            assert!(fallen <= last.to_f32());
            let days = withering.len().to_f32() / 4.0;
            assert!((8.5..13.5).contains(&days), "{eppo}: {days} days");
            assert!(withering.windows(2).all(|w| w[0][0] < w[1][0]) && withering.last().unwrap()[0] > 0.95);
            let ratios = [1, 2].map(|k| {
                let values = || withering.iter().map(|w| w[k]);
                values().fold(f32::MAX, f32::min) / values().fold(0.0, f32::max)
            });
            assert!(ratios.iter().all(|r| *r > 0.8), "{eppo}: {ratios:?}");
        }
    }
}

/// Rationale: lower leaves of older plants are yellow and lie down. Expected: in an old maize plant some of the oldest
/// true leaves are senescent, within the range of `oldest_to`, and at least half of them hang lower than without
/// senescence; their lengths are kept within 6 %, no leaf is missing and all other leaves are the same. A seedling has
/// none. Source: `scenes/species/maize.ron`.
#[test]
fn the_oldest_leaves_yellow_and_hang() {
    let aged = page("ZEAMX");
    let green = PlantDesc { senescence: SenescenceDesc::default(), ..aged.clone() };
    assert!(aged.senescence.oldest.get() > 0.0);
    let (mut old, mut lower) = (0, 0);
    for seed in 0..6 {
        let stream = stream(seed);
        let [with, without] = [&aged, &green].map(|desc| grow(desc, Stage::Age(50.0), &stream));
        assert_eq!(with.organs.len(), without.organs.len());
        for (a, b) in with.organs.iter().zip(&without.organs) {
            assert_eq!((a.leaf, a.kind), (b.leaf, b.kind));
            if a.senescence == b.senescence {
                assert_eq!(a.mesh, b.mesh, "leaf {}", a.leaf);
                continue;
            }
            assert!(a.senescence > b.senescence && a.senescence <= 0.8 && a.leaf <= 6, "leaf {}", a.leaf);
            let (Some(own), Some(other)) = (&a.axis, &b.axis) else { continue };
            assert!((0.94..=1.0).contains(&(own.size.length / other.size.length)));
            old += 1;
            lower += usize::from(own.tip.z < other.tip.z);
        }
        let seedling = grow(&aged, Stage::Bbch(12), &stream);
        assert!(seedling.organs.iter().all(|organ| organ.senescence == 0.0));
    }
    assert!(old >= 2 && lower * 2 >= old, "{lower} of {old}");
}
