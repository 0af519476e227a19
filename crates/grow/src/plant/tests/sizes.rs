//! Numbers of leaves, sizes and proportions, compared with tables from the literature.

use super::*;
use furrow_base::math::{RoundTo, ToFloat, ToInt};

/// Returns the number of unfolded true leaves at a stage, and the number of all. A leaf has unfolded once it is 0.35
/// times as long as the longest leaf, and so have all older leaves, withered or not. In whorled plants whorls are
/// counted.
fn unfolded(plant: &PlantDesc, stage: &StageDesc) -> (usize, usize) {
    let stream = stream(0);
    let whorls = plant.form == Form::Whorl;
    let lengths: Vec<(f64, usize)> = stage
        .layers
        .iter()
        .filter(|l| plant.kinds[&l.kind].organ == OrganKind::Blade)
        .map(|l| (l.blade_mm.draw(&mut stream.clone()), if whorls { 1 } else { l.leaves.get().trunc_to::<usize>() }))
        .collect();
    let peak = lengths.iter().fold(0.0, |m: f64, l| m.max(l.0));
    let (mut longest, mut unfolded, mut all) = (0.0_f64, 0, 0);
    for (length, n) in lengths {
        if longest < peak || length > 0.35 * peak {
            unfolded += n;
        }
        longest = longest.max(length);
        all += n;
    }
    (unfolded, all)
}

/// Rationale: a stage is defined by the number of unfolded leaves. Expected: the code's second digit; 9 means nine or
/// more. Source: Meier 2001.
#[test]
fn leaves_are_as_many_as_the_stage_says() {
    everywhere(|page, stage, _| {
        if stage.bbch > 19 {
            return;
        }
        let stream = stream(0);
        let grown = growth::growth(&page.plant, Stage::Bbch(stage.bbch), &stream, 1.0).unwrap();
        let (unfolded, all) = unfolded(&page.plant, stage);
        let expected = stage.bbch.saturating_sub(10).to_usize();
        let fits = if expected == 9 { unfolded >= 9 } else { unfolded == expected };
        assert!(fits, "{} BBCH {}: {unfolded} unfolded of {all}", page.eppo, stage.bbch);
        assert!(grown.leaves.windows(2).all(|w| w[0].number < w[1].number));
    });
}

#[test]
fn every_species_stands_in_both_tables() {
    let (sizes, plans) = (table("species_sizes.csv"), table("species_plans.csv"));
    for page in pages() {
        for rows in [&sizes, &plans] {
            assert!(rows.iter().any(|row| row["eppo"] == page.eppo), "{}: {} is in no table", page.name, page.eppo);
        }
    }
}

/// Expected: for all seeds the largest leaf is within the table's ranges, with a tolerance of 3 %, and so is the number
/// of unfolded leaves. Source: the sources of `tests/ref/species_sizes.csv`.
#[test]
fn sizes_lie_within_the_tables() {
    let pages = pages();
    for row in table("species_sizes.csv") {
        let plant = &pages.iter().find(|p| p.eppo == row["eppo"]).unwrap().plant;
        let bbch: u32 = row["bbch"].parse().unwrap();
        let at = format!("{} {bbch}", row["eppo"]);
        let stage = plant.stages.iter().find(|s| s.bbch == bbch).unwrap_or_else(|| panic!("{at}: no such stage"));
        let within = |what: &str, value: f32, slack: f32| {
            let least = number(&row, &format!("{what}_least")).is_none_or(|l| value >= l * (1.0 - slack));
            let most = number(&row, &format!("{what}_most")).is_none_or(|m| value <= m * (1.0 + slack));
            assert!(least && most, "{at}: {what} {value}");
        };
        within("leaves", unfolded(plant, stage).0.to_f32(), 0.0);
        for seed in 0..20 {
            let stream = stream(seed);
            let grown = growth::growth(plant, Stage::Bbch(bbch), &stream, 1.0).unwrap();
            let leaf = grown
                .leaves
                .iter()
                .filter(|l| bbch == 10 || l.kind.organ == OrganKind::Blade)
                .max_by(|a, b| a.blade.total_cmp(&b.blade))
                .unwrap();
            within("length", leaf.blade * 1e3, 0.03);
            within("width", leaf.width * 1e3, 0.03);
        }
    }
}

/// Rationale: outlines are distinguished by the fraction of their bounding rectangle that they fill. Expected: the
/// fraction of each species' commonest leaf is the table's within 7 %; the built blades have that area, slightly more
/// for the mesh's rim, less for waves. Source: the sources of `tests/ref/species_plans.csv`.
#[test]
fn blades_fill_as_much_of_their_length_and_width_as_the_table_says() {
    let rows = table("species_plans.csv");
    for page in pages() {
        let row = rows.iter().find(|r| r["eppo"] == page.eppo).unwrap();
        let Some(area) = number(row, "area") else { continue };
        let kinds = || page.plant.kinds.iter().filter(|(_, k)| k.organ == OrganKind::Blade);
        let ratio = |outline: outline::Outline| {
            (0..2000).map(|i| 2.0 * outline.half_width((i.to_f32() + 0.5) / 2000.0)).sum::<f32>() / 2000.0
        };
        let fits = kinds().any(|(_, k)| match k.shape {
            Shape::Sheet { outline } | Shape::Leaflets { outline, .. } => (ratio(outline) / area - 1.0).abs() < 0.07,
            _ => false,
        });
        assert!(fits, "{}: no leaf fills {area}", page.eppo);
        let stream = stream(3);
        let stage = Stage::Bbch(page.plant.stages.iter().map(|s| s.bbch).filter(|b| *b <= 19).max().unwrap());
        let plant = grow(&page.plant, stage, &stream);
        for leaf in growth::growth(&page.plant, stage, &stream, 1.0).unwrap().leaves {
            let Shape::Sheet { outline: of @ outline::Outline::Power { .. } } = leaf.kind.shape else { continue };
            let blade = plant.organs.iter().find(|o| o.leaf == leaf.number && o.axis.is_some()).unwrap();
            let share = blade.mesh.area() / (leaf.blade * leaf.width) / ratio(of);
            // The mesh has a rim, waves fold it, and no two leaves share an outline.
            assert!((0.8..1.4).contains(&share), "{} leaf {}: {share}", page.eppo, leaf.number);
        }
    }
}

/// Rationale: users who measure leaves expect less area than length times width. Segments of a young divided leaf are
/// as wide as those of a full-grown one and overlap; `docs/guide/traits.md` documents this with the length above which
/// leaves are as expected. Expected: leaves of 6 mm and more have less area; some shorter leaves have more. Source: the
/// meshes.
#[test]
fn divided_leaves_have_less_area_than_length_times_width_from_6_mm_on() {
    let mut most_of_young = 0.0_f32;
    for eppo in ["MATIN", "DAUCA"] {
        let desc = page(eppo);
        let mut long = 0;
        for (seed, day) in (0..4).flat_map(|seed| [10.0, 14.0, 18.0, 22.0, 26.0].map(|day| (seed, day))) {
            let plant = grow(&desc, Stage::Age(day), &stream(seed));
            for organ in plant.organs.iter().filter(|o| o.kind == OrganKind::Blade) {
                let size = organ.axis.as_ref().unwrap().size;
                let share = organ.mesh.area() / (size.length * size.width);
                if size.length < 6e-3 {
                    most_of_young = most_of_young.max(share);
                } else {
                    assert!(share < 1.0, "{eppo} day {day} leaf {} of {} m: {share}", organ.leaf, size.length);
                    long += 1;
                }
            }
        }
        assert!(long > 20, "{eppo}: {long}");
    }
    assert!(most_of_young > 1.0, "{most_of_young}");
}

/// Rationale: soybean has three leaflets, peanut four. Expected: the blade consists of this number of sheets; with a
/// terminal leaflet the midrib reaches the end of that leaflet, without one it ends with the rachis. Source: the
/// species files.
#[test]
fn compound_blades_have_as_many_leaflets_as_their_species() {
    for (eppo, leaflets, reach) in [("GLXMA", 3, 0.75..1.2), ("ARHHY", 4, 0.3..0.45)] {
        let page = page(eppo);
        for seed in 0..10 {
            let stream = stream(seed);
            let plant = grow(&page, Stage::Bbch(14), &stream);
            for leaf in growth::growth(&page, Stage::Bbch(14), &stream, 1.0).unwrap().leaves {
                if leaf.kind_name != "leaf" {
                    continue;
                }
                let organ = plant.organs.iter().find(|o| o.leaf == leaf.number && o.axis.is_some()).unwrap();
                // Vertices that share a triangle belong to one sheet.
                let mut sheet: Vec<u32> = (0..organ.mesh.positions.len().to_u32()).collect();
                let mut joined = true;
                while joined {
                    joined = false;
                    for triangle in &organ.mesh.triangles {
                        let least = triangle.iter().map(|i| sheet[i.to_usize()]).min().unwrap();
                        for i in triangle {
                            joined |= sheet[i.to_usize()] != least;
                            sheet[i.to_usize()] = least;
                        }
                    }
                }
                let held: std::collections::BTreeSet<u32> =
                    organ.mesh.triangles.iter().map(|t| sheet[t[0].to_usize()]).collect();
                assert_eq!(held.len(), leaflets, "{eppo} leaf {}", leaf.number);
                let axis = organ.axis.as_ref().unwrap();
                let share = axis.base.distance(axis.tip) / leaf.blade;
                assert!(reach.contains(&share), "{eppo} leaf {}: {share}", leaf.number);
            }
        }
    }
}

/// Expected: the mean of ten plants is within the table's ranges, with a tolerance of 10 %. Source:
/// `tests/ref/beet_stages.csv`.
#[test]
fn beets_are_as_high_and_wide_as_their_stage() {
    let beet = page("BEAVX");
    for row in table("beet_stages.csv") {
        let bbch: u32 = row["bbch"].parse().unwrap();
        let stage = beet.stages.iter().find(|s| s.bbch == bbch).unwrap();
        // Selects the stage of the file by its days, because its code may be one of ground cover.
        let plants: Vec<Plant> = (0..10).map(|seed| grow(&beet, Stage::Age(stage.days.f32()), &stream(seed))).collect();
        let mean = |pick: fn(&Plant) -> f32| plants.iter().map(pick).sum::<f32>() / plants.len().to_f32() * 1e3;
        let span = |plant: &Plant| {
            let corners = || plant.organs.iter().filter_map(|o| o.mesh.bounds());
            let low = corners().fold(Vec3::MAX, |low, b| low.min(b.0));
            let high = corners().fold(Vec3::MIN, |high, b| high.max(b.1));
            0.5 * (high.x - low.x + high.y - low.y)
        };
        for (what, value) in [("height", mean(|p| p.height)), ("span", mean(span))] {
            let [least, most] = ["least", "most"].map(|end| number(&row, &format!("{what}_{end}")).unwrap());
            assert!((0.9 * least..1.1 * most).contains(&value), "BBCH {bbch}: {what} {value:.0} of {least} to {most}");
        }
    }
}

/// Expected: shepherd's purse and cauliflower have the proportions seen in pictures: the first leaves of shepherd's
/// purse, and all grown leaves of cauliflower above their winged base; the rosette of shepherd's purse is flat on the
/// ground. Source: cut-outs, see docs/results/labels-and-detail.md, "Outlines of plants".
#[test]
fn rosettes_have_the_proportions_of_their_pictures() {
    for seed in 0..10 {
        let stream = stream(seed);
        let purse = page("CAPBP");
        let grown = growth::growth(&purse, Stage::Bbch(16), &stream, 1.0).unwrap();
        for leaf in grown.leaves.iter().filter(|l| l.kind_name == "leaf_entire") {
            let ratio = leaf.blade / leaf.width;
            assert!((1.3..=1.6).contains(&ratio), "leaf {}: {ratio}", leaf.number);
        }
        let plant = grow(&purse, Stage::Bbch(19), &stream);
        assert!(plant.height < 0.5 * plant.radius, "seed {seed}: {} of {}", plant.height, plant.radius);
        let cauliflower = page("BRSOB");
        let grown = growth::growth(&cauliflower, Stage::Bbch(16), &stream, 1.0).unwrap();
        let longest = grown.leaves.iter().map(|l| l.blade).fold(0.0, f32::max);
        for leaf in grown.leaves.iter().filter(|l| l.kind_name == "leaf" && l.blade > 0.5 * longest) {
            let ratio = 0.86 * leaf.blade / leaf.width;
            assert!((1.05..1.45).contains(&ratio), "leaf {}: {ratio}", leaf.number);
            assert!(leaf.stalk < 0.25 * leaf.blade, "leaf {}", leaf.number);
        }
    }
}
