//! Ray queries, hit filters, instances and lifetimes of the bindings, against a search of all triangles.
//!
//! Rationale: all `unsafe` code of the renderer's ray tracing is in this crate; a wrong struct layout or lifetime reads
//! memory that belongs to others. `fuzz/sanitize.sh` runs these tests with AddressSanitizer. Expected: the hits that the
//! intersection of Möller and Trumbore (1997) finds, in double precision, by trying every triangle.

use furrow_embree::{Device, Error, Everything, Filter, Geometry, Hit, PACKET, Ray, Scene};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

type Triangles = Vec<[[f32; 3]; 3]>;

fn device() -> Arc<Device> {
    Arc::new(Device::new("avx2", 1).expect("a device"))
}

fn point(random: &mut Pcg64Mcg) -> [f32; 3] {
    std::array::from_fn(|_| random.random_range(-1.0..1.0))
}

fn triangles(random: &mut Pcg64Mcg, count: usize) -> Triangles {
    let near = |at: [f32; 3], by: [f32; 3]| std::array::from_fn(|k| at[k] + 0.3 * by[k]);
    let mut triangle = || {
        let at = point(random);
        [at, near(at, point(random)), near(at, point(random))]
    };
    (0..count).map(|_| triangle()).collect()
}

/// Returns rays from outside of the cube [−1, 1]³ to points in it.
fn rays(random: &mut Pcg64Mcg, count: usize) -> Vec<Ray> {
    let mut ray = || {
        let (from, to) = (point(random).map(|x| 3.0 * x + 3.0 * x.signum()), point(random));
        Ray { origin: from, direction: std::array::from_fn(|k| to[k] - from[k]), t_max: f32::INFINITY }
    };
    (0..count).map(|_| ray()).collect()
}

fn mesh<F: Filter>(device: &Arc<Device>, triangles: &Triangles, filter: Option<F>) -> Arc<Geometry<F>> {
    let indices = (0..u32::try_from(triangles.len()).expect("few")).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]);
    Arc::new(Geometry::new(device, triangles.concat().into_iter(), indices, filter).expect("a mesh"))
}

fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| a[k] - b[k])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Returns distance and barycentric coordinates of a ray's hit with a triangle.
fn intersection(ray: &Ray, triangle: &[[f32; 3]; 3]) -> Option<[f64; 3]> {
    let [a, b, c] = triangle.map(|corner| corner.map(f64::from));
    let (origin, direction) = (ray.origin.map(f64::from), ray.direction.map(f64::from));
    let (e1, e2, s) = (sub(b, a), sub(c, a), sub(origin, a));
    let p = cross(direction, e2);
    let q = cross(s, e1);
    let scale = 1.0 / dot(e1, p);
    let [t, u, v] = [dot(e2, q), dot(s, p), dot(direction, q)].map(|x| x * scale);
    (t > 0.0 && t < f64::from(ray.t_max) && u >= 0.0 && v >= 0.0 && u + v <= 1.0).then_some([t, u, v])
}

/// Returns the nearest hit that `keep` accepts, by trying every triangle.
fn nearest(ray: &Ray, triangles: &Triangles, keep: impl Fn(u32) -> bool) -> Option<(u32, [f64; 3])> {
    let indexed = (0..).zip(triangles).filter(|(i, _)| keep(*i));
    let hits = indexed.filter_map(|(i, triangle)| Some((i, intersection(ray, triangle)?)));
    hits.min_by(|a, b| a.1[0].total_cmp(&b.1[0]))
}

/// Panics if the hit is not the expected one. A ray that meets an edge may hit either side: at most `strays` such rays.
fn compare(hits: &[Option<Hit>], expected: &[Option<(u32, [f64; 3])>], strays: usize) {
    let mut differ = 0;
    for (hit, expected) in hits.iter().zip(expected) {
        match (hit, expected) {
            (None, None) => {}
            (Some(hit), Some((primitive, at))) if hit.primitive == *primitive => {
                for (found, at) in [hit.t, hit.u, hit.v].into_iter().zip(at) {
                    assert!((f64::from(found) - at).abs() < 1e-3, "{hit:?} instead of {at:?}");
                }
            }
            _ => differ += 1,
        }
    }
    assert!(differ <= strays, "{differ} of {} hits differ", hits.len());
}

fn packets(scene: &Scene<impl Filter>, rays: &[Ray]) -> (Vec<Option<Hit>>, Vec<bool>) {
    let packets = rays.chunks(PACKET).map(|chunk| std::array::from_fn(|i| chunk.get(i).copied()));
    let both = packets.map(|packet| (scene.closest_packet(&packet), scene.occluded_packet(&packet)));
    let (hits, blocked): (Vec<_>, Vec<_>) = both.unzip();
    let cut = |i: &usize| *i < rays.len();
    let hits = hits.concat().into_iter().enumerate().filter(|(i, _)| cut(i)).map(|(_, hit)| hit).collect();
    (hits, blocked.concat().into_iter().take(rays.len()).collect())
}

#[test]
fn single_rays_and_packets_hit_what_a_search_of_all_triangles_finds() {
    let mut random = Pcg64Mcg::seed_from_u64(1);
    let (device, triangles) = (device(), triangles(&mut random, 200));
    // The last packet has three lanes without a ray.
    let mut rays = rays(&mut random, 2005);
    for ray in rays.iter_mut().step_by(3) {
        ray.t_max = random.random_range(0.0..1.0);
    }
    let expected: Vec<_> = rays.iter().map(|ray| nearest(ray, &triangles, |_| true)).collect();
    assert!((500..1800).contains(&expected.iter().flatten().count()));
    for quick in [false, true] {
        let scene =
            Scene::build(&device, vec![mesh(&device, &triangles, None::<Everything>)], quick, None).expect("a scene");
        let single: Vec<_> = rays.iter().map(|ray| scene.closest(ray)).collect();
        let (hits, blocked) = packets(&scene, &rays);
        compare(&single, &expected, 2);
        compare(&hits, &expected, 2);
        let differ = |blocked: bool, expected: &Option<_>| blocked != expected.is_some();
        let wrong = rays.iter().zip(&expected).filter(|(ray, hit)| differ(scene.occluded(ray), hit)).count();
        assert!(wrong <= 2, "{wrong} single rays");
        let wrong = blocked.iter().zip(&expected).filter(|(blocked, hit)| differ(**blocked, hit)).count();
        assert!(wrong <= 2, "{wrong} rays of packets");
    }
}

/// Keeps the triangles with an even number, and counts its calls.
struct Even(Arc<AtomicU32>);

impl Filter for Even {
    fn accepts(&self, primitive: u32, u: f32, v: f32) -> bool {
        self.0.fetch_add(1, Ordering::Relaxed);
        assert!(u >= -1e-5 && v >= -1e-5 && u + v <= 1.0 + 1e-5, "{u} {v}");
        primitive.is_multiple_of(2)
    }
}

#[test]
fn a_filter_sees_each_hit_and_decides() {
    let mut random = Pcg64Mcg::seed_from_u64(2);
    let (device, triangles) = (device(), triangles(&mut random, 200));
    let rays = rays(&mut random, 1003);
    let calls = Arc::new(AtomicU32::new(0));
    let geometry = mesh(&device, &triangles, Some(Even(calls.clone())));
    let scene = Scene::build(&device, vec![geometry], false, None).expect("a scene");
    let expected: Vec<_> = rays.iter().map(|ray| nearest(ray, &triangles, |i| i.is_multiple_of(2))).collect();
    compare(&rays.iter().map(|ray| scene.closest(ray)).collect::<Vec<_>>(), &expected, 2);
    let (hits, blocked) = packets(&scene, &rays);
    compare(&hits, &expected, 2);
    assert!(blocked.iter().zip(&expected).filter(|(blocked, hit)| **blocked != hit.is_some()).count() <= 2);
    assert!(calls.load(Ordering::Relaxed) > 1000);
    // Lanes without a ray reach neither filter nor result.
    let before = calls.load(Ordering::Relaxed);
    assert_eq!(scene.closest_packet(&[None; PACKET]), [None; PACKET]);
    assert_eq!(scene.occluded_packet(&[None; PACKET]), [false; PACKET]);
    assert_eq!(calls.load(Ordering::Relaxed), before);
}

#[test]
fn instances_are_hit_where_they_are_placed_and_keep_their_scene_alive() {
    let mut random = Pcg64Mcg::seed_from_u64(3);
    let (device, shape) = (device(), triangles(&mut random, 40));
    // A turn about z by 90°, twice the size, and a shift.
    let columns = [[0.0, 2.0, 0.0], [-2.0, 0.0, 0.0], [0.0, 0.0, 2.0], [0.5, -0.25, 0.125]];
    let place = |[x, y, z]: [f32; 3]| [-2.0 * y + 0.5, 2.0 * x - 0.25, 2.0 * z + 0.125];
    let placed: Triangles = shape.iter().map(|corners| corners.map(place)).collect();
    let scene = {
        let calls = Arc::new(AtomicU32::new(0));
        let shared =
            Scene::build(&device, vec![mesh(&device, &shape, Some(Even(calls)))], false, None).expect("a scene");
        let shared = Arc::new(shared);
        let outside =
            Geometry::instance(&shared, [columns[0], columns[1], columns[2], [50.0; 3]]).expect("an instance");
        let inside = Geometry::instance(&shared, columns).expect("an instance");
        Scene::build(&device, vec![Arc::new(outside), Arc::new(inside)], false, None).expect("a scene")
    };
    // Shape, mesh, filter and instances have no other owner any more.
    drop(device);
    let rays = rays(&mut random, 1000);
    let expected: Vec<_> = rays.iter().map(|ray| nearest(ray, &placed, |i| i.is_multiple_of(2))).collect();
    let hits: Vec<_> = rays.iter().map(|ray| scene.closest(ray)).collect();
    compare(&hits, &expected, 2);
    compare(&packets(&scene, &rays).0, &expected, 2);
    let hits: Vec<Hit> = hits.into_iter().flatten().collect();
    assert!(hits.len() > 100 && hits.iter().all(|hit| hit.instance == Some(1) && hit.geometry == 0));
}

#[test]
fn threads_share_a_scene() {
    let mut random = Pcg64Mcg::seed_from_u64(4);
    let (device, triangles) = (device(), triangles(&mut random, 100));
    let calls = Arc::new(AtomicU32::new(0));
    let scene =
        Scene::build(&device, vec![mesh(&device, &triangles, Some(Even(calls)))], false, None).expect("a scene");
    let rays = rays(&mut random, 500);
    let hits = |scene: &Scene<Even>| {
        furrow_embree::prepare_thread();
        rays.iter().map(|ray| scene.closest(ray)).collect::<Vec<_>>()
    };
    let alone = hits(&scene);
    std::thread::scope(|scope| {
        let workers: Vec<_> = (0..4).map(|_| scope.spawn(|| hits(&scene))).collect();
        for worker in workers {
            assert_eq!(worker.join().expect("no panic"), alone);
        }
    });
}

#[test]
fn a_mesh_without_triangles_has_an_index_and_is_never_hit() {
    let device = device();
    let empty = mesh(&device, &Vec::new(), None::<Everything>);
    let square = mesh(&device, &vec![[[-1.0, -1.0, 0.0], [3.0, -1.0, 0.0], [-1.0, 3.0, 0.0]]], None);
    let scene = Scene::build(&device, vec![empty.clone(), square, empty], false, None).expect("a scene");
    let down = Ray { origin: [0.0, 0.0, 1.0], direction: [0.0, 0.0, -2.0], t_max: f32::INFINITY };
    let hit = scene.closest(&down).expect("a hit");
    assert_eq!((hit.instance, hit.geometry, hit.primitive), (None, 1, 0));
    assert!((hit.t - 0.5).abs() < 1e-6, "{hit:?}");
    assert_eq!(scene.closest(&Ray { t_max: 0.25, ..down }), None);
    assert_eq!(scene.closest(&Ray { direction: [0.0, 0.0, 2.0], ..down }), None);
    let none = Scene::build(&device, Vec::<Arc<Geometry<Everything>>>::new(), false, None).expect("a scene");
    assert!(none.closest(&down).is_none() && !none.occluded(&down) && none.geometries().is_empty());
}

#[test]
fn wrong_calls_are_errors_or_panics_and_touch_no_memory() {
    assert_eq!(Device::new("avx2\0", 1).err(), Some(Error::InvalidArgument));
    let device = device();
    assert!((30_000..50_000).contains(&device.version()), "{}", device.version());
    let cancelled = {
        let mut random = Pcg64Mcg::seed_from_u64(5);
        let geometry = mesh(&device, &triangles(&mut random, 20_000), None::<Everything>);
        Scene::build(&device, vec![geometry], false, Some(&AtomicBool::new(true))).err()
    };
    assert_eq!(cancelled, Some(Error::Cancelled));
    let panics = |wrong: Box<dyn FnOnce() + std::panic::UnwindSafe>| std::panic::catch_unwind(wrong).is_err();
    let own = std::panic::AssertUnwindSafe(device.clone());
    assert!(panics(Box::new(move || {
        drop(Geometry::new(&own, [[0.0; 3]].into_iter(), [[0, 0, 1]].into_iter(), None::<Everything>));
    })));
    let own = std::panic::AssertUnwindSafe(device);
    assert!(panics(Box::new(move || {
        let other = Arc::new(Device::new("avx2", 1).expect("a device"));
        let geometry = mesh(&other, &Vec::new(), None::<Everything>);
        drop(Scene::build(&own, vec![geometry], false, None));
    })));
}
