//! Labels are exact, pixel by pixel.
//!
//! Rationale: networks learn the labels as they are. A label must be the object at the pixel's centre: not a neighbour,
//! not the majority of the pixel, and independent of light and material.
//!
//! Expected: for a quadrilateral, the label is the point-in-polygon test of the pixel's centre; for a masked leaf, the
//! mask's value there; for a whole field, the nearest of all triangles, all computed in double precision without
//! Embree. If the centre is within a thousandth of a pixel of an edge, either side may win. Lights, materials and
//! samples change nothing. Files hold the same numbers. Source: geometry; OpenCV's camera model for distorted images.

use crate::common::pictures;
use crate::common::program::{self, SMALL};
use crate::common::scenes::{sphere, square};
use furrow_base::geometry::{AlphaMask, Intersect, Mesh, Ray, Window};
use furrow_base::math::{Mat3, Vec3, vec3};
use furrow_base::sampling::{Purpose, Stream};
use furrow_field::assemble::Options;
use furrow_field::{Field, assemble};
use furrow_optics::sensor::{Camera, Distortion, Pose};
use furrow_output::{Provenance, Spp};
use furrow_render::accel::{BruteForce, EmbreeAccel};
use furrow_render::film::{Film, Filter, Pixel};
use furrow_render::material::Material;
use furrow_render::render::label::NONE;
use furrow_render::render::{LabelMap, label};
use furrow_render::scene::tag::{Class, Tag};
use furrow_render::scene::{Part, Scene};
use std::path::Path;
use std::sync::Arc;

/// Distance to an edge, in pixels, within which single precision may fail.
const DOUBT: f64 = 1e-3;

fn part(mesh: Mesh, mask: Option<Arc<AlphaMask>>, tag: Tag) -> Part {
    Part { mesh: Arc::new(mesh), mask, material: 0, tag, instance: None }
}

#[allow(clippy::large_types_passed_by_value, reason = "the scene takes the camera")]
fn scene(parts: Vec<Part>, camera: Camera) -> Scene {
    Scene { parts, materials: Vec::new(), lights: Vec::new(), camera, haze: None, filter: Filter::Box.footprint() }
}

fn labels_of(scene: &Scene) -> LabelMap {
    let geometry = EmbreeAccel::build(&scene.surfaces(), 1).expect("an accelerator");
    label(&geometry, &scene.parts, &scene.camera, Window::full(scene.camera.width(), scene.camera.height()))
}

/// Returns part + 1 for each pixel, 0 for no part.
fn ids(parts: &[u32]) -> Vec<u32> {
    parts.iter().map(|p| p.wrapping_add(1)).collect()
}

/// Inverts a distortion by step halving; it shares only the distortion model with the renderer's Newton iteration.
fn undistort(d: &Distortion, to: [f64; 2]) -> [f64; 2] {
    let model = |[x, y]: [f64; 2]| {
        let r2 = x * x + y * y;
        let radial = 1.0 + d.k1 * r2 + d.k2 * r2 * r2 + d.k3 * r2 * r2 * r2;
        [
            x * radial + 2.0 * d.p1 * x * y + d.p2 * (r2 + 2.0 * x * x),
            y * radial + d.p1 * (r2 + 2.0 * y * y) + 2.0 * d.p2 * x * y,
        ]
    };
    let mut at = to;
    for _ in 0..200 {
        let [x, y] = model(at);
        at = [at[0] + 0.5 * (to[0] - x), at[1] + 0.5 * (to[1] - y)];
    }
    at
}

/// Returns the pixel's centre on the camera's plane z = 1, by the pinhole model.
fn centre(camera: &Camera, x: u32, y: u32) -> [f64; 2] {
    let [fx, fy, cx, cy] = camera.intrinsics();
    let lens = camera.distortion().polynomials().expect("a lens of these tests has polynomials alone");
    undistort(&lens, [(f64::from(x) + 0.5 - cx) / fx, (f64::from(y) + 0.5 - cy) / fy])
}

/// Projects a world point onto that plane.
fn onto_plane(camera: &Camera, p: Vec3) -> [f64; 2] {
    let pose = camera.pose();
    let d = p.as_dvec3() - pose.position.as_dvec3();
    let along = |axis: Vec3| axis.as_dvec3().dot(d);
    let depth = along(pose.axes.z_axis);
    assert!(depth > 0.0, "behind the camera");
    [along(pose.axes.x_axis) / depth, along(pose.axes.y_axis) / depth]
}

/// Returns whether a point is in a convex polygon, and its distance to the polygon's outline.
fn in_polygon(polygon: &[[f64; 2]], p: [f64; 2]) -> (bool, f64) {
    let mut sides = [false; 2];
    let mut distance = f64::INFINITY;
    for (i, a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (e, d) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
        sides[usize::from(e[0] * d[1] - e[1] * d[0] > 0.0)] = true;
        let t = ((e[0] * d[0] + e[1] * d[1]) / (e[0] * e[0] + e[1] * e[1])).clamp(0.0, 1.0);
        distance = distance.min((d[0] - t * e[0]).hypot(d[1] - t * e[1]));
    }
    (sides != [true, true], distance)
}

const LENSES: [Distortion; 3] = [
    Distortion { k1: 0.0, k2: 0.0, p1: 0.0, p2: 0.0, k3: 0.0 },
    Distortion { k1: -0.21, k2: 0.06, p1: 1.5e-3, p2: -1e-3, k3: -0.01 },
    Distortion { k1: 0.12, k2: 0.02, p1: -2e-3, p2: 1e-3, k3: 0.0 },
];

fn eye(lens: Distortion, position: Vec3, target: Vec3) -> Camera {
    let pose = Pose::look_at(position, target).expect("a direction");
    Camera::new((160, 120), [150.0, 148.0], [82.3, 58.9], lens, pose).expect("a camera")
}

#[test]
fn a_quadrilaterals_label_is_the_point_in_polygon_test_of_every_pixel_centre() {
    let mut s = Stream::of(8, 0, Purpose::Test, 0);
    for (k, lens) in LENSES.into_iter().enumerate() {
        for round in 0..10 {
            let camera = eye(lens, vec3(s.range32(-0.3, 0.3), -0.6, s.range32(0.7, 1.2)), vec3(0.0, 0.1, 0.0));
            let mut mesh = square(Vec3::ZERO, s.range32(0.2, 0.7));
            mesh.transform(
                Mat3::from_rotation_z(s.range32(0.0, 6.0)) * Mat3::from_rotation_x(s.range32(-0.5, 0.5)),
                Vec3::ZERO,
            );
            let polygon: Vec<[f64; 2]> = mesh.positions.iter().map(|p| onto_plane(&camera, *p)).collect();
            let tag = Tag { class: Class::Crop, plant: 1, leaf: 1 };
            let map = labels_of(&scene(vec![part(mesh, None, tag)], camera));
            let [fx, ..] = camera.intrinsics();
            let (mut expected, mut doubtful) = (Vec::new(), 0);
            for i in 0..160 * 120 {
                let (inside, distance) = in_polygon(&polygon, centre(&camera, i % 160, i / 160));
                let is = u32::from(map.parts[i as usize] != NONE);
                let doubt = distance * fx < DOUBT;
                doubtful += u32::from(doubt && is != u32::from(inside));
                expected.push(if doubt { is } else { u32::from(inside) });
            }
            let count: u32 = expected.iter().sum();
            assert!(count > 500 && count < 160 * 120, "lens {k}, {round}: {count} pixels inside are too few");
            pictures::same(&format!("quadrilateral-{k}-{round}"), 160, &ids(&map.parts), &expected);
            assert!(doubtful <= 2, "lens {k}, {round}: {doubtful} ambiguous pixels");
            for (part, tag_there) in map.parts.iter().zip(&map.tags) {
                assert_eq!(*tag_there, if *part == NONE { Tag::default() } else { tag });
            }
        }
    }
}

/// Rationale: most label edges are mask edges. Expected: the mask's value at the texel under the pixel's centre,
/// projected onto the leaf's plane in double precision.
#[test]
fn a_masked_leafs_label_is_its_masks_value_under_every_pixel_centre() {
    const SIZE: (u32, u32) = (97, 61);
    let texel = |x: i64, y: i64| {
        let (u, v) = ((x as f64 + 0.5) / f64::from(SIZE.0) - 0.5, (y as f64 + 0.5) / f64::from(SIZE.1));
        x >= 0
            && y >= 0
            && x < 97
            && y < 61
            && u.abs() < 0.46 * (std::f64::consts::PI * v).sin() * (0.8 + 0.2 * (50.0 * v).cos())
    };
    let mask = Arc::new(AlphaMask::new(SIZE.0, SIZE.1, |x, y| texel(i64::from(x), i64::from(y))));
    let mut s = Stream::of(9, 0, Purpose::Test, 0);
    for (k, lens) in LENSES.into_iter().enumerate() {
        let camera = eye(lens, vec3(s.range32(-0.2, 0.2), -0.3, 0.8), vec3(0.0, 0.05, 0.0));
        let mut mesh = square(Vec3::ZERO, 0.6);
        mesh.transform(Mat3::from_rotation_z(0.7) * Mat3::from_rotation_x(0.3), vec3(0.01, 0.02, 0.0));
        let corners: Vec<glam::DVec3> = mesh.positions.iter().map(|p| p.as_dvec3()).collect();
        // Texture coordinates (0, 1), (1, 1), (0, 0) are at corners 0, 1, 3.
        let (origin, along_u, against_v) = (corners[3], corners[1] - corners[0], corners[0] - corners[3]);
        let normal = along_u.cross(against_v);
        let map = labels_of(&scene(vec![part(mesh, Some(mask.clone()), Tag::default())], camera));
        let pose = camera.pose();
        let eye = pose.position.as_dvec3();
        let (mut expected, mut doubtful) = (Vec::new(), 0);
        for i in 0..160 * 120 {
            let [x, y] = centre(&camera, i % 160, i / 160);
            let direction =
                pose.axes.x_axis.as_dvec3() * x + pose.axes.y_axis.as_dvec3() * y + pose.axes.z_axis.as_dvec3();
            let at = |direction: glam::DVec3| {
                let p = eye + direction * ((origin - eye).dot(normal) / direction.dot(normal)) - origin;
                let u = p.dot(along_u) / along_u.length_squared() * f64::from(SIZE.0);
                let v = p.dot(against_v) / against_v.length_squared() * f64::from(SIZE.1);
                u32::from(texel(u.floor() as i64, v.floor() as i64))
            };
            let inside = at(direction);
            let is = u32::from(map.parts[i as usize] != NONE);
            // Ambiguous: a thousandth of a pixel to the side the result differs.
            let step = DOUBT / camera.intrinsics()[0];
            let sides = [(step, 0.0), (-step, 0.0), (0.0, step), (0.0, -step)];
            let doubt = sides.iter().any(|(dx, dy)| {
                at(direction + pose.axes.x_axis.as_dvec3() * *dx + pose.axes.y_axis.as_dvec3() * *dy) != inside
            });
            doubtful += u32::from(doubt && is != inside);
            expected.push(if doubt { is } else { inside });
        }
        assert!(expected.iter().sum::<u32>() > 1500, "lens {k} sees too little of the leaf");
        pictures::same(&format!("masked-leaf-{k}"), 160, &ids(&map.parts), &expected);
        assert!(doubtful <= 2, "lens {k}: {doubtful} ambiguous pixels");
    }
}

/// Returns the nearest part at every pixel's centre and its distance, by testing each triangle at the pixels that its
/// corners span. It shares only the rays with Embree.
fn every_triangle(scene: &Scene) -> (Vec<u32>, Vec<f32>) {
    let camera = &scene.camera;
    let (w, h) = (camera.width(), camera.height());
    let surfaces = scene.surfaces();
    let brute = BruteForce::new(&surfaces);
    let rays: Vec<Ray> = (0..w * h)
        .map(|i| {
            let (origin, direction) = camera.centre_ray(i % w, i / w);
            Ray::new(origin, direction)
        })
        .collect();
    let (mut parts, mut distances) = (vec![NONE; rays.len()], vec![f32::INFINITY; rays.len()]);
    let straight = camera.distortion().is_none();
    for (p, part) in scene.parts.iter().enumerate() {
        let seen: Vec<_> = part.positions().map(|q| camera.pose().point_to_camera(q)).collect();
        let image: Vec<_> = seen.iter().map(|q| camera.project_camera(*q)).collect();
        for (t, corners) in part.mesh.triangles.iter().enumerate() {
            let corners = corners.map(|i| i as usize);
            if corners.iter().all(|i| seen[*i][2] <= 0.0) {
                continue;
            }
            let (mut lo, mut hi) = ([0.0, 0.0], [f64::from(w), f64::from(h)]);
            if let [Some(a), Some(b), Some(c)] = corners.map(|i| image[i]) {
                for axis in 0..2 {
                    let (least, most) = (a[axis].min(b[axis]).min(c[axis]), a[axis].max(b[axis]).max(c[axis]));
                    // A lens bends straight edges outward by less than half the triangle's size.
                    let margin = if straight { 0.05 } else { 0.05 + 0.5 * (most - least) };
                    (lo[axis], hi[axis]) = (least - margin, most + margin);
                }
            }
            let first = |v: f64| (v - 0.5).ceil().max(0.0) as u32;
            let last = |v: f64, n: u32| ((v - 0.5).floor() + 1.0).clamp(0.0, f64::from(n)) as u32;
            for y in first(lo[1])..last(hi[1], h) {
                for x in first(lo[0])..last(hi[0], w) {
                    let i = (y * w + x) as usize;
                    if let Some(hit) = brute.triangle(&rays[i], p as u32, t as u32)
                        && hit.t < distances[i]
                    {
                        (parts[i], distances[i]) = (p as u32, hit.t);
                    }
                }
            }
        }
    }
    (parts, distances)
}

/// Compares Embree's label map with that of all triangles. A pixel may differ only if both hits are equally far, or if
/// a ray a thousandth of a pixel to the side gives Embree's result for the triangles too.
fn check_every_pixel(name: &str, scene: &Scene) {
    let map = labels_of(scene);
    let (parts, distances) = every_triangle(scene);
    let camera = &scene.camera;
    let surfaces = scene.surfaces();
    let brute = BruteForce::new(&surfaces);
    let mut expected = parts.clone();
    let mut doubtful = 0;
    let wrong: Vec<usize> = (0..parts.len()).filter(|i| map.parts[*i] != parts[*i]).collect();
    for &i in wrong.iter().take(40) {
        let (x, y) = (i as u32 % camera.width(), i as u32 / camera.width());
        let (origin, direction) = camera.centre_ray(x, y);
        let step = (DOUBT as f32) * camera.pixel_angle();
        let axes = camera.pose().axes;
        let sides = [(0.0, 0.0), (step, 0.0), (-step, 0.0), (0.0, step), (0.0, -step)];
        let excused = sides.iter().any(|(dx, dy)| {
            let ray = Ray::new(origin, (direction + axes.x_axis * *dx + axes.y_axis * *dy).normalize());
            let aside = brute.closest(&ray);
            aside.map_or(NONE, |h| h.part) == map.parts[i]
                || (map.parts[i] != NONE && {
                    let count = scene.parts[map.parts[i] as usize].mesh.triangles.len() as u32;
                    let same_distance =
                        |t| brute.triangle(&ray, map.parts[i], t).is_some_and(|h| (h.t - distances[i]).abs() < 2e-6);
                    (0..count).any(same_distance)
                })
        });
        if excused {
            doubtful += 1;
            expected[i] = map.parts[i];
        }
    }
    let mut seen = map.parts.clone();
    seen.sort_unstable();
    seen.dedup();
    eprintln!(
        "{name}: {} pixels show {} of {} parts, {doubtful} ambiguous",
        parts.len(),
        seen.len(),
        scene.parts.len()
    );
    pictures::same(&format!("every-triangle-{name}"), camera.width(), &ids(&map.parts), &ids(&expected));
    assert!(doubtful * 4000 <= parts.len(), "{name}: {doubtful} of {} pixels are ambiguous", parts.len());
}

fn open(page: &Path, options: &Options) -> Field {
    assemble::field(page, options).unwrap_or_else(|e| panic!("{}: {e}", page.display()))
}

#[test]
fn every_pixel_of_the_main_scene_shows_the_nearest_of_all_triangles() {
    let field =
        open(Path::new("scenes/field.ron"), &Options { width: Some(324), height: Some(242), ..Options::default() });
    check_every_pixel("field", &field.scene);
}

#[test]
fn every_pixel_of_the_teaching_scenes_shows_the_nearest_of_all_triangles() {
    check_every_pixel("small", &open(Path::new(SMALL), &Options::default()).scene);
    let mut pages: Vec<_> = std::fs::read_dir("scenes").unwrap().map(|e| e.unwrap().path()).collect();
    pages.retain(|p| {
        p.extension().is_some_and(|e| e == "ron") && p.file_name().unwrap().to_string_lossy().starts_with(['0', '1'])
    });
    pages.sort();
    for page in pages {
        let field = open(&page, &Options { width: Some(90), ..Options::default() });
        check_every_pixel(&page.file_stem().unwrap().to_string_lossy(), &field.scene);
    }
}

/// Rationale: the kind of the part at a pixel distinguishes flowers from leaves. Expected: at BBCH 65, the tutorial
/// scene shows flowers, buds, heads and pods, all of them part of a plant but of no leaf; at BBCH 19 none of these.
#[test]
fn flowers_are_labelled_as_the_organs_that_they_are() {
    use furrow_grow::plant::OrganKind::{Bud, Flower, Head, Pod};
    let kinds = [Flower, Bud, Head, Pod];
    let counts = |text: &str| {
        let field = program::field(text, &Options { width: Some(480), ..Options::default() });
        let map = labels_of(&field.scene);
        let mut counts = [0; 4];
        for (part, tag) in map.parts.iter().zip(&map.tags).filter(|(part, _)| **part != NONE) {
            let Some(kind) = field.kinds[*part as usize].organ() else { continue };
            let Some(i) = kinds.iter().position(|k| *k == kind) else { continue };
            assert!(tag.plant > 0 && tag.leaf == 0, "{kind:?} {tag:?}");
            counts[i] += 1;
        }
        counts
    };
    let root = env!("CARGO_MANIFEST_DIR");
    let text = std::fs::read_to_string("scenes/flowering.ron").unwrap();
    let text = text.replace("\"species/", &format!("\"{root}/scenes/species/")).replace("\"../", &format!("\"{root}/"));
    let flowering = counts(&text);
    assert!(flowering.iter().all(|count| *count > 10), "{flowering:?}");
    assert_eq!(counts(&text.replace("Bbch(65)", "Bbch(19)")), [0; 4]);
}

/// Rationale: a test must be able to fail. Expected: the field shifted by half a pixel has another label map.
#[test]
fn the_test_itself_finds_labels_that_are_half_a_pixel_off() {
    let mut field = program::field(&program::small_text(), &Options::default());
    let straight = labels_of(&field.scene).parts;
    let [fx, fy, cx, cy] = field.scene.camera.intrinsics();
    let pose = *field.scene.camera.pose();
    field.scene.camera = Camera::new((96, 72), [fx, fy], [cx + 0.5, cy], Distortion::default(), pose).unwrap();
    let aside = every_triangle(&field.scene).0;
    let differ = straight.iter().zip(&aside).filter(|(a, b)| a != b).count();
    assert!(differ > 50, "only {differ} pixels differ");
}

/// Checks that every leaf belongs to a plant and every plant to a class, consistent with the records.
fn check_tags(field: &Field, map: &LabelMap) {
    for tag in &map.tags {
        assert_eq!(tag.plant > 0, tag.class != Class::Soil, "{tag:?}: only plants are crop or weed");
        assert!(tag.leaf == 0 || tag.plant > 0, "{tag:?}: a leaf without a plant");
        if tag.plant > 0 {
            let record = field.plants.iter().find(|p| p.number == tag.plant).expect("a record of every plant in view");
            assert_eq!((record.number, record.class), (tag.plant, tag.class), "{tag:?} is not {record:?}");
            assert!(tag.leaf <= record.leaves, "{tag:?}: plant {} has {} leaves", record.number, record.leaves);
        }
    }
    for part in &field.scene.parts {
        assert!(part.tag.leaf == 0 || part.tag.plant > 0, "{:?}", part.tag);
    }
}

#[test]
fn light_and_material_change_no_label() {
    let mut field = program::field(&program::small_text(), &Options::default());
    let before = labels_of(&field.scene);
    check_tags(&field, &before);
    assert!(before.tags.iter().filter(|t| t.leaf > 0).count() > 100, "too few leaf pixels to test anything");
    field.scene.lights.clear();
    for material in &mut field.scene.materials {
        *material = Material::Plain(furrow_optics::bsdf::Bsdf::examples()[0].1);
    }
    field.scene.filter = Filter::Box.footprint();
    assert_eq!(before, labels_of(&field.scene));
    // The same with changes in the scene file: no lights, another filter.
    let text = program::small_text();
    let from = text.find("lights: [").unwrap();
    let to = from + text[from..].find("],\n").unwrap() + 1;
    let night = format!("{}lights: [], filter: Box{}", &text[..from], &text[to..]);
    let night = program::field(&night, &Options::default());
    assert!(night.warnings.iter().any(|w| w.contains("black")), "{:?}", night.warnings);
    assert_eq!(before, labels_of(&night.scene));
}

#[test]
fn a_crop_holds_the_labels_of_its_part_of_the_image() {
    let field = program::field(&program::small_text(), &Options::default());
    let scene = &field.scene;
    let geometry = EmbreeAccel::build(&scene.surfaces(), 1).unwrap();
    let take = |window| label(&geometry, &scene.parts, &scene.camera, window);
    let full = take(Window::full(96, 72));
    for window in [
        Window { x0: 0, y0: 0, x1: 1, y1: 1 },
        Window { x0: 13, y0: 7, x1: 60, y1: 50 },
        Window { x0: 95, y0: 0, x1: 96, y1: 72 },
        Window { x0: 0, y0: 40, x1: 96, y1: 41 },
    ] {
        let crop = take(window);
        assert_eq!(crop.window, window);
        for i in 0..window.width() * window.height() {
            let (x, y) = (window.x0 + i % window.width(), window.y0 + i / window.width());
            let whole = (y * 96 + x) as usize;
            assert_eq!(
                (crop.parts[i as usize], crop.tags[i as usize]),
                (full.parts[whole], full.tags[whole]),
                "{window:?} {x} {y}"
            );
        }
    }
}

fn palette(path: &Path) -> Vec<u8> {
    let decoder = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(path).unwrap()));
    decoder.read_info().unwrap().info().palette.as_ref().expect("a palette").to_vec()
}

/// Expected: files hold the numbers of the map; the palette is black, green and red for soil, crop and weed, as in Di
/// Cicco et al. 2017; class areas add up to the image.
#[test]
fn label_files_read_back_as_the_label_map() {
    let field = program::field(&program::small_text(), &Options::default());
    let map = labels_of(&field.scene);
    let (w, h) = (map.window.width(), map.window.height());
    let film = Film { window: map.window, pixels: vec![Pixel::default(); (w * h) as usize] };
    let photograph = field.photograph(&film);
    let provenance = Provenance {
        scene_hash: field.hash.clone(),
        seed: 0,
        index: 0,
        light: 0,
        spp: Spp::Uniform(1),
        integrator: "path".into(),
        deviations: Vec::new(),
        kernels: "none".into(),
    };
    let (_keep, out) = program::scratch();
    let tags = furrow_output::CameraTags::of(&field);
    let files = furrow_output::image_files(&film, &map, &photograph, &provenance, &tags).unwrap();
    furrow_output::write_files(&out, &files).unwrap();
    let (sw, sh, classes) = furrow_output::read_indexed(&out.join("semantics.png")).unwrap();
    assert_eq!((sw, sh), (w, h));
    let of = |f: fn(&Tag) -> u32| map.tags.iter().map(f).collect::<Vec<u32>>();
    assert_eq!(classes.iter().map(|c| u32::from(*c)).collect::<Vec<_>>(), of(|t| t.class as u32));
    assert_eq!(palette(&out.join("semantics.png")), [0, 0, 0, 0, 255, 0, 255, 0, 0]);
    assert_eq!(furrow_output::read_numbers(&out.join("plants.png")).unwrap(), (w, h, of(|t| t.plant)));
    assert_eq!(furrow_output::read_numbers(&out.join("leaves.png")).unwrap(), (w, h, of(|t| u32::from(t.leaf))));
    let areas = Class::ALL.map(|c| map.tags.iter().filter(|t| t.class == c).count());
    assert_eq!(areas.iter().sum::<usize>(), (w * h) as usize, "{areas:?}");
    assert!(areas.iter().all(|a| *a > 20), "{areas:?}: a class is missing");
    // A plant has one class: the plant numbers are unique across classes.
    let mut class_of = std::collections::BTreeMap::new();
    for tag in &map.tags {
        assert_eq!(*class_of.entry(tag.plant).or_insert(tag.class), tag.class, "plant {} has two classes", tag.plant);
    }
}

/// Expected: for a plane, the depth at which the ray through the pixel's centre hits it, computed in double precision,
/// and the plane's normal on the visible side; no value where there is no surface.
#[test]
fn depth_and_normals_are_those_of_a_plane_through_any_lens_and_from_both_sides() {
    let mut s = Stream::of(9, 0, Purpose::Test, 0);
    for lens in LENSES {
        for height in [0.8_f32, -0.8] {
            let camera = eye(lens, vec3(s.range32(-0.3, 0.3), -0.5, height), vec3(0.0, 0.1, 0.0));
            let mut mesh = square(Vec3::ZERO, 0.6);
            mesh.transform(Mat3::from_rotation_x(s.range32(-0.3, 0.3)), vec3(0.02, 0.0, 0.01));
            let [a, b, c] = mesh.corners(0).map(Vec3::as_dvec3);
            let upper = (b - a).cross(c - a).normalize();
            let pose = *camera.pose();
            let [right, down, forward] = [pose.axes.x_axis, pose.axes.y_axis, pose.axes.z_axis].map(Vec3::as_dvec3);
            let map = labels_of(&scene(vec![part(mesh, None, Tag::default())], camera));
            let mut hits = 0;
            for i in 0..160 * 120 {
                let (depth, normal) = (map.depth[i as usize], map.normals[i as usize]);
                if map.parts[i as usize] == NONE {
                    assert!(depth == f32::INFINITY && normal == Vec3::ZERO);
                    continue;
                }
                hits += 1;
                let [x, y] = centre(&camera, i % 160, i / 160);
                // The ray has this direction at unit depth, so the distance along it to the plane is the depth.
                let through = right * x + down * y + forward;
                let expected = upper.dot(a - pose.position.as_dvec3()) / upper.dot(through);
                assert!((f64::from(depth) - expected).abs() < 1e-5, "{depth} for {expected}");
                let seen = if upper.dot(through) < 0.0 { upper } else { -upper };
                assert!((normal.as_dvec3() - seen).length() < 1e-5, "{normal} for {seen}");
            }
            assert!(hits > 3000, "{hits}");
        }
    }
}

/// Expected: on a sphere, smooth normals up to its outline, exact except for the angular error of a mesh with 60 bands.
/// In a field, unit normals that face the camera wherever there is a surface, and depths that agree with the distances
/// of all triangles.
#[test]
fn normals_are_smooth_and_face_the_camera_everywhere() {
    let camera = eye(Distortion::default(), vec3(0.2, -0.6, 0.9), Vec3::ZERO);
    let ball = sphere(Vec3::ZERO, 0.25, 60);
    let map = labels_of(&scene(vec![part(ball, None, Tag::default())], camera));
    let mut seen = 0;
    for i in (0..160 * 120).filter(|i| map.parts[*i as usize] != NONE) {
        let (origin, direction) = camera.centre_ray(i % 160, i / 160);
        let normal = map.normals[i as usize];
        assert!(normal.dot(direction) <= 0.0 && (normal.length() - 1.0).abs() < 1e-5);
        let p = origin
            + direction
                * (map.depth[i as usize] / camera.axis_cosine([f64::from(i % 160) + 0.5, f64::from(i / 160) + 0.5]));
        // Near the outline, the triangle's geometric normal is used instead.
        let limit = if normal.dot(direction) < -0.1 { 0.005 } else { 0.06 };
        assert!(normal.distance(p.normalize()) < limit, "{normal} at {p}");
        seen += 1;
    }
    assert!(seen > 2000, "{seen}");

    let field = program::field(&program::small_text(), &Options::default());
    let map = labels_of(&field.scene);
    let (parts, distances) = every_triangle(&field.scene);
    let camera = &field.scene.camera;
    let mut compared = 0;
    for i in 0..parts.len() {
        let (x, y) = (i as u32 % camera.width(), i as u32 / camera.width());
        let (_, direction) = camera.centre_ray(x, y);
        assert_eq!(map.parts[i] == NONE, map.depth[i] == f32::INFINITY);
        if map.parts[i] != NONE {
            assert!(map.normals[i].dot(direction) <= 0.0 && (map.normals[i].length() - 1.0).abs() < 1e-5);
        }
        if map.parts[i] == parts[i] && parts[i] != NONE {
            let expected = distances[i] * camera.axis_cosine([f64::from(x) + 0.5, f64::from(y) + 0.5]);
            // Within a thousandth of a pixel of an edge, another layer of the same part may win.
            compared += usize::from((map.depth[i] - expected).abs() < 2e-5);
        }
    }
    assert!(compared * 1000 > parts.len() * 998, "only {compared} depths of {} agree", parts.len());
}

/// Rationale: volunteer potatoes are weeds, and a cover crop may be a weed elsewhere. Expected: the list in the scene file
/// decides on the class, for plants, pixels and the species table, and a warning names the species. Source: the lists.
#[test]
fn the_list_of_a_species_decides_its_class() {
    let (text, listed) = (program::small_text(), [("sugar_beet", "beet"), ("chenopodium", "fat hen")]);
    let [crop, weed] =
        listed.map(|(file, _)| format!("species: \"{}/tests/ref/species/{file}.ron\"", env!("CARGO_MANIFEST_DIR")));
    let swapped = text.replacen(&crop, "species: \"?\"", 1).replace(&weed, &crop).replace("species: \"?\"", &weed);
    for (text, fat_hen, warnings) in [(&text, Class::Weed, 0), (&swapped, Class::Crop, 2)] {
        let field = program::field(text, &Options { width: Some(32), ..Options::default() });
        let of: Vec<_> = field.plants.iter().filter(|plant| plant.species == "fat hen").collect();
        assert!(!of.is_empty() && of.iter().all(|plant| plant.class == fat_hen), "{fat_hen:?}");
        let kinds = of.iter().map(|plant| &field.species[usize::from(plant.kind) - 1]);
        assert!(kinds.into_iter().all(|kind| (kind.name.as_str(), kind.class) == ("fat hen", fat_hen)));
        let numbers: Vec<u32> = of.iter().map(|plant| plant.number).collect();
        let tags = field.scene.tags();
        assert!(tags.iter().filter(|tag| numbers.contains(&tag.plant)).all(|tag| tag.class == fat_hen));
        let told: Vec<_> = field.warnings.iter().filter(|words| words.contains("` lists it")).collect();
        assert_eq!(told.len(), warnings, "{told:?}");
        // Single plants keep the role of their species file.
        let single = field.plants.iter().find(|plant| plant.species == "sugar beet" && plant.age_days == 20.0);
        assert_eq!(single.map(|plant| plant.class), Some(Class::Crop));
    }
}
