//! Instances: plants that share meshes behave like any other plants.
//!
//! Rationale: a hectare fits into memory only if plants share meshes, and a wrong label, shadow or trait of one among a
//! hundred thousand goes unnoticed.
//!
//! Expected: rays hit the same parts at the same distances as on copies of the meshes in world space; a field of
//! instances has the plants, positions, rows and cover of a field whose plants have individual shapes; nothing depends
//! on threads or on other objects in view. Source: `accel::brute`, Möller & Trumbore 1997 in double precision, over the
//! copies; the same scene file with another detail setting.

use crate::common::program::{field, hash, shoot};
use crate::common::scenes::{point, square, unit};
use furrow_base::geometry::{AlphaMask, Hit, Interaction, Intersect, Mesh, PACKET, Placement, Ray};
use furrow_base::math::{Mat3, Spectrum, Vec3, Vec4, vec2, vec3};
use furrow_base::ron_file::Num;
use furrow_base::sampling::{Purpose, Stream};
use furrow_field::assemble::Options;
use furrow_field::traits::Traits;
use furrow_field::{Field, PartKind, PlantRecord};
use furrow_grow::plant::OrganKind;
use furrow_optics::bsdf::{Bsdf, Leaf, Portable};
use furrow_optics::optics::{LeafOptics, Pigments};
use furrow_render::accel::{BruteForce, EmbreeAccel, Surface};
use furrow_render::material::Material;
use furrow_render::scene::tag::Class;
use furrow_render::scene::{Instance, Part};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

fn stream(index: u64) -> Stream {
    Stream::of(23, 0, Purpose::Test, index)
}

/// An organ: its mesh and mask.
type Organ = (Arc<Mesh>, Option<Arc<AlphaMask>>);

/// Builds two plants with three and two organs: bent sheets, with and without a striped mask.
fn plants() -> [Vec<Organ>; 2] {
    let stripes = Arc::new(AlphaMask::new(32, 32, |x, y| x % 8 < 5 && y % 16 < 11));
    let mut s = stream(0);
    let mut sheet = |mask: Option<&Arc<AlphaMask>>| {
        let n = 5;
        let mut mesh = Mesh::default();
        for i in 0..=n {
            for j in 0..=n {
                let (u, v) = (j as f32 / n as f32, i as f32 / n as f32);
                mesh.positions.push(vec3(u - 0.5, v - 0.5, 0.4 * v * v - 0.1 * (9.0 * u).sin()) * 0.5);
                mesh.uvs.push(vec2(u, v));
                if i < n && j < n {
                    let (a, b) = (i * (n + 1) + j, (i + 1) * (n + 1) + j);
                    mesh.triangles.extend([[a, a + 1, b], [a + 1, b + 1, b]]);
                }
            }
        }
        mesh.recompute_normals();
        mesh.transform(Mat3::from_axis_angle(unit(&mut s), s.range32(0.0, 3.0)), point(&mut s, 0.2));
        (Arc::new(mesh), mask.cloned())
    };
    [vec![sheet(Some(&stripes)), sheet(None), sheet(Some(&stripes))], vec![sheet(None), sheet(Some(&stripes))]]
}

/// Builds a stand as instances and as world-space copies: a separate sheet, seven instances of the two plants in turn,
/// and another sheet.
fn stand() -> (Vec<Part>, Vec<Part>) {
    let mut s = stream(1);
    let part = |mesh: Arc<Mesh>, mask: Option<Arc<AlphaMask>>, instance: Option<Arc<Placement>>| {
        let tag = furrow_render::scene::tag::Tag { class: Class::Crop, plant: 1, leaf: 1 };
        let instance = instance.map(|placement| Instance { placement, tint: Vec3::ONE });
        Part { mesh, mask, material: 0, tag, instance }
    };
    let own = |z: f32| part(Arc::new(square(vec3(0.0, 0.0, z), 0.6)), None, None);
    let mut all = vec![own(0.8)];
    let plants = plants();
    for k in 0..7 {
        let rotation = Mat3::from_axis_angle(unit(&mut s), s.range32(0.0, 6.0));
        let at = Arc::new(Placement { rotation, scale: 0.7 + 0.1 * k as f32, offset: point(&mut s, 0.8) });
        all.extend(plants[k % 2].iter().map(|(mesh, mask)| part(mesh.clone(), mask.clone(), Some(at.clone()))));
    }
    all.push(own(-0.8));
    let copy = |p: &Part| Part { mesh: Arc::new(p.in_world().into_owned()), instance: None, ..p.clone() };
    let copies = all.iter().map(copy).collect();
    (all, copies)
}

fn surfaces(parts: &[Part]) -> Vec<Surface<'_>> {
    parts.iter().map(Part::surface).collect()
}

/// Samples a ray from a random point, toward the stand or in a random direction.
fn ray(s: &mut Stream, toward: bool) -> Ray {
    let origin = point(s, 1.6);
    Ray::new(origin, if toward { (point(s, 0.9) - origin).normalize() } else { unit(s) })
}

/// Expected: the same part and triangle at the same distance, and the same shadow, position and normals, except where a
/// ray moved by the single-precision error of a rotation gives another result.
#[test]
fn instances_meet_what_their_copies_meet() {
    let (parts, copies) = stand();
    let [instanced, plain] = [&parts, &copies].map(|parts| EmbreeAccel::build(&surfaces(parts), 1).unwrap());
    let all = surfaces(&copies);
    let brute = BruteForce::new(&all);
    let mut s = stream(2);
    let (mut met, mut masked, mut close) = (0, 0, 0);
    for i in 0..60_000 {
        let ray = ray(&mut s, i % 2 == 0);
        let (got, expected) = (instanced.closest(&ray), brute.closest(&ray));
        assert_eq!(instanced.occluded(&ray), got.is_some(), "{ray:?}: occluded and closest disagree");
        match (got, expected) {
            (Some(g), Some(e)) if g.part == e.part && (g.t - e.t).abs() <= 2e-5 => {
                met += 1;
                masked += usize::from(parts[g.part as usize].mask.is_some());
                let Some(p) = plain.closest(&ray).filter(|p| (p.part, p.triangle) == (g.part, g.triangle)) else {
                    continue;
                };
                let at = parts[g.part as usize].interaction(&g, 1e-3);
                let copy: Interaction = copies[p.part as usize].interaction(&p, 1e-3);
                assert!(at.p.distance(copy.p) < 5e-5, "{ray:?}: {} and {}", at.p, copy.p);
                assert!(at.p.distance(ray.origin + ray.direction * g.t) < 5e-5);
                assert!(at.ng.dot(copy.ng) > 0.99999 && at.ns.dot(copy.ns) > 0.99999);
                // A ray that leaves the surface does not hit it again at once.
                let away = at.ray(at.ng, 1e-3);
                assert!(
                    instanced.closest(&away).is_none_or(|h| h.part != g.part),
                    "{away:?} hits the surface that it leaves"
                );
            }
            (None, None) => {}
            _ => {
                let frame = furrow_base::math::Frame::about(ray.direction);
                let moved = |angle: u32| {
                    let (sin, cos) = (angle as f32 * std::f32::consts::FRAC_PI_4).sin_cos();
                    Ray { origin: ray.origin + (frame.x * cos + frame.y * sin) * 4e-6, ..ray }
                };
                let excusable = (0..8).any(|k| brute.closest(&moved(k)).map(|h| h.part) == got.map(|h| h.part));
                assert!(excusable, "{ray:?}: instances {got:?}, oracle {expected:?}");
                close += 1;
            }
        }
    }
    assert!(met > 12_000 && masked > 3_000, "{met} hits, {masked} of them masked: too few to test anything");
    assert!(close <= 30, "{close} rays too close to an edge: more than single precision explains");
}

#[test]
fn packets_meet_instances_as_single_rays_do() {
    let (parts, _) = stand();
    let embree = EmbreeAccel::build(&surfaces(&parts), 2).unwrap();
    let mut s = stream(3);
    let (mut met, mut dark) = (0, 0);
    for i in 0..8000 {
        let first = ray(&mut s, true);
        let rays: [Option<Ray>; PACKET] = std::array::from_fn(|_| {
            let apart = if i % 3 == 0 { ray(&mut s, true) } else { first };
            let direction = (apart.direction + unit(&mut s) * 0.01).normalize();
            (s.uniform32() > 0.2).then_some(Ray::until(apart.origin, direction, 3.0))
        });
        let (hits, shadows) = (embree.closest_packet(&rays), embree.occluded_packet(&rays));
        for ((ray, hit), shadow) in rays.iter().zip(hits).zip(shadows) {
            let alone = ray.and_then(|ray| embree.closest(&ray));
            assert_eq!(hit.map(|h| (h.part, h.triangle)), alone.map(|h| (h.part, h.triangle)), "{ray:?}");
            assert_eq!(shadow, ray.is_some_and(|ray| embree.occluded(&ray)), "{ray:?}");
            met += usize::from(hit.is_some());
            dark += usize::from(shadow);
        }
    }
    assert!(met > 10_000 && dark > 10_000, "{met} hits, {dark} shadowed");
}

/// Builds a field seen from 14 m: pixels of more than 4 mm, plants of two populations.
fn meadow(detail: &str, x: f32) -> Field {
    let text = format!(
        r#"Field(
            seed: 31,
            detail: {detail},
            reach_m: 6,
            camera: Pinhole(size: (240, 240), intrinsics: FieldOfView(horizontal_deg: 16), pose: LookAt(position_m: ({x}, -0.01, 14), target_m: ({x}, 0, 0))),
            lights: [Daylight(sun: Angles(elevation_deg: 47, azimuth_deg: 150), turbidity: 3.5)],
            soil: (
                layers: [(albedo: "textures/soil/dirt.png", height: "textures/soil/dirt.height.png", size_m: 0.5, height_mm: (-4, 8))],
                moisture: (mean: 0.35),
            ),
            crops: [(species: "scenes/species/sugar_beet.ron", growth: Bbch(18), rows: (in_row_m: 0.18))],
            weeds: [(species: "scenes/species/chenopodium.ron", growth: AgeDays(Uniform(14, 30)), spread: (per_m2: 12))],
        )"#
    );
    field(&text, &Options::default())
}

fn distinct(field: &Field) -> usize {
    field.scene.parts.iter().map(|part| Arc::as_ptr(&part.mesh)).collect::<BTreeSet<_>>().len()
}

/// Expected: plants with the same identities at the same positions, on average as tall, as wide and with as many
/// leaves; the number of crop and weed pixels within 10 % of that with individual plant shapes; each labelled pixel
/// within its plant's radius; fewer meshes.
#[test]
fn a_field_of_instances_has_the_plants_of_the_field() {
    let [own, shared] = ["ByPixel", "Instanced"].map(|detail| meadow(detail, 0.0));
    assert!(shared.scene.parts.iter().any(|part| part.instance.is_some()));
    assert!(own.scene.parts.iter().all(|part| part.instance.is_none()));
    let places = |field: &Field| field.plants.iter().map(|p| (p.id, p.position)).collect::<BTreeMap<_, _>>();
    let (a, b) = (places(&own), places(&shared));
    let both: Vec<u32> = a.keys().filter(|id| b.contains_key(id)).copied().collect();
    // Plants that only cast shadows into the view may differ, because their heights do.
    assert!(
        both.len() > 150 && both.len() * 20 > 19 * a.len().max(b.len()),
        "{} of {} and {}",
        both.len(),
        a.len(),
        b.len()
    );
    assert!(both.iter().all(|id| a[id].distance(b[id]) < 1e-6));
    let mean = |field: &Field, of: fn(&PlantRecord) -> f32| {
        let beets: Vec<f32> = field.plants.iter().filter(|p| p.eppo == "BEAVX").map(of).collect();
        beets.iter().sum::<f32>() / beets.len() as f32
    };
    let sizes: [fn(&PlantRecord) -> f32; 3] = [|p| p.radius, |p| p.height, |p| p.leaves as f32];
    for of in sizes {
        let (own, shared) = (mean(&own, of), mean(&shared, of));
        assert!((own / shared - 1.0).abs() < 0.06, "{own} and {shared}");
    }
    assert!(distinct(&shared) < distinct(&own), "{} and {}", distinct(&shared), distinct(&own));

    let [(_, own_labels), (_, labels)] = [&own, &shared].map(|field| shoot(field, 1, 2));
    let pixels = |labels: &furrow_render::render::LabelMap, class: Class| {
        labels.tags.iter().filter(|tag| tag.class == class).count() as f32
    };
    for class in [Class::Crop, Class::Weed] {
        let (own, shared) = (pixels(&own_labels, class), pixels(&labels, class));
        assert!(own > 500.0 && (own / shared - 1.0).abs() < 0.1, "{class:?}: {own} and {shared}");
    }
    // The camera looks straight down: 14 m · 2 tan 8° over 240 pixels.
    let pixel = 14.0 * 2.0 * 8.0_f32.to_radians().tan() / 240.0;
    let plant: BTreeMap<u32, _> = shared.plants.iter().map(|p| (p.number, p)).collect();
    for (k, tag) in labels.tags.iter().enumerate().filter(|(_, tag)| tag.plant > 0) {
        let at = vec2((k % 240) as f32 - 119.5, 119.5 - (k / 240) as f32) * pixel;
        let p = plant[&tag.plant];
        // A point at height h above the ground appears up to h · tan 11° farther out.
        let off = at.distance(p.position.truncate());
        assert!(
            off < 1.05 * p.radius + 0.2 * p.height + 2.0 * pixel,
            "plant {} is seen {off} m from its foot",
            tag.plant
        );
    }
}

/// Expected: the same bits with one and with two threads; plants common to two views have equal numbers of organs with
/// the same tints and the same headings, except for the tilt of the ground below them.
#[test]
fn instances_do_not_depend_on_threads_or_the_view() {
    let field = meadow("Instanced", 0.0);
    let bits = |threads: usize| {
        let (film, labels) = shoot(&field, 2, threads);
        let pixels = film.pixels.iter().flat_map(|p| p.mean.to_array().map(f32::to_bits));
        (hash(pixels), hash(labels.tags.iter().map(|tag| tag.plant)))
    };
    assert_eq!(bits(1), bits(2));
    let shapes = |field: &Field| {
        let ids: BTreeMap<u32, u32> = field.plants.iter().map(|p| (p.number, p.id)).collect();
        let mut of: BTreeMap<u32, (Vec<Vec3>, Placement)> = BTreeMap::new();
        for part in &field.scene.parts {
            if let Some(Instance { placement, tint }) = &part.instance {
                of.entry(ids[&part.tag.plant]).or_insert((Vec::new(), **placement)).0.push(*tint);
            }
        }
        of
    };
    let (here, there) = (shapes(&field), shapes(&meadow("Instanced", 0.7)));
    let both: Vec<u32> = here.keys().filter(|id| there.contains_key(id)).copied().collect();
    assert!(both.len() > 300, "{}", both.len());
    for id in both {
        let ((tints, at), (tints_there, at_there)) = (&here[&id], &there[&id]);
        assert_eq!(tints, tints_there, "plant {id}");
        // Ground heights are sampled on a grid that depends on the view, and plants tilt with the ground; their
        // headings are the same.
        let [heading, heading_there] = [at, at_there].map(|at| at.rotation.x_axis.truncate().normalize());
        let turned = heading.distance(heading_there);
        assert!(turned < 0.1, "plant {id}: {turned} apart");
        assert!(at.offset.truncate().distance(at_there.offset.truncate()) < 1e-5, "plant {id}");
        assert_eq!(at.scale, at_there.scale, "plant {id}");
    }
}

/// Expected: instances of one plant differ in size; heights, radii and leaf lengths scale with it, leaf areas with its
/// square.
#[test]
fn instances_have_sizes_of_their_own() {
    let field = meadow("Instanced", 0.0);
    let traits = Traits::of(&field);
    let plants: BTreeMap<u32, &PlantRecord> = field.plants.iter().map(|p| (p.number, p)).collect();
    // Plants with the same first mesh are instances of the same plant.
    let (mut worn, mut known) = (BTreeMap::<*const Mesh, Vec<(f32, u32)>>::new(), BTreeSet::new());
    for part in &field.scene.parts {
        if let Some(at) = part.placement().filter(|_| known.insert(part.tag.plant)) {
            worn.entry(Arc::as_ptr(&part.mesh)).or_default().push((at.scale, part.tag.plant));
        }
    }
    let leaves = |plant: u32| -> Vec<_> {
        traits.leaves.range((plant, 0)..=(plant, u16::MAX)).map(|(_, leaf)| (leaf.length_m, leaf.width_m)).collect()
    };
    let mut compared = 0;
    for pair in worn.values().flat_map(|wearers| wearers.windows(2)) {
        let [(one, a), (other, b)] = [pair[0], pair[1]];
        assert!(one != other && (one / other).ln().abs() < 0.22, "plants {a} and {b}: {one} and {other}");
        let near = |x: f32, y: f32, power: i32| (y / x / (other / one).powi(power) - 1.0).abs() < 2e-3;
        let (p, q) = (plants[&a], plants[&b]);
        assert!(near(p.height, q.height, 1) && near(p.radius, q.radius, 1), "plants {a} and {b}");
        let areas = [a, b].map(|plant| traits.plants[&plant].leaf_area_m2);
        assert!(near(areas[0], areas[1], 2), "plants {a} and {b}: {areas:?}");
        let (small, large) = (leaves(a), leaves(b));
        assert!(!small.is_empty() && small.len() == large.len(), "plants {a} and {b}");
        assert!(small.iter().zip(&large).all(|(x, y)| near(x.0, y.0, 1) && near(x.1, y.1, 1)), "plants {a} and {b}");
        compared += 1;
    }
    assert!(compared > 100, "{compared}");
}

/// Expected: leaf area, height and cover of a field of instances equal those of its copies in world space.
#[test]
fn traits_of_instances_are_those_of_their_copies() {
    let field = meadow("Instanced", 0.0);
    let copy = |p: &Part| Part { mesh: Arc::new(p.in_world().into_owned()), instance: None, ..p.clone() };
    let mut copies = meadow("Instanced", 0.0);
    copies.scene.parts = copies.scene.parts.iter().map(copy).collect();
    let (shared, own) = (Traits::of(&field), Traits::of(&copies));
    assert!(shared.plants.len() > 150 && shared.plants.keys().eq(own.plants.keys()));
    for (number, plant) in &shared.plants {
        let copy = &own.plants[number];
        let near = |a: f32, b: f32| (a - b).abs() <= 2e-3 * b.abs() + 1e-6;
        assert!(near(plant.leaf_area_m2, copy.leaf_area_m2) && near(plant.top_m, copy.top_m), "plant {number}");
        assert!((plant.cover_m2 - copy.cover_m2).abs() <= 0.02 * copy.cover_m2 + 1e-6, "plant {number}");
    }
}

/// Rationale: an image's record needs the plants in view alone. Expected: plants that are asked for in two calls have the traits that
/// measuring the whole field gives, the others none; the canopy is the same.
#[test]
fn traits_of_some_plants_are_those_of_the_whole_field() {
    let field = meadow("Instanced", 0.0);
    let mut all = Traits::of(&field);
    let first = Traits::default().of_next_image(&field, |plant| plant % 3 == 0);
    let both = first.of_next_image(&field, |plant| plant % 3 < 2);
    let whole = all.plants.len();
    all.plants.retain(|plant, _| plant % 3 < 2);
    all.leaves.retain(|(plant, _), _| plant % 3 < 2);
    assert!(all.plants.len() > 100 && all.plants.len() < whole && all.canopy.is_some());
    assert_eq!(both, all);
}

/// Evaluates the BSDF of a part at one of its middle triangles, seen from above; `tinted` may change the interaction.
fn sheet(field: &Field, k: usize, tinted: impl Fn(Interaction) -> Interaction) -> Leaf {
    let part = &field.scene.parts[k];
    let hit = Hit { part: k as u32, triangle: part.mesh.triangles.len() as u32 / 2, u: 0.3, v: 0.3, t: 1.0 };
    let at = tinted(part.interaction(&hit, 1e-3));
    match field.scene.materials[part.material as usize].scatter(&at, at.ng).0 {
        Bsdf::Leaf(leaf) => leaf,
        other => panic!("part {k} is no leaf: {other:?}"),
    }
}

/// Returns the petioles of beets with the numbers of their plants; their material has no texture and no age.
fn stalks(field: &Field) -> Vec<(usize, u32)> {
    let beets: BTreeSet<u32> = field.plants.iter().filter(|p| p.eppo == "BEAVX").map(|p| p.number).collect();
    let parts = field.scene.parts.iter().enumerate().filter(|(_, part)| !part.mesh.triangles.is_empty());
    let stalks = parts.filter(|(k, _)| field.kinds[*k] == PartKind::Organ(OrganKind::Petiole));
    stalks.map(|(k, part)| (k, part.tag.plant)).filter(|(_, plant)| beets.contains(plant)).collect()
}

/// Reflectance of the beets' petioles, by plant identity.
fn colors(field: &Field) -> BTreeMap<u32, Spectrum> {
    let ids: BTreeMap<u32, u32> = field.plants.iter().map(|p| (p.number, p.id)).collect();
    stalks(field).into_iter().map(|(k, plant)| (ids[&plant], sheet(field, k, |at| at).reflectance(1.0))).collect()
}

/// Chlorophyll content relative to the species file, computed from a petiole's reflectance in green.
fn chlorophyll(optics: &LeafOptics, seen: Spectrum) -> f64 {
    let green = |s: Spectrum| s.to_array()[1];
    let model = |factor: f32| green(optics.with_chlorophyll(36.0 * factor).reflectance);
    let wanted = green(seen) / green(optics.plain().reflectance) * model(1.0);
    let (mut lo, mut hi) = (0.4, 1.8);
    for _ in 0..40 {
        let middle = 0.5 * (lo + hi);
        // More chlorophyll makes a leaf darker.
        (lo, hi) = if model(middle) > wanted { (middle, hi) } else { (lo, middle) };
    }
    f64::from(lo)
}

/// Rationale: distant plants must vary in colour exactly as near ones do. Expected: the petiole of an instance has the
/// same reflectance in all bands as the same plant with an individual shape, within 0.1 %. The mean relative
/// chlorophyll content is 1 and its standard deviation 12 %, the default of `chlorophyll_sd`, both within six standard
/// errors (one false alarm in 10⁸ seeds). Source: the field with `ByPixel`; the inverted leaf model.
#[test]
fn instances_have_the_chlorophyll_that_their_plants_have() {
    let [own, shared] = ["ByPixel", "Instanced"].map(|detail| meadow(detail, 0.0));
    let (grown, seen) = (colors(&own), colors(&shared));
    let both: Vec<u32> = grown.keys().filter(|id| seen.contains_key(id)).copied().collect();
    assert!(both.len() > 100, "{}", both.len());
    for id in &both {
        let off = (seen[id].0 / grown[id].0 - 1.0).abs().max_element();
        assert!(off < 1e-3, "plant {id}: {:?} as an instance, {:?} with its own shape", seen[id], grown[id]);
    }
    // The petiole of `scenes/species/sugar_beet.ron`.
    let stalk = Pigments {
        n: Num::new(2.0),
        chlorophyll: Num::new(36.0),
        carotenoid: Num::new(8.0),
        anthocyanin: Num::new(0.6),
        water: Num::new(0.06),
        dry_matter: Num::new(0.004),
        ..Pigments::default()
    };
    let optics = LeafOptics::new(&stalk);
    let contents: Vec<f64> = seen.values().map(|color| chlorophyll(&optics, *color)).collect();
    let n = contents.len() as f64;
    let mean = contents.iter().sum::<f64>() / n;
    let sd = (contents.iter().map(|c| (c - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
    assert!((mean - 1.0).abs() < 6.0 * 0.12 / n.sqrt(), "{mean} of {n}");
    assert!((sd / 0.12 - 1.0).abs() < 6.0 / (2.0 * n).sqrt(), "{sd} of {n}");
}

/// Expected: two instances of one plant differ in tint; no organ reflects and transmits more light than it receives, on
/// either side and in any band, even with a tint ten times as bright.
#[test]
fn tints_differ_and_keep_energy() {
    let field = meadow("Instanced", 0.0);
    let mut of_mesh: BTreeMap<*const Mesh, BTreeMap<u32, Vec3>> = BTreeMap::new();
    for (k, plant) in stalks(&field) {
        let part = &field.scene.parts[k];
        of_mesh.entry(Arc::as_ptr(&part.mesh)).or_default().insert(plant, part.tint());
    }
    let mut compared = 0;
    for tints in of_mesh.values() {
        let tints: Vec<Vec3> = tints.values().copied().collect();
        for pair in tints.windows(2) {
            assert!(pair[0] != pair[1], "{pair:?}");
            compared += 1;
        }
    }
    assert!(compared > 50, "{compared}");
    let tells =
        |k: &usize| field.scene.parts[*k].instance.is_some() && !field.scene.parts[*k].mesh.triangles.is_empty();
    let mut passes = 0;
    for k in (0..field.scene.parts.len()).filter(tells) {
        for brighter in [1.0, 10.0] {
            let leaf = sheet(&field, k, |at| at.tinted(at.tint * brighter));
            for side in leaf.both_sides() {
                let sum = (side.diffuse() + leaf.transmittance()).max();
                assert!(sum <= 0.9901, "part {k}, {brighter} times as bright: {sum}");
            }
            passes += usize::from(leaf.transmittance().max() > 0.1);
        }
    }
    assert!(passes > 1000, "{passes}");
}

/// Rationale: exported documents share textures and store tints as factors. Expected: the mean colour of a healthy leaf
/// is that of the tinted leaf, except where it is nearly black; a scene with fixed mip levels for Mitsuba, in which
/// each tint is a material, has the same reflectance as before.
#[test]
fn exports_have_the_tints_of_instances() {
    let mut field = meadow("Instanced", 0.0);
    let bright = |s: Spectrum| Vec4::select(s.0.cmpge(Vec4::splat(0.02)), s.0, Vec4::ZERO);
    let off = |a: Spectrum, b: Spectrum| (bright(a) - bright(b)).abs().max_element();
    for tint in [vec3(1.1, 1.15, 1.02), vec3(0.9, 0.87, 0.98)] {
        let healthy = |m: &&Material| matches!(m, Material::Leaf(leaf) if !leaf.has_condition());
        for material in field.scene.materials.iter().filter(healthy) {
            let tinted = material.tinted(tint);
            let (dye, own) = (material.swatch().dyed(material.tint_factors(tint)), tinted.swatch());
            assert!(off(dye.mean.reflectance, own.mean.reflectance) < 1e-4, "{dye:?} {:?}", own.mean);
            assert!(off(dye.mean.transmittance, own.mean.transmittance) < 1e-4, "{dye:?} {:?}", own.mean);
            assert!(off(material.swatch().mean.reflectance, own.mean.reflectance) > 1e-4, "the tint has no effect");
        }
    }
    let before = colors(&field);
    furrow_output::mitsuba::fix_levels(&mut field.scene);
    assert!(field.scene.parts.iter().all(|part| part.tint() == Vec3::ONE));
    assert_eq!(colors(&field), before);
}
