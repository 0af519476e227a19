//! Areas and numbers of the parts that marks remove or colour.

use super::*;
use furrow_base::math::ToFloat;
use furrow_optics::texture::noise::Perlin;

const IMAGE: Vec2 = vec2(60.0, 100.0);

fn oval() -> AlphaMask {
    AlphaMask::new(300, 500, |x, y| ((x.to_f32() - 149.5) / 140.0).hypot((y.to_f32() - 249.5) / 235.0) < 1.0)
}

fn leaf(mask: &AlphaMask) -> Bearer<'_> {
    Bearer {
        age: 1.0,
        cotyledon: false,
        share: 1.0,
        height: 0.0,
        met: None,
        image_mm: IMAGE,
        mask: Some(mask),
        margin: None,
    }
}

fn stream(k: u64) -> Stream {
    Stream::of(1, 0, Purpose::Test, k)
}

fn marks(condition: &Condition, bearer: &Bearer<'_>, k: u64) -> Marks {
    bearer.draw_marks(&ConditionDesc::flawless(), condition, &stream(k))
}

#[test]
fn no_condition_leaves_no_mark() {
    let mask = oval();
    assert!((0..50).all(|k| marks(&Condition::default(), &leaf(&mask), k).nothing()));
}

/// Expected: mean and variance of a Poisson distribution within 4 standard errors over 600 leaves; on the youngest leaf
/// a fifth of the mean.
#[test]
fn holes_are_counted_as_a_poisson_counts() {
    let mask = oval();
    let condition = Condition { holes: 3.0, ..Condition::default() };
    let of = |age: f32| -> Vec<f64> {
        let bearer = Bearer { age, ..leaf(&mask) };
        (0..600).map(|k| marks(&condition, &bearer, k).holes().to_f64()).collect()
    };
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len().to_f64();
    let old = of(1.0);
    let m = mean(&old);
    let variance = old.iter().map(|x| (x - m).powi(2)).sum::<f64>() / old.len().to_f64();
    assert!((m - 3.0).abs() < 0.29 && (variance / 3.0 - 1.0).abs() < 0.25, "{m} {variance}");
    let young = mean(&of(0.0));
    assert!((young - 0.6).abs() < 0.13, "{young}");
}

/// Rationale: radii in a species file must be the actual ones. Expected: π r² within 15 % over more than 50 leaves with
/// a single hole.
#[test]
fn holes_remove_the_area_of_their_radius() {
    let mask = oval();
    let desc = ConditionDesc { hole_mm: Vary::fixed(3.0), ..ConditionDesc::flawless() };
    let condition = Condition { holes: 1.0, ..Condition::default() };
    let (mut removed, mut holes) = (0.0, 0);
    for k in 0..400 {
        let m = leaf(&mask).draw_marks(&desc, &condition, &stream(k));
        let centred = m.holes.iter().all(|h| (h.centre / vec2(28.0, 47.0) - vec2(0.0, 50.0 / 47.0)).length() < 0.8);
        if m.holes() == 1 && centred {
            removed += (mask.count() - m.cut(Some(&mask)).count()).to_f32() * 0.04;
            holes += 1;
        }
    }
    let area = removed / holes.to_f32() / (std::f32::consts::PI * 9.0);
    assert!(holes > 50 && (area - 1.0).abs() < 0.15, "{area} of {holes}");
}

/// Rationale: the same number of holes on a leaf of 1 cm as on one of 10 cm would leave only lace. Expected: fewer in
/// proportion to the area, and never more than the largest removable fraction; outlines are ragged, so the cut may
/// exceed its discs slightly.
#[test]
fn a_small_leaf_has_few_holes_and_is_never_lace() {
    let mask = oval();
    let condition = Condition { holes: 6.0, shot_holes: 10.0, ..Condition::default() };
    let of = |length_mm: f32, cotyledon: bool| {
        let bearer = Bearer { image_mm: vec2(0.6, 1.0) * length_mm, cotyledon, ..leaf(&mask) };
        let (mut holes, mut most) = (0, 0.0_f32);
        for k in 0..200 {
            let m = marks(&condition, &bearer, k);
            holes += m.holes();
            most = most.max(1.0 - m.cut(Some(&mask)).count().to_f32() / mask.count().to_f32());
        }
        (holes.to_f32() / 200.0, most)
    };
    for (length_mm, cotyledon) in [(5.0, true), (10.0, true), (10.0, false), (20.0, true), (40.0, false)] {
        let (mean, most) = of(length_mm, cotyledon);
        assert!(most < 1.5 * MOST_EATEN, "{length_mm} mm: {most}");
        assert!(length_mm > 10.0 || mean < 2.5, "{length_mm} mm: {mean}");
    }
    // 6 of slugs and a third of 10 of beetles; some overlap and are dropped, the blade of 47 cm² has the rest.
    let (mean, most) = of(100.0, false);
    assert!(mean > 7.5 && most < MOST_EATEN, "{mean} {most}");
    assert!(of(10.0, true).0 > 0.3, "seed leaves have holes too");
}

#[test]
fn bites_and_tears_cut_the_margin_and_not_more_than_a_third_of_the_leaf() {
    let mask = oval();
    let condition = Condition { bites: 3.0, tears: 1.0, ..Condition::default() };
    for k in 0..40 {
        let m = marks(&condition, &leaf(&mask), k);
        let left = m.cut(Some(&mask)).count().to_f32() / mask.count().to_f32();
        assert!(m.cuts() == (left < 1.0) && left > 0.67, "{k}: {left}");
    }
}

/// Expected: at the soil the mean cover is the given one; it decreases with height.
#[test]
fn dust_covers_what_it_should() {
    let mask = oval();
    let condition = Condition { dust: 0.2, ..Condition::default() };
    let cover = |height: f32| {
        let mut sum = 0.0;
        for k in 0..60 {
            let m = marks(&condition, &Bearer { height, ..leaf(&mask) }, k);
            let noise = m.noise();
            let at = |i: usize| m.tissue(vec2((i % 20).to_f32() / 20.0, (i / 20).to_f32() / 20.0), &noise).soil;
            sum += (0..400).map(at).sum::<f32>() / 400.0;
        }
        sum / 60.0
    };
    let (low, high) = (cover(0.0), cover(0.1));
    assert!((low - 0.21).abs() < 0.05, "{low}");
    assert!(high < 0.5 * low && high > 0.1 * low, "{high}");
}

#[test]
fn splash_covers_more_the_more_of_it_there_is() {
    let mask = oval();
    let cover = |splash: f32| {
        let m = marks(&Condition { splash, ..Condition::default() }, &leaf(&mask), 3);
        let noise = m.noise();
        let at = |i: usize| m.tissue(vec2((i % 100).to_f32() / 100.0, (i / 100).to_f32() / 100.0), &noise).soil;
        (0..10_000).map(at).sum::<f32>() / 10_000.0
    };
    let all = [0.5, 2.0, 8.0].map(cover);
    assert!(all[0] < all[1] && all[1] < all[2] && all[2] < 0.3, "{all:?}");
    // Eight specks per cm² of 0.15–1 mm radius, log-uniform: 8 · π · 0.25 mm² of 100 mm².
    assert!((all[2] - 0.065).abs() < 0.025, "{all:?}");
}

/// Rationale: a rim of fixed width in mm would cover all of a seedling's leaf. Expected: rims cover the same fraction
/// of a leaf of 8 mm as of one of 80 mm, within 3 percentage points, and less than a third; by default fewer than one
/// in thirty of the oldest leaves has one. Source: photographs of fields, where a leaf with a dead margin is rare.
#[test]
fn scorched_rims_are_a_share_of_the_blade_and_rare() {
    let mask = oval();
    let margin = Arc::new(Margin::of(&mask));
    let noise = Perlin::new(0);
    let share = |length: f32| {
        let bearer = Bearer { image_mm: vec2(0.7, 1.0) * length, margin: Some(&margin), ..leaf(&mask) };
        let condition = Condition { scorched: 1.0, scorch: 0.08, ..Condition::default() };
        let mut ill = (0.0, 0.0);
        for k in 0..200 {
            let marks = marks(&condition, &bearer, k);
            for i in 0..1600 {
                let uv = vec2((i % 40).to_f32() + 0.5, (i / 40).to_f32() + 0.5) / 40.0;
                if mask.opaque_at(uv) {
                    let t = marks.tissue(uv, &noise);
                    ill = (ill.0 + t.brown.max(t.yellow), ill.1 + 1.0);
                }
            }
        }
        ill.0 / ill.1
    };
    let (large, small) = (share(80.0), share(8.0));
    assert!(large > 0.05 && large < 0.33 && small <= large + 0.03, "{large} {small}");
    let desc = ConditionDesc::default();
    let bearer = Bearer { margin: Some(&margin), ..leaf(&mask) };
    let rims =
        (0..2000).filter(|k| bearer.draw_marks(&desc, &desc.draw(&stream(*k)), &stream(*k)).scorch_mm > 0.0).count();
    assert!((10..67).contains(&rims), "{rims} of 2000");
}

#[test]
fn marks_are_the_same_every_time() {
    let mask = oval();
    let condition = Condition { holes: 4.0, bites: 1.0, spots: 5.0, splash: 3.0, ..Condition::default() };
    let (a, b) = (marks(&condition, &leaf(&mask), 5), marks(&condition, &leaf(&mask), 5));
    assert_eq!(a, b);
    assert_eq!(a.cut(Some(&mask)), b.cut(Some(&mask)));
    assert_ne!(a, marks(&condition, &leaf(&mask), 6));
}
