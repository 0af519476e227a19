//! Structure of plants: sheaths, mats, joints, spines.

use super::*;
use furrow_base::math::{ToFloat, vec2};

/// Rationale: sheaths that leave the ground side by side look like straws; grasses have one stem of nested sheaths.
/// Expected: the extent of a shoot's sheaths near the soil, below the lowest collar, is at most the stem's width plus a
/// quarter for the lean. Source: Clifford & McLean 1962.
#[test]
fn sheaths_of_a_shoot_are_nested() {
    for (eppo, bbch) in [("ZEAMX", 16), ("ECHCG", 14), ("POAAN", 13), ("TRZAX", 13)] {
        let desc = page(eppo);
        for seed in 0..10 {
            let plant = grow(&desc, Stage::Bbch(bbch), &stream(seed));
            let low = if eppo == "POAAN" { 1e-3..3e-3 } else { 4e-3..10e-3 };
            let sheaths = || plant.organs.iter().filter(|o| o.kind == OrganKind::Sheath);
            let corners =
                |o: &Organ| -> Vec<Vec3> { o.mesh.positions.iter().copied().filter(|p| low.contains(&p.z)).collect() };
            let width = |points: &[Vec3]| {
                let wide = points.iter().flat_map(|p| points.iter().map(move |q| (*p - *q).truncate().length()));
                wide.fold(0.0_f32, f32::max)
            };
            let all: Vec<Vec3> = sheaths().flat_map(corners).collect();
            let widest = sheaths().map(|o| width(&corners(o))).fold(0.0, f32::max);
            let most = 1.25 * growth::growth(&desc, Stage::Bbch(bbch), &stream(seed), 1.0).unwrap().stem;
            assert!(
                !all.is_empty() && width(&all) < most.max(1.05 * widest),
                "{eppo} {seed}: {} over {most}",
                width(&all)
            );
        }
    }
}

/// Rationale: seen from above, a chickweed at BBCH 25 is a mat, not a line, and cleavers lie on the soil. Expected: the
/// mat's narrowest extent is at least half of its widest; its height is at most half of its width. Maize at BBCH 16 is
/// about as tall as wide. Sources: Holm et al. 1977 for the growth of chickweed; the ratios are estimates from
/// pictures.
#[test]
fn plants_are_as_high_as_they_are_wide_or_lie() {
    let extents = |eppo: &str, bbch: u32| {
        let desc = page(eppo);
        let of = |seed| {
            let plant = grow(&desc, Stage::Bbch(bbch), &stream(seed));
            let width = |angle: f32| {
                let across = vec2(angle.cos(), angle.sin());
                let along = plant.organs.iter().flat_map(|o| &o.mesh.positions).map(|p| p.truncate().dot(across));
                let (low, high) = along.fold((f32::MAX, f32::MIN), |(l, h), x| (l.min(x), h.max(x)));
                high - low
            };
            let widths: Vec<f32> = (0..12).map(|k| width(PI * k.to_f32() / 12.0)).collect();
            let (low, high) = widths.iter().fold((f32::MAX, 0.0_f32), |(l, h), w| (l.min(*w), h.max(*w)));
            [low, high, plant.height]
        };
        let all: Vec<[f32; 3]> = (0..10).map(of).collect();
        [0, 1, 2].map(|k| all.iter().map(|e| e[k]).sum::<f32>() / 10.0)
    };
    let [narrow, wide, high] = extents("STEME", 25);
    assert!(narrow > 0.5 * wide && high < 0.5 * wide, "chickweed: {narrow} {wide} {high}");
    let [_, wide, high] = extents("GALAP", 15);
    assert!(high < 0.6 * wide, "cleavers: {wide} {high}");
    let [_, wide, high] = extents("ZEAMX", 16);
    assert!((0.6..1.2).contains(&(high / wide)), "maize: {wide} {high}");
}

/// Rationale: joints are placed where a species bends, not at equal distances. Expected: joints at the listed
/// positions, and branches on a blade with parallel veins if `branch_angle_deg` is given. Source: Di Cicco et al. 2017,
/// §III-A.
#[test]
fn joints_stand_where_the_species_file_says() {
    let plain = r#"(form: Rosette, kinds: {"leaf": (shape: Sheet(outline: Power(a: 0.5, b: 0.8)), vein_angle_deg: 0)}, stages: [
        (bbch: 12, days: 3, hypocotyl_mm: 5, stem_mm: 1, layers: [(kind: "leaf", blade_mm: 50, width_mm: 20, angle_deg: 50)])])"#;
    let posed = plain.replace("vein_angle_deg: 0", "vein_angle_deg: 0, branch_angle_deg: 60, joint_at: [0.1, 0.5]");
    let joints = |text: &str| {
        let desc: PlantDesc = furrow_base::ron_file::RonFile::of(text).parse().unwrap();
        let plant = grow(&desc, Stage::Bbch(12), &stream(1));
        plant.leaf_axes().next().unwrap().joints
    };
    let named = |joints: &[PlacedJoint], name: &str| joints.iter().find(|j| j.name.to_string() == name).map(|j| j.at);
    let (before, after) = (joints(plain), joints(&posed));
    assert!(named(&before, "STL1").is_none() && named(&before, "VN5").is_some());
    assert!(named(&after, "STL2").is_some() && named(&after, "VN3").is_none());
    let [base, first, second] = ["B", "VN1", "VN2"].map(|name| named(&after, name).unwrap());
    let share = base.distance(first) / first.distance(second);
    assert!((share - 0.25).abs() < 0.01, "{share}");
    for bad in ["joint_at: [0.5, 0.1]", "joint_at: [0, 0.5]"] {
        let wrong = posed.replace("joint_at: [0.1, 0.5]", bad);
        assert!(
            furrow_base::ron_file::RonFile::of(&wrong)
                .parse::<PlantDesc>()
                .unwrap_err()
                .to_string()
                .contains("must rise")
        );
    }
}

/// Rationale: a real leaf of carrot or mayweed twists pinna by pinna, but a blade that bends only along its rachis is
/// developable. Expected: it has branches at its vein joints. If these rise by 30° at the midrib, the outer half of a
/// blade rises by sin 30° of its distance along the branch and the rachis does not move. Source: Di Cicco et al. 2017,
/// §III-A, for the branches; a rotation about a hinge at the midrib.
#[test]
fn divided_blades_bend_branch_by_branch() {
    for (eppo, shape) in [
        ("DAUCA", "Fern(pairs: 6, pinnules: 4, segment_mm: 1)"),
        ("MATIN", "Pinnate(pairs: 10, lobes: 3, segment_mm: 0.7, bare: 0.14)"),
    ] {
        assert!(
            grow(&page(eppo), Stage::Bbch(16), &stream(1))
                .leaf_axes()
                .any(|axis| axis.joints.iter().any(|joint| joint.name.to_string() == "STR2")),
            "{eppo} has no branches"
        );
        let grown = |bend: &str| {
            let text = format!(
                r#"(form: Dissected, kinds: {{"leaf": (shape: {shape}, wobble_deg: 0, roll_deg: 0, branch_bend_deg: ({bend}, 0))}}, lean_deg: 0, stages: [
                (bbch: 12, days: 3, hypocotyl_mm: 80, stem_mm: 1, layers: [(kind: "leaf", blade_mm: 50, width_mm: 24, angle_deg: 90)])])"#
            );
            let desc: PlantDesc = furrow_base::ron_file::RonFile::of(&text).parse().unwrap();
            let plant = grow(&desc, Stage::Bbch(12), &stream(4));
            let blade = plant.organs.into_iter().find(|o| o.kind == OrganKind::Blade).unwrap();
            (blade.mesh.positions, blade.axis.unwrap())
        };
        let ((flat, axis), (bent, _)) = (grown("0"), grown("30"));
        let along = (axis.tip - axis.base).normalize();
        let across = |p: Vec3| (p - axis.base - along * (p - axis.base).dot(along)).truncate().length();
        let widest = flat.iter().map(|p| across(*p)).fold(0.0_f32, f32::max);
        let rise = |least: f32, most: f32| {
            let of = flat.iter().zip(&bent).filter(|(p, _)| (least..most).contains(&(across(**p) / widest)));
            let all: Vec<f32> = of.map(|(p, q)| (q.z - p.z) / across(*p).max(1e-5)).collect();
            all.iter().sum::<f32>() / all.len().to_f32()
        };
        assert!(
            flat.iter().zip(&bent).filter(|(p, _)| across(**p) < 1e-5).all(|(p, q)| p.distance(*q) < 1e-5),
            "{eppo}"
        );
        let outer = rise(0.5, 1.1) * 55f32.to_radians().sin();
        assert!((outer - 0.5).abs() < 0.1, "{eppo}: {outer}");
    }
}

/// Rationale: cultivars of carrot have fine or broad lobes; all leaves of a plant are of one cultivar. Expected: a plant
/// that draws its breadth is the plant with some fixed breadth, leaf by leaf, and other seeds draw other ones; a blade
/// with lobes three segments wide has more area than a finely cut one. Source: UPOV TG/49, "Leaf: division" from fine to
/// coarse.
#[test]
fn all_leaves_of_a_carrot_have_lobes_of_one_breadth() {
    let grown = |breadth: &str, seed: u64| {
        let leaf = |alpha: f32| format!(r#"(kind: "leaf", alpha: {alpha}, blade_mm: 60, width_mm: 32, angle_deg: 40)"#);
        let text = format!(
            r#"(form: Dissected, kinds: {{"leaf": (shape: Fern(pairs: 6, pinnules: 4, segment_mm: 1, breadth: {breadth}))}}, stages: [
            (bbch: 12, days: 3, hypocotyl_mm: 4, stem_mm: 1, layers: [{}, {}])])"#,
            leaf(0.0),
            leaf(0.8)
        );
        let desc: PlantDesc = furrow_base::ron_file::RonFile::of(&text).parse().unwrap();
        let plant = grow(&desc, Stage::Bbch(12), &stream(seed));
        plant.organs.into_iter().filter(|o| o.kind == OrganKind::Blade).map(|o| o.mesh).collect::<Vec<_>>()
    };
    let area = |breadth: &str| grown(breadth, 4).iter().map(Mesh::area).sum::<f32>();
    let ratio = area("3") / area("1");
    assert!((1.1..2.5).contains(&ratio), "{ratio}");
    let mut drawn = std::collections::BTreeSet::new();
    for seed in 0..8 {
        let blades = grown("Choice([1, 3])", seed);
        let of = ["1", "3"]
            .into_iter()
            .find(|fixed| grown(fixed, seed).iter().zip(&blades).all(|(a, b)| a.positions == b.positions));
        drawn.insert(of.unwrap_or_else(|| panic!("seed {seed}: leaves of two breadths")));
    }
    assert_eq!(drawn.len(), 2, "{drawn:?}");
}

/// Rationale: thistles have spines. Expected: spines of the length in the species file, some above the blade and some
/// below, only on the leaves whose kind has them. Source: 1.5-3 mm, SLU Ogräsrådgivaren.
#[test]
fn thistles_have_spines_off_the_blades_plane() {
    let armed = page("CIRAR");
    let mut bare = armed.clone();
    bare.kinds.get_mut("leaf").unwrap().spines = None;
    let [a, b] = [&armed, &bare].map(|desc| grow(desc, Stage::Bbch(16), &stream(2)));
    for (a, b) in a.organs.iter().zip(&b.organs) {
        let more = a.mesh.positions.len() - b.mesh.positions.len();
        let spined = a.kind == OrganKind::Petiole && armed.kinds["leaf"].spines.is_some() && more > 0;
        if !spined {
            assert_eq!(more, 0, "{:?} {}", a.kind, a.leaf);
            continue;
        }
        assert_eq!(more % 4, 0);
        for spine in a.mesh.positions[b.mesh.positions.len()..].chunks(4) {
            let long = spine[3].distance((spine[0] + spine[1] + spine[2]) / 3.0);
            assert!((0.1e-3..4e-3).contains(&long), "leaf {}: {long}", a.leaf);
        }
    }
    assert!(a.organs.iter().zip(&b.organs).any(|(a, b)| a.mesh.positions.len() > b.mesh.positions.len()));
}

/// Rationale: a seed tuber has several main stems, and a leaf must keep its number over the days. Expected: 2 to 6
/// stems, 3 to 4.6 on average, the same number on all days, with bases within 50 mm of the centre. The first stem is
/// bit-identical to that of a plant without others. A leaf's base moves by at most 12 mm per day. Source: Allen & Wurr
/// 1992 for the number; the rest is an estimate.
#[test]
fn a_potato_has_several_stems_that_stay_what_they_are() {
    let desc = page("SOLTU");
    let mut single = desc.clone();
    single.stages.iter_mut().for_each(|stage| stage.tillers = Vary::fixed(0.0));
    let mut all = Vec::new();
    for seed in 0..60 {
        let stream = stream(seed);
        let (mut counts, mut feet) = (Vec::new(), BTreeMap::<u16, Vec3>::new());
        // Later days of the first seeds only: they differ in positions, not in the number of stems.
        for day in 5..if seed < 12 { 36 } else { 6 } {
            let [plant, first] = [&desc, &single].map(|desc| grow(desc, Stage::Age(day.to_f32()), &stream));
            assert_eq!(plant.organs[..first.organs.len()], first.organs, "seed {seed}, day {day}");
            let hypocotyls = || plant.organs.iter().filter(|o| o.kind == OrganKind::Hypocotyl);
            counts.push(hypocotyls().count());
            for organ in hypocotyls() {
                let ground = organ.mesh.positions.iter().filter(|p| p.z.abs() < 0.006);
                let far = ground.fold(0.0_f32, |far, p| far.max(p.truncate().length()));
                assert!(far < 0.05, "seed {seed}, day {day}: {far}");
            }
            assert!(plant.leaf_axes().all(|axis| plant.ages.contains_key(&axis.leaf)));
            for axis in plant.leaf_axes() {
                let foot = axis.joints[0].at;
                let before = feet.insert(axis.leaf, foot).unwrap_or(foot);
                assert!(before.distance(foot) < 0.012, "seed {seed}, day {day}, leaf {}", axis.leaf);
            }
        }
        assert!((2..=6).contains(&counts[0]) && counts.iter().all(|n| *n == counts[0]), "seed {seed}: {counts:?}");
        all.push(counts[0]);
    }
    let mean = all.iter().sum::<usize>().to_f32() / all.len().to_f32();
    assert!((3.0..4.6).contains(&mean), "{mean}");
}

/// Rationale: leaves are tracked over the days by their numbers. Expected: no leaf jumps to another leaf's size from
/// one day to the next, even if side shoots and flowering axes appear before it. A change of up to 0.4 of its length
/// plus a fifth of the longest blade counts as growth or death.
#[test]
fn leaves_keep_their_numbers_while_others_come_out() {
    let coarse = GrowOptions { cell: 0.02, ..GrowOptions::default() };
    for page in pages() {
        let ((first, last), stream) = (page.plant.days(), stream(0));
        let lengths = |day: f32| -> BTreeMap<u16, f32> {
            let plant = grow_with(&page.plant, Stage::Age(day), &stream, &coarse);
            plant.leaf_axes().map(|axis| (axis.leaf, axis.size.length)).collect()
        };
        let (mut before, mut day) = (lengths(first), first);
        while day < last {
            day += 1.0;
            let now = lengths(day);
            let longest = now.values().fold(0.0_f32, |most, length| most.max(*length));
            for (leaf, length) in &now {
                let Some(was) = before.get(leaf) else { continue };
                let most = 0.4 * was.max(*length) + 0.2 * longest;
                assert!((length - was).abs() <= most, "{} day {day} leaf {leaf}: {was} to {length} m", page.eppo);
            }
            before = now;
        }
    }
}

/// Expected: no two leaves of a plant share a number.
#[test]
fn blocks_of_numbers_do_not_overlap() {
    for page in pages() {
        let plant = grow(&page.plant, Stage::Bbch(page.plant.stages.last().unwrap().bbch), &stream(1));
        let mut seen = std::collections::BTreeSet::new();
        for axis in plant.leaf_axes() {
            assert!(axis.leaf > 0 && seen.insert(axis.leaf), "{}: two leaves are number {}", page.eppo, axis.leaf);
        }
    }
}

/// Rationale: one stage may give its lean as a number and the next as a distribution; the plant must not turn around
/// between them. Expected: a plant that leans by 40° at BBCH 10 and 12 leans in the same direction on all days, however
/// the two are written.
#[test]
fn plants_lean_one_way_whatever_their_stages_say() {
    let mut desc = page("BEAVX");
    desc.stages[1].lean_deg = Some(Vary::fixed(40.0));
    let mut ways = Vec::new();
    for at_12 in [Vary::fixed(40.0), Vary::uniform(40.0, 40.01)] {
        desc.stages[2].lean_deg = Some(at_12);
        for days in [4.0, 9.0, 14.0] {
            let plant = grow(&desc, Stage::Age(days), &stream(5));
            let below = plant.organs.iter().find(|o| o.kind == OrganKind::Hypocotyl).unwrap();
            let high = |p: &&Vec3, q: &&Vec3| p.z.total_cmp(&q.z);
            let ends = [below.mesh.positions.iter().min_by(high), below.mesh.positions.iter().max_by(high)];
            ways.push((*ends[1].unwrap() - *ends[0].unwrap()).truncate().normalize());
        }
    }
    assert!(ways.iter().all(|way| way.dot(ways[0]) > 0.95), "{ways:?}");
}

/// Rationale: seedlings emerge bent over and straighten within days. Expected: at BBCH 9 the axis leans by more than
/// 25°, at 10 by at most the plant's `lean_deg`, and in between less each day. Source: the species files.
#[test]
fn seedlings_straighten_after_emergence() {
    for eppo in ["BEAVX", "CHEAL"] {
        let desc = page(eppo);
        let most = desc.lean_deg.usual().1.to_f32();
        for seed in 0..10 {
            let stream = stream(seed);
            let leans = [1.0, 2.0, 3.0, 4.0].map(|days| {
                let grown = growth::growth(&desc, Stage::Age(days), &stream, 1.0).unwrap();
                grown.lean(&mut stream.child(Purpose::Plant, 1)).to_degrees()
            });
            assert!(leans[0] >= 25.0 && leans[3] <= most, "{eppo} {seed}: {leans:?}");
            assert!(leans.windows(2).all(|w| w[1] < w[0]), "{eppo} {seed}: {leans:?}");
        }
    }
}
