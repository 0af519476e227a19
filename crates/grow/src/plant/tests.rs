//! System tests of the species files; they cover every file in `scenes/species`.

use super::*;
use furrow_base::geometry::{Mesh, outline};
use furrow_base::math::{ToFloat, ToInt, Vec2, Vec3};
use furrow_base::ron_file::Vary;
use furrow_base::sampling::Purpose;
use furrow_field::species_text::SpeciesFile;
use serde::Deserialize;
use serde::de::IgnoredAny;
use std::collections::BTreeMap;
use std::f32::consts::{PI, TAU};

mod build;
mod senescence;
mod sizes;

/// Material; only its roughness is read.
#[derive(Deserialize)]
#[serde(rename = "Leaf")]
struct Material {
    roughness: f32,
}

/// The fields of a species file that these tests read.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename = "Species")]
#[allow(dead_code)]
struct Page {
    name: String,
    #[serde(default)]
    scientific: String,
    eppo: String,
    role: IgnoredAny,
    materials: BTreeMap<String, Material>,
    plant: PlantDesc,
}

fn pages() -> Vec<Page> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/species");
    let mut files: Vec<_> = std::fs::read_dir(folder).unwrap().map(|f| f.unwrap().path()).collect();
    files.retain(|f| f.extension().is_some_and(|e| e == "ron"));
    files.sort();
    assert!(files.len() >= 16, "species pages are missing");
    files
        .iter()
        .map(|f| {
            let file = SpeciesFile::read(f).unwrap_or_else(|e| panic!("{e}"));
            ron::from_str(&file.page().text).unwrap_or_else(|e| panic!("{}: {e}", f.display()))
        })
        .collect()
}

fn page(eppo: &str) -> PlantDesc {
    pages().into_iter().find(|p| p.eppo == eppo).unwrap().plant
}

fn stream(seed: u64) -> Stream {
    Stream::of(seed, 0, Purpose::Plant, 3)
}

/// Returns the rows of a table in `tests/ref`, which documents the sources of its numbers.
fn table(name: &str) -> Vec<BTreeMap<String, String>> {
    let path = format!("{}/../../tests/ref/{name}", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{path}: {e}"));
    let mut lines = text.lines().filter(|l| !l.starts_with('#')).map(|l| l.split(',').map(str::to_owned));
    let head: Vec<String> = lines.next().unwrap().collect();
    lines.map(|row| head.iter().cloned().zip(row).collect()).collect()
}

/// Returns a number of a row; `None` where the table does not state it.
fn number(row: &BTreeMap<String, String>, column: &str) -> Option<f32> {
    let text = &row[column];
    (!text.is_empty()).then(|| text.parse().unwrap_or_else(|e| panic!("{row:?}: {column}: {e}")))
}

/// Returns `true` if the plants have several stems from one place.
fn has_several_stems(page: &Page, stage: &StageDesc) -> bool {
    page.plant.form == Form::Erect && stage.tillers.largest() > 0.0
}

/// Calls `look` with every species, every stage and twenty seeds, or three at flowering stages, whose plants have more
/// geometry.
fn everywhere(mut look: impl FnMut(&Page, &StageDesc, &Plant)) {
    for page in pages() {
        for stage in &page.plant.stages {
            let seeds = if stage.inflorescences.is_empty() { 10 } else { 3 };
            for seed in 0..seeds {
                look(&page, stage, &grow(&page.plant, Stage::Bbch(stage.bbch), &stream(seed)));
            }
        }
    }
}

#[test]
fn every_species_grows_valid_meshes_at_every_stage() {
    everywhere(|page, stage, plant| {
        assert!(!plant.organs.is_empty());
        assert_eq!(plant.bbch, stage.bbch);
        for organ in &plant.organs {
            let at = format!("{} {} {:?} {}", page.eppo, stage.bbch, organ.kind, organ.leaf);
            assert_eq!(organ.mesh.fault(), None, "{at}");
            assert!(!organ.mesh.triangles.is_empty(), "{at}");
            assert!(page.materials.contains_key(&organ.material), "{at}: no material {}", organ.material);
            assert_eq!(
                organ.leaf > 0,
                matches!(organ.kind, OrganKind::Blade | OrganKind::Cotyledon | OrganKind::Petiole | OrganKind::Sheath),
                "{at}"
            );
        }
    });
}

#[test]
fn every_age_between_the_stages_grows_valid_meshes() {
    for page in pages() {
        let (first, last) = page.plant.days();
        for k in 0..40 {
            let age = first - 3.0 + (last - first + 8.0) * k.to_f32() / 39.0;
            let plant = grow(&page.plant, Stage::Age(age), &stream(k));
            for organ in &plant.organs {
                assert_eq!(organ.mesh.fault(), None, "{} at {age} days", page.eppo);
            }
        }
    }
}

#[test]
fn a_species_names_all_its_materials() {
    for page in pages() {
        for key in page.plant.materials() {
            // A grass has no stem of its own; the key then names its stalk material.
            assert!(page.materials.get(&key).is_some_and(|s| s.roughness > 0.0), "{}: {key}", page.eppo);
        }
    }
}

#[test]
fn plants_stand_in_the_soil_and_never_deep() {
    everywhere(|page, stage, plant| {
        let low = plant.organs.iter().filter_map(|o| o.mesh.bounds()).map(|b| b.0.z).fold(0.0, f32::min);
        let deepest = match page.eppo.as_str() {
            // The stems beside the first continue deeper.
            _ if has_several_stems(page, stage) => -0.024,
            // Leaves of a whorl hang from stems that creep.
            "GALAP" => -0.014,
            _ => -0.012,
        };
        assert!((deepest..-0.004).contains(&low), "{} {}: {low}", page.eppo, stage.bbch);
        assert!(plant.height > 0.001 && plant.radius > 0.003, "{} {}", page.eppo, stage.bbch);
    });
}

/// Returns the distance from `p` to a triangle. Source: Ericson 2004, "Real-Time Collision Detection", §5.1.5.
fn distance_to_triangle(p: Vec3, [a, b, c]: [Vec3; 3]) -> f32 {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return ap.length();
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return bp.length();
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return (ap - ab * (d1 / (d1 - d3))).length();
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return cp.length();
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return (ap - ac * (d2 / (d2 - d6))).length();
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return (bp - (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)))).length();
    }
    let n = ab.cross(ac).normalize_or(Vec3::Z);
    ap.dot(n).abs()
}

/// Returns the least distance of the points from a mesh, or any distance below `enough` where the least one is below it.
fn distance(points: &[Vec3], mesh: &Mesh, enough: f32) -> f32 {
    // No point of a triangle is farther from its first vertex than the longer of the two sides that meet there.
    let sides = (0..mesh.triangles.len().to_u32()).map(|i| {
        let [a, b, c] = mesh.corners(i);
        a.distance_squared(b).max(a.distance_squared(c))
    });
    let side = sides.fold(0.0, f32::max).sqrt();
    let mut least = f32::MAX;
    for p in points {
        for (i, triangle) in (0..).zip(&mesh.triangles) {
            let far = p.distance_squared(mesh.positions[triangle[0].to_usize()]);
            if far < (least + side) * (least + side) {
                least = least.min(far.sqrt()).min(distance_to_triangle(*p, mesh.corners(i)));
                if least < enough {
                    return least;
                }
            }
        }
    }
    least
}

#[test]
fn nothing_floats() {
    everywhere(|page, stage, plant| {
        let mut axis = Mesh::default();
        for organ in plant.organs.iter().filter(|o| matches!(o.kind, OrganKind::Stem | OrganKind::Hypocotyl)) {
            axis.append(&organ.mesh);
        }
        for organ in plant.organs.iter().filter(|o| o.leaf != 0) {
            let at = format!("{} {} {:?} of leaf {}", page.eppo, stage.bbch, organ.kind, organ.leaf);
            let base = &organ.mesh.positions[..organ.mesh.positions.len().min(15)];
            // Rings are a tenth of a stalk apart, so the crown's surface may be half of that away from the nearest ring. The blade of
            // a large leaf is above a channel that is a few millimetres deep.
            let (low, high) = organ.mesh.bounds().unwrap();
            let share = if organ.kind == OrganKind::Petiole { 0.05 } else { 0.008 };
            let most = (share * low.distance(high)).max(1.2e-3);
            let gap = match organ.kind {
                OrganKind::Sheath => base.iter().map(|p| p.z.max(0.0)).fold(f32::MAX, f32::min),
                // A stalk may start inside the crown: it must pass through the crown's surface within its first rings.
                OrganKind::Petiole => {
                    distance(&organ.mesh.positions[..organ.mesh.positions.len().min(50)], &axis, most)
                }
                _ => plant
                    .organs
                    .iter()
                    .filter(|o| o.leaf == organ.leaf && matches!(o.kind, OrganKind::Petiole | OrganKind::Sheath))
                    .map(|o| distance(base, &o.mesh, most))
                    .fold(f32::MAX, f32::min),
            };
            assert!(gap < most, "{at}: {gap}");
        }
    });
}

/// Expected: the midrib of the mesh has the length given by the species file, because relief and joints bend but do not
/// stretch it.
#[test]
fn bent_blades_keep_their_length() {
    let beet = page("BEAVX");
    for seed in 0..20 {
        let stream = stream(seed);
        let plant = grow(&beet, Stage::Bbch(16), &stream);
        let grown = growth::growth(&beet, Stage::Bbch(16), &stream, 1.0).unwrap();
        for leaf in grown.leaves.iter().filter(|l| l.blade > 0.03) {
            let organ = plant.organs.iter().find(|o| o.leaf == leaf.number && o.kind == OrganKind::Blade).unwrap();
            let middle: Vec<Vec3> = (0..organ.mesh.positions.len())
                .filter(|i| (organ.mesh.uvs[*i].x - 0.5).abs() < 1e-5)
                .map(|i| organ.mesh.positions[i])
                .collect();
            let length: f32 = middle.windows(2).map(|w| w[0].distance(w[1])).sum();
            let share = length / (leaf.blade * (1.0 + 2.0 * blade::PAD));
            assert!((0.97..1.03).contains(&share), "leaf {}: {share}", leaf.number);
        }
    }
}

/// Returns the angle from a to b in 0..2π.
fn turn(a: f32, b: f32) -> f32 {
    (b - a).rem_euclid(TAU)
}

/// Rationale: phyllotaxis distinguishes a goosefoot from a chickweed. Expected: cotyledons are opposite, pairs are
/// perpendicular to those below, and single leaves follow at the species' angle. Source: the sources of
/// `tests/ref/species_plans.csv`.
#[test]
fn leaves_follow_each_other_at_the_species_angle() {
    let pages = pages();
    for row in table("species_plans.csv") {
        let page = pages.iter().find(|p| p.eppo == row["eppo"]).unwrap();
        if page.plant.form == Form::Whorl {
            continue;
        }
        for (seed, stage) in (0..20).flat_map(|s| page.plant.stages.iter().map(move |t| (s, t))) {
            let at = format!("{} {} seed {seed}", page.eppo, stage.bbch);
            let stream = stream(seed);
            let leaves = growth::growth(&page.plant, Stage::Bbch(stage.bbch), &stream, 1.0).unwrap().leaves;
            let mut layers: BTreeMap<usize, Vec<f32>> = BTreeMap::new();
            for leaf in &leaves {
                layers.entry(leaf.layer).or_default().push(leaf.azimuth);
            }
            let seeds = page.plant.kinds.values().filter(|k| k.organ == OrganKind::Cotyledon).count();
            let pairs: Vec<(usize, &Vec<f32>)> =
                layers.iter().filter(|(_, l)| l.len() == 2).map(|(k, l)| (*k, l)).collect();
            let expected = row["pairs"].parse::<usize>().map_or(usize::MAX, |n| n + seeds);
            assert!(pairs.len() <= expected, "{at}: {} pairs", pairs.len());
            for (_, pair) in &pairs {
                assert!((turn(pair[0], pair[1]) - PI).abs() < 0.4, "{at}: a pair is not opposite");
            }
            for two in pairs.windows(2).filter(|two| two[0].0 + 1 == two[1].0) {
                let crossed = turn(two[0].1[0], two[1].1[0]).rem_euclid(PI);
                assert!((crossed - 0.5 * PI).abs() < 0.4, "{at}: pairs do not cross: {crossed}");
            }
            let Some(angle) = number(&row, "turn") else { continue };
            let stray = number(&row, "stray").unwrap();
            let single: Vec<(usize, f32)> =
                layers.iter().filter(|(_, l)| l.len() == 1).map(|(k, l)| (*k, l[0])).collect();
            for two in single.windows(2).filter(|two| two[0].0 + 1 == two[1].0) {
                let turned = turn(two[0].1, two[1].1).to_degrees();
                assert!((turned - angle).abs() < stray, "{at}: {turned}");
            }
        }
    }
}

#[test]
fn the_same_stream_gives_the_same_bits_and_another_gives_another_plant() {
    for page in pages() {
        let stage = Stage::Bbch(page.plant.stages.last().unwrap().bbch);
        let plant = grow(&page.plant, stage, &stream(1));
        assert_eq!(plant, grow(&page.plant, stage, &stream(1)));
        assert_ne!(plant, grow(&page.plant, stage, &stream(2)));
    }
}

#[test]
fn what_happens_to_one_leaf_moves_no_other() {
    let page = page("BEAVX");
    let mut changed = page.clone();
    // Layer 3 is leaf 6: two cotyledons, the first pair, leaf 5, leaf 6.
    let stage = changed.stages.iter_mut().find(|s| s.bbch == 16).unwrap();
    stage.layers[3].blade_mm = Vary::fixed(40.0);
    stage.layers[3].fold_deg = Vary::fixed(60.0);
    let [before, after] = [&page, &changed].map(|p| grow(p, Stage::Bbch(16), &stream(4)));
    for (a, b) in before.organs.iter().zip(&after.organs) {
        assert_eq!(a.mesh == b.mesh, a.leaf != 6, "leaf {}", a.leaf);
    }
}

#[test]
fn a_plant_only_grows_with_its_days() {
    for eppo in ["BEAVX", "CHEAL"] {
        let desc = page(eppo);
        for seed in 0..5 {
            let stream = stream(seed);
            let mut before: BTreeMap<u16, f32> = BTreeMap::new();
            for day in 4..=43 {
                for leaf in growth::growth(&desc, Stage::Age(day.to_f32()), &stream, 1.0).unwrap().leaves {
                    if leaf.kind.organ == OrganKind::Blade {
                        let last = before.insert(leaf.number, leaf.blade).unwrap_or(0.0);
                        assert!(leaf.blade > last * 0.999, "{eppo} leaf {} on day {day}", leaf.number);
                    }
                }
            }
        }
    }
}

#[test]
fn triangles_stay_within_budget() {
    let mut wrong = Vec::new();
    everywhere(|page, stage, plant| {
        let count: usize = plant.organs.iter().map(|o| o.mesh.triangles.len()).sum();
        if !stage.inflorescences.is_empty() {
            assert!(count <= 300_000, "{} {}: {count}", page.eppo, stage.bbch);
            return;
        }
        let most = match (page.eppo.as_str(), stage.bbch) {
            ("BEAVX", ..=16) => 12_000,
            ("BEAVX", ..=19) => 17_000,
            // Twenty leaves or more, and leaves on every side shoot.
            ("BEAVX", _) | ("ARHHY", 20..) | ("GALAP", 12..) => 40_000,
            // A mat: every side shoot has side shoots.
            ("STEME", 20..) | ("POROL", 19..) => 60_000,
            // Broad lobes have twice the triangles of fine ones.
            ("DAUCA", _) => 32_000,
            ("TRZAX" | "HORVX" | "ORYSA" | "SETVI" | "DIGSA", 22..)
            | ("ARHHY", 14..)
            | ("CONAR", 16..)
            | ("CIRAR" | "MATIN", _) => 24_000,
            ("BRSOB" | "BRSOL" | "CAPBP" | "ARHHY" | "GLXMA" | "PHSVX" | "PIBSX" | "LYPES", _) => 14_000,
            // Up to six stems.
            ("SOLTU", _) => 70_000,
            _ => 9_000,
        };
        if count > most {
            wrong.push(format!("{} {}: {count}", page.eppo, stage.bbch));
        }
    });
    assert!(wrong.is_empty(), "{wrong:?}");
}

/// Rationale: a perfectly flat leaf looks artificial in images of a robot's camera. Expected: the vertices of grown
/// beet blades span at least a twentieth of the blade's bounding diagonal perpendicular to its mean plane.
#[test]
fn no_beet_leaf_is_a_card() {
    let beet = page("BEAVX");
    for seed in 0..20 {
        let plant = grow(&beet, Stage::Bbch(16), &stream(seed));
        for organ in plant.organs.iter().filter(|o| o.kind == OrganKind::Blade && o.mesh.area() > 3e-4) {
            let mean = organ.mesh.normals.iter().sum::<Vec3>().normalize();
            let heights = || organ.mesh.positions.iter().map(|p| p.dot(mean));
            let depth = heights().fold(f32::MIN, f32::max) - heights().fold(f32::MAX, f32::min);
            let (lo, hi) = organ.mesh.bounds().unwrap();
            assert!(depth > 0.05 * lo.distance(hi), "seed {seed} leaf {}: {depth}", organ.leaf);
        }
    }
}

#[test]
fn pages_that_do_not_fit_together_are_refused() {
    let ok = r#"(form: Rosette, kinds: {"leaf": (shape: Sheet(outline: Full))}, stages: [
        (bbch: 12, days: 3, hypocotyl_mm: 5, stem_mm: 1, layers: [
            (kind: "leaf", blade_mm: 5, width_mm: 3, angle_deg: 50)])])"#;
    assert!(ron::from_str::<PlantDesc>(ok).is_ok());
    for (from, to, says) in [
        ("kind: \"leaf\"", "kind: \"laef\"", "no kind of leaf is called \"laef\""),
        (
            "angle_deg: 50)])]",
            "angle_deg: 50)]), (bbch: 11, days: 9, hypocotyl_mm: 5, stem_mm: 1, layers: [])]",
            "rise",
        ),
        (
            "angle_deg: 50)])]",
            "angle_deg: 50)]), (bbch: 13, days: 9, hypocotyl_mm: 5, stem_mm: 1, layers: [(kind: \"leaf\", leaves: 2, blade_mm: 5, width_mm: 3, angle_deg: 50)])]",
            "changes its kind",
        ),
        (
            "angle_deg: 50)])]",
            "angle_deg: 50), (kind: \"leaf\", blade_mm: 5, width_mm: 3, angle_deg: 50)]), (bbch: 13, days: 9, hypocotyl_mm: 5, stem_mm: 1, layers: [(kind: \"leaf\", blade_mm: 5, width_mm: 3, angle_deg: 50)])]",
            "lost",
        ),
        ("blade_mm: 5", "blade_mm: -5", "between 0 and 10000"),
        ("stem_mm: 1,", "stem_mm: 1, tillers: 30,", "up to 30 side shoots"),
        ("stem_mm: 1,", "stem_mm: 1, lean_deg: 91,", "between -90 and 90"),
        ("form: Rosette", "form: Rosete", "Rosete"),
        ("days: 3", "day: 3", "day"),
    ] {
        let page = ok.replace(from, to);
        assert_ne!(page, ok);
        let message = ron::from_str::<PlantDesc>(&page).unwrap_err().to_string();
        assert!(message.contains(says), "{message}");
    }
}

#[test]
fn a_written_page_reads_back_the_same() {
    for page in pages() {
        let text = ron::to_string(&page.plant).unwrap();
        assert_eq!(ron::from_str::<PlantDesc>(&text).unwrap(), page.plant);
    }
}

/// Returns the point of a mesh at these texture coordinates.
fn point_at(mesh: &Mesh, uv: Vec2) -> Option<Vec3> {
    mesh.triangles.iter().find_map(|t| {
        let [a, b, c] = t.map(|i| mesh.uvs[i.to_usize()]);
        let whole = (b - a).perp_dot(c - a);
        let weights = [(c - b).perp_dot(uv - b), (a - c).perp_dot(uv - c), (b - a).perp_dot(uv - a)].map(|w| w / whole);
        let inside = weights.iter().all(|w| *w >= -1e-5);
        inside.then(|| t.iter().zip(weights).map(|(i, w)| mesh.positions[i.to_usize()] * w).sum())
    })
}

/// Rationale: keypoints come from the skeleton, images from the mesh that it deforms. Expected: every leaf has one
/// axis; both of its ends are on the leaf's mesh, for a sheet at the ends of the texture's midrib; the tip is farther
/// from the stem than the base, where the stalk ends, unless the leaf withers.
#[test]
fn the_keypoints_of_a_leaf_lie_on_its_blade_and_point_outward() {
    everywhere(|page, stage, plant| {
        let mut stem = Mesh::default();
        for organ in plant.organs.iter().filter(|o| matches!(o.kind, OrganKind::Stem | OrganKind::Hypocotyl)) {
            stem.append(&organ.mesh);
        }
        let leaves: std::collections::BTreeSet<u16> = plant.organs.iter().map(|o| o.leaf).filter(|l| *l > 0).collect();
        let axes: Vec<LeafAxis> = plant.leaf_axes().collect();
        assert_eq!(axes.iter().map(|a| a.leaf).collect::<std::collections::BTreeSet<_>>(), leaves);
        assert_eq!(axes.len(), leaves.len(), "one axis a leaf");
        for LeafAxis { leaf, base, tip, .. } in axes {
            let at = format!("{} {} leaf {leaf}", page.eppo, stage.bbch);
            let of = |flat: bool| {
                let is =
                    |o: &&Organ| o.leaf == leaf && matches!(o.kind, OrganKind::Blade | OrganKind::Cotyledon) == flat;
                plant.organs.iter().find(is)
            };
            let blade = &of(true).expect("a blade").mesh;
            let gap = [base, tip].map(|p| distance(&[p], blade, 2e-3));
            assert!(gap[0] < 2e-3 && gap[1] < 2e-3, "{at}: {gap:?}");
            // A grass has sheaths instead of a stem.
            let stem = if stem.triangles.is_empty() { &of(false).expect("a sheath").mesh } else { &stem };
            // With several shoots a leaf may point towards another shoot.
            let shoots = matches!(page.plant.form, Form::Runner | Form::Whorl) || has_several_stems(page, stage);
            // A withering leaf hangs, also along the stem.
            let hangs = plant.organs.iter().any(|o| o.leaf == leaf && o.senescence > 0.0);
            let any = shoots || hangs || !stage.inflorescences.is_empty();
            if !any {
                let away = [base, tip].map(|p| distance(&[p], stem, 0.0));
                assert!(away[1] > away[0], "{at}: {away:?}");
            }
            if let Some(stalk) = of(false) {
                assert!(distance(&[base], &stalk.mesh, 2e-3) < 2e-3, "{at}: the stalk ends elsewhere");
            }
            // Divided leaves use other texture coordinates.
            let whole = |k: &LeafKind| matches!(k.shape, Shape::Sheet { .. });
            if page.plant.kinds.values().all(whole) {
                for (p, t) in [(base, 0.0), (tip, 1.0)] {
                    let there = point_at(blade, outline::uv(0.0, t)).expect("a point of the midrib");
                    assert!(p.distance(there) < 5e-4, "{at}: the midrib's {t} is {} m away", p.distance(there));
                }
            }
        }
    });
}

/// Rationale: pansies are identified by their stipules. Expected: with stipules the stalk's organ has more surface,
/// most of it in its lower half; blades do not move.
#[test]
fn pansies_have_stipules_at_the_foot_of_their_stalks() {
    let viola = page("VIOAR");
    let mut without = viola.clone();
    without.kinds.values_mut().for_each(|kind| kind.stipules = Stipules::default());
    for seed in 0..10 {
        let [with, bare] = [&viola, &without].map(|desc| grow(desc, Stage::Bbch(16), &stream(seed)));
        assert_eq!(with.organs.len(), bare.organs.len());
        let mut stalks = 0;
        for (a, b) in with.organs.iter().zip(&bare.organs) {
            if a.kind != OrganKind::Petiole {
                assert_eq!(a, b);
            } else if a.mesh.triangles.len() > b.mesh.triangles.len() {
                stalks += 1;
                assert!(a.mesh.area() > b.mesh.area());
                let base = b.mesh.positions[0];
                let reach = b.mesh.positions.iter().map(|p| p.distance(base)).fold(0.0, f32::max);
                let added = &a.mesh.positions[b.mesh.positions.len()..];
                let near = added.iter().filter(|p| p.distance(base) < 0.75 * reach).count();
                assert!(near > added.len() / 2, "seed {seed} leaf {}", a.leaf);
            }
        }
        assert!(stalks >= 6, "{stalks}");
    }
}
