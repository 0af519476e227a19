//! Point clouds on the surfaces of a field.
//!
//! Rationale: users who measure a plant by its points must find its true area. Expected: on average, the number of
//! points of every part and every triangle is its area times the density; there are none where a mask is transparent;
//! every point is on its part and has its label. Bounds are 5 standard errors.

use crate::common::program::{SMALL, field, scratch, small_text, trace};
use furrow_base::geometry::Mesh;
use furrow_base::math::{Vec3, vec3};
use furrow_field::Field;
use furrow_field::assemble::Options;
use furrow_output::cloud::{self, Cloud};
use std::collections::BTreeMap;

/// Size of a point in bytes: position, normal and labels.
const POINT: usize = 38;

/// Positions, normals and labels (plant, leaf) of a cloud's points.
fn points(cloud: Cloud) -> Vec<(Vec3, Vec3, (u32, u16))> {
    let count = cloud.points();
    let file = cloud.file("test");
    let header = file.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    let words = String::from_utf8_lossy(&file[..header]).into_owned();
    assert!(words.contains(&format!("element vertex {count}\n")), "{words}");
    // Open3D drops properties of other types.
    let mut properties = words.lines().filter_map(|line| line.strip_prefix("property "));
    let read = |property: &str| ["float ", "int ", "uchar "].iter().any(|kind| property.starts_with(kind));
    assert!(properties.all(read), "{words}");
    let body = &file[header..];
    assert_eq!(body.len(), count as usize * POINT);
    let float = |p: &[u8], k: usize| f32::from_le_bytes(p[4 * k..4 * k + 4].try_into().unwrap());
    let vector = |p: &[u8], k: usize| vec3(float(p, k), float(p, k + 1), float(p, k + 2));
    let label = |p: &[u8]| (u32::from_le_bytes(p[30..34].try_into().unwrap()), u16::from_le_bytes([p[34], p[35]]));
    body.chunks_exact(POINT).map(|p| (vector(p, 0), vector(p, 3), label(p))).collect()
}

fn plants(text: &str) -> Field {
    let text = format!(
        "Field(
            seed: 3,
            camera: Pinhole(size: (64, 48), intrinsics: FieldOfView(horizontal_deg: 50), pose: Nadir(height_m: 1)),
            lights: [Constant(radiance: (1, 1, 1, 1))],
            plants: [{text}],
        )"
    );
    field(&text, &Options::default())
}

/// Area of a mesh inside its mask, m²; each triangle is sampled on a grid.
fn left(mesh: &Mesh, mask: Option<&furrow_base::geometry::AlphaMask>) -> f64 {
    let places: Vec<(f32, f32)> = (0..64).map(|i| ((i % 8) as f32 + 0.5, (i / 8) as f32 + 0.5)).collect();
    let one = |i: u32| {
        let [a, b, c] = mesh.corners(i);
        let area = 0.5 * f64::from((b - a).cross(c - a).length());
        let [ta, tb, tc] = mesh.triangles[i as usize].map(|k| mesh.uvs[k as usize]);
        let there = |(x, y): &&(f32, f32)| {
            let (u, v) = (x / 8.0, y / 8.0);
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            mask.is_none_or(|mask| mask.opaque_at(ta * (1.0 - u - v) + tb * u + tc * v))
        };
        area * places.iter().filter(there).count() as f64 / places.len() as f64
    };
    (0..mesh.triangles.len() as u32).map(one).sum()
}

#[test]
fn leaves_bear_points_by_their_area_and_none_in_their_holes() {
    let field = plants(
        "(species: \"scenes/species/sugar_beet.ron\", growth: Bbch(16), position_m: (0, 0), condition: (holes: 6, bites: 2, wilt: 0))",
    );
    let density = 2e6;
    let found = points(cloud::sample(&field, density).unwrap());
    let (mut areas, mut whole) = (BTreeMap::new(), 0.0);
    for part in &field.scene.parts {
        *areas.entry((part.tag.plant, part.tag.leaf)).or_insert(0.0) += left(&part.mesh, part.mask.as_deref());
        whole += f64::from(part.mesh.area());
    }
    let mut counts: BTreeMap<(u32, u16), usize> = BTreeMap::new();
    for (_, normal, label) in &found {
        *counts.entry(*label).or_default() += 1;
        assert!((normal.length() - 1.0).abs() < 1e-3);
    }
    assert!(areas.len() > 4);
    for (label, area) in &areas {
        let (expected, count) = (area * density, counts.get(label).copied().unwrap_or(0) as f64);
        // The area inside a mask is measured on a grid: 1 % in addition to the sampling error.
        assert!(
            (count - expected).abs() < 5.0 * expected.sqrt() + 0.01 * expected,
            "{label:?}: {count}, not {expected}"
        );
    }
    assert!((found.len() as f64) < 0.98 * whole * density, "masks and holes must remove some area");
}

/// Expected: the two halves of each triangle, separated by a median, have equal numbers of points, and all points are
/// inside a triangle. The stem has no mask.
#[test]
fn points_are_uniform_on_their_triangles() {
    let field = plants("(species: \"scenes/species/sugar_beet.ron\", growth: Bbch(16), position_m: (0, 0))");
    let found = points(cloud::sample(&field, 1.2e7).unwrap());
    // The stem: the parts that belong to no leaf.
    let stem: Vec<&Mesh> = field.scene.parts.iter().filter(|part| part.tag.leaf == 0).map(|part| &*part.mesh).collect();
    assert!(!stem.is_empty() && field.scene.parts.iter().all(|part| part.tag.leaf > 0 || part.mask.is_none()));
    let own: Vec<Vec3> = found.iter().filter(|(_, _, (_, leaf))| *leaf == 0).map(|(at, ..)| *at).collect();
    let (mut first, mut inside) = (0_u32, 0_u32);
    for at in &own {
        let corners = stem.iter().flat_map(|mesh| (0..mesh.triangles.len() as u32).map(|i| mesh.corners(i)));
        let place = corners.filter_map(|corners| {
            let [a, b, c] = corners.map(Vec3::as_dvec3);
            let (e1, e2, p) = (b - a, c - a, at.as_dvec3() - a);
            let n = e1.cross(e2);
            let (u, v) = (p.cross(e2).dot(n) / n.length_squared(), e1.cross(p).dot(n) / n.length_squared());
            let near = p.dot(n.normalize_or_zero()).abs() < 1e-7;
            (near && u > -1e-3 && v > -1e-3 && u + v < 1.001).then_some(u > v)
        });
        if let Some(half) = place.into_iter().next() {
            inside += 1;
            first += u32::from(half);
        }
    }
    assert!(f64::from(inside) > 0.999 * own.len() as f64, "{inside} of {}", own.len());
    assert!(inside > 2000, "{inside} of {}", own.len());
    let share = f64::from(first) / f64::from(inside);
    assert!((share - 0.5).abs() < 2.5 / f64::from(inside).sqrt(), "{share} of {inside}");
}

#[test]
fn the_same_field_has_the_same_points_and_too_many_are_refused() {
    let grown = field(&small_text(), &Options::default());
    let file = || cloud::sample(&grown, 3e4).unwrap().file("test");
    assert!(file() == file());
    let error = cloud::sample(&grown, 1e12).map(|_| ()).unwrap_err();
    assert!(error.to_string().contains("points on"), "{error}");
    let (_keep, folder) = scratch();
    let export = |more: &[&str]| {
        let mut command = trace(&["export", "--scene", SMALL, "--width", "32", "--density", "20000"]);
        command.args(more).arg("--out").arg(&folder).output().unwrap()
    };
    assert!(!export(&["--format", "gltf"]).status.success());
    let done = export(&["--format", "ply"]);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let file = std::fs::read(folder.join("points.ply")).unwrap();
    assert!(file.starts_with(b"ply\nformat binary_little_endian"));
    // The last line of the output gives the number of points, the number on the soil, and the file size.
    let message = String::from_utf8_lossy(&done.stderr);
    let fields = message.lines().last().unwrap().split_whitespace();
    let numbers: Vec<f64> = fields.filter_map(|word| word.parse().ok()).collect();
    let [points, of_soil, megabytes] = numbers[..] else { panic!("{message}") };
    let head = format!("element vertex {points}\n");
    assert!(file.windows(head.len()).any(|text| text == head.as_bytes()), "{message}");
    assert!(0.5 * points < of_soil && of_soil < points, "{message}");
    assert!((megabytes - file.len() as f64 * 1e-6).abs() < 0.051, "{message}");
}
