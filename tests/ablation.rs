//! Edits for ablation studies: each changes exactly one aspect of a field, as its name says, and leaves everything else
//! bit-identical.
//!
//! Rationale: the effect of removing one aspect can only be measured if nothing else changes with it. Expected: of
//! geometry, surfaces, lights, camera, sensor and render options, only the group the edit names differs; labels stay
//! the same where the edit says so; datasets with edits can be resumed like those without. Source: none needed,
//! equality is exact.

use crate::common::dataset::{fail, made, path, same, succeed, tree, verb};
use crate::common::program::{SMALL, bits, scratch, trace};
use furrow_base::geometry::{Hit, Interaction, Window};
use furrow_base::math::Vec3;
use furrow_base::sampling::Points;
use furrow_dataset::Set;
use furrow_dataset::read::native;
use furrow_field::ablation::{Change, EDITS, Edit, FULL};
use furrow_field::assemble::Options;
use furrow_field::{Field, PlantRecord};
use furrow_optics::light::{Emitter, Light};
use furrow_optics::sensor::Photograph;
use furrow_render::accel::EmbreeAccel;
use furrow_render::film::Film;
use furrow_render::integrator::{PathTracer, World};
use furrow_render::material::Material;
use furrow_render::render::{self, LabelMap, RenderMonitor, Settings};
use furrow_render::scene::Part;
use furrow_render::settings::{Engine, Quality, RenderOptions};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::Path;
use std::process::Stdio;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, LazyLock, Mutex, OnceLock};
use std::time::{Duration, Instant};

/// Render options of the small field without an edit.
fn options() -> RenderOptions {
    RenderOptions::path_traced(Quality::spp(2))
}

/// Scene file with a field that contains everything the edits remove.
const DRIVING: &str = "tests/ref/driving.ron";

/// Fields by the names of their edits.
type Fields = HashMap<&'static str, Arc<OnceLock<Arc<Field>>>>;

/// The field with an edit, grown once for all tests that ask for it.
fn grow(edit: &Edit) -> Arc<Field> {
    static ALL: LazyLock<Mutex<Fields>> = LazyLock::new(Mutex::default);
    let one = ALL.lock().expect("no test panics here").entry(edit.name).or_default().clone();
    one.get_or_init(|| Arc::new(grow_on(edit, 2))).clone()
}

fn grow_on(edit: &Edit, threads: usize) -> Field {
    let options = Options { width: Some(72), ..Options::default() };
    let source = edit.open(Path::new(DRIVING), furrow_base::input::Scope::Anywhere).unwrap();
    render::pool(threads).unwrap().install(|| edit.field(&source, &options)).unwrap()
}

/// Rendered outputs of a field.
struct Rendered {
    film: Film,
    photograph: Photograph,
    labels: LabelMap,
}

fn shoot(edit: &Edit, field: &Field, threads: usize) -> Rendered {
    let scene = &field.scene;
    let RenderOptions { quality, techniques, .. } = edit.options(options());
    let (spp, max_depth) = (quality.spp, techniques.max_depth);
    let tracer =
        PathTracer { max_depth: max_depth.unwrap_or(PathTracer::default().max_depth), ..PathTracer::default() };
    render::pool(threads).unwrap().install(|| {
        let geometry = EmbreeAccel::build(&scene.surfaces(), threads as u32).unwrap();
        let window = Window::full(scene.camera.width(), scene.camera.height());
        let settings = Settings { spp, seed: field.sample_seed(), window, points: Points::Sobol };
        let watch = RenderMonitor { done: &|_| (), stop: &AtomicBool::new(false) };
        let film = render::render(&World::new(scene, &geometry), &tracer, &settings, &watch).unwrap();
        let labels = render::label(&geometry, &scene.parts, &scene.camera, window);
        let labels = edit.labels(labels, &film, &scene.tags());
        Rendered { photograph: edit.photograph(field, &film), film, labels }
    })
}

/// Hash of the geometry of all parts and of their tags.
fn shape(field: &Field) -> String {
    let numbers = field.scene.parts.iter().flat_map(|part| {
        let corners = part.mesh.positions.iter().chain(&part.mesh.normals).flat_map(Vec3::to_array).map(f32::to_bits);
        let tag = [part.tag.plant, u32::from(part.tag.leaf), part.tag.class as u32];
        corners.chain(part.mesh.triangles.iter().flatten().copied()).chain(tag).chain([u32::from(part.mask.is_some())])
    });
    crate::common::program::hash(numbers)
}

/// BSDF values at a few points of every part.
fn surfaces(field: &Field) -> Vec<String> {
    let scatter = |(i, part): (usize, &Part)| {
        let count = part.mesh.triangles.len() as u32;
        let at = |triangle: u32| {
            let hit = Hit { part: i as u32, triangle, u: 0.3, v: 0.3, t: 1.0 };
            let at = Interaction::new(&part.mesh, &hit, 1e-3);
            let wo = if at.ng.z > 0.0 { Vec3::new(0.3, 0.2, 0.9) } else { Vec3::new(0.1, 0.4, -0.9) };
            format!("{:?}", field.scene.materials[part.material as usize].scatter(&at, wo.normalize()))
        };
        (0..7).map(|k| at(k * (count - 1) / 7)).collect::<String>()
    };
    field.scene.parts.iter().enumerate().map(scatter).collect()
}

/// Kind of each light, and the irradiance that it gives level ground.
fn lights(field: &Field) -> Vec<String> {
    let recorded = |light: &Light| match light {
        Light::Sun(sun) => format!("{sun:?}"),
        Light::Sky(sky) => format!("sky {:?}", sky.horizontal_irradiance()),
        Light::Constant(environment) => format!("{environment:?}"),
        Light::EnvironmentMap(map) => format!("environment map {:?}", map.horizontal_irradiance()),
        Light::Lamp(lamp) => format!("{lamp:?}"),
    };
    field.scene.lights.iter().map(recorded).collect()
}

#[test]
fn names_are_words_that_find_their_edits() {
    let mut names = BTreeSet::from([FULL.name]);
    for edit in EDITS {
        assert!(names.insert(edit.name), "{} twice", edit.name);
        let word = |w: &str| !w.is_empty() && w.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit());
        assert!(edit.name.split('-').all(word), "{}", edit.name);
        assert!(edit.about.len() > 10 && !edit.about.ends_with('.'), "{}", edit.name);
        assert_eq!(Edit::named(edit.name).unwrap().name, edit.name);
    }
    let message = Edit::named("no-skye").unwrap_err().to_string();
    assert!(message.contains("no edit `no-skye`") && message.contains("did you mean `no-sky`?"), "{message}");
    assert!(EDITS.iter().all(|e| message.contains(e.name)), "{message}");
}

#[test]
fn every_edit_changes_one_thing_and_nothing_else() {
    let full = grow(&FULL);
    for edit in EDITS {
        let field = grow(edit);
        let name = edit.name;
        let differs = [
            ("shape", shape(&field) != shape(&full)),
            ("lights", lights(&field) != lights(&full)),
            (
                "lens",
                field.scene.camera != full.scene.camera || field.scene.filter.filter() != full.scene.filter.filter(),
            ),
            ("sensor", field.sensor != full.sensor),
            ("options", edit.options(options()) != options()),
        ];
        let found: Vec<&str> = differs.into_iter().filter(|(_, differs)| *differs).map(|(what, _)| what).collect();
        let expected: &[&str] = match edit.change {
            Change::Growth(_) => &["shape"],
            Change::Lights(_) => &["lights"],
            Change::Lens(_) => &["lens"],
            Change::Sensor(_) => &["sensor"],
            Change::Rendering(_) => &["options"],
            Change::Nothing | Change::Materials(_) | Change::Photograph(_) | Change::Labels(_) => &[],
        };
        assert_eq!(found, expected, "{name}");
        if !matches!(edit.change, Change::Growth(_)) {
            let other = surfaces(&field) != surfaces(&full);
            assert_eq!(other, matches!(edit.change, Change::Materials(_)), "{name}: surfaces");
        }
        // The random draws of the field are unchanged, and the same plants are at the same positions.
        assert_eq!(field.conditions, full.conditions, "{name}");
        assert_eq!((&field.hash, &field.species, field.sample_seed()), (&full.hash, &full.species, full.sample_seed()));
        // Plants outside the view that cast no visible shadow are left out; whether that happens depends on their size.
        let number = |p: &PlantRecord| p.number;
        let both: Vec<(&PlantRecord, &PlantRecord)> = field
            .plants
            .iter()
            .filter_map(|p| Some((p, &full.plants[full.plants.binary_search_by_key(&p.number, number).ok()?])))
            .collect();
        assert!(both.len() + 2 >= full.plants.len(), "{name}");
        for (is, was) in both {
            let place = |p: &PlantRecord| (p.species.clone(), p.position.truncate().to_array());
            assert_eq!(place(is), place(was), "{name}");
        }
    }
}

#[test]
fn every_edit_shows_and_keeps_labels_where_it_says_so() {
    let full = shoot(&FULL, &grow(&FULL), 2);
    // `raster.rs` tests the edits of the raster engine, if that is built.
    for edit in EDITS.iter().filter(|edit| edit.options(options()).engine == Engine::Trace) {
        let shot = shoot(edit, &grow(edit), 2);
        let same_labels = shot.labels.tags == full.labels.tags;
        assert_eq!(same_labels, edit.keeps_labels, "{}", edit.name);
        let same_film = bits(&shot.film) == bits(&full.film);
        let behind = matches!(edit.change, Change::Sensor(_) | Change::Photograph(_) | Change::Labels(_));
        // The denoiser changes the film's image, and it is not available everywhere.
        let denoised = edit.options(options()).quality.denoise;
        assert_eq!(same_film, behind || denoised, "{}", edit.name);
        let same_picture = shot.photograph == full.photograph;
        assert_eq!(same_picture, matches!(edit.change, Change::Labels(_)) || denoised, "{}", edit.name);
    }
}

/// Parts of all plants, in order.
fn plant_parts(field: &Field) -> impl Iterator<Item = &Part> {
    field.scene.parts.iter().filter(|p| p.tag.plant > 0)
}

#[test]
fn edits_do_what_their_names_say() {
    let full = grow(&FULL);
    let named = |name: &str| grow(Edit::named(name).unwrap());
    let is_ground = |f: &Field, p: &Part| matches!(f.scene.materials[p.material as usize], Material::Ground(_));

    let flat = named("flat-soil");
    let ground: Vec<&Part> = flat.scene.parts.iter().filter(|p| is_ground(&flat, p)).collect();
    assert_eq!(ground.len(), 1, "clods");
    assert!(ground[0].mesh.positions.iter().all(|p| p.z == 0.0));
    // The same plants, moved down to the flat ground. Leaves that lie on crumbs there lie lower by their height, at most 12 mm.
    assert_eq!(flat.plants.len(), full.plants.len());
    let mut exact = [0, 0];
    for (is, was) in plant_parts(&flat).zip(plant_parts(&full)) {
        assert_eq!(is.tag, was.tag);
        let foot = full.plants.iter().find(|p| p.number == is.tag.plant).unwrap().position;
        let down = |(is, was): (&Vec3, &Vec3)| (*was - *is - Vec3::new(0.0, 0.0, foot.z)).length();
        let far = is.mesh.positions.iter().zip(&was.mesh.positions).map(down).fold(0.0, f32::max);
        assert!(far < 0.012, "plant {}: {far}", is.tag.plant);
        exact[usize::from(far < 1e-5)] += 1;
    }
    assert!(exact[1] > exact[0], "{exact:?}");

    // Almost all of a flat blade faces one way; it bends only where it leaves the petiole.
    let flat = named("flat-leaves");
    let blades = |f: &Field| -> Vec<Part> {
        let leaves = f.scene.parts.iter().filter(|p| p.tag.plant > 0 && p.mask.is_some());
        leaves.cloned().collect()
    };
    assert_eq!(blades(&flat).len(), blades(&full).len());
    for blade in blades(&flat) {
        let faces: Vec<Vec3> = (0..blade.mesh.triangles.len() as u32)
            .map(|i| {
                let [a, b, c] = blade.mesh.corners(i);
                (b - a).cross(c - a)
            })
            .collect();
        let mean = faces.iter().sum::<Vec3>().normalize();
        let level: f32 = faces.iter().filter(|n| n.normalize_or_zero().dot(mean) > 0.998).map(|n| n.length()).sum();
        let all: f32 = faces.iter().map(|n| n.length()).sum();
        assert!(level > 0.8 * all, "plant {} leaf {}: {}", blade.tag.plant, blade.tag.leaf, level / all);
    }

    let coarse = named("low-poly");
    let count = |f: &Field| blades(f).iter().map(|b| b.mesh.triangles.len()).max().unwrap();
    assert!(count(&coarse) == 16 && count(&full) > 64, "{} of {}", count(&coarse), count(&full));

    // All plants of a species and an age share one mesh: here crops and weeds; one beet has an age of its own.
    let alike = named("one-mesh");
    let mut groups: BTreeMap<(&str, u32), Vec<_>> = BTreeMap::new();
    for plant in &alike.plants {
        groups.entry((&plant.species, plant.age_days.to_bits())).or_default().push(plant);
    }
    assert!(groups.len() <= 3 && alike.plants.len() > 4, "{} groups of {}", groups.len(), alike.plants.len());
    for plants in groups.values() {
        let area = |number: u32| -> Vec<f32> {
            let parts = alike.scene.parts.iter().filter(|p| p.tag.plant == number);
            parts.map(|p| p.mesh.area()).collect()
        };
        let first = area(plants[0].number);
        for plant in plants {
            assert!(area(plant.number).iter().zip(&first).all(|(a, b)| (a / b - 1.0).abs() < 1e-3));
            assert_eq!((plant.leaves, plant.bbch), (plants[0].leaves, plants[0].bbch));
        }
    }

    let irradiance = |f: &Field| f.scene.lights.iter().map(Light::horizontal_irradiance).fold(0.0, |s, e| s + e.mean());
    let near = |name: &str| (irradiance(&named(name)) / irradiance(&full) - 1.0).abs();
    assert!(near("hard-ambient") < 1e-4 && near("point-light") < 1e-4 && near("no-sky") > 0.05);
}

/// Expected: the number of threads changes nothing, with or without an edit.
#[test]
fn edited_fields_are_the_same_on_any_number_of_threads() {
    for name in ["flat-soil", "one-mesh", "smooth-labels"] {
        let edit = Edit::named(name).unwrap();
        let field = grow(edit);
        let [a, b] = [1, 3].map(|threads| shoot(edit, &field, threads));
        assert_eq!(bits(&a.film), bits(&b.film), "{name}");
        assert_eq!(a.labels, b.labels, "{name}");
    }
}

/// Returns the command `trace ablate` on the small scene: two images in each dataset.
fn ablate(out: &Path, more: &[&str]) -> std::process::Command {
    let mut command = trace(&["ablate", "--scene", SMALL, "--count", "2", "--width", "64", "--spp", "2", "--quiet"]);
    command.args(["--out", path(out)]).args(more);
    command
}

#[test]
fn a_dataset_of_each_edit_has_the_same_files_and_labels() {
    let (_keep, out) = scratch();
    let edits = ["no-sky", "no-nir", "low-poly", "smooth-labels", "spp-4"];
    let done = succeed(ablate(&out, &["--only", &edits.join(",")]));
    let paths = String::from_utf8(done.stdout).unwrap();
    let names = |folder: &Path| -> Vec<String> {
        let all = tree(folder).into_keys().filter(|name| name.starts_with("images/"));
        all.collect()
    };
    let full = out.join("full");
    for name in edits {
        let folder = out.join(name);
        assert!(paths.contains(&format!("{name}/manifest.json")), "{paths}");
        assert_eq!(names(&folder), names(&full), "{name}");
        let set = Set::open(&folder).unwrap();
        let rendering = set.recipe.rendering().unwrap();
        assert_eq!(rendering.edit.as_deref(), Some(name));
        assert_eq!(rendering.spp, if name == "spp-4" { 4 } else { 2 });
        for image in ["000000", "000001"] {
            let [theirs, ours] = [&folder, &full].map(|f| native::read(f, image).unwrap());
            let same =
                (&theirs.semantics, &theirs.plants, &theirs.leaves) == (&ours.semantics, &ours.plants, &ours.leaves);
            assert_eq!(same, Edit::named(name).unwrap().keeps_labels, "{name} {image}");
            assert_eq!(theirs.record.conditions, ours.record.conditions, "{name} {image}");
        }
    }
    assert!(Set::open(&full).unwrap().recipe.rendering().unwrap().edit.is_none());
    // The dataset can be generated again on its own by the name of its edit, and its images record that name.
    let (_keep, alone) = scratch();
    succeed(trace(&[
        "dataset",
        "--scene",
        SMALL,
        "--count",
        "2",
        "--width",
        "64",
        "--spp",
        "2",
        "--edit",
        "low-poly",
        "--quiet",
        "--out",
        path(&alone),
    ]));
    same(&tree(&alone), &tree(&out.join("low-poly")));
    let message = succeed(verb("verify", &alone, &["--rerender", "1"])).stderr;
    assert!(String::from_utf8_lossy(&message).contains("1 rendered again and the same; 0 faults"));
    let picture = std::fs::read(alone.join("images/000000/semantics.png")).unwrap();
    assert!(picture.windows(14).any(|bytes| bytes == b"edit: low-poly"));
}

#[test]
fn killed_it_ends_as_if_never_killed() {
    let (_keep, whole) = scratch();
    let (_keep, data) = scratch();
    let more = ["--only", "no-coat,flat-leaves"];
    let begin = Instant::now();
    succeed(ablate(&whole, &more));
    let once = begin.elapsed();
    // The state after a kill during the first file of a dataset.
    std::fs::create_dir_all(data.join("full")).unwrap();
    std::fs::write(data.join("full/.furrow-half"), "half").unwrap();
    for part in [0.3, 0.5, 0.7] {
        let mut child = ablate(&data, &more).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        std::thread::sleep(once.mul_f64(part).min(Duration::from_secs(10)));
        child.kill().unwrap();
        child.wait().unwrap();
    }
    succeed(ablate(&data, &more));
    same(&tree(&data), &tree(&whole));
    // No image is rendered twice.
    let before = made(&data.join("no-coat")).len();
    succeed(ablate(&data, &more));
    assert_eq!(made(&data.join("no-coat")).len(), before);
}

#[test]
fn shards_make_the_bytes_of_one_run() {
    let (_keep, whole) = scratch();
    let (_keep, parts) = scratch();
    let only = |more: &[&'static str]| [&["--only", "direct-light"], more].concat();
    succeed(ablate(&whole, &only(&[])));
    let message = fail(ablate(&parts, &only(&["--shard", "0/2"])), 2);
    assert!(message.contains("--plan"), "{message}");
    succeed(ablate(&parts, &only(&["--plan"])));
    assert!(made(&parts.join("full")).is_empty());
    for shard in ["1/2", "0/2"] {
        succeed(ablate(&parts, &only(&["--shard", shard])));
    }
    assert_eq!(made(&parts.join("direct-light")), [0, 1]);
    succeed(ablate(&parts, &only(&[])));
    assert_eq!(made(&parts.join("direct-light")), [0, 1]);
    same(&tree(&parts), &tree(&whole));
}

#[test]
fn impossible_requests_are_reported_before_anything_is_written() {
    let (_keep, out) = scratch();
    for (more, words) in [
        (&["--only", "no-sky,no-skye"][..], "did you mean `no-sky`?"),
        (&["--except", "sky"], "there is no edit `sky`"),
        (&["--only", "spp-4", "--spp", "4"], "already rendered like this"),
        (&["--only", "no-sky", "--except", "no-sky"], "cannot be used with"),
    ] {
        let mut command = trace(&["ablate", "--scene", SMALL, "--count", "2", "--out", path(&out)]);
        command.args(more);
        let message = fail(command, 2);
        assert!(message.contains(words), "{message}");
        assert!(!out.exists());
    }
    let page = ["--scene", SMALL, "--width", "64", "--out", path(&out)];
    let message = fail(trace(&[&page[..], &["--edit", "x"]].concat()), 2);
    assert!(
        message.contains("there is no edit `x`") && message.contains("edits are raster, direct-light"),
        "{message}"
    );
    // A dataset with one edit cannot be continued with another edit.
    let dataset =
        |more: &[&'static str]| trace(&[&["dataset", "plan", "--count", "2", "--spp", "2"], &page[..], more].concat());
    succeed(dataset(&["--edit", "no-sky"]));
    for more in [&[][..], &["--edit", "no-coat"]] {
        let message = fail(dataset(more), 2);
        assert!(message.contains("edit \"no-sky\" there"), "{message}");
    }
    succeed(dataset(&["--edit", "no-sky"]));
}

#[test]
fn edits_are_listed_and_an_image_names_its_edit() {
    let listed = String::from_utf8(succeed(trace(&["ablate", "--list"])).stdout).unwrap();
    assert_eq!(listed.lines().count(), EDITS.len() + 1);
    assert!(EDITS.iter().all(|edit| listed.contains(edit.name) && listed.contains(edit.about)), "{listed}");
    let done = succeed(trace(&["--scene", SMALL, "--width", "64", "--edit", "direct-light", "--pixel", "30,20"]));
    let message = String::from_utf8(done.stdout).unwrap();
    assert!(message.contains("edit: direct-light") && message.contains("(64 samples)"), "{message}");
    let (_keep, out) = scratch();
    succeed(trace(&["--scene", SMALL, "--width", "64", "--edit", "spp-4", "--quiet", "--out", path(&out)]));
    let picture = std::fs::read(out.join("rgb.png")).unwrap();
    let holds = |words: &[u8]| picture.windows(words.len()).any(|bytes| bytes == words);
    assert!(holds(b"edit: spp-4") && holds(b"spp: 4\n"));
}
