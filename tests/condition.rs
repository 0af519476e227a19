//! Leaves in a condition: what is eaten is gone for everyone who asks, and nothing else moves.
//!
//! Rationale: labels, rays, both renderers and exports must see one leaf, and a page without a condition must stay the field that
//! it was. Expected: the label map loses exactly the pixels whose leaf was cut there; Embree and brute force agree on a field
//! of eaten leaves; a condition of zeros gives the same bits as none; a condition given to one plant leaves the others alone.
//! Source: none, these are identities.

mod common;

use common::program::{bits, field, shoot};
use furrow::accel::{Brute, EmbreeAccel};
use furrow::geometry::{Interaction, Intersect, Ray, Window};
use furrow::plant::ConditionDesc;
use furrow::render::label;
use furrow::render::label::NONE;
use furrow::scene::assemble::Options;
use furrow::scene::{Field, Part};

/// Everything that can be eaten, eaten.
const EATEN: &str = "(holes: 6, shot_holes: 10, bites: 2, tears: 1, wilt: 0)";

/// Plants of species at places, each with what stands behind it on the page, on no ground.
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

/// The same parts, as they were before anything was eaten.
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
    let flawless = ron::to_string(&ConditionDesc::flawless()).expect("words");
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
        // Posture and width are drawn by an ordinary condition too: the meshes are those of the eaten plant.
        let parts = whole(&eaten, &flawless);
        let scene = furrow::scene::Scene {
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
    let unmasked: Vec<furrow::accel::Surface<'_>> =
        surfaces.iter().map(|s| furrow::accel::Surface { mesh: s.mesh, mask: None }).collect();
    let brute = Brute::new(&unmasked);
    for y in 0..camera.height() {
        for x in 0..camera.width() {
            let i = (y * camera.width() + x) as usize;
            let part = before.parts[i];
            if part == NONE {
                assert_eq!(after.parts[i], NONE, "something appeared at {x} {y}");
                continue;
            }
            shown += 1;
            // Where on the part the pixel's centre lies, and what its mask says there.
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
    // As much of the picture as of the masks: blades are seen at all angles, and overlap.
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
    let brute = Brute::new(&surfaces);
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
    assert!(second(&a) == second(&b), "the first plant's condition moved the second");
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
    // A leaf's leaflets are one leaf to the labels.
    assert!(blades.iter().all(|p| p.tag == blades[0].tag));
}

/// Expected: under a sky of one radiance no pixel is brighter than the sky by more than 5 of its standard errors, and the mean of
/// the blades is what leaves absorb below it.
#[test]
fn sick_leaves_return_no_more_than_they_receive() {
    let ill = "(chlorosis: 1, spots: 20, scorched: 1, scorch: 0.2, dust: 0.5, splash: 15, reddening: 8)";
    let field = plants((120, 60), &[("sugar_beet", 16, &condition(ill))]);
    let (film, labels) = shoot(&field, 64, 2);
    let least = |p: &furrow::film::Pixel| (p.mean.0 - 5.0 * p.variance.map(f32::sqrt).0).max_element();
    let brightest = film.pixels.iter().map(least).fold(0.0, f32::max);
    assert!(brightest < 1.005, "{brightest}");
    let leaves = film.pixels.iter().zip(&labels.parts).filter(|(_, part)| **part != NONE).map(|(p, _)| p.mean.max());
    let (sum, count) = leaves.fold((0.0, 0), |(s, n), m| (s + m, n + 1));
    assert!(count > 200 && sum / (count as f32) < 0.97, "{}", sum / count as f32);
}

/// Expected: a wilted plant is lower, and its leaves reach the ground without going through it.
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

/// Expected: a page with the keyword of the last version reads, has its rims, and is told the new one; a page with the new one is not.
/// No leaf of the synthetic sets has a rim, for no frame that they stand for has any.
#[test]
fn the_old_keyword_of_rims_is_read_and_told() {
    let field = plants((24, 12), &[("sugar_beet", 16, &condition("(scorch_mm: 2)"))]);
    let [warning] = field.warnings.as_slice() else { panic!("{:?}", field.warnings) };
    assert!(warning.contains("`scorch_mm`") && warning.contains("`scorched`"), "{warning}");
    assert_eq!(field.plants[0].condition.unwrap().scorch_mm, 2.0);
    let field = plants((24, 12), &[("sugar_beet", 16, &condition("(scorched: 1, scorch: 0.1)"))]);
    assert_eq!(field.warnings, Vec::<String>::new());
    for set in ["a", "b", "c", "d"] {
        let page = std::path::PathBuf::from(format!("scenes/synthetic-{set}.ron"));
        let desc: furrow::scene::desc::FieldDesc = furrow::ron_file::RonFile::read(&page).unwrap().parse().unwrap();
        let none =
            |c: &Option<ConditionDesc>| c.as_ref().is_none_or(|c| c.scorched == furrow::ron_file::Vary::fixed(0.0));
        assert!(
            desc.crops.iter().all(|c| none(&c.condition)) && desc.weeds.iter().all(|w| none(&w.condition)),
            "{set}"
        );
    }
}
