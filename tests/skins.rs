//! Skins of exported leaves: other programs bend the leaves exactly as this program does.
//!
//! Rationale: a slightly wrong skin tears or moves leaves, which is invisible in the rest pose. Expected: the file's
//! rest pose equals its mesh within 1e-5 m; weights sum to one; a joint moves only the parts beyond it; meshes equal
//! those of an export without skins. Source: glTF 2.0 specification, 3.7.3 (skins); the `gltf` crate reads the file.

use crate::common::program::{SMALL, field, scratch, trace};
use furrow_base::math::{DMat4, DQuat, DVec3};
use furrow_field::Field;
use furrow_field::assemble::Options;
use gltf::Gltf;
use gltf::material::AlphaMode;
use std::collections::{BTreeMap, BTreeSet};

/// Builds two beets and a peanut, which has leaflets.
fn grown(rigged: bool) -> Field {
    let plant = |species: &str, x: f32| {
        format!("(species: \"scenes/species/{species}.ron\", growth: Bbch(14), position_m: ({x}, 3)),")
    };
    let all = plant("sugar_beet", -0.2) + &plant("peanut", 0.0) + &plant("sugar_beet", 0.2);
    let text = format!(
        "Field(
            seed: 12,
            camera: Pinhole(size: (64, 48), intrinsics: FieldOfView(horizontal_deg: 50), pose: Nadir(height_m: 1, at_m: (0, 3))),
            lights: [Constant(radiance: (1, 1, 1, 1))],
            plants: [{all}],
        )"
    );
    field(&text, &Options { rigged, ..Options::default() })
}

/// Builds plants with flowers, ears and fruits on several kinds of stems.
fn flowering() -> Field {
    let sorts = [("rape", 65), ("wheat", 65), ("papaver", 75), ("potato", 75), ("sugar_beet", 65), ("maize", 69)];
    let plant = |(k, (species, bbch)): (usize, &(&str, u32))| {
        let x = k as f32 - 2.5;
        format!("(species: \"scenes/species/{species}.ron\", growth: Bbch({bbch}), position_m: ({x}, 3)),")
    };
    let all: String = sorts.iter().enumerate().map(plant).collect();
    let text = format!(
        "Field(
            seed: 12,
            camera: Pinhole(size: (64, 48), intrinsics: FieldOfView(horizontal_deg: 50), pose: Nadir(height_m: 8, at_m: (0, 3))),
            lights: [Constant(radiance: (1, 1, 1, 1))],
            plants: [{all}],
        )"
    );
    field(&text, &Options { rigged: true, ..Options::default() })
}

fn encoded(of: &Field) -> Vec<u8> {
    furrow_output::gltf::encode(&of.scene, &of.plants, &of.provenance()).unwrap().0
}

/// A vertex of a mesh in the file.
struct Corner {
    at: DVec3,
    uv: [f32; 2],
    weights: Vec<(usize, f64)>,
}

/// A vertex as stored in the file: position and texture coordinates.
type Vertex = ([f32; 3], [f32; 2]);

/// A skinned mesh: its name, vertices, joint nodes and inverse bind matrices.
struct Skinned {
    name: String,
    corners: Vec<Corner>,
    joints: Vec<usize>,
    binds: Vec<DMat4>,
    triangles: Vec<[usize; 3]>,
    /// Whether the material has a mask.
    masked: bool,
}

impl Skinned {
    /// Positions of the vertices for the given node transforms.
    fn posed(&self, places: &BTreeMap<usize, DMat4>) -> Vec<DVec3> {
        let joint = |k: usize| places[&self.joints[k]] * self.binds[k];
        let carry = |c: &Corner| c.weights.iter().map(|(k, w)| *w * joint(*k).transform_point3(c.at)).sum();
        self.corners.iter().map(carry).collect()
    }
}

fn matrix(m: [[f32; 4]; 4]) -> DMat4 {
    DMat4::from_cols_array_2d(&m.map(|column| column.map(f64::from)))
}

/// World transforms of all nodes, each with `change` applied in its own frame.
fn places(file: &Gltf, change: &BTreeMap<usize, DMat4>) -> BTreeMap<usize, DMat4> {
    let mut todo: Vec<_> = file.default_scene().unwrap().nodes().map(|node| (node, DMat4::IDENTITY)).collect();
    let mut all = BTreeMap::new();
    while let Some((node, above)) = todo.pop() {
        let own = change.get(&node.index()).copied().unwrap_or(DMat4::IDENTITY);
        let at = above * matrix(node.transform().matrix()) * own;
        todo.extend(node.children().map(|child| (child, at)));
        assert!(all.insert(node.index(), at).is_none(), "a node has two parents");
    }
    all
}

fn skinned(file: &Gltf) -> Vec<Skinned> {
    let blob = file.blob.as_deref().unwrap();
    let mut all = Vec::new();
    for node in file.nodes() {
        let (Some(mesh), Some(skin)) = (node.mesh(), node.skin()) else { continue };
        let binds = skin.reader(|_| Some(blob)).read_inverse_bind_matrices().unwrap().map(matrix).collect();
        let primitive = mesh.primitives().next().unwrap();
        let reader = primitive.reader(|_| Some(blob));
        let weights = reader.read_weights(0).unwrap().into_f32();
        let joints = reader.read_joints(0).unwrap().into_u16();
        let uvs = reader.read_tex_coords(0).unwrap().into_f32();
        let corners = reader.read_positions().unwrap().zip(uvs).zip(joints.zip(weights));
        let corner = |((at, uv), (joints, weights)): (Vertex, ([u16; 4], [f32; 4]))| {
            let sum: f32 = weights.iter().sum();
            assert!((sum - 1.0).abs() < 1e-6, "weights sum to {sum}");
            let used: Vec<(usize, f64)> = joints
                .iter()
                .zip(weights)
                .filter(|(_, w)| *w > 0.0)
                .map(|(k, w)| (usize::from(*k), f64::from(w)))
                .collect();
            assert_eq!(
                used.iter().map(|(k, _)| *k).collect::<BTreeSet<_>>().len(),
                used.len(),
                "a joint is used twice"
            );
            Corner { at: DVec3::from_array(at.map(f64::from)), uv, weights: used }
        };
        let indices: Vec<usize> = reader.read_indices().unwrap().into_u32().map(|i| i as usize).collect();
        all.push(Skinned {
            triangles: indices.as_chunks::<3>().0.to_vec(),
            name: node.name().unwrap().to_owned(),
            corners: corners.map(corner).collect(),
            joints: skin.joints().map(|joint| joint.index()).collect(),
            binds,
            masked: primitive.material().alpha_mode() == AlphaMode::Mask,
        });
    }
    all
}

#[test]
fn the_pose_of_the_file_is_its_mesh() {
    let field = grown(true);
    let file = Gltf::from_slice(&encoded(&field)).unwrap_or_else(|e| panic!("{e}"));
    let rest = places(&file, &BTreeMap::new());
    let up = rest[&file.default_scene().unwrap().nodes().next().unwrap().index()];
    let all = skinned(&file);
    let mut worst = 0.0_f64;
    for one in &all {
        for (corner, posed) in one.corners.iter().zip(one.posed(&rest)) {
            worst = worst.max(posed.distance(up.transform_point3(corner.at)));
        }
    }
    eprintln!("{} meshes, {} skins, at most {worst:.1e} m", all.len(), file.skins().count());
    assert!(worst < 1e-5, "{worst}");
    // Every leaf has a skin, and so do each plant's stems; all plant parts use them.
    let skins: usize = field.plants.iter().map(|plant| plant.leaf_axes.len() + 1).sum();
    assert_eq!(file.skins().count(), skins);
    let parts = field.scene.parts.iter().filter(|part| part.tag.plant > 0);
    assert_eq!(parts.count(), all.len());
}

/// Expected: the part of a beet's blade up to the middle of the link before the joint stays; the tip moves by about its
/// distance from the joint times the angle.
#[test]
fn a_joint_moves_what_lies_beyond_it_and_nothing_else() {
    let field = grown(true);
    let file = Gltf::from_slice(&encoded(&field)).unwrap();
    let rest = places(&file, &BTreeMap::new());
    let named: BTreeMap<String, gltf::Node<'_>> =
        file.nodes().filter_map(|node| Some((node.name()?.to_owned(), node.clone()))).collect();
    let beets = field.plants.iter().filter(|plant| plant.species.contains("beet"));
    let numbers: BTreeSet<u32> = beets.map(|plant| plant.number).collect();
    let all = skinned(&file);
    let of_beets = |one: &&Skinned| numbers.iter().any(|n| one.name.starts_with(&format!("crop {n} leaf")));
    let mut tested = 0;
    // The texture of a blade spans its whole length.
    for one in all.iter().filter(of_beets) {
        let (Some(joint), Some(tip)) =
            (named.get(&format!("{} VN3", one.name)), named.get(&format!("{} PK", one.name)))
        else {
            continue;
        };
        let at = |joint: &str| rest[&named[&format!("{} {joint}", one.name)].index()].w_axis.truncate();
        let angle = 0.3;
        let change = BTreeMap::from([(joint.index(), DMat4::from_quat(DQuat::from_rotation_z(angle)))]);
        let (before, after) = (one.posed(&rest), one.posed(&places(&file, &change)));
        let moved: Vec<f64> = before.iter().zip(&after).map(|(a, b)| a.distance(*b)).collect();
        // All nodes below the joint.
        let mut below = BTreeSet::new();
        let mut todo = vec![joint.clone()];
        while let Some(node) = todo.pop() {
            below.insert(node.index());
            todo.extend(node.children());
        }
        for (corner, moved) in one.corners.iter().zip(&moved) {
            let beyond: f64 =
                corner.weights.iter().filter(|(k, _)| below.contains(&one.joints[*k])).map(|(_, w)| w).sum();
            assert!(beyond > 0.0 || *moved < 1e-9, "{}: moved {moved} without a weight", one.name);
        }
        // Petioles and midribs have the leaf's name as well, but no mask.
        if !one.masked {
            continue;
        }
        let uvs = one.corners.iter().map(|c| c.uv[1]);
        if uvs.clone().fold(1.0_f32, f32::min) > 0.1 || uvs.fold(0.0_f32, f32::max) < 0.9 {
            continue;
        }
        let chain: Vec<DVec3> = ["B", "VN1", "VN2", "VN3"].map(at).to_vec();
        let along: Vec<f64> = chain.windows(2).map(|w| w[0].distance(w[1])).collect();
        let mut length = along.iter().sum::<f64>();
        let mut from = at("VN3");
        for name in ["VN4", "VN5", "VN6", "VN7", "PK"] {
            if let Some(node) = named.get(&format!("{} {name}", one.name)) {
                let next = rest[&node.index()].w_axis.truncate();
                (length, from) = (length + from.distance(next), next);
            }
        }
        let still = (along[0] + along[1] + 0.5 * along[2]) / length;
        for (corner, moved) in one.corners.iter().zip(&moved) {
            let t = 1.0 - f64::from(corner.uv[1]);
            assert!(t > still - 0.03 || *moved < 1e-9, "{}: {t} of the blade moved by {moved}", one.name);
        }
        let lever = at("VN3").distance(rest[&tip.index()].w_axis.truncate());
        let most = moved.iter().copied().fold(0.0, f64::max);
        assert!(most > 0.7 * lever * angle && most < 1.6 * lever * angle, "{most} at {lever}");
        tested += 1;
    }
    assert!(tested >= 4, "{tested} blades");
}

/// Rationale: bending a stem must carry everything attached to it without tearing. When vertices followed the nearest
/// stem, flowers that touched another shoot were stretched to a quarter of a metre. Expected: whichever stem joint of
/// rape, poppy, potato, bolting beet, wheat and maize is rotated, no mesh edge grows more than the bend of its stem
/// explains, and parts beyond the joint are carried along; leaves of grasses stay.
#[test]
fn a_stems_joint_carries_its_leaves_and_flowers_whole() {
    let field = flowering();
    let file = Gltf::from_slice(&encoded(&field)).unwrap();
    let rest = places(&file, &BTreeMap::new());
    let all = skinned(&file);
    let nodes: BTreeMap<&str, usize> = file.nodes().filter_map(|node| Some((node.name()?, node.index()))).collect();
    let angle = 0.2;
    for plant in &field.plants {
        let name = format!("{} {}", plant.class.name(), plant.number);
        let worn = all.iter().filter(|one| one.name == name || one.name.starts_with(&format!("{name} leaf")));
        let worn: Vec<(&Skinned, Vec<DVec3>)> = worn.map(|one| (one, one.posed(&rest))).collect();
        let (mut torn, mut flowers, mut leaves) = (0.0_f64, 0, 0);
        // Every joint of plants with few joints, a subset for plants with many.
        for joint in plant.rig.iter().step_by(plant.rig.len().div_ceil(25)) {
            let node = nodes[&*format!("{name} {}", joint.name)];
            let change = BTreeMap::from([(node, DMat4::from_quat(DQuat::from_rotation_z(angle)))]);
            let turned = places(&file, &change);
            let at = rest[&node].w_axis.truncate();
            for (one, before) in &worn {
                let after = one.posed(&turned);
                for triangle in &one.triangles {
                    for (i, k) in [(0, 1), (1, 2), (2, 0)].map(|(i, k)| (triangle[i], triangle[k])) {
                        torn = torn.max(after[i].distance(after[k]) - before[i].distance(before[k]));
                    }
                }
                let far =
                    |(p, q): (&DVec3, &DVec3)| p.distance(*q) > 0.5 * angle * p.distance(at) && p.distance(at) > 0.02;
                let carried = before.iter().zip(&after).filter(|pair| far(*pair)).count();
                *(if one.name.contains("leaf") { &mut leaves } else { &mut flowers }) += carried;
            }
        }
        eprintln!(
            "{}, {} joints: edges grow by {:.1} mm at most; {leaves} corners of leaves, {flowers} others carried",
            plant.species,
            plant.rig.len(),
            1e3 * torn
        );
        assert!(torn < 0.006, "{}: {torn} m", plant.species);
        assert!(flowers > 1000, "{}", plant.species);
        let grass = ["wheat", "maize"].iter().any(|word| plant.species.contains(word));
        assert_eq!(leaves > 0, !grass, "{}", plant.species);
    }
}

#[test]
fn skins_change_nothing_else() {
    let (with, without) = (grown(true), grown(false));
    assert_eq!(with.scene.parts.len(), without.scene.parts.len());
    for (a, b) in with.scene.parts.iter().zip(&without.scene.parts) {
        assert!(a.mesh.positions == b.mesh.positions && a.mesh.triangles == b.mesh.triangles);
        assert!(a.mesh.fault().is_none() && b.mesh.weights.is_empty());
    }
    let file = Gltf::from_slice(&encoded(&without)).unwrap();
    assert_eq!(file.skins().count(), 0);
    let (of, skinned) = (encoded(&without).len(), encoded(&with).len());
    eprintln!("{of} bytes, {skinned} with skins");
}

#[test]
fn skins_are_asked_for_where_there_are_any() {
    let (_keep, folder) = scratch();
    let export = |format: &str| {
        let mut command = trace(&["export", "--scene", SMALL, "--width", "32", "--skins", "--format", format, "--out"]);
        command.arg(folder.join(format)).output().unwrap()
    };
    let refused = export("mitsuba");
    assert!(!refused.status.success() && String::from_utf8_lossy(&refused.stderr).contains("--format gltf"));
    let done = export("gltf");
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let file = Gltf::open(folder.join("gltf/scene.glb")).unwrap();
    assert!(file.skins().count() > 0 && !skinned(&file).is_empty());
}
