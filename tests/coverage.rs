//! Coverage: the fraction of each pixel that a class covers.
//!
//! Rationale: a label gives each pixel one class, but an edge pixel shows two. Fractions must come from the samples of
//! the image itself, with the same footprint, lens and masks, so that users who mask out edges remove exactly the
//! pixels that are mixed in the image.
//!
//! Expected: for a quadrilateral, the fraction of each pixel is the area of their intersection, within the sampling
//! error; fractions sum to one; parts of one class count together. All rendering modes count the same samples. Source:
//! area of a clipped polygon (Sutherland & Hodgman 1974); variance of a fraction, p (1 − p) / n.

use crate::common::program;
use crate::common::scenes::{camera, scene, shoot, square, with_world};
use furrow_base::geometry::Window;
use furrow_base::math::{Mat3, Vec3, vec3};
use furrow_base::sampling::Points;
use furrow_field::assemble::Options;
use furrow_optics::bsdf::Bsdf;
use furrow_render::film::Film;
use furrow_render::integrator::{FalseColor, PathTracer};
use furrow_render::render::{self, Settings, coverage};
use furrow_render::scene::Scene;
use furrow_render::scene::tag::{Class, Tag};

/// Fraction of the pixel (x, y) inside a convex polygon; coordinates are in pixels.
fn area(polygon: &[[f64; 2]], x: u32, y: u32) -> f64 {
    let mut left: Vec<[f64; 2]> = polygon.to_vec();
    let (x, y) = (f64::from(x), f64::from(y));
    for (axis, limit, sign) in [(0, x, 1.0), (0, x + 1.0, -1.0), (1, y, 1.0), (1, y + 1.0, -1.0)] {
        let inside = |p: &[f64; 2]| sign * (p[axis] - limit);
        let mut cut = Vec::new();
        for (i, a) in left.iter().enumerate() {
            let b = left[(i + 1) % left.len()];
            let (da, db) = (inside(a), inside(&b));
            if da >= 0.0 {
                cut.push(*a);
            }
            if da * db < 0.0 {
                let t = da / (da - db);
                cut.push([a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]);
            }
        }
        left = cut;
    }
    let twice: f64 =
        (0..left.len()).map(|i| (left[i], left[(i + 1) % left.len()])).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum();
    0.5 * twice.abs()
}

/// Builds a tilted square without background: half is crop, the other half is weed, split into two leaves.
fn flag() -> Scene {
    let bsdf = Bsdf::examples()[0].1;
    let mut whole = square(Vec3::ZERO, 0.4);
    whole.transform(Mat3::from_rotation_z(0.4) * Mat3::from_rotation_x(0.3), vec3(0.01, 0.02, 0.0));
    // The two triangles of the square; the second is cut in two again.
    let [first, second] = [0, 1].map(|t| {
        let mut mesh = whole.clone();
        mesh.triangles = vec![whole.triangles[t]];
        mesh
    });
    let mut halves = [second.clone(), second];
    let [a, b, c] = halves[0].triangles[0];
    for (mesh, corners) in halves.iter_mut().zip([[a, b, 4], [a, 4, c]]) {
        let middle = (mesh.positions[b as usize] + mesh.positions[c as usize]) * 0.5;
        mesh.positions.push(middle);
        mesh.normals.push(mesh.normals[0]);
        mesh.uvs.push(mesh.uvs[0]);
        mesh.triangles = vec![corners];
    }
    let [third, fourth] = halves;
    let eye = camera((24, 20), vec3(0.1, -0.4, 0.6), Vec3::ZERO, 60.0);
    let mut scene = scene(vec![(first, bsdf), (third, bsdf), (fourth, bsdf)], Vec::new(), eye);
    for (part, (class, leaf)) in scene.parts.iter_mut().zip([(Class::Crop, 1), (Class::Weed, 1), (Class::Weed, 2)]) {
        part.tag = Tag { class, plant: class as u32, leaf };
    }
    scene
}

#[test]
fn a_quadrilateral_covers_of_each_pixel_the_area_that_geometry_says() {
    const SPP: u32 = 1024;
    let scene = flag();
    let film = shoot(&scene, &PathTracer::default(), SPP, 3);
    let shares = coverage(&film, &scene.tags());
    let outline = |part: usize| {
        let corners = scene.parts[part].mesh.corners(0);
        corners.map(|p| scene.camera.project_camera(scene.camera.pose().point_to_camera(p)).expect("in view"))
    };
    let (mut edges, mut chi2) = (0, 0.0);
    for (i, share) in shares.iter().enumerate() {
        let (x, y) = (i as u32 % 24, i as u32 / 24);
        let (crop, weed) = (area(&outline(0), x, y), area(&outline(1), x, y) + area(&outline(2), x, y));
        for (class, expected) in Class::ALL.into_iter().zip([1.0 - crop - weed, crop, weed]) {
            let is = f64::from(share[class as usize]);
            // Five standard deviations of independent samples, plus one sample that rounding may move across an edge.
            let deviation = (expected * (1.0 - expected)).max(0.0).sqrt() / f64::from(SPP).sqrt();
            assert!(
                (is - expected).abs() <= 5.0 * deviation + 1.5 / f64::from(SPP),
                "{x},{y} {class:?}: {is} for {expected}"
            );
            if (0.02..0.98).contains(&expected) {
                edges += 1;
                chi2 += ((is - expected) / deviation).powi(2);
            }
        }
        assert!((share.iter().sum::<f32>() - 1.0).abs() <= f32::EPSILON, "{share:?}");
    }
    assert!(edges > 60, "{edges} shares of edges");
    // Stratified samples have less variance than independent ones, also on average.
    assert!(chi2 < f64::from(edges), "{chi2} over {edges}");
}

/// Expected: another integrator uses the same camera samples and so counts the same, as do passes, a deadline and a
/// crop.
#[test]
fn every_way_of_rendering_counts_the_same_samples() {
    let field = program::field(&program::small_text(), &Options { width: Some(40), ..Options::default() });
    let scene = &field.scene;
    let window = Window::full(scene.camera.width(), scene.camera.height());
    let settings = Settings { spp: 24, seed: 5, window, points: Points::Sobol };
    let tallies = |film: &Film| film.pixels.iter().map(|p| p.tally.clone()).collect::<Vec<_>>();
    with_world(scene, 2, |world, watch| {
        let path = PathTracer::default();
        let whole = render::render(world, &path, &settings, watch).unwrap();
        assert!(whole.pixels.iter().all(|p| p.tally.iter().map(|(_, n)| n).sum::<u32>() <= p.samples));
        assert!(whole.pixels.iter().any(|p| p.tally.iter().count() > 2), "no pixel contains more than two parts");
        let ids = render::render(world, &FalseColor::Ids, &settings, watch).unwrap();
        assert_eq!(tallies(&ids), tallies(&whole));
        let mut passes = render::Progressive::new(world, &path, &settings);
        for spp in [8, 16, 24] {
            passes.advance(spp, watch).unwrap();
        }
        assert_eq!(tallies(&passes.film()), tallies(&whole));
        let crop = Window { x0: 7, y0: 3, x1: 29, y1: 24 };
        let part = render::render(world, &path, &Settings { window: crop, ..settings }, watch).unwrap();
        for y in crop.y0..crop.y1 {
            for x in crop.x0..crop.x1 {
                assert_eq!(part.at(x - crop.x0, y - crop.y0).tally, whole.at(x, y).tally, "{x},{y}");
            }
        }
        // If the number of samples varies between pixels, the fractions still sum to one.
        let open = Settings { spp: 256, ..settings };
        let adaptive = render::adaptive(world, &path, &open, 0.04, None, watch).unwrap();
        let (least, _, most) = adaptive.samples();
        assert!(least < most, "all tiles have {least} samples");
        for share in coverage(&adaptive, &scene.tags()) {
            assert!(
                (share.iter().sum::<f32>() - 1.0).abs() <= f32::EPSILON
                    && share.iter().all(|s| (0.0..=1.0).contains(s))
            );
        }
    });
}

/// Rationale: coverage must be consistent with labels. Expected: if all fractions but one are zero, the label is that
/// class, and edge pixels are a minority.
#[test]
fn a_pixel_of_one_class_has_its_label() {
    let field = program::field(&program::small_text(), &Options::default());
    let (film, labels) = program::shoot(&field, 64, 2);
    let shares = coverage(&film, &field.scene.tags());
    let pure: Vec<_> = shares.iter().zip(&labels.tags).filter(|(s, _)| s.contains(&1.0)).collect();
    let agree = pure.iter().filter(|(s, tag)| s[tag.class as usize] == 1.0).count();
    assert!(agree * 1000 >= pure.len() * 998, "{agree} of {} pixels", pure.len());
    assert!(pure.len() < shares.len() && pure.len() * 2 > shares.len(), "{} of {} are pure", pure.len(), shares.len());
}
