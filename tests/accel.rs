//! Embree finds the same hits as a test of every triangle.
//!
//! Rationale: colour and label depend on the first surface that a ray hits. A lost hit is a crack, a wrong hit is a
//! wrong label, and both are too rare to notice by eye.
//!
//! Expected: the same part at the same distance as the double-precision oracle, except where the ray passes so close to
//! an edge of a triangle or of a mask texel that single precision cannot decide; no ray through a shared edge is lost;
//! the mask is applied; nothing depends on the number of threads. Source: `accel::brute`, Möller & Trumbore 1997 in
//! double precision; the watertightness tests of pbrt.

use crate::common::scenes::{point, sphere, square, unit};
use furrow_base::geometry::{AlphaMask, Hit, Interaction, Intersect, Mesh, PACKET, Ray};
use furrow_base::math::{Mat3, Vec3, vec2, vec3};
use furrow_base::sampling::{Purpose, Stream};
use furrow_render::accel::{BruteForce, EmbreeAccel, Surface};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

fn stream(index: u64) -> Stream {
    Stream::of(17, 0, Purpose::Test, index)
}

/// Mask of a lobed leaf, 61 × 83 texels.
fn leaf_mask() -> Arc<AlphaMask> {
    Arc::new(AlphaMask::new(61, 83, |x, y| {
        let (x, y) = ((x as f32 + 0.5) / 61.0 - 0.5, (y as f32 + 0.5) / 83.0);
        let width = 0.45 * (std::f32::consts::PI * y).sin() * (0.75 + 0.25 * (40.0 * y).cos());
        x.abs() < width
    }))
}

/// Builds a bent, wavy sheet of 2·n² triangles that covers a whole mask.
fn blade(n: u32, bend: f32) -> Mesh {
    let mut mesh = Mesh::default();
    for i in 0..=n {
        for j in 0..=n {
            let (u, v) = (j as f32 / n as f32, i as f32 / n as f32);
            let z = bend * (v * v - 0.3 * (9.0 * v).sin() * (u - 0.5));
            mesh.positions.push(vec3(u - 0.5, v - 0.5, z) * 0.6);
            mesh.uvs.push(vec2(u, v));
            if i < n && j < n {
                let (a, b) = (i * (n + 1) + j, (i + 1) * (n + 1) + j);
                mesh.triangles.extend([[a, a + 1, b], [a + 1, b + 1, b]]);
            }
        }
    }
    mesh.recompute_normals();
    mesh
}

/// Builds `n` triangles that share no vertices; some of their texture coordinates are outside the mask.
fn confetti(n: u32, s: &mut Stream) -> Mesh {
    let mut mesh = Mesh::default();
    for i in 0..n {
        let middle = point(s, 1.0);
        for _ in 0..3 {
            mesh.positions.push(middle + point(s, 0.25));
            mesh.uvs.push(vec2(s.range32(-0.1, 1.1), s.range32(-0.1, 1.1)));
        }
        mesh.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    mesh.recompute_normals();
    mesh
}

/// Builds a few hundred triangles, some with masks.
fn thicket() -> Vec<(Mesh, Option<Arc<AlphaMask>>)> {
    let mut s = stream(0);
    let mask = leaf_mask();
    let mut all = vec![(confetti(60, &mut s), None), (confetti(60, &mut s), Some(mask.clone()))];
    for k in 0..4 {
        let mut mesh = blade(6, 0.2 + 0.1 * k as f32);
        mesh.transform(Mat3::from_axis_angle(unit(&mut s), s.range32(0.0, 3.0)), point(&mut s, 0.5));
        all.push((mesh, (k != 3).then(|| mask.clone())));
    }
    all
}

fn surfaces(of: &[(Mesh, Option<Arc<AlphaMask>>)]) -> Vec<Surface<'_>> {
    of.iter().map(|(mesh, mask)| Surface { mesh, mask: mask.as_ref(), instance: None }).collect()
}

/// Returns whether a deviating hit is excusable: the oracle finds it for a ray moved sideways by `by` metres, the
/// largest error of single precision.
fn on_the_edge(brute: &BruteForce<'_>, ray: &Ray, part: Option<u32>, by: f32) -> bool {
    let frame = furrow_base::math::Frame::about(ray.direction);
    [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0), (0.7, 0.7), (-0.7, 0.7), (0.7, -0.7), (-0.7, -0.7)].iter().any(
        |(x, y)| {
            let moved = Ray { origin: ray.origin + (frame.x * *x + frame.y * *y) * by, ..*ray };
            brute.closest(&moved).map(|h| h.part) == part
        },
    )
}

#[test]
fn embree_meets_what_trying_every_triangle_meets() {
    let thicket = thicket();
    let surfaces = surfaces(&thicket);
    let embree = EmbreeAccel::build(&surfaces, 1).unwrap();
    let brute = BruteForce::new(&surfaces);
    let mut s = stream(1);
    let (mut met, mut masked, mut close) = (0, 0, 0);
    for i in 0..100_000 {
        let origin = point(&mut s, 1.5);
        let ray = if i % 2 == 0 {
            Ray::new(origin, unit(&mut s))
        } else {
            Ray::new(origin, (point(&mut s, 1.0) - origin).normalize())
        };
        let (got, expected) = (embree.closest(&ray), brute.closest(&ray));
        assert_eq!(embree.occluded(&ray), got.is_some(), "{ray:?}: occluded and closest disagree");
        match (got, expected) {
            (Some(g), Some(e)) if g.part == e.part && (g.t - e.t).abs() <= 1e-5 * e.t.max(1.0) => {
                met += 1;
                masked += u32::from(thicket[g.part as usize].1.is_some());
            }
            (None, None) => {}
            _ => {
                assert!(
                    on_the_edge(&brute, &ray, got.map(|h| h.part), 2e-6),
                    "{ray:?}: Embree {got:?}, oracle {expected:?}"
                );
                close += 1;
            }
        }
    }
    assert!(met > 20_000 && masked > 8_000, "{met} hits, {masked} of them masked: too few to test anything");
    eprintln!("{met} hits, {masked} of them masked, {close} too close to an edge");
    assert!(close <= 20, "{close} rays too close to an edge: more than single precision explains");
}

/// Builds a closed ball: the vertices at the poles and along the seam are bitwise equal.
fn ball(n: u32) -> Mesh {
    let mut mesh = sphere(Vec3::ZERO, 1.0, n);
    let row = 2 * n as usize + 1;
    for i in 0..=n as usize {
        mesh.positions[i * row + row - 1] = mesh.positions[i * row];
    }
    mesh.positions[..row].fill(Vec3::Z);
    mesh.positions[n as usize * row..].fill(-Vec3::Z);
    mesh
}

/// Rationale: hits on shared edges and corners belong to several triangles or, in a careless kernel, to none. Expected:
/// no ray aimed at an edge is lost. Embree may lose a few in a thousand of the rays aimed exactly at corners: in single
/// precision, the edges that meet there can disagree about the side on which the ray passes. No other ray comes close
/// enough to a corner.
#[test]
fn no_ray_through_a_shared_edge_is_lost() {
    let ball = ball(24);
    let lobe = Arc::new(AlphaMask::new(8, 8, |_, _| true));
    let mut inner = ball.clone();
    // A mask ends at texture coordinates 0 and 1; here the surface must not end anywhere.
    inner.uvs.iter_mut().for_each(|uv| *uv = *uv * 0.9 + 0.05);
    let shapes = [(ball, None), (inner, Some(lobe)), (blade(24, 0.5), None), (blade(24, 0.5), Some(leaf_mask()))];
    for (k, shape) in shapes.iter().enumerate() {
        let one = std::slice::from_ref(shape);
        let surfaces = surfaces(one);
        let embree = EmbreeAccel::build(&surfaces, 1).unwrap();
        let (mesh, mask) = shape;
        let mut s = stream(2);
        let (mut aimed, mut slipped) = ([0; 2], [0; 2]);
        for round in 0..12 {
            for t in &mesh.triangles {
                let corner = |i: usize| (mesh.positions[t[i] as usize], mesh.uvs[t[i] as usize]);
                let (i, w) = (s.index(3), if round % 3 == 0 { 0.0 } else { s.uniform32() });
                let ((p, uv), (q, vw)) = (corner(i), corner((i + 1) % 3));
                let (target, at) = (p + (q - p) * w, uv + (vw - uv) * w);
                // Inside the sheet and well inside the mask, so that the surface continues on all sides.
                let sheet = k >= 2;
                let around = [(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)];
                let inside = |x: i32, y: i32| vec2(at.x + x as f32 * 0.03, at.y + y as f32 * 0.03);
                if sheet
                    && !around.iter().all(|(x, y)| {
                        let at = inside(*x, *y);
                        at.min_element() > 0.0
                            && at.max_element() < 1.0
                            && mask.as_ref().is_none_or(|m| m.opaque_at(at))
                    })
                {
                    continue;
                }
                // Rays reach the ball from anywhere outside, and the sheet from above or below, not along it.
                let origin = if sheet {
                    target + vec3(s.range32(-0.5, 0.5), s.range32(-0.5, 0.5), if s.chance(0.5) { 1.5 } else { -1.5 })
                } else {
                    unit(&mut s) * 3.0
                };
                let ray = Ray::new(origin, (target - origin).normalize());
                // Skip rays along the ball's outline, which may miss it.
                if !sheet && ray.direction.dot(target) > -0.1 {
                    continue;
                }
                let kind = usize::from(w == 0.0);
                aimed[kind] += 1;
                if embree.closest(&ray).is_none_or(|hit| hit.t > (target - origin).length() + 1e-5)
                    || !embree.occluded(&ray)
                {
                    slipped[kind] += 1;
                }
            }
        }
        assert!(aimed[0] > 1000 && aimed[1] > 1000, "shape {k}: only {aimed:?} rays");
        assert_eq!(slipped[0], 0, "shape {k}: rays through edges are lost, of {}", aimed[0]);
        assert!(slipped[1] * 50 < aimed[1], "shape {k}: {} of {} rays through corners are lost", slipped[1], aimed[1]);
    }
}

#[test]
fn a_ray_ends_at_its_maximum_distance() {
    let thicket = thicket();
    let surfaces = surfaces(&thicket);
    let embree = EmbreeAccel::build(&surfaces, 1).unwrap();
    let mut s = stream(3);
    let mut tried = 0;
    while tried < 5000 {
        let ray = Ray::new(point(&mut s, 1.5), unit(&mut s));
        let Some(hit) = embree.closest(&ray) else { continue };
        if hit.t < 1e-2 {
            continue;
        }
        tried += 1;
        let short = Ray { t_max: hit.t * (1.0 - 1e-6), ..ray };
        assert!(
            embree.closest(&short).is_none() && !embree.occluded(&short),
            "{short:?} reaches past its end, {}",
            hit.t
        );
        let long = Ray { t_max: hit.t * (1.0 + 1e-6), ..ray };
        assert_eq!(embree.closest(&long), Some(hit), "{long:?}");
        assert!(embree.occluded(&long), "{long:?} throws no shadow");
    }
}

/// Rationale: a part's index is its label. A part without triangles, or whose mask hides all its triangles, must not
/// shift the others.
#[test]
fn parts_keep_their_index_next_to_empty_ones() {
    let at = |z: f32| square(vec3(0.0, 0.0, z), 1.0);
    let clear = Arc::new(AlphaMask::new(4, 4, |_, _| false));
    let all = [
        (Mesh::default(), None),
        (at(0.0), None),
        (at(1.0), Some(clear.clone())),
        (Mesh::default(), Some(clear)),
        (at(-1.0), Some(leaf_mask())),
        (at(-2.0), None),
    ];
    let surfaces = surfaces(&all);
    let embree = EmbreeAccel::build(&surfaces, 1).unwrap();
    let down = |z: f32| embree.closest(&Ray::new(vec3(0.01, 0.02, z), -Vec3::Z));
    assert_eq!(down(5.0).map(|h| h.part), Some(1), "the transparent sheet above must not be hit");
    assert_eq!(down(-0.5).map(|h| h.part), Some(4));
    assert_eq!(down(-1.5).map(|h| h.part), Some(5));
    assert_eq!(down(-2.5), None);
    // The degenerate placeholder of an empty part is at the origin and is never hit.
    let mut s = stream(4);
    let alone = EmbreeAccel::build(&surfaces[..1], 1).unwrap();
    for _ in 0..1000 {
        let origin = unit(&mut s);
        assert!(alone.closest(&Ray::new(origin, -origin)).is_none());
    }
    assert!(EmbreeAccel::build(&[], 1).unwrap().closest(&Ray::new(Vec3::ZERO, Vec3::X)).is_none());
}

#[test]
fn hits_are_the_same_bits_however_many_threads_build() {
    let mut s = stream(5);
    let all: Vec<_> = (0..12)
        .map(|k| {
            let mut mesh = blade(40, 0.4);
            mesh.transform(Mat3::from_axis_angle(unit(&mut s), s.range32(0.0, 3.0)), point(&mut s, 0.5));
            (mesh, (k % 3 != 0).then(leaf_mask))
        })
        .collect();
    let surfaces = surfaces(&all);
    let build = |threads| EmbreeAccel::build(&surfaces, threads).unwrap();
    let (one, two, again) = (build(1), build(2), build(2));
    let bits = |h: Option<Hit>| h.map(|h| (h.part, h.triangle, h.u.to_bits(), h.v.to_bits(), h.t.to_bits()));
    for _ in 0..50_000 {
        let ray = Ray::new(point(&mut s, 1.0), unit(&mut s));
        let first = bits(one.closest(&ray));
        assert!(first == bits(two.closest(&ray)) && first == bits(again.closest(&ray)), "{ray:?}");
    }
}

/// Rationale: leaves rest on the soil and on each other. If the origin of a ray is moved off the surface by a fixed
/// step, it skips surfaces that touch, and contact shadows vanish. Expected: between two sheets 0.01 mm apart, a ray
/// that leaves one hits the other in any direction, and never hits the sheet it leaves.
#[test]
fn sheets_that_nearly_touch_are_both_met() {
    const GAP: f32 = 1e-5;
    let turns =
        [Mat3::IDENTITY, Mat3::from_rotation_x(0.6), Mat3::from_axis_angle(vec3(0.5, 0.7, 0.1).normalize(), 1.3)];
    for (k, turn) in turns.into_iter().enumerate() {
        let foot = [Vec3::ZERO, vec3(0.3, -0.2, 0.1), vec3(0.6, 0.7, 0.4)][k];
        let sheet = |height: f32| {
            let mut mesh = square(vec3(0.0, 0.0, height), 1.0);
            mesh.transform(turn, foot);
            (mesh, None)
        };
        let all = [sheet(0.0), sheet(GAP)];
        let surfaces = surfaces(&all);
        let embree = EmbreeAccel::build(&surfaces, 1).unwrap();
        let mut s = stream(6);
        for _ in 0..10_000 {
            let target = foot + turn * vec3(s.range32(-0.4, 0.4), s.range32(-0.4, 0.4), GAP);
            let origin = target + turn * vec3(s.range32(-0.3, 0.3), s.range32(-0.3, 0.3), 0.5);
            let first = embree.closest(&Ray::new(origin, (target - origin).normalize())).expect("the upper sheet");
            assert_eq!(first.part, 1, "turn {k}: the lower sheet shows through at {target}");
            let upper = Interaction::new(&all[1].0, &first, 0.0);
            let steep = |s: &mut Stream, up: f32| {
                let d = unit(s);
                turn * vec3(d.x, d.y, up * (d.z.abs() + 0.05)).normalize()
            };
            let down = upper.ray(steep(&mut s, -1.0), f32::INFINITY);
            let below = embree.closest(&down).unwrap_or_else(|| panic!("turn {k}: the contact at {target} is lost"));
            assert_eq!(below.part, 0, "turn {k}: {down:?} hits the sheet that it leaves");
            let lower = Interaction::new(&all[0].0, &below, 0.0);
            let back = embree.closest(&lower.ray(steep(&mut s, 1.0), f32::INFINITY));
            assert_eq!(back.map(|h| h.part), Some(1), "turn {k}: the contact above {target} is lost");
            for away in [upper.ray(steep(&mut s, 1.0), f32::INFINITY), lower.ray(steep(&mut s, -1.0), f32::INFINITY)] {
                assert!(!embree.occluded(&away), "turn {k}: {away:?} hits the sheet that it leaves");
            }
        }
    }
}

/// Rationale: camera rays and sun shadow rays are traced in packets, which Embree traverses differently from single
/// rays. Expected: the same part, distance and shadow, whichever lanes are empty and however the rays of a packet
/// differ.
#[test]
fn packets_meet_what_single_rays_meet() {
    let thicket = thicket();
    let embree = EmbreeAccel::build(&surfaces(&thicket), 1).unwrap();
    let mut s = stream(7);
    let (mut met, mut dark) = (0, 0);
    for i in 0..20_000 {
        // Most packets form a narrow cone from one origin; every third has arbitrary origins and directions. Some lanes
        // are empty.
        let (eye, ahead) = (point(&mut s, 1.5), unit(&mut s));
        let rays: [Option<Ray>; PACKET] = std::array::from_fn(|_| {
            let apart = if i % 3 == 0 { (point(&mut s, 1.5), unit(&mut s)) } else { (eye, ahead) };
            let ray = Ray::until(apart.0, (apart.1 + unit(&mut s) * 0.01).normalize(), s.range32(0.2, 4.0));
            (s.uniform32() > 0.2).then_some(ray)
        });
        let (hits, shadows) = (embree.closest_packet(&rays), embree.occluded_packet(&rays));
        for ((ray, hit), shadow) in rays.iter().zip(hits).zip(shadows) {
            let alone = ray.and_then(|ray| embree.closest(&ray));
            assert_eq!(hit.map(|h| (h.part, h.triangle)), alone.map(|h| (h.part, h.triangle)), "{ray:?}");
            if let (Some(hit), Some(alone)) = (hit, alone) {
                assert!((hit.t - alone.t).abs() <= 1e-6 * alone.t.max(1.0), "{ray:?}: {} for {}", hit.t, alone.t);
                met += 1;
            }
            assert_eq!(shadow, ray.is_some_and(|ray| embree.occluded(&ray)), "{ray:?}");
            dark += usize::from(shadow);
        }
    }
    assert!(met > 10_000 && dark > 10_000, "{met} hits, {dark} shadowed");
}

/// Rationale: building ten million triangles for an outdated preview would delay the preview that the user waits for.
/// Expected: a build whose stop flag is set ends with an interruption, and one whose flag is not set completes. Source:
/// Embree's progress monitor.
#[test]
fn a_build_that_is_not_wanted_is_given_up() {
    const SIDE: u32 = 500;
    let place = |k: u32| vec3((k % (SIDE + 1)) as f32, (k / (SIDE + 1)) as f32, (k as f32).sin());
    let positions: Vec<_> = (0..(SIDE + 1) * (SIDE + 1)).map(place).collect();
    let cell = |k: u32| {
        let a = k / SIDE * (SIDE + 1) + k % SIDE;
        [[a, a + 1, a + SIDE + 2], [a, a + SIDE + 2, a + SIDE + 1]]
    };
    let uvs = vec![vec2(0.0, 0.0); positions.len()];
    let mesh = Mesh::smooth(positions, uvs, (0..SIDE * SIDE).flat_map(cell).collect());
    let surfaces = [Surface { mesh: &mesh, mask: None, instance: None }];
    let build = |raised: bool| EmbreeAccel::build_until(&surfaces, 2, Some(&AtomicBool::new(raised)), None);
    assert_eq!(build(true).err().map(|e| e.kind()), Some(furrow_base::error::Kind::Interrupted));
    let down = Ray::new(vec3(3.3, 4.4, 10.0), vec3(0.0, 0.0, -1.0));
    assert!(build(false).unwrap().closest(&down).is_some());
}
