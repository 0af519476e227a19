//! Meshes at rest: transforms of nodes, morph targets and skins.

use super::super::document::{Document, Node, Primitive, item};
use super::super::notes::Notes;
use super::super::settle::ModelError;
use super::accessors::Accessors;
use furrow_base::geometry::Mesh;
use furrow_base::math::{DMat3, DMat4, DQuat, DVec3, ToFloat, ToInt, Vec3};

/// Largest difference of the matrices of a skin that leaves its mesh where the mesh's own node puts it.
const AT_REST: f64 = 1e-5;

/// Largest difference of a quaternion's length from 1, and of the last row of a matrix from 0, 0, 0, 1, that rounding explains.
const ROUNDING: f64 = 1e-3;

/// Returns the transform of a node relative to its parent. An error states why the node has none; `name` is its name.
pub(super) fn placement(node: &Node, name: &str, notes: &mut Notes) -> Result<DMat4, ModelError> {
    if let Some(matrix) = &node.matrix {
        let matrix = DMat4::from_cols_array(matrix);
        let affine = DMat4::IDENTITY.row(3);
        if !matrix.row(3).abs_diff_eq(affine, ROUNDING) {
            let what = format!(
                "the last row of the matrix of `{name}` is not 0, 0, 0, 1: it is no translation, rotation and scale"
            );
            return Err(what.into());
        }
        if node.translation.is_some() || node.rotation.is_some() || node.scale.is_some() {
            notes.about("passed over: translation, rotation and scale of nodes that have a matrix", name);
        }
        return Ok(matrix);
    }
    let scale = node.scale.map_or(DVec3::ONE, DVec3::from);
    let rotation = node.rotation.map_or(DQuat::IDENTITY, DQuat::from_array);
    let length = rotation.length();
    if length == 0.0 {
        return Err(format!("the rotation of `{name}` is a quaternion of length 0").into());
    }
    if (length - 1.0).abs() > ROUNDING {
        notes.about("quaternions whose length is not 1, which were normalized", name);
    }
    let translation = node.translation.map_or(DVec3::ZERO, DVec3::from);
    Ok(DMat4::from_scale_rotation_translation(scale, rotation.normalize(), translation))
}

/// Adds the displacements of a primitive's morph targets, as the mesh or its node weighs them, to `values` of an
/// attribute. Returns whether there are any.
pub(super) fn morph<const N: usize>(
    accessors: &Accessors<'_>,
    primitive: &Primitive,
    weights: &[f64],
    attribute: &str,
    values: &mut [[f32; N]],
) -> Result<bool, ModelError> {
    let mut changed = false;
    for (target, weight) in primitive.targets.iter().zip(weights).filter(|(_, weight)| **weight != 0.0) {
        let Some(by) = target.get(attribute) else { continue };
        let by = accessors.floats::<N>(*by)?;
        if by.len() != values.len() {
            let what = format!("a morph target has {} values of {attribute} for {} vertices", by.len(), values.len());
            return Err(what.into());
        }
        for (value, by) in values.as_flattened_mut().iter_mut().zip(by.as_flattened()) {
            *value = (f64::from(*value) + weight * f64::from(*by)).to_f32();
        }
        changed = true;
    }
    Ok(changed)
}

/// Matrices of a skin's joints, from its mesh into the model's frame.
pub(super) struct Pose(Vec<DMat4>);

impl Pose {
    /// Returns the pose of a skin at rest; `None` if it leaves the mesh where `to`, the transform of the mesh's node,
    /// puts it. `world` holds the transforms of all nodes.
    pub(super) fn of(
        document: &Document,
        accessors: &Accessors<'_>,
        world: &[DMat4],
        skin: usize,
        to: &DMat4,
    ) -> Result<Option<Self>, ModelError> {
        let skin = item(&document.skins, skin, "skin")?;
        let mut binds = match skin.inverse_bind_matrices {
            Some(matrices) => accessors.floats::<16>(matrices)?,
            None => vec![DMat4::IDENTITY.as_mat4().to_cols_array(); skin.joints.len()],
        };
        if binds.len() < skin.joints.len() {
            return Err(format!("a skin has {} joints and {} matrices", skin.joints.len(), binds.len()).into());
        }
        binds.truncate(skin.joints.len());
        let mut joints = Vec::with_capacity(binds.len());
        for (joint, bind) in skin.joints.iter().zip(binds) {
            joints.push(*item(world, *joint, "node")? * DMat4::from_cols_array(&bind.map(f64::from)));
        }
        let same = |joint: &DMat4| joint.abs_diff_eq(*to, AT_REST);
        Ok((!joints.iter().all(same)).then_some(Self(joints)))
    }

    /// Bends a mesh, whose vertices `joints` and `weights` bind, into the model's frame. `to` transforms vertices without
    /// weights.
    pub(super) fn bend(&self, mesh: &mut Mesh, bound: &[Vec<(u32, f32)>], to: &DMat4) -> Result<(), ModelError> {
        for (k, bound) in bound.iter().enumerate() {
            let sum: f64 = bound.iter().map(|(_, weight)| f64::from(*weight)).sum();
            let mut matrix = if sum > 0.0 { DMat4::ZERO } else { *to };
            for (joint, weight) in bound.iter().filter(|_| sum > 0.0) {
                matrix += *item(&self.0, joint.to_usize(), "joint")? * (f64::from(*weight) / sum);
            }
            mesh.positions[k] = matrix.transform_point3(mesh.positions[k].as_dvec3()).as_vec3();
            if let Some(normal) = mesh.normals.get_mut(k) {
                let turned = DMat3::from_mat4(matrix).inverse().transpose() * normal.as_dvec3();
                *normal = if turned.is_finite() { turned.as_vec3().normalize_or_zero() } else { Vec3::ZERO };
            }
        }
        Ok(())
    }
}

/// Reads the joints and weights of each vertex of a primitive with `vertices` vertices; empty if it has none.
pub(super) fn bound(
    accessors: &Accessors<'_>,
    primitive: &Primitive,
    vertices: usize,
) -> Result<Vec<Vec<(u32, f32)>>, ModelError> {
    let mut bound: Vec<Vec<(u32, f32)>> = Vec::new();
    for set in 0.. {
        let named = |what: &str| primitive.attributes.get(&format!("{what}_{set}")).copied();
        let (Some(joints), Some(weights)) = (named("JOINTS"), named("WEIGHTS")) else { break };
        let (joints, weights) = (accessors.whole::<4>(joints)?, accessors.floats::<4>(weights)?);
        if joints.len() != vertices || weights.len() != vertices {
            let what = format!("it binds {} and {} of {vertices} vertices to joints", joints.len(), weights.len());
            return Err(what.into());
        }
        bound.resize(vertices, Vec::new());
        for ((bound, joints), weights) in bound.iter_mut().zip(joints).zip(weights) {
            bound.extend(joints.into_iter().zip(weights).filter(|(_, weight)| *weight > 0.0));
        }
    }
    Ok(bound)
}
