//! Leaf condition: eaten areas are missing for every user of the leaf, and nothing else changes.
//!
//! Rationale: labels, rays, both renderers and exports must see the same leaf, and a scene file without a condition
//! must give the same field as before. Expected: the label map loses exactly the pixels whose leaf was cut there;
//! Embree and brute force agree on a field of eaten leaves; a condition of zeros gives the same bits as none; the
//! condition of one plant leaves the others unchanged. Source: none, these are identities.

use crate::common::program::{bits, field, shoot};
use furrow_base::geometry::{Hit, Interaction, Intersect, Mesh, Ray, Window};
use furrow_base::math::{Vec2, Vec3, smoothstep, vec2};
use furrow_base::ron_file::Vary;
use furrow_base::sampling::{Purpose, Stream};
use furrow_dataset::make::damage::damage;
use furrow_field::Field;
use furrow_field::PartKind;
use furrow_field::assemble::Options;
use furrow_grow::plant::condition::Bearer;
use furrow_grow::plant::{Condition, ConditionDesc, OrganKind};
use furrow_optics::optics::soil::LOESS;
use furrow_optics::texture::marks::Marks;
use furrow_render::accel::{BruteForce, EmbreeAccel};
use furrow_render::material::{ConditionOptics, Damage, LeafDesc, LeafMaterial, Material, Tones};
use furrow_render::render::label;
use furrow_render::render::label::NONE;
use furrow_render::scene::Part;
use std::f32::consts::PI;
use std::sync::Arc;

/// A condition with every kind of feeding damage.
const EATEN: &str = "(holes: 6, shot_holes: 10, bites: 2, tears: 1, wilt: 0)";

/// Builds a field of plants in a row without ground; each entry is a species, a BBCH stage and further scene file text.
fn plants(size: (u32, u32), entries: &[(&str, u32, &str)]) -> Field {
    let (w, h) = size;
    let entry = |(i, (species, bbch, more)): (usize, &(&str, u32, &str))| {
        let x = 0.16 * (i as f32 - 0.5 * (entries.len() as f32 - 1.0));
        format!("(species: \"scenes/species/{species}.ron\", growth: Bbch({bbch}), position_m: ({x}, 0) {more}),")
    };
    let all: String = entries.iter().enumerate().map(entry).collect();
    let text = format!(
        "Field(
            seed: 12,
            camera: Pinhole(size: ({w}, {h}), intrinsics: FieldOfView(horizontal_deg: 34), pose: Nadir(height_m: 0.7)),
            lights: [Constant(radiance: (1, 1, 1, 1))],
            plants: [{all}],
        )"
    );
    field(&text, &Options::default())
}

fn condition(of: &str) -> String {
    format!(", condition: {of}")
}

/// Returns the eaten field's parts with the masks of the flawless field.
fn whole(eaten: &Field, flawless: &Field) -> Vec<Part> {
    let mut parts = eaten.scene.parts.clone();
    for (part, model) in parts.iter_mut().zip(&flawless.scene.parts) {
        assert_eq!(part.tag, model.tag);
        part.mask.clone_from(&model.mask);
    }
    parts
}

#[test]
fn a_condition_of_zeros_is_no_condition() {
    let flawless = ron::to_string(&ConditionDesc::flawless()).expect("RON text");
    let without = plants((96, 48), &[("sugar_beet", 14, ""), ("peanut", 14, "")]);
    let with = plants((96, 48), &[("sugar_beet", 14, &condition(&flawless)), ("peanut", 14, "")]);
    assert_eq!(with.scene.materials.len(), without.scene.materials.len());
    let ((film, labels), (film0, labels0)) = (shoot(&with, 4, 2), shoot(&without, 4, 2));
    assert_eq!(bits(&film), bits(&film0));
    assert_eq!(labels.parts, labels0.parts);
    assert!(with.plants[0].condition.is_some() && without.plants[0].condition.is_none());
}

#[test]
fn labels_lose_what_is_eaten_and_nothing_else() {
    let flawless = plants((480, 240), &[("sugar_beet", 16, "")]);
    let eaten = plants((480, 240), &[("sugar_beet", 16, &condition(EATEN))]);
    let camera = &eaten.scene.camera;
    let window = Window::full(camera.width(), camera.height());
    let before = {
        // A normal condition also draws posture and width, so the meshes are those of the eaten plant.
        let parts = whole(&eaten, &flawless);
        let scene = furrow_render::scene::Scene {
            parts,
            materials: Vec::new(),
            lights: Vec::new(),
            camera: *camera,
            ..flawless.scene
        };
        let geometry = EmbreeAccel::build(&scene.surfaces(), 1).expect("an accelerator");
        label(&geometry, &scene.parts, camera, window)
    };
    let geometry = EmbreeAccel::build(&eaten.scene.surfaces(), 1).expect("an accelerator");
    let after = label(&geometry, &eaten.scene.parts, camera, window);
    let (mut lost, mut shown) = (0, 0);
    let surfaces = eaten.scene.surfaces();
    let unmasked: Vec<furrow_render::accel::Surface<'_>> =
        surfaces.iter().map(|s| furrow_render::accel::Surface { mask: None, ..*s }).collect();
    let brute = BruteForce::new(&unmasked);
    for y in 0..camera.height() {
        for x in 0..camera.width() {
            let i = (y * camera.width() + x) as usize;
            let part = before.parts[i];
            if part == NONE {
                assert_eq!(after.parts[i], NONE, "a part appeared at {x} {y}");
                continue;
            }
            shown += 1;
            // Position of the pixel's centre on the part, and the mask's value there.
            let (origin, direction) = camera.centre_ray(x, y);
            let ray = Ray::until(origin, direction, f32::INFINITY);
            let mesh = &eaten.scene.parts[part as usize].mesh;
            let depth = |t: u32| brute.triangle(&ray, part, t);
            let hits = (0..mesh.triangles.len() as u32).filter_map(depth);
            let mask = eaten.scene.parts[part as usize].mask.as_deref();
            let there = hits.map(|h| Interaction::new(mesh, &h, 0.0).uv).any(|uv| mask.is_none_or(|m| m.opaque_at(uv)));
            assert_eq!(after.parts[i] == part, there, "at {x} {y}");
            lost += u32::from(after.parts[i] != part);
        }
    }
    assert!(lost > 200 && lost < shown / 3, "{lost} of {shown}");
    // The lost fractions of image and masks are similar: blades are seen at all angles, and overlap.
    let share = |parts: &[Part], of: &[Part]| {
        let count =
            |parts: &[Part]| parts.iter().filter_map(|p| p.mask.as_ref()).map(|m| m.count()).sum::<u64>() as f64;
        1.0 - count(parts) / count(of)
    };
    let cut = share(&eaten.scene.parts, &whole(&eaten, &plants((48, 24), &[("sugar_beet", 16, "")])));
    assert!(cut > 0.0 && cut < 0.3, "{cut}");
}

#[test]
fn embree_and_brute_force_agree_on_eaten_leaves() {
    let c = condition(EATEN);
    let field = plants((120, 60), &[("sugar_beet", 14, &c), ("peanut", 12, &c), ("chenopodium", 14, &c)]);
    let scene = &field.scene;
    let window = Window::full(scene.camera.width(), scene.camera.height());
    let surfaces = scene.surfaces();
    let fast = label(&EmbreeAccel::build(&surfaces, 1).expect("an accelerator"), &scene.parts, &scene.camera, window);
    let brute = BruteForce::new(&surfaces);
    let slow = label(&brute as &dyn Intersect, &scene.parts, &scene.camera, window);
    let differ = fast.parts.iter().zip(&slow.parts).filter(|(a, b)| a != b).count();
    assert!(differ <= 1, "{differ} pixels");
    assert!(fast.parts.iter().filter(|p| **p != NONE).count() > 300);
}

#[test]
fn a_condition_is_its_plants_own_and_the_same_every_time() {
    let pair = |first: &str| plants((96, 48), &[("sugar_beet", 14, first), ("sugar_beet", 14, &condition("()"))]);
    let (a, b, c) = (pair(""), pair(&condition("(holes: 5)")), pair(&condition("(holes: 5)")));
    let second = |f: &Field| {
        let own = f.scene.parts.iter().filter(|p| p.tag.plant == 2);
        own.map(|p| (p.mesh.clone(), p.mask.as_deref().cloned())).collect::<Vec<_>>()
    };
    assert!(second(&a) == second(&b), "the first plant's condition changed the second");
    assert_eq!(a.plants[1], b.plants[1]);
    let ((film, _), (again, _)) = (shoot(&b, 4, 1), shoot(&c, 4, 2));
    assert_eq!(bits(&film), bits(&again));
}

#[test]
fn leaflets_are_eaten_one_by_one() {
    let field = plants((96, 48), &[("peanut", 14, &condition("(holes: 8)"))]);
    let blades: Vec<&Part> = field.scene.parts.iter().filter(|p| p.tag.leaf == 3 && p.mask.is_some()).collect();
    assert!(blades.len() >= 4, "{} leaflets", blades.len());
    let masks: Vec<_> = blades.iter().filter_map(|p| p.mask.as_deref()).collect();
    let differ = (1..masks.len()).any(|i| masks[i] != masks[0]);
    assert!(differ, "all leaflets have the same holes");
    // All leaflets of a leaf have the same label.
    assert!(blades.iter().all(|p| p.tag == blades[0].tag));
}

/// Expected: under a sky of uniform radiance, no pixel is brighter than the sky by more than 5 standard errors, and the
/// mean over the blades is lower because leaves absorb light.
#[test]
fn sick_leaves_return_no_more_than_they_receive() {
    let ill = "(chlorosis: 1, spots: 20, scorched: 1, scorch: 0.2, dust: 0.5, splash: 15, reddening: 8)";
    let field = plants((120, 60), &[("sugar_beet", 16, &condition(ill))]);
    let (film, labels) = shoot(&field, 64, 2);
    let least = |p: &furrow_render::film::Pixel| (p.mean.0 - 5.0 * p.variance.map(f32::sqrt).0).max_element();
    let brightest = film.pixels.iter().map(least).fold(0.0, f32::max);
    assert!(brightest < 1.005, "{brightest}");
    let leaves = film.pixels.iter().zip(&labels.parts).filter(|(_, part)| **part != NONE).map(|(p, _)| p.mean.max());
    let (sum, count) = leaves.fold((0.0, 0), |(s, n), m| (s + m, n + 1));
    assert!(count > 200 && sum / (count as f32) < 0.97, "{}", sum / count as f32);
}

/// Expected: a wilted plant is lower, and its leaves reach the ground without penetrating it.
#[test]
fn wilted_plants_are_lower_and_stay_above_the_ground() {
    let height = |wilt: f32| {
        let only = format!("(wilt: {wilt}, holes: 0, shot_holes: 0, bites: 0, tears: 0)");
        let field = plants((24, 12), &[("sugar_beet", 16, &condition(&only))]);
        let lowest = field.scene.parts.iter().filter_map(|p| p.mesh.bounds()).map(|b| b.0.z).fold(1.0, f32::min);
        assert!(lowest > -0.012, "{wilt}: {lowest}");
        field.plants[0].height
    };
    let all = [0.0, 0.4, 0.8].map(height);
    assert!(all[1] < 0.95 * all[0] && all[2] < 0.9 * all[1], "{all:?}");
}

/// Rationale: none of the photographs that the synthetic datasets represent shows a dead leaf margin. Expected: no leaf
/// of their scenes has one.
#[test]
fn no_leaf_of_the_synthetic_datasets_has_a_dead_margin() {
    for set in ["a", "b", "c", "d"] {
        let page = std::path::PathBuf::from(format!("scenes/synthetic-{set}.ron"));
        let desc: furrow_field::desc::FieldDesc = furrow_base::ron_file::RonFile::read(&page).unwrap().parse().unwrap();
        let none = |c: &Option<ConditionDesc>| {
            c.as_ref().is_none_or(|c| c.scorched == furrow_base::ron_file::Vary::fixed(0.0))
        };
        assert!(
            desc.crops.iter().all(|c| none(&c.condition)) && desc.weeds.iter().all(|w| none(&w.condition)),
            "{set}"
        );
    }
}

/// Size of a blade without an image texture, mm.
const IMAGE: Vec2 = vec2(60.0, 100.0);

/// The oldest leaf of plant `k`, at ground level, and its marks.
fn leaf(desc: &ConditionDesc, condition: &Condition, k: u64) -> (Material, Marks) {
    let bearer = Bearer {
        age: 1.0,
        cotyledon: false,
        share: 1.0,
        height: 0.0,
        met: None,
        image_mm: IMAGE,
        mask: None,
        margin: None,
    };
    let marks = bearer.draw_marks(desc, condition, &Stream::of(5, 0, Purpose::Test, k));
    let leaf = LeafDesc::default();
    let tones = Arc::new(Tones::new(&leaf.pigments));
    let optics = ConditionOptics::new((&leaf.pigments, tones), Some(marks.clone()), 0.0, LOESS);
    (Material::Leaf(LeafMaterial::new(&leaf, None).worn(optics, 1.0)), marks)
}

/// Damage at sample points of a leaf `step` mm apart, seen along `direction`; points that are cut away are left out.
fn places(of: &(Material, Marks), step: f32, direction: Vec3) -> Vec<Damage> {
    let corners = [Vec2::ZERO, 2.0 * Vec2::X, 2.0 * Vec2::Y];
    // Texture rows run downwards, so the upper side faces up.
    let positions = corners.map(|p| Vec3::new(p.x, -p.y, 0.0)).to_vec();
    let mesh = Mesh::smooth(positions, corners.to_vec(), vec![[0, 2, 1]]);
    let mask = of.1.cuts().then(|| of.1.cut(None));
    let (columns, rows) = ((IMAGE.x / step) as usize, (IMAGE.y / step) as usize);
    let at = |i: usize| {
        let uv = (vec2((i % columns) as f32, (i / columns) as f32) + 0.5) / vec2(columns as f32, rows as f32);
        let there = mask.as_ref().is_none_or(|mask| mask.opaque_at(uv));
        // Barycentric coordinates of the second and the third vertex.
        let hit = Hit { part: 0, triangle: 0, u: 0.5 * uv.y, v: 0.5 * uv.x, t: 1.0 };
        there.then(|| of.0.damage(&Interaction::new(&mesh, &hit, 0.0), direction))
    };
    (0..columns * rows).filter_map(at).collect()
}

/// Mean of `of` over the sample points of `count` leaves.
fn mean(desc: &ConditionDesc, condition: &Condition, count: u64, of: impl Fn(&Damage) -> f32) -> f32 {
    let one = |k: u64| {
        let all = places(&leaf(desc, condition, k), 1.5, -Vec3::Z);
        all.iter().map(&of).sum::<f32>() / all.len() as f32
    };
    (0..count).map(one).sum::<f32>() / count as f32
}

/// Rationale: the damage maps must agree with the condition. Expected: over the mean of leaves, yellowing and dust
/// equal the condition's value times the mean of its lognormal spread (σ 0.4, 1.083), within 4 standard errors of 200
/// leaves (0.43 / √200). The lower side has no dust, and a healthy leaf has no damage.
#[test]
fn damage_is_what_the_condition_says() {
    let flawless = ConditionDesc::flawless();
    let yellow = mean(&flawless, &Condition { chlorosis: 0.25, ..Condition::default() }, 200, |d| d.chlorosis);
    assert!((yellow / (0.25 * 1.083) - 1.0).abs() < 0.13, "{yellow}");
    let dusty = Condition { dust: 0.2, ..Condition::default() };
    let dust = mean(&flawless, &dusty, 200, |d| d.soil);
    assert!((dust / (0.2 * 1.083) - 1.0).abs() < 0.13, "{dust}");
    assert!(
        places(&leaf(&flawless, &dusty, 1), 5.0, Vec3::Z).iter().all(|d| d.soil == 0.0),
        "the lower side must have no soil"
    );
    let healthy = leaf(&flawless, &Condition::default(), 1);
    assert!(places(&healthy, 2.0, -Vec3::Z).iter().all(|d| *d == Damage::default()));
}

/// Expected: a spot of radius r is necrotic over r² ∫ (1 − (1 − r(d)) (1 − b(d))) 2πd dd, minus the area outside the
/// leaf: a disc of radius R in a width W loses the fraction 4R / 3πW. For 300 leaves with 4 spots on average, 4
/// standard errors are 12 %.
#[test]
fn spots_are_dead_over_the_area_of_their_radius() {
    let radius = 3.0;
    let desc = ConditionDesc { spot_mm: Vary::fixed(f64::from(radius)), ..ConditionDesc::flawless() };
    let condition = Condition { spots: 4.0, ..Condition::default() };
    let dead = |d: f32| {
        let (rim, brown) = (smoothstep(0.6, 0.8, d) * smoothstep(1.2, 0.95, d), smoothstep(0.95, 0.7, d));
        1.0 - (1.0 - rim) * (1.0 - brown)
    };
    let ring = |i: u32| (i as f32 + 0.5) / 1000.0 * 1.2;
    let area: f32 = (0..1000).map(|i| dead(ring(i)) * 2.0 * PI * ring(i) * 1.2e-3).sum::<f32>() * radius * radius;
    let inside = |width: f32| 1.0 - 4.0 * radius / (3.0 * PI * width);
    let expected = 4.0 * area * inside(IMAGE.x) * inside(IMAGE.y) / (IMAGE.x * IMAGE.y);
    let found = mean(&desc, &condition, 300, |d| d.necrosis);
    assert!((found / expected - 1.0).abs() < 0.12, "{found}, not {expected}");
    let yellow = mean(&desc, &condition, 20, |d| d.chlorosis + d.necrosis);
    assert!(yellow > mean(&desc, &condition, 20, |d| d.necrosis), "spots have a yellow border");
}

/// Expected: the rim of a hole of radius r is a ring 0.35 mm wide with area π ((r + 0.35)² − r²), within 10 % over 60
/// leaves; a torn leaf has a rim, too.
#[test]
fn edges_are_rings_round_holes() {
    let desc = ConditionDesc { hole_mm: Vary::fixed(3.0), ..ConditionDesc::flawless() };
    let condition = Condition { holes: 2.0, ..Condition::default() };
    let (mut edges, mut holes, step) = (0.0, 0, 0.25);
    for k in 0..60 {
        let of = leaf(&desc, &condition, k);
        edges += places(&of, step, -Vec3::Z).iter().filter(|d| d.edge).count() as f32 * step * step;
        holes += of.1.holes();
    }
    let ring = PI * (3.35 * 3.35 - 9.0) * (1.0 - 4.0 * 3.0 / (3.0 * PI) * (1.0 / IMAGE.x + 1.0 / IMAGE.y));
    let share = edges / (holes as f32 * ring);
    assert!(holes > 80 && (share - 1.0).abs() < 0.1, "{share} of {holes}");
    let torn = Condition { tears: 3.0, ..Condition::default() };
    assert!(places(&leaf(&desc, &torn, 2), 0.25, -Vec3::Z).iter().any(|d| d.edge));
}

/// Rationale: damage maps are traced with separate rays, which must equal those of the labels. Expected: a flawless
/// plant has no damage; on a sick plant, damage occurs only on blades and cotyledons, and every kind occurs.
#[test]
fn damage_lies_where_labels_show_blades() {
    let seen = |field: &Field| {
        let camera = &field.scene.camera;
        let geometry = EmbreeAccel::build(&field.scene.surfaces(), 1).expect("an accelerator");
        let labels = label(&geometry, &field.scene.parts, camera, Window::full(camera.width(), camera.height()));
        (damage(&field.scene, &geometry), labels)
    };
    let (none, _) = seen(&plants((240, 120), &[("sugar_beet", 16, "")]));
    assert!(none.iter().all(|d| *d == Damage::default()));
    let sick = "(holes: 6, bites: 2, spots: 8, chlorosis: 0.5, dust: 0.2)";
    let field = plants((480, 240), &[("sugar_beet", 16, &condition(sick))]);
    let (all, labels) = seen(&field);
    let blade = |part: u32| {
        let kind = field.kinds.get(part as usize);
        matches!(kind, Some(PartKind::Organ(OrganKind::Blade | OrganKind::Cotyledon)))
    };
    for (i, (at, part)) in all.iter().zip(&labels.parts).enumerate() {
        assert!(*at == Damage::default() || blade(*part), "pixel {i}: {at:?}");
        assert!(at.chlorosis + at.necrosis < 1.0001, "pixel {i}: {at:?}");
    }
    let sum = |of: fn(&Damage) -> f32| all.iter().map(of).sum::<f32>();
    assert!(sum(|d| d.chlorosis) > 100.0 && sum(|d| d.necrosis) > 10.0 && sum(|d| d.soil) > 100.0);
    assert!(all.iter().any(|d| d.edge));
}
