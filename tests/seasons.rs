//! Days: a field over a growing season.
//!
//! Rationale: a time series of several weeks needs the same plants at the same positions, each a little larger, with
//! its earlier damage and more. Expected: identities and positions stay, leaves appear and grow, holes keep their
//! positions on the leaf, weeds are absent before they emerge, and no byte depends on the other days that are rendered.
//! Equality is exact.

use crate::common::dataset::{fail, made, path, same, succeed, tree, verb};
use crate::common::program::{SMALL, scratch, small_text, trace};
use crate::common::python::{ask, python};
use furrow_base::geometry::AlphaMask;
use furrow_base::math::vec2;
use furrow_base::sampling::{Purpose, Stream};
use furrow_dataset::read::native;
use furrow_dataset::{Record, Set, format};
use furrow_field::assemble::{Options, field_of};
use furrow_field::days::DaysDesc;
use furrow_field::traits::Traits;
use furrow_field::{Field, PartKind};
use furrow_grow::plant::condition::Bearer;
use furrow_grow::plant::{Condition, ConditionDesc};
use furrow_optics::light::LightRecord;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

const CAMERA: &str = "Pinhole(size: (24, 18), intrinsics: FieldOfView(horizontal_deg: 40), pose: Nadir(height_m: 0.6))";

/// A row of beets and two flushes of fat hen without soil, in the given condition.
fn bare(condition: &str) -> String {
    let root = env!("CARGO_MANIFEST_DIR");
    let weed = |day: u32| {
        format!(
            "(species: \"{root}/scenes/species/chenopodium.ron\", growth: EmergesOn(Uniform({day}, {})), spread: (per_m2: 20), condition: {condition})",
            day + 4
        )
    };
    format!(
        "Field(seed: 4, camera: {CAMERA}, days: (from: 4, to: 36, every: 4), lights: [Overcast()], crops: [(species: \"{root}/scenes/species/sugar_beet.ron\", \
         growth: EmergesOn(Normal(mean: 0, sd: 1)), rows: (spacing_m: 0.45, in_row_m: 0.15), condition: {condition})], weeds: [{}, {}])",
        weed(0),
        weed(18)
    )
}

fn on(text: &str, day: u32) -> Field {
    field_of(text, &Options { day: Some(day), ..Options::default() }).unwrap()
}

const FLAWLESS: &str = "(holes: 0, shot_holes: 0, bites: 0, tears: 0, spots: 0, blotches: 0, scorched: 0, wilt: 0)";

/// Expected: all plants are still present and older, no leaf is smaller, and no plant has less leaf area.
#[test]
fn one_field_grows() {
    let text = bare(FLAWLESS);
    let days = [4, 12, 24, 36];
    let fields: Vec<Field> = days.iter().map(|day| on(&text, *day)).collect();
    let (mut rates, mut leaves) = (Vec::new(), 0);
    for pair in fields.windows(2) {
        let (before, now) = (&pair[0], &pair[1]);
        let (had, have) = (Traits::of(before), Traits::of(now));
        for plant in &before.plants {
            let grown = now.plants.iter().find(|other| other.id == plant.id).expect("no plant may disappear");
            assert_eq!((grown.number, grown.position, &grown.species), (plant.number, plant.position, &plant.species));
            assert!(grown.leaf_ids.starts_with(&plant.leaf_ids), "leaves must keep their identities");
            assert!(grown.age_days > plant.age_days && grown.bbch >= plant.bbch && grown.leaves >= plant.leaves);
            rates.push(
                (grown.age_days - plant.age_days) / f32::from(now.day.unwrap() as u16 - before.day.unwrap() as u16),
            );
            // Cotyledons narrow and fall as the species file states.
            for leaf in plant.leaf_axes.iter().filter(|leaf| leaf.leaf > 2) {
                let later =
                    grown.leaf_axes.iter().find(|other| other.leaf == leaf.leaf).expect("no leaf may disappear");
                let area = |of: furrow_grow::plant::LeafSize| of.length * of.width;
                assert!(area(later.size) >= (1.0 - 1e-5) * area(leaf.size), "{} leaf {}", plant.species, leaf.leaf);
                leaves += 1;
            }
            let (a, b) = (had.plants[&plant.number].leaf_area_m2, have.plants[&plant.number].leaf_area_m2);
            assert!(b >= a * (1.0 - 1e-4), "{} {}: {a} {b}", plant.species, plant.number);
        }
        assert!(have.canopy.unwrap().lai > had.canopy.unwrap().lai);
    }
    assert!(leaves > 50, "{leaves}");
    // Every plant has its own constant growth rate.
    let (lo, hi) = rates.iter().fold((f32::MAX, 0.0_f32), |(lo, hi), r| (lo.min(*r), hi.max(*r)));
    assert!(lo > 0.7 && hi < 1.31 && hi - lo > 0.05, "{lo} {hi}");
}

/// Expected: on day 17 only the first flush of days 0 to 4 is present; on day 30 the second flush of days 18 to 22 as
/// well, with new plants. No plant ages by more than 1.3 or less than 0.7 days per day.
#[test]
fn weeds_emerge_in_flushes() {
    let text = bare(FLAWLESS);
    let weeds = |day| -> BTreeMap<u32, f32> {
        let hens = on(&text, day).plants.into_iter().filter(|p| p.species.contains("hen"));
        hens.map(|p| (p.id, p.age_days)).collect()
    };
    let [before, early, late] = [2, 17, 30].map(weeds);
    assert!(before.values().all(|age| *age <= 2.0 * 1.3) && before.len() < early.len());
    assert!(early.values().all(|age| *age >= 13.0 * 0.7) && !early.is_empty());
    let (young, old): (Vec<_>, Vec<_>) = late.iter().partition(|(_, age)| **age <= 12.0 * 1.3);
    assert!(young.len() > 2 && young.iter().all(|(id, _)| !early.contains_key(id)));
    assert!(old.iter().all(|(_, age)| **age >= 26.0 * 0.7) && old.len() >= early.len());
}

/// Cut areas of all leaves, sampled on a grid in each leaf's texture coordinates.
fn cut(field: &Field) -> BTreeMap<(u32, u16), Vec<bool>> {
    let ids: BTreeMap<u32, u32> = field.plants.iter().map(|p| (p.number, p.id)).collect();
    let at = |i: usize| vec2(((i % 64) as f32 + 0.5) / 64.0, ((i / 64) as f32 + 0.5) / 64.0);
    let parts = field.scene.parts.iter().filter(|part| part.mask.is_some());
    let of = |part: &furrow_render::scene::Part| {
        let mask = part.mask.as_ref().unwrap();
        ((ids[&part.tag.plant], part.tag.leaf), (0..64 * 64).map(|i| !mask.opaque_at(at(i))).collect())
    };
    parts.map(of).collect()
}

/// Expected: areas missing from a leaf on one day are missing at the same positions on all later days, and more are
/// added.
#[test]
fn damage_never_heals_and_stays_where_it_was() {
    let text = bare("(holes: 4, shot_holes: 6, bites: 1, tears: 0.5)");
    let days = [6, 20, 36].map(|day| cut(&on(&text, day)));
    let mut gained = 0;
    for pair in days.windows(2) {
        for (leaf, gone) in &pair[0] {
            // Cotyledons fall.
            let Some(later) = pair[1].get(leaf) else {
                assert!(leaf.1 <= 2, "leaf {leaf:?} is gone");
                continue;
            };
            assert!(gone.iter().zip(later).all(|(before, now)| !before || *now), "leaf {leaf:?} has healed");
            gained += usize::from(gone != later);
        }
    }
    assert!(gained > 20, "{gained}");
}

/// A patch of soil with a crust and stones, under clouds.
fn soil() -> String {
    let root = env!("CARGO_MANIFEST_DIR");
    let layer = |name: &str, more: &str| {
        format!("(albedo: \"{root}/textures/soil/{name}.png\", size_m: 0.5, height_mm: (-3, 5){more})")
    };
    format!(
        "Field(seed: 4, camera: {CAMERA}, lights: [Daylight(sun: Angles(elevation_deg: 40, azimuth_deg: 90), cloud: Uniform(0, 1))], \
         soil: (layers: [{}, {}], stones: [(cover: 0.02)], clods: (over_5mm_per_m2: 2000)))",
        layer("dirt", ""),
        layer("crust", ", clods: 0")
    )
}

/// Expected: stones stay in place except for millimetres of height; moisture and clouds change by day; the sun is at
/// the position in the scene file; crusts cover more ground every day. A day gives the same bits whatever the list of
/// days.
#[test]
fn weather_is_the_days_and_soil_the_fields() {
    let text = soil();
    let days = [3, 9, 30].map(|day| on(&text, day));
    let known = days.each_ref().map(|field| field.conditions.soil.clone().unwrap());
    let share = known.each_ref().map(|soil| soil.layers[1].share);
    assert!(share[0] < share[1] && share[1] < share[2], "{share:?}");
    assert!(known[0].moisture.mean != known[1].moisture.mean && known[1].moisture.mean != known[2].moisture.mean);
    assert_eq!((known[0].relief.clone(), known[0].clods.clone()), (known[2].relief.clone(), known[2].clods.clone()));
    let sky = days.each_ref().map(|field| match &field.conditions.lights[0] {
        LightRecord::Daylight(day) => (day.sun_elevation_deg, day.cloud),
        other => panic!("{other:?}"),
    });
    assert!(sky.iter().all(|(sun, _)| *sun == sky[0].0) && sky[0].1 != sky[1].1 && sky[1].1 != sky[2].1, "{sky:?}");
    let stones = days.each_ref().map(|field| {
        let debris = field.scene.parts.iter().zip(&field.kinds).filter(|(_, kind)| matches!(kind, PartKind::Debris(_)));
        debris
            .map(|(part, _)| {
                part.mesh.positions.iter().map(|p| p.truncate()).sum::<furrow_base::math::Vec2>()
                    / part.mesh.positions.len() as f32
            })
            .collect::<Vec<_>>()
    });
    assert!(stones[0].len() > 3 && stones[0].len() == stones[2].len());
    for (a, b) in stones[0].iter().zip(&stones[2]).take(3) {
        assert!(a.distance(*b) < 0.002, "{a} {b}");
    }
    let listed = text.replacen("lights:", "days: (on: [9, 30]), lights:", 1);
    let (first, again) = (field_of(&listed, &Options::default()).unwrap(), &days[1]);
    assert_eq!((first.day, again.day), (Some(9), Some(9)));
    assert!(first.conditions == again.conditions && first.sample_seed() == again.sample_seed());
    let undated = field_of(&text, &Options::default()).unwrap();
    assert_eq!((undated.day, undated.conditions.soil.unwrap().layers[1].share), (None, 0.5));
}

/// Expected: a scene file whose crop has a mean age of 20 days shows it at that age on day 20, and correspondingly
/// younger on earlier days; the same for growth given as BBCH stage.
#[test]
fn a_scene_file_without_days_is_of_the_day_that_its_crop_says() {
    let root = env!("CARGO_MANIFEST_DIR");
    let text = |growth: &str| {
        format!(
            "Field(seed: 4, camera: {CAMERA}, days: (to: 1, pace: 1), crops: [(species: \"{root}/scenes/species/sugar_beet.ron\", growth: {growth}, \
             rows: (spacing_m: 0.45, in_row_m: 0.15))])"
        )
    };
    let ages = |text: &str, day| on(text, day).plants.iter().map(|p| (p.id, p.age_days)).collect::<BTreeMap<_, _>>();
    let (written, other) = (text("AgeDays(Uniform(15, 25))"), text("Bbch(14)"));
    let undated = field_of(&written.replace("days: (to: 1, pace: 1),", ""), &Options::default()).unwrap();
    let (now, week) = (ages(&written, 20), ages(&written, 13));
    assert!(undated.plants.len() > 1 && now.len() == undated.plants.len() && !week.is_empty());
    for plant in &undated.plants {
        assert!((now[&plant.id] - plant.age_days).abs() < 1e-4);
        // A smaller plant may not reach into the view.
        assert!(week.get(&plant.id).is_none_or(|age| (age - plant.age_days + 7.0).abs() < 1e-4));
    }
    // By the species file, the fourth leaf unfolds on day 23; the sampled plants all have that age.
    assert!(ages(&other, 23).values().all(|age| (age - 23.0).abs() < 1e-4));
    assert!(on(&other, 0).plants.iter().all(|p| p.age_days < 1e-3));
}

/// Writes the small scene file, whose images render in a fraction of a second, with a second camera and two frames on
/// each day.
fn page(folder: &Path) -> PathBuf {
    let more = "cameras: [(name: \"right\", camera: Pinhole(size: (96, 72), intrinsics: FieldOfView(horizontal_deg: 40), pose: Nadir(height_m: 0.45, \
                at_m: (0.04, 0))))], drive: (frames: 2, path: Straight(speed_m_s: 0.2)), days: (on: [9, 21]), lights:";
    let text = small_text().replacen("lights:", more, 1);
    let text = text.replace("growth:", "condition: (holes: 2, dust: 0.2, wilt: 0.3), growth:");
    let path = folder.join("page.ron");
    std::fs::write(&path, text).unwrap();
    path
}

/// Expected: days form a dataset like any other. Images have the same bytes alone, after any others and among other
/// days; shards divide the days among them; a plant keeps its number and identity over the days; flow ends with the
/// day.
#[test]
fn images_of_days_do_not_depend_on_the_others() {
    let (_keep, folder) = scratch();
    std::fs::create_dir_all(&folder).unwrap();
    let page = page(&folder);
    let (whole, parts, one) = (folder.join("whole"), folder.join("parts"), folder.join("one"));
    let size = ["--width", "32", "--spp", "1", "--quiet"];
    let make = |out: &Path, more: &[&str]| {
        let mut command = trace(&["sequence", "--scene", path(&page), "--out", path(out)]);
        command.args(size).args(more);
        command
    };
    succeed(make(&whole, &[]));
    let before = tree(&whole);
    let records: Vec<Record> = (0..8).map(|k| native::read_record(&whole, &Set::name(k)).unwrap()).collect();
    for (record, k) in records.iter().zip(0_u32..) {
        let capture = record.capture.as_ref().expect("a sequence");
        assert_eq!((capture.field, capture.day, capture.frame), (0, Some([9, 21][k as usize / 4]), k / 2));
        let time = f64::from(k / 4) * 12.0 * 86_400.0 + f64::from(k / 2 % 2) * 0.1;
        assert!((capture.time_s - time).abs() < 1e-6, "{}", capture.time_s);
    }
    let recorded = |record: &Record| -> BTreeMap<u32, (u32, f32)> {
        record.plants.iter().map(|p| (p.id.unwrap(), (p.number, p.grown.as_ref().unwrap().age_days))).collect()
    };
    let (early, late) = (recorded(&records[0]), recorded(&records[4]));
    let both: Vec<_> = early.iter().filter_map(|(id, then)| Some((then, late.get(id)?))).collect();
    assert!(both.len() > 1 && both.iter().all(|(then, now)| then.0 == now.0 && then.1 < now.1));
    for name in
        ["colmap/000000-day009/images.txt", "colmap/000000-day021/images.txt", "nerf/000000-day021/transforms.json"]
    {
        assert!(before.contains_key(name), "{name}");
    }
    let lines = |name: &str| String::from_utf8(before[name].clone()).unwrap().lines().count();
    assert_eq!((lines("tum/000000-right.txt"), lines("colmap/000000-day009/images.txt")), (5, 10));
    let flows = |k: u32| {
        // Channel names are stored uncompressed in the file header.
        before[&format!("flow/{k:06}.exr")].windows(6).any(|name| name == b"next.x")
    };
    assert_eq!([0, 2, 4, 6].map(flows), [true, false, true, false]);
    // A lost image, shards in the other order, and another list of days.
    std::fs::remove_dir_all(whole.join("images/000005")).unwrap();
    succeed(make(&whole, &[]));
    same(&tree(&whole), &before);
    let formats = "colmap,flow,mots,nerf,tum";
    let mut plan = trace(&["dataset", "plan", "--scene", path(&page), "--out", path(&parts), "--count", "8"]);
    plan.args(&size[..4]).args(["--format", formats]);
    succeed(plan);
    succeed(verb("render", &parts, &["--shard", "1/2", "--quiet"]));
    assert!(parts.join("images/000004").exists() && !parts.join("images/000003").exists());
    succeed(verb("render", &parts, &["--shard", "0/2", "--quiet"]));
    succeed(verb("finish", &parts, &[]));
    same(&tree(&parts), &before);
    succeed(verb("verify", &parts, &["--rerender", "2"]));
    succeed(make(&one, &["--days", "21"]));
    for (k, name) in [(0, "rgb.png"), (3, "rgb.png"), (2, "plants.png"), (1, "leaves.png")] {
        let (theirs, ours) = (format!("images/{:06}/{name}", k + 4), format!("images/{k:06}/{name}"));
        let pixels = |bytes: &[u8]| image::load_from_memory(bytes).unwrap().into_rgb16().into_raw();
        assert_eq!(pixels(&before[&theirs]), pixels(&std::fs::read(one.join(&ours)).unwrap()), "{ours}");
    }
    // Another list of days is another dataset.
    assert!(fail(make(&one, &["--days", "9,21"]), 2).contains("days [21] there, [9,21] here"));
    // Tables contain the field, camera and day of their entries.
    succeed(verb("finish", &whole, &["--format", "coco,traits"]));
    let recorded = std::fs::read(whole.join("coco/annotations/instances_train.json")).unwrap();
    let recorded: serde_json::Value = serde_json::from_slice(&recorded).unwrap();
    // A video contains the images of one camera over all days.
    for (video, name) in [(1, "000000-camera"), (2, "000000-right")] {
        assert_eq!(recorded["videos"][video - 1]["name"], name);
        let of = recorded["images"].as_array().unwrap().iter().filter(|image| image["video_id"] == video);
        assert!(of.map(|image| image["frame_id"].as_u64().unwrap()).eq(0..4), "{name}");
    }
    if let Some(python) = python("import pandas, pyarrow") {
        ask(&python, "formats/check_index.py", &[path(&whole)]);
    }
}

/// Rationale: warnings about formats that the user did not request are noise. Expected: if no format is named, formats
/// without content for these images are omitted silently; named ones cause a warning. Optical flow, which has no target
/// with one image per day, then has no files, and the dataset is complete.
#[test]
fn formats_without_content_are_left_out() {
    let (_keep, folder) = scratch();
    std::fs::create_dir_all(&folder).unwrap();
    let run = |out: &Path, scene: &str, more: &[&str]| {
        let size = ["--scene", scene, "--width", "64", "--quiet", "--out", path(out)];
        let printed = succeed(trace(&[&["sequence"][..], &size[..], more].concat())).stderr;
        let folders = tree(out).into_keys().filter_map(|name| Some(name.split_once('/')?.0.to_owned()));
        let formats: BTreeSet<String> = folders.filter(|name| format::named(name).is_some()).collect();
        (String::from_utf8(printed).unwrap(), formats.into_iter().collect::<Vec<_>>())
    };
    let days = ["--days", "9,21", "--spp", "1"];
    let (printed, formats) = run(&folder.join("usual"), SMALL, &days);
    assert!(!printed.contains("one image a day"), "{printed}");
    assert_eq!(formats, ["mots", "tum"]);
    let named = folder.join("named");
    let (printed, formats) = run(&named, SMALL, &[&days[..], &["--format", "colmap,flow,tum"]].concat());
    for name in ["colmap", "flow"] {
        assert!(printed.contains(&format!("warning: {name}: each field has one image a day")), "{printed}");
    }
    assert_eq!(formats, ["colmap", "tum"]);
    succeed(verb("render", &named, &["--quiet"]));
    assert_eq!(made(&named).len(), 2, "no image may be rendered again");
    succeed(verb("verify", &named, &["--rerender", "1"]));
    let page = page(&folder);
    let (_, formats) = run(&folder.join("labels"), path(&page), &["--days", "21", "--labels-only"]);
    assert_eq!(formats, ["flow", "mots", "tum"]);
}

#[test]
fn invalid_days_are_reported() {
    let refused = |change: &dyn Fn(String) -> String| {
        let error = field_of(&change(bare("()")), &Options::default()).err().expect("refused").to_string();
        assert!(error.contains("help: "), "{error}");
        error
    };
    let days = "days: (from: 4, to: 36, every: 4),";
    let none = refused(&|text| text.replace(days, ""));
    assert!(none.contains("a plant emerges on a day, but there are no days") && none.contains("--day"), "{none}");
    for (wrong, words) in [
        ("(from: 9, to: 4)", "there are no days between 9 and 4"),
        ("(to: 9, every: 0)", "in steps of 0"),
        ("(on: [9, 4])", "in order"),
        ("(to: 40, on: [9])", "given twice"),
        ("(from: 4.5)", "a whole number"),
    ] {
        let recorded = refused(&|text| text.replace(days, &format!("days: {wrong},")));
        assert!(recorded.contains(words) && recorded.contains("page.ron:1:"), "{recorded}");
    }
}

/// Expected: areas that a leaf has lost at some time stay missing, point by point of its texture; more are missing at
/// every later time, and none at the start.
#[test]
fn marks_stay_where_they_were_and_more_come() {
    let mask = AlphaMask::new(120, 200, |x, y| ((x as f32 - 59.5) / 56.0).hypot((y as f32 - 99.5) / 95.0) < 1.0);
    let condition =
        Condition { holes: 5.0, shot_holes: 6.0, bites: 2.0, tears: 0.5, spots: 5.0, ..Condition::default() };
    let mut cut = [0; 5];
    for k in 0..30 {
        let mut before: Option<AlphaMask> = None;
        for (moment, all) in cut.iter_mut().enumerate() {
            let bearer = Bearer {
                age: 0.2 * moment as f32,
                cotyledon: false,
                share: 1.0,
                height: 0.02 * moment as f32,
                met: Some(0.25 * moment as f32),
                image_mm: vec2(60.0, 100.0),
                mask: Some(&mask),
                margin: None,
            };
            let stream = Stream::of(1, 0, Purpose::Test, k);
            let left = bearer.draw_marks(&ConditionDesc::flawless(), &condition, &stream).cut(Some(&mask));
            *all += mask.count() - left.count();
            if let Some(had) = before {
                for i in 0..120 * 200 {
                    let uv = vec2(((i % 120) as f32 + 0.5) / 120.0, ((i / 120) as f32 + 0.5) / 200.0);
                    assert!(had.opaque_at(uv) || !left.opaque_at(uv), "{k} {moment} {uv}");
                }
            }
            before = Some(left);
        }
    }
    assert!(cut[0] == 0 && cut.windows(2).all(|moments| moments[0] < moments[1]), "{cut:?}");
}

#[test]
fn days_are_read_as_a_command_line_says_them() {
    assert_eq!(DaysDesc::read("8..16/4").unwrap(), [8, 12, 16]);
    assert_eq!(DaysDesc::read("3..5").unwrap(), [3, 4, 5]);
    assert_eq!(DaysDesc::read("8, 12,40").unwrap(), [8, 12, 40]);
    for wrong in ["", "8..", "12..8", "8..40/0", "8,8", "12,8", "-3", "8..4000", "2000", "8..40/4/2"] {
        let message = DaysDesc::read(wrong).unwrap_err().to_string();
        assert!(message.contains("help: "), "{wrong}: {message}");
    }
}
