//! Extents: the number of pixels of every plant and leaf that are visible, hidden by others, or outside the frame.
//!
//! Rationale: a detector's evaluation needs the visible fraction to decide which plants could have been found. It must
//! be consistent with the label pixels, and rounding must never make the visible area larger than the whole.
//!
//! Expected: for every plant and leaf, the counts that Embree gives for that plant or leaf alone, pixel centre by pixel
//! centre, inside the image and beyond it, except for centres within a thousandth of a pixel of an outline; for simple
//! shapes, the areas of geometry; always visible ≤ unoccluded ≤ whole; the same numbers with any number of threads.
//! Source: geometry.

use crate::common::program::{field, small_text};
use crate::common::scenes::{camera, square};
use furrow_base::geometry::{Intersect, Mesh, Ray, Window};
use furrow_base::math::{Vec3, vec3};
use furrow_field::assemble::{self, Options};
use furrow_optics::sensor::{Camera, Distortion};
use furrow_render::accel::{EmbreeAccel, Surface};
use furrow_render::film::Filter;
use furrow_render::render::{self, Extent, LabelMap, extents, label};
use furrow_render::scene::tag::{Class, Tag};
use furrow_render::scene::{Part, Scene};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;

type Extents = BTreeMap<(u32, u16), Extent>;

fn labels_of(scene: &Scene, window: Window) -> LabelMap {
    let geometry = EmbreeAccel::build(&scene.surfaces(), 1).expect("an accelerator");
    label(&geometry, &scene.parts, &scene.camera, window)
}

fn full(scene: &Scene) -> Window {
    Window::full(scene.camera.width(), scene.camera.height())
}

/// Number of pixel centres that a set of parts covers on its own, by Embree: inside the window, and in total.
fn alone(scene: &Scene, window: Window, is: impl Fn(&Part) -> bool) -> [u32; 2] {
    let surfaces: Vec<Surface<'_>> = scene.parts.iter().filter(|p| is(p)).map(Part::surface).collect();
    let geometry = EmbreeAccel::build(&surfaces, 1).expect("an accelerator");
    let (camera, mut counts) = (&scene.camera, [0; 2]);
    let (w, h) = (camera.width() as i32, camera.height() as i32);
    for y in -h..2 * h {
        for x in -w..2 * w {
            let Some((origin, direction)) = camera.ray_beyond(x, y) else { continue };
            if geometry.closest(&Ray::new(origin, direction)).is_some() {
                let inside =
                    x >= window.x0 as i32 && x < window.x1 as i32 && y >= window.y0 as i32 && y < window.y1 as i32;
                counts[0] += u32::from(inside);
                counts[1] += 1;
            }
        }
    }
    counts
}

/// Checks that the counts are ordered, leaf counts do not exceed those of their plants, and visible counts equal the
/// label pixels.
fn check_order(found: &Extents, labels: &LabelMap) {
    let mut pixels: BTreeMap<(u32, u16), u32> = BTreeMap::new();
    for tag in labels.tags.iter().filter(|t| t.plant > 0) {
        *pixels.entry((tag.plant, 0)).or_default() += 1;
        if tag.leaf > 0 {
            *pixels.entry((tag.plant, tag.leaf)).or_default() += 1;
        }
    }
    for (key, Extent { visible, unoccluded, whole }) in found {
        assert!(visible <= unoccluded && unoccluded <= whole && *whole > 0, "{key:?}: {visible} {unoccluded} {whole}");
        let plant = found[&(key.0, 0)];
        assert!(*visible <= plant.visible && *unoccluded <= plant.unoccluded && *whole <= plant.whole, "{key:?}");
        assert_eq!(*visible, pixels.remove(key).unwrap_or(0), "{key:?}");
    }
    assert!(pixels.is_empty(), "visible but without an extent: {pixels:?}");
}

/// Compares every plant and leaf with Embree's counts; a few pixels in total may differ.
fn check(scene: &Scene, window: Window) -> Extents {
    let labels = labels_of(scene, window);
    let found = extents(scene, &labels);
    check_order(&found, &labels);
    let (mut compared, mut doubtful) = (0, 0);
    let plants: BTreeSet<u32> = scene.parts.iter().map(|p| p.tag.plant).filter(|p| *p > 0).collect();
    for plant in plants {
        let leaves: BTreeSet<u16> = scene.parts.iter().filter(|p| p.tag.plant == plant).map(|p| p.tag.leaf).collect();
        let whole = alone(scene, window, |p| p.tag.plant == plant);
        if whole[0] == 0 {
            let few = found.get(&(plant, 0)).map_or(0, |e| e.unoccluded);
            assert!(few < 2, "plant {plant} is outside the window, but {few} of its pixels are counted");
            continue;
        }
        for leaf in leaves.into_iter().chain([0]).collect::<BTreeSet<_>>() {
            let expected =
                if leaf == 0 { whole } else { alone(scene, window, |p| (p.tag.plant, p.tag.leaf) == (plant, leaf)) };
            let is = found.get(&(plant, leaf)).copied().unwrap_or_default();
            let off = is.unoccluded.abs_diff(expected[0]) + is.whole.abs_diff(expected[1]);
            assert!(off * 100 <= 100 + expected[1], "plant {plant} leaf {leaf}: {is:?} for {expected:?}");
            doubtful += off;
            compared += expected[1];
        }
    }
    assert!(doubtful * 2000 <= compared, "{doubtful} of {compared} pixels differ");
    found
}

/// Builds the small scene with the given lens distortion.
fn small(lens: Distortion) -> Scene {
    let mut scene = field(&small_text(), &Options::default()).scene;
    let [fx, fy, cx, cy] = scene.camera.intrinsics();
    let size = (scene.camera.width(), scene.camera.height());
    scene.camera = Camera::new(size, [fx, fy], [cx, cy], lens, *scene.camera.pose()).expect("a camera");
    scene
}

#[test]
fn extents_are_those_of_each_plant_and_leaf_alone() {
    let scene = small(Distortion::default());
    let found = check(&scene, full(&scene));
    let hidden = found.values().filter(|e| e.visible < e.unoccluded).count();
    let cut = found.values().filter(|e| e.unoccluded < e.whole).count();
    assert!(found.len() > 20 && hidden > 5 && cut > 2, "{} extents, {hidden} hidden, {cut} cut", found.len());
}

/// A closed canopy with many overlapping leaves, and models from files, whose triangles may be large.
#[test]
fn extents_hold_in_a_canopy_and_for_models() {
    for page in ["benches/canopy.ron", "scenes/07-model.ron"] {
        let options = Options { width: Some(64), ..Options::default() };
        let scene = assemble::field(Path::new(page), &options).unwrap_or_else(|e| panic!("{e}")).scene;
        assert!(!check(&scene, full(&scene)).is_empty());
    }
}

#[test]
fn extents_hold_through_a_lens_that_distorts() {
    for lens in [
        Distortion { k1: -0.21, k2: 0.06, p1: 1.5e-3, p2: -1e-3, k3: -0.01 },
        Distortion { k1: 0.12, k2: 0.02, p1: -2e-3, p2: 1e-3, k3: 0.0 },
    ] {
        let scene = small(lens);
        check(&scene, full(&scene));
    }
}

/// Expected: the window acts as the frame, so fewer pixels are inside it, and the whole stays the same.
#[test]
fn a_crop_cuts_what_lies_outside_of_it() {
    let scene = small(Distortion::default());
    let whole = extents(&scene, &labels_of(&scene, full(&scene)));
    let found = check(&scene, Window { x0: 20, y0: 11, x1: 61, y1: 50 });
    let mut less = 0;
    for (key, extent) in &found {
        assert_eq!(extent.whole, whole[key].whole, "{key:?}");
        assert!(extent.unoccluded <= whole[key].unoccluded && extent.visible <= whole[key].visible);
        less += usize::from(extent.unoccluded < whole[key].unoccluded);
    }
    assert!(less > 3 && !found.is_empty() && found.len() < whole.len(), "{less} of {} are cut", found.len());
}

/// Builds a scene of tagged squares, 0.5 m below a camera of 100 × 80 pixels; a pixel covers 2 mm at that distance.
fn squares(parts: &[(Vec3, f32, u32, u16)]) -> Scene {
    squares_in((100, 80), parts)
}

/// Builds the same scene for a camera of `size` pixels.
fn squares_in(size: (u32, u32), parts: &[(Vec3, f32, u32, u16)]) -> Scene {
    let fov = 2.0 * (0.001 * f64::from(size.0) / 0.5).atan().to_degrees();
    let eye = camera(size, vec3(0.0, 0.0, 0.5), Vec3::ZERO, fov);
    let part = |&(centre, side, plant, leaf): &(Vec3, f32, u32, u16)| {
        let class = if plant > 0 { Class::Crop } else { Class::Soil };
        Part {
            mesh: Arc::new(square(centre, side)),
            mask: None,
            material: 0,
            tag: Tag { class, plant, leaf },
            instance: None,
        }
    };
    let parts = parts.iter().map(part).collect();
    Scene { parts, materials: Vec::new(), lights: Vec::new(), camera: eye, haze: None, filter: Filter::Box.footprint() }
}

/// Expected: a leaf of 20 × 20 pixels whose right half is below another plant's leaf, a stem of 10 × 10 pixels beside
/// it, and soil that hides neither; the counts follow from geometry.
#[test]
fn a_leaf_half_hidden_by_another_is_half_visible() {
    // Side of a pixel on the plane z = 0.
    let p = 0.002;
    let at = |x: f32, y: f32, z: f32| vec3(x * p, y * p, z);
    // The upper leaf is half-way to the camera, where a pixel is half as large.
    let scene = squares(&[
        (at(0.0, 0.0, -0.001), 1.0, 0, 0),
        (at(0.0, 0.0, 0.0), 20.0 * p, 1, 1),
        (at(10.0, 0.0, 0.25), 20.0 * p, 2, 1),
        (at(-20.0, 0.0, 0.0), 10.0 * p, 1, 0),
    ]);
    let labels = labels_of(&scene, full(&scene));
    let found = extents(&scene, &labels);
    check_order(&found, &labels);
    // Projected onto the plane, the upper leaf has its centre at 20 and sides of 40 pixels, so it covers x ≥ 0.
    let expected = [
        ((1, 0), Extent { visible: 200 + 100, unoccluded: 400 + 100, whole: 500 }),
        ((1, 1), Extent { visible: 200, unoccluded: 400, whole: 400 }),
        ((2, 0), Extent { visible: 1600, unoccluded: 1600, whole: 1600 }),
        ((2, 1), Extent { visible: 1600, unoccluded: 1600, whole: 1600 }),
    ];
    assert_eq!(found, expected.into());
    assert_eq!(found[&(1, 1)].visible_fraction(), 0.5);
    // Soil hides leaves like other leaves do.
    let mut buried = scene;
    buried.parts[0].mesh = Arc::new(square(at(0.0, 0.0, 0.1), 1.0));
    let labels = labels_of(&buried, full(&buried));
    let found = extents(&buried, &labels);
    assert_eq!(found[&(1, 1)], Extent { visible: 0, unoccluded: 400, whole: 400 });
    assert_eq!((found[&(1, 1)].visible_fraction(), found[&(1, 1)].inside_fraction()), (0.0, 1.0));
}

/// Expected: a quarter of a square plant centred on the frame's corner is in the image; its leaf outside has an extent
/// with no pixels inside; a plant entirely outside the image has no extent; pixels are counted up to one image size
/// beyond each side of the frame.
#[test]
fn a_plant_cut_by_the_frame_counts_beyond_it() {
    let p = 0.002;
    let corner = vec3(-50.0 * p, 40.0 * p, 0.0);
    let scene = squares(&[
        (corner, 20.0 * p, 1, 1),
        (corner + vec3(-20.0 * p, 0.0, 0.0), 10.0 * p, 1, 2),
        (corner + vec3(-60.0 * p, 0.0, 0.0), 20.0 * p, 2, 1),
        (Vec3::ZERO, 2.0, 3, 1),
    ]);
    let labels = labels_of(&scene, full(&scene));
    let found = extents(&scene, &labels);
    check_order(&found, &labels);
    // All squares are in one plane: the labels decide which is visible where they overlap.
    let hidden = |key: (u32, u16)| (found[&key].unoccluded, found[&key].whole);
    assert_eq!(hidden((1, 1)), (100, 400));
    assert_eq!(hidden((1, 2)), (0, 100));
    assert_eq!(hidden((1, 0)), (100, 500));
    assert_eq!(found[&(1, 0)].inside_fraction(), 0.2);
    assert_eq!(hidden((3, 1)), (100 * 80, 300 * 240));
    assert_eq!(found.keys().map(|k| k.0).collect::<BTreeSet<_>>(), [1, 3].into());
}

/// Rationale: a hectare has more than 65,536 plants. Expected: of 72,000 plants, one per pixel, labels show each once,
/// and each has an extent of that pixel; none is confused with the one whose number is lower by 65,536.
#[test]
fn plants_beyond_16_bits_have_different_numbers() {
    let (w, h) = (300, 240);
    let at = |k: u32, n: u32| (k as f32 + 0.5 - 0.5 * n as f32) * 0.002;
    let plant = |k: u32| (vec3(at(k % w, w), at(k / w, h), 0.0), 0.0018, k + 1, 1);
    let parts: Vec<_> = (0..w * h).map(plant).collect();
    let scene = squares_in((w, h), &parts);
    let labels = labels_of(&scene, full(&scene));
    let mut shown: Vec<u32> = labels.tags.iter().map(|tag| tag.plant).collect();
    shown.sort_unstable();
    assert!(shown.iter().copied().eq(1..=w * h), "{} of {} plants", shown.len(), w * h);
    let found = extents(&scene, &labels);
    let one = Extent { visible: 1, unoccluded: 1, whole: 1 };
    let expected = (1..=w * h).flat_map(|number| [((number, 0), one), ((number, 1), one)]);
    assert!(found.into_iter().eq(expected));
}

/// A plant that extends past the camera must neither abort the count nor make it endless.
#[test]
fn a_leaf_that_reaches_behind_the_camera_is_counted_where_it_is_seen() {
    let mut scene = squares(&[(Vec3::ZERO, 0.04, 1, 1)]);
    // A long triangle from below the camera to above it.
    scene.parts[0].mesh = Arc::new(Mesh::smooth(
        vec![vec3(-0.02, 0.01, 0.0), vec3(0.02, 0.01, 0.0), vec3(0.0, 0.05, 0.9)],
        vec![furrow_base::math::Vec2::ZERO; 3],
        vec![[0, 1, 2]],
    ));
    let found = check(&scene, full(&scene));
    assert!(found[&(1, 1)].whole > found[&(1, 1)].unoccluded && found[&(1, 1)].visible > 100, "{found:?}");
}

#[test]
fn extents_are_the_same_at_any_number_of_threads() {
    let scene = small(Distortion::default());
    let labels = labels_of(&scene, full(&scene));
    let count = |threads| render::pool(threads).unwrap().install(|| extents(&scene, &labels));
    let one = count(1);
    assert!(!one.is_empty());
    assert!(one == count(2) && one == count(7));
}

/// Rationale: keypoints are drawn over images. Expected: each leaf of every plant has one axis in world space whose
/// ends are on that leaf's mesh, within 2 mm of its vertices; a plant with only one leaf lists only that leaf.
#[test]
fn keypoints_stand_in_the_world_where_the_leaves_do() {
    let mut ends = 0;
    for page in ["tests/ref/small.ron", "scenes/01-one-leaf.ron"] {
        let options = Options { width: Some(32), ..Options::default() };
        let grown = assemble::field(Path::new(page), &options).unwrap_or_else(|e| panic!("{e}"));
        for plant in &grown.plants {
            let parts = || grown.scene.parts.iter().filter(|p| p.tag.plant == plant.number && p.tag.leaf > 0);
            let leaves: BTreeSet<u16> = parts().map(|p| p.tag.leaf).collect();
            let recorded: Vec<u16> = plant.leaf_axes.iter().map(|a| a.leaf).collect();
            assert!(!recorded.is_empty(), "plant {} has no leaves", plant.number);
            assert_eq!(recorded, leaves.into_iter().collect::<Vec<_>>(), "plant {}", plant.number);
            for axis in &plant.leaf_axes {
                for end in [axis.base, axis.tip] {
                    let corners = parts().filter(|p| p.tag.leaf == axis.leaf).flat_map(|p| &p.mesh.positions);
                    let gap = corners.map(|p| p.distance(end)).fold(f32::MAX, f32::min);
                    assert!(gap < 2e-3, "{page}: plant {} leaf {}: {gap}", plant.number, axis.leaf);
                    ends += 1;
                }
            }
        }
    }
    assert!(ends > 40, "{ends}");
}
