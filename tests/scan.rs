//! LiDAR scans of a field: ranges, intensities, echoes and labels.
//!
//! Rationale: users who simulate a robot's LiDAR rely on its ranges, intensities and labels; they are known in closed
//! form on planes, and by independent rays in a field.
//!
//! Expected: the LiDAR equation for targets larger than the beam, a cos θ / r² (Wagner et al. 2006); normally
//! distributed range errors; two echoes at an edge, with the energy fractions of a Gaussian beam; the labels of the
//! geometry. Statistical bounds are 5 standard errors, a false-alarm rate of 6e-7.

use crate::common::dataset::fail;
use crate::common::program::{names, scratch, small_text, trace};
use crate::common::scenes::{camera, scene, square, with_world};
use furrow_base::geometry::{Intersect, Mesh, Ray};
use furrow_base::math::{Spectrum, Vec2, Vec3, vec3};
use furrow_base::ron_file::RonFile;
use furrow_base::sampling::{Purpose, Stream};
use furrow_field::assemble::Scanner;
use furrow_job::{PreparedField, SceneFile, Threads};
use furrow_optics::bsdf::{Bsdf, OrenNayar};
use furrow_optics::sensor::{Lidar, LidarDesc};
use furrow_render::render::{self, Echo};
use furrow_render::scene::Scene;
use furrow_render::scene::tag::{Class, Tag};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// A LiDAR for the field of [`page`]: one ray per pulse, without errors.
const RAYS: &str = "lidar: (position_m: (0.05, 0.02, 0.9), beams: Fan(count: 16, from_deg: -88, to_deg: -40), pulses: StepDeg(3), \
                    min_m: 0.2, divergence_mrad: 0, exit_mm: 0, range_noise_m: 0),";

fn lidar(text: &str) -> Lidar {
    let desc: LidarDesc = RonFile::of(text).parse().unwrap_or_else(|e| panic!("{e}"));
    desc.build(&mut Stream::of(1, 0, Purpose::Test, 0)).unwrap_or_else(|e| panic!("{e}"))
}

fn matt(albedo: f32) -> Bsdf {
    Bsdf::OrenNayar(OrenNayar::new(Spectrum::splat(albedo), 0.0))
}

/// Builds a scene of matt surfaces with these labels. It has no light, because a LiDAR emits its own.
fn stage(parts: Vec<(Mesh, f32, Tag)>) -> Scene {
    let look = camera((8, 8), vec3(0.0, 0.0, 1.0), vec3(0.0, 0.1, 0.0), 40.0);
    let tags: Vec<Tag> = parts.iter().map(|(.., tag)| *tag).collect();
    let mut stage = scene(parts.into_iter().map(|(mesh, albedo, _)| (mesh, matt(albedo))).collect(), Vec::new(), look);
    for (part, tag) in stage.parts.iter_mut().zip(tags) {
        part.tag = tag;
    }
    stage
}

fn ground(albedo: f32, side: f32) -> Scene {
    stage(vec![(square(Vec3::ZERO, side), albedo, Tag::default())])
}

fn scanned(stage: &Scene, lidar: &Lidar) -> Vec<Echo> {
    with_world(stage, 2, |world, _| render::scan(world, lidar, &Stream::of(1, 0, Purpose::Test, 0)))
}

/// Expected: at height h and an elevation e below the horizon, r = h / sin e and intensity = albedo · sin e / r², to
/// single precision for a beam without width and errors. A beam with width averages over its Gaussian; at 1 mrad, 1/r²
/// and r differ by less than 1e-4 from their values on the axis.
#[test]
fn a_matt_plane_is_as_far_and_as_bright_as_the_lidar_equation_says() {
    let (height, albedo) = (3.0_f32, 0.6);
    let plane = ground(albedo, 60.0);
    for (width, bound) in [("divergence_mrad: 0, exit_mm: 0", 1e-5), ("divergence_mrad: 1, exit_mm: 0", 1e-4)] {
        let lidar = lidar(&format!(
            "(position_m: (0, 0, {height}), beams: Angles([-90, -60, -30, -10, 20]), pulses: StepDeg(10), range_noise_m: 0, {width})"
        ));
        let echoes = scanned(&plane, &lidar);
        assert_eq!(echoes.len(), 4 * 36, "the beam above the horizon must have no echo");
        for echo in &echoes {
            let down = [90.0, 60.0, 30.0, 10.0_f32][usize::from(echo.pulse.beam)].to_radians().sin();
            let (range, intensity) = (height / down, albedo * down * (down / height).powi(2));
            assert!((echo.range / range - 1.0).abs() < bound, "{width}: {} m, not {range}", echo.range);
            assert!(echo.at().z.abs() < 1e-4 * range, "{}", echo.at());
            let off = (echo.intensity / intensity - 1.0).abs();
            assert!(off < 10.0 * bound, "{width}: intensity {}, not {intensity}", echo.intensity);
            assert!((echo.number, echo.count) == (1, 1) && (echo.normal - Vec3::Z).length() < 1e-6);
        }
    }
}

/// Expected: normally distributed range errors with mean 0 and the requested standard deviation σ: means within 5 σ/√n,
/// deviations within 5 σ/√(2n); a different error for each pulse; no echo outside the range limits.
#[test]
fn ranges_err_by_the_noise_that_was_asked_for() {
    let (height, sigma) = (3.0, 0.02);
    let aimed = |noise: f64, more: &str| {
        let text = format!(
            "(position_m: (0, 0, {height}), beams: Angles([-90]), pulses: StepDeg(0.03), range_noise_m: {noise}, {more})"
        );
        scanned(&ground(0.6, 10.0), &lidar(&text))
    };
    let echoes = aimed(sigma, "");
    let n = echoes.len() as f64;
    assert_eq!(echoes.len(), 12_000);
    let errors: Vec<f64> = echoes.iter().map(|echo| f64::from(echo.range) - height).collect();
    let mean = errors.iter().sum::<f64>() / n;
    let deviation = (errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / n).sqrt();
    assert!(mean.abs() < 5.0 * sigma / n.sqrt(), "{mean}");
    assert!((deviation - sigma).abs() < 5.0 * sigma / (2.0 * n).sqrt(), "{deviation}, not {sigma}");
    let different: BTreeSet<u32> = echoes.iter().map(|echo| echo.range.to_bits()).collect();
    assert!(different.len() > 11_000, "{}", different.len());
    // Half of the echoes are beyond the limit and not returned.
    let near = aimed(sigma, "max_m: 3");
    assert!(near.iter().all(|echo| echo.range <= 3.0), "echo beyond the range limit");
    let share = near.len() as f64 / n;
    assert!((share - 0.5).abs() < 2.5 / n.sqrt(), "{share}");
    let wild = aimed(10.0, "min_m: 0");
    assert!(wild.iter().all(|echo| (0.0..=100.0).contains(&echo.range)));
}

/// Builds a leaf at a height of 1 m over ground, whose edge runs north at x = `edge` m; the LiDAR is at 5 m.
fn leaf_over_ground(edge: f32) -> Scene {
    let leaf = Tag { class: Class::Crop, plant: 7, leaf: 3 };
    let mesh = square(vec3(edge + 0.5, 0.0, 1.0), 1.0);
    stage(vec![(square(Vec3::ZERO, 10.0), 0.2, Tag::default()), (mesh, 0.5, leaf)])
}

/// Fraction of a Gaussian beam's energy beyond the distance `d` from its axis, in units of half its 1/e² width,
/// relative to the energy within that width; summed numerically.
fn share_beyond(d: f64) -> f64 {
    let (mut beyond, mut all) = (0.0, 0.0);
    let n = 400;
    for (i, j) in (0..n * n).map(|k| (k % n, k / n)) {
        let at = |k: i32| (2.0 * f64::from(k) + 1.0) / f64::from(n) - 1.0;
        let (x, y) = (at(i), at(j));
        let rho = x * x + y * y;
        if rho < 1.0 {
            let weight = (-2.0 * rho).exp();
            all += weight;
            beyond += if x > d { weight } else { 0.0 };
        }
    }
    beyond / all
}

/// Expected: a leaf and ground 1 m apart give two echoes of a 0.5 m pulse, at 4 m and 5 m. Their intensities, relative
/// to those of the whole beam, sum to 1; the leaf's fraction is that of a Gaussian beam within the resolution of 19
/// rays (the weight of a few of them).
///
/// First and last echoes are returned as requested. A 1.5 m pulse gives one echo of both: the sum of the intensities,
/// at their mean range.
#[test]
fn a_beam_over_the_edge_of_a_leaf_has_two_echoes() {
    let aimed = |returns: &str, pulse_ns: f32| {
        lidar(&format!(
            "(position_m: (0, 0, 5), beams: Angles([-90]), azimuth_deg: (0, 1), pulses: StepDeg(1), divergence_mrad: 6, exit_mm: 10, \
             range_noise_m: 0, min_intensity: 0, returns: {returns}, pulse_ns: {pulse_ns})"
        ))
    };
    let half = 0.5 * (0.01 + 0.006 * 4.0);
    for beyond in [-0.55_f32, -0.15, 0.1, 0.5] {
        let stage = leaf_over_ground(beyond * half);
        let both = scanned(&stage, &aimed("All", 3.33));
        let [leaf, soil] = both[..] else { panic!("{} echoes", both.len()) };
        assert!((leaf.range - 4.0).abs() < 1e-4 && (soil.range - 5.0).abs() < 1e-4, "{} {}", leaf.range, soil.range);
        assert_eq!([leaf.number, leaf.count, soil.number, soil.count], [1, 2, 2, 2]);
        let labels = [leaf, soil].map(|echo| stage.parts[echo.part as usize].tag);
        assert_eq!(labels, [Tag { class: Class::Crop, plant: 7, leaf: 3 }, Tag::default()]);
        let shares = [leaf.intensity * 16.0 / 0.5, soil.intensity * 25.0 / 0.2];
        assert!((shares[0] + shares[1] - 1.0).abs() < 1e-4, "{shares:?}");
        let expected = share_beyond(f64::from(beyond));
        assert!((f64::from(shares[0]) - expected).abs() < 0.12, "{beyond}: {}, not {expected}", shares[0]);
        // The same echoes, selected by the return mode.
        let brightest = if leaf.intensity > soil.intensity { leaf } else { soil };
        for (returns, recorded) in [
            ("First", vec![leaf]),
            ("Last", vec![soil]),
            ("Strongest", vec![brightest]),
            ("FirstAndLast", vec![leaf, soil]),
        ] {
            assert_eq!(scanned(&stage, &aimed(returns, 3.33)), recorded, "{returns}");
        }
        let long = scanned(&stage, &aimed("All", 10.0));
        let [one] = long[..] else { panic!("{} echoes of a long pulse", long.len()) };
        let sum = leaf.intensity + soil.intensity;
        let mean = (leaf.intensity * leaf.range + soil.intensity * soil.range) / sum;
        assert!((one.intensity / sum - 1.0).abs() < 1e-5 && (one.range - mean).abs() < 1e-4 && one.count == 1);
        assert_eq!(one.part, brightest.part);
    }
}

/// Rationale: a slope spreads a beam over metres of range, which is one long echo, not several. Expected: one echo of
/// each pulse on a plane, however grazing the beam and however short the pulse; its intensity follows the LiDAR
/// equation for the whole beam, to second order in its width.
#[test]
fn a_plane_that_is_met_flatly_is_one_echo() {
    for pulse_ns in ["0", "1", "6.67"] {
        let lidar = lidar(&format!(
            "(position_m: (0, 0, 1.2), beams: Angles([-45, -10, -3, -1.5]), pulses: StepDeg(10), range_noise_m: 0, min_intensity: 0, \
             returns: All, pulse_ns: {pulse_ns})"
        ));
        let echoes = scanned(&ground(0.4, 400.0), &lidar);
        assert_eq!(echoes.len(), 4 * 36, "pulses of {pulse_ns} ns");
        for echo in &echoes {
            let down = [45.0, 10.0, 3.0, 1.5_f32][usize::from(echo.pulse.beam)].to_radians().sin();
            let (range, intensity) = (1.2 / down, 0.4 * down * (down / 1.2).powi(2));
            assert!((echo.range / range - 1.0).abs() < 0.01, "{} m, not {range}", echo.range);
            assert!((echo.intensity / intensity - 1.0).abs() < 0.03, "{}, not {intensity}", echo.intensity);
        }
    }
}

/// Writes the small scene file with the text `more` added.
fn page(folder: &Path, name: &str, more: &str) -> PathBuf {
    std::fs::create_dir_all(folder).unwrap();
    let text = small_text().replacen("lights:", &format!("reach_m: 1.5,\n    {more}\n    lights:"), 1);
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    path
}

fn grown(page: &Path, threads: usize) -> PreparedField {
    let threads = Threads::new(threads).unwrap();
    SceneFile::open(page).unwrap().threads(&threads).scanned(Scanner::OfScene).field(0).unwrap()
}

/// Returns the columns of a PLY file by name, and its comments, using only its header.
fn columns(file: &[u8]) -> (BTreeMap<String, Vec<f64>>, Vec<String>) {
    let end = file.windows(11).position(|w| w == b"end_header\n").expect("a header") + 11;
    let header = std::str::from_utf8(&file[..end]).unwrap();
    assert!(header.starts_with("ply\nformat binary_little_endian 1.0\n"), "{header}");
    let mut comments = Vec::new();
    let (mut count, mut properties) = (0_usize, Vec::new());
    for line in header.lines() {
        match line.split(' ').collect::<Vec<_>>()[..] {
            ["comment", ..] => comments.push(line.trim_start_matches("comment ").to_owned()),
            ["element", "vertex", n] => count = n.parse().unwrap(),
            ["property", kind, name] => properties.push((kind.to_owned(), name.to_owned())),
            _ => {}
        }
    }
    let mut found: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    let mut at = end;
    let mut take = |n: usize| {
        at += n;
        &file[at - n..at]
    };
    for _ in 0..count {
        for (kind, name) in &properties {
            let value = match kind.as_str() {
                "float" => f64::from(f32::from_le_bytes(take(4).try_into().unwrap())),
                "double" => f64::from_le_bytes(take(8).try_into().unwrap()),
                "int" => f64::from(i32::from_le_bytes(take(4).try_into().unwrap())),
                "uchar" => f64::from(take(1)[0]),
                other => panic!("a property of type {other}"),
            };
            found.entry(name.clone()).or_default().push(value);
        }
    }
    assert_eq!(at, file.len(), "the file's length must agree with its header");
    (found, comments)
}

/// Expected: an independent ray along each pulse hits the part and range of its echo, or nothing if there is no echo.
/// The file contains the same labels and the identity of the plant; plants of both classes and soil occur.
#[test]
fn every_echo_has_the_labels_of_a_ray_of_its_own() {
    let (_keep, folder) = scratch();
    let field = grown(&page(&folder, "rays.ron", RAYS), 2);
    let (lidar, echoes) = field.scan().unwrap();
    let (geometry, parts) = (field.geometry().unwrap(), &field.grown().scene.parts);
    let pulses = (0..lidar.columns()).flat_map(|c| (0..lidar.beams()).map(move |b| lidar.pulse(c, b)));
    let met: Vec<_> = pulses.filter_map(|p| Some((p, geometry.closest(&Ray::new(p.origin, p.direction))?))).collect();
    assert_eq!(met.len(), echoes.len());
    let file = furrow_output::scan::cloud(field.grown(), lidar, &echoes).file("test");
    let (columns, _) = columns(&file);
    let ids: BTreeMap<u32, u32> = field.grown().plants.iter().map(|plant| (plant.number, plant.id)).collect();
    let mut seen = BTreeMap::new();
    for (k, ((pulse, hit), echo)) in met.iter().zip(&echoes).enumerate() {
        assert_eq!((*pulse, hit.part), (echo.pulse, echo.part));
        assert!((hit.t - echo.range).abs() < 1e-6 * hit.t, "{} {}", hit.t, echo.range);
        let tag = parts[hit.part as usize].tag;
        *seen.entry(tag.class as u8).or_insert(0) += 1;
        let recorded = |name: &str| columns[name][k];
        assert_eq!(
            [recorded("class"), recorded("plant"), recorded("leaf")],
            [f64::from(tag.class as u8), f64::from(tag.plant), f64::from(tag.leaf)]
        );
        assert_eq!(recorded("plant_id"), f64::from(ids.get(&tag.plant).copied().unwrap_or(0)));
        let at = pulse.origin + pulse.direction * hit.t;
        for (name, expected) in
            [("x", at.x), ("y", at.y), ("z", at.z), ("range", hit.t), ("azimuth", pulse.azimuth_deg)]
        {
            assert!((recorded(name) - f64::from(expected)).abs() < 1e-5 * (1.0 + recorded(name).abs()), "{name}");
        }
        assert_eq!(
            [recorded("beam"), recorded("return_number"), recorded("number_of_returns")],
            [f64::from(pulse.beam), 1.0, 1.0]
        );
        assert!((recorded("reflectance") / (recorded("intensity") * recorded("range").powi(2)) - 1.0).abs() < 1e-5);
    }
    assert!([0, 1, 2].iter().all(|class| seen.get(class).is_some_and(|n| *n > 10)), "{seen:?}");
}

/// Expected for beams with width: if all rays of a pulse hit one surface, its label, otherwise the label of one of the
/// surfaces hit; each plant's echoes are around it.
#[test]
fn an_echo_of_a_wide_beam_has_a_label_within_its_beam() {
    let (_keep, folder) = scratch();
    let wide =
        RAYS.replace("divergence_mrad: 0, exit_mm: 0", "divergence_mrad: 6, exit_mm: 8, returns: All, pulse_ns: 0.1");
    let field = grown(&page(&folder, "wide.ron", &wide), 2);
    let (lidar, echoes) = field.scan().unwrap();
    let (geometry, parts) = (field.geometry().unwrap(), &field.grown().scene.parts);
    let (mut pure, mut mixed, mut several) = (0, 0, 0);
    for echo in &echoes {
        let rays = lidar.rays(&echo.pulse);
        let hits: Vec<_> = rays.iter().filter_map(|r| geometry.closest(&Ray::new(r.origin, r.direction))).collect();
        let tags: Vec<Tag> = hits.iter().map(|hit| parts[hit.part as usize].tag).collect();
        let tag = parts[echo.part as usize].tag;
        assert!(tags.contains(&tag), "{tag:?} is none of {tags:?}");
        let alike = tags.iter().all(|other| *other == tags[0]);
        pure += u32::from(alike);
        mixed += u32::from(!alike);
        several += u32::from(echo.count > 1);
        let (lo, hi) = hits.iter().fold((f32::INFINITY, 0.0_f32), |(lo, hi), hit| (lo.min(hit.t), hi.max(hit.t)));
        assert!((lo - 1e-4..=hi + 1e-4).contains(&echo.range));
        assert!(echo.normal.dot(echo.pulse.direction) < 0.1, "the normal must face the LiDAR");
    }
    assert!(pure > 500 && mixed > 50 && several > 10, "{pure} {mixed} {several}");
    // Several echoes only from several surfaces, or from one that is in the beam twice; rarely from the ground alone.
    let of = |echo: &&Echo| parts[echo.part as usize].tag == Tag::default();
    let alone = echoes.windows(2).filter(|pair| pair[0].pulse == pair[1].pulse && pair.iter().all(|e| of(&e))).count();
    assert!(alone * 50 < echoes.len(), "{alone} of {} echoes are of ground behind ground", echoes.len());
}

/// Expected: the same bytes, noise included.
#[test]
fn a_scan_is_the_same_bits_on_one_and_two_threads() {
    let (_keep, folder) = scratch();
    let noisy = RAYS.replace("divergence_mrad: 0, exit_mm: 0, range_noise_m: 0", "returns: All, range_noise_m: 0.01");
    let path = page(&folder, "threads.ron", &noisy);
    let file = |threads| {
        let field = grown(&path, threads);
        let (lidar, echoes) = field.scan().unwrap();
        furrow_output::scan::cloud(field.grown(), lidar, &echoes).file("test")
    };
    let one = file(1);
    assert!(one.len() > 50_000 && one == file(2));
    let field = grown(&path, 2);
    let (_, again) = field.scan().unwrap();
    assert_eq!(again, field.scan().unwrap().1, "a second scan of the same field must be equal");
}

/// Expected: a drive of 0.5 m/s to the east at 2 Hz moves the LiDAR by 0.25 m per frame, and its pulses move with it
/// during a turn. Plants stay in place: those with the same identity are found in both frames at about the same
/// positions. The range errors differ between the frames.
#[test]
fn frames_of_a_drive_move_the_lidar() {
    let (_keep, folder) = scratch();
    let drive = format!("drive: (frames: 2, rate_hz: 2, path: Straight(heading_deg: 90, speed_m_s: 0.5)),\n    {RAYS}");
    let mut field = grown(&page(&folder, "drive.ron", &drive), 2);
    let mut frames = Vec::new();
    for frame in 0..2 {
        field.take(frame).unwrap();
        let (lidar, echoes) = field.scan().unwrap();
        let file = furrow_output::scan::cloud(field.grown(), lidar, &echoes).file("test");
        let (columns, comments) = columns(&file);
        let [x, y] = [lidar.position.x, lidar.position.y];
        assert!(comments.iter().any(|line| line.starts_with(&format!("lidar position_m: {x} {y} "))), "{comments:?}");
        frames.push((lidar.clone(), columns));
    }
    let way = frames[1].0.position - frames[0].0.position;
    assert!((way - vec3(0.25, 0.0, 0.0)).length() < 1e-5, "{way}");
    for (lidar, _) in &frames {
        assert!((lidar.axes.y_axis - Vec3::X).length() < 1e-5, "its front must face the direction of travel");
        let [begin, half] = [0, lidar.columns() / 2].map(|column| lidar.pulse(column, 0));
        assert!((half.origin - begin.origin - Vec3::X * (0.5 * half.time_s)).length() < 1e-6 && half.time_s > 0.04);
    }
    let centres = |k: usize| {
        let columns: &BTreeMap<String, Vec<f64>> = &frames[k].1;
        let mut of: BTreeMap<u64, Vec<Vec2>> = BTreeMap::new();
        for (i, id) in columns["plant_id"].iter().enumerate().filter(|(_, id)| **id > 0.0) {
            of.entry(*id as u64).or_default().push(Vec2::new(columns["x"][i] as f32, columns["y"][i] as f32));
        }
        of
    };
    let (first, second) = (centres(0), centres(1));
    let radius: BTreeMap<u64, (Vec2, f32)> = field
        .grown()
        .plants
        .iter()
        .map(|plant| (u64::from(plant.id), (plant.position.truncate(), plant.radius)))
        .collect();
    let both: Vec<_> = first.keys().filter(|id| second.contains_key(id)).collect();
    assert!(both.len() > 3, "{}", both.len());
    for (id, at) in first.iter().chain(&second).flat_map(|(id, all)| all.iter().map(move |at| (id, at))) {
        let (stem, radius) = radius[id];
        assert!(at.distance(stem) < radius + 0.02, "{at} is {} m from its plant", at.distance(stem));
    }
}

/// Expected: each plant in an image of the field is in its scan, with the same identity, position, species and age.
#[test]
fn plants_have_the_identities_of_an_image() {
    let (_keep, folder) = scratch();
    let path = page(&folder, "ids.ron", RAYS);
    let image = SceneFile::open(&path).unwrap().field(0).unwrap();
    let scan = grown(&path, 2);
    let of: BTreeMap<u32, _> = scan.grown().plants.iter().map(|plant| (plant.id, plant)).collect();
    assert!(image.grown().plants.len() > 3);
    for plant in &image.grown().plants {
        let same = of.get(&plant.id).unwrap_or_else(|| panic!("{} is not in the scan", plant.id));
        assert!((plant.position - same.position).truncate().length() < 1e-5, "{} {}", plant.position, same.position);
        assert_eq!((&plant.species, plant.age_days, plant.leaves), (&same.species, same.age_days, same.leaves));
    }
    // The LiDAR does not change the camera's image.
    let plain = SceneFile::open(page(&folder, "plain.ron", "")).unwrap().field(0).unwrap();
    assert_eq!(image.label().unwrap(), plain.label().unwrap());
}

/// Rationale: a LiDAR emits its own light, so scene files for scans need no lights. Expected: a scan without lights
/// causes no warning, while an image would be black and causes one.
#[test]
fn a_scan_needs_no_light() {
    let (_keep, folder) = scratch();
    std::fs::create_dir_all(&folder).unwrap();
    let scene = folder.join("dark.ron");
    let camera =
        "camera: Pinhole(size: (8, 6), intrinsics: FieldOfView(horizontal_deg: 40), pose: Nadir(height_m: 0.5))";
    std::fs::write(&scene, format!("Field({camera}, {RAYS} lights: [])")).unwrap();
    let image = SceneFile::open(&scene).unwrap();
    let warns = |scene: SceneFile| {
        scene.expected_warnings(0).unwrap().iter().any(|words| words.contains("no light in the scene"))
    };
    assert!(!warns(image.clone().scanned(Scanner::OfScene)));
    assert!(warns(image));
}

/// Expected: exit code 2, one error with a remedy, and no file; then a scan that succeeds.
#[test]
fn errors_are_reported_and_write_nothing() {
    let (_keep, folder) = scratch();
    let out = folder.join("out");
    let written = |k: usize, more: &str| page(&folder, &format!("{k}.ron"), more).to_str().unwrap().to_owned();
    let scan = |page: &str, more: &[&str]| {
        let mut command = trace(&["scan", "--scene", page, "--out", out.to_str().unwrap()]);
        command.args(more);
        command
    };
    for (k, (more, words)) in [
        ("", "has no LiDAR"),
        ("lidar: Vlp17(),", "unknown LiDAR `Vlp17`"),
        ("lidar: (azimuth_deg: (60, -60)),", "from 60 to -60"),
        ("lidar: (beams: Angles([])),", "of 0 beams"),
        ("lidar: (beams: Fan(count: 0, from_deg: 0, to_deg: 1)),", "a whole number from 1"),
        ("lidar: (pulses: PerSecond(1000000000)),", "pulses in a turn are too many"),
        ("lidar: (range_noise_m: NaN),", "NaN"),
        ("lidar: (divergence_mrad: 1000),", "between 0 and 100"),
        ("lidar: (position_m: (0, 0, -1)),", "above 0"),
        ("lidar: (position_m: (1000000000, 0, 1)),", "between -1000 and 1000"),
    ]
    .into_iter()
    .enumerate()
    {
        let error = fail(scan(&written(k, more), &[]), 2);
        assert!(error.contains(words) && error.matches("error:").count() == 1, "{more}: {error}");
        assert!(error.contains("help:"), "{more}: {error}");
        assert!(!out.exists(), "{more}: output was written");
    }
    let good = written(20, RAYS);
    let error = fail(scan(&good, &["--lidar", "Vlp16"]), 2);
    assert!(error.contains("a LiDAR of its own"), "{error}");
    let error = fail(scan(&good, &["--lidar", "Vlp17"]), 2);
    assert!(error.contains("Vlp16"), "{error}");
    let error = fail(scan(&good, &["--frame", "9"]), 2);
    assert!(error.contains("no frame 9"), "{error}");
    assert!(!out.exists());
    let done = scan(&good, &[]).output().unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    assert_eq!(names(&out), ["scan.ply"]);
    let (found, _) = columns(&std::fs::read(out.join("scan.ply")).unwrap());
    assert!(found["x"].len() > 1000 && found.len() == 23, "{:?}", found.keys());
    let done = scan(&good, &["--las"]).output().unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    assert_eq!(names(&out), ["scan.las", "scan.ply"]);
    las_is_the_ply(&std::fs::read(out.join("scan.las")).unwrap(), &found);
    // A file of an earlier scan beside this one's would show another field.
    assert!(scan(&good, &["--laz"]).output().unwrap().status.success());
    assert_eq!(names(&out), ["scan.laz", "scan.ply"]);
    assert!(scan(&good, &[]).output().unwrap().status.success());
    assert_eq!(names(&out), ["scan.ply"]);
}

/// Compares a LAS file with the columns of the PLY file of the same scan. Expected: the same points, to half a step of
/// 0.1 mm, with the same labels. Source: byte offsets of tables 2, 15 and 16 of ASPRS 2019, "LAS Specification 1.4 - R15".
fn las_is_the_ply(file: &[u8], ply: &BTreeMap<String, Vec<f64>>) {
    fn bytes<const N: usize>(file: &[u8], at: usize) -> [u8; N] {
        file[at..at + N].try_into().unwrap()
    }
    let u16_at = |at: usize| usize::from(u16::from_le_bytes(bytes(file, at)));
    let u32_at = |at: usize| u32::from_le_bytes(bytes(file, at)) as usize;
    let f64_at = |at: usize| f64::from_le_bytes(bytes(file, at));
    assert_eq!((&file[..4], &file[24..26], u16_at(94)), (&b"LASF"[..], &[1, 4][..], 375));
    assert_eq!((u16_at(6), file[104], u32_at(100), u32_at(107)), (16, 6, 2, 0));
    let (begin, length) = (u32_at(96), u16_at(105));
    let count = u64::from_le_bytes(bytes(file, 247)) as usize;
    assert_eq!((count, file.len()), (ply["x"].len(), begin + count * length));
    // The bit of a text for the coordinate system has its record, the first one; the record of extra bytes follows.
    let system = 375 + 54 + u16_at(395);
    assert_eq!((&file[377..392], u16_at(393)), (&b"LASF_Projection"[..], 2112));
    assert!(file[375 + 54..].starts_with(b"LOCAL_CS[") && file[system - 1] == 0);
    assert_eq!((&file[system + 2..system + 11], u16_at(system + 18)), (&b"LASF_Spec"[..], 4));
    assert_eq!(system + 54 + u16_at(system + 20), begin);
    let extra: Vec<(u8, String)> = (system + 54..begin)
        .step_by(192)
        .map(|at| (file[at + 2], String::from_utf8_lossy(&file[at + 4..at + 36]).trim_end_matches('\0').to_owned()))
        .collect();
    assert_eq!(extra, [(5, "plant_id".to_owned()), (3, "leaf".to_owned()), (3, "beam".to_owned())]);
    assert_eq!(length, 30 + 4 + 2 + 2);
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        let (scale, offset) = (f64_at(131 + 8 * axis), f64_at(155 + 8 * axis));
        let [high, low] = [0, 8].map(|end| f64_at(179 + 16 * axis + end));
        for (k, value) in ply[name].iter().enumerate() {
            let at = begin + k * length + 4 * axis;
            let found = f64::from(i32::from_le_bytes(bytes(file, at))) * scale + offset;
            assert!(
                (found - value).abs() < 0.51e-4 && (low..=high).contains(&found),
                "{name} of point {k}: {found}, {value}"
            );
        }
    }
    let by_return: Vec<u64> = (0..15).map(|k| u64::from_le_bytes(bytes(file, 255 + 8 * k))).collect();
    for (k, number) in by_return.into_iter().enumerate() {
        assert_eq!(number as usize, ply["return_number"].iter().filter(|n| **n == (k + 1) as f64).count());
    }
    let point = |name: &str, k: usize| ply[name][k];
    for k in 0..count {
        let at = begin + k * length;
        let of = |name: &str| point(name, k);
        assert_eq!(f64::from(file[at + 14] & 15), of("return_number"));
        assert_eq!(f64::from(file[at + 14] >> 4), of("number_of_returns"));
        assert_eq!(file[at + 16], [2, 64, 65][of("class") as usize]);
        assert_eq!(f64::from(file[at + 17]), of("part"));
        let intensity = u16_at(at + 12) as f64 / 65535.0;
        assert!((intensity - of("reflectance").min(1.0)).abs() < 1e-5, "{intensity}");
        let turn = f64::from(i16::from_le_bytes(bytes(file, at + 18))) * 0.006 - of("azimuth");
        assert!((turn - 360.0 * (turn / 360.0).round()).abs() < 0.0031, "{turn}");
        assert_eq!(f64_at(at + 22), of("time"));
        assert_eq!((u32_at(at + 30) as f64, u16_at(at + 34) as f64), (of("plant_id"), of("leaf")));
        assert_eq!(u16_at(at + 36) as f64, of("beam"));
    }
}
