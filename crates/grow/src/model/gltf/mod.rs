//! Reader of glTF 2.0 and GLB files.
//!
//! Files are not trusted: every index is checked, every byte range is compared with the available data, and every node
//! is visited once.

mod accessors;
mod appearance;
mod passed_over;
mod pose;
#[cfg(test)]
mod tests;

use super::document::{Document, Material, Mesh as MeshDesc, Node, Primitive, item};
use super::files::Files;
use super::gather::UnplacedParts;
use super::glb;
use super::notes::Notes;
use super::parts::{Label, Model, Up};
use super::settle::{ModelError, faceted, into_one_tile};
use accessors::Accessors;
use appearance::{Appearance, AppearanceReader};
use furrow_base::geometry::Mesh;
use furrow_base::math::{DMat4, ToInt, Vec2, Vec3};
use furrow_optics::texture::Surface;
use pose::{Pose, bound, morph, placement};
use std::collections::BTreeMap;

/// Reads a model, or returns an error.
pub(super) fn read(mut files: Files<'_>, up: Up) -> Result<Model, ModelError> {
    let file = files.own()?;
    let (json, own) = if glb::is_glb(&file) { glb::split(&file)? } else { (&file[..], None) };
    let json = json.strip_prefix(b"\xef\xbb\xbf").unwrap_or(json);
    let document: Document = serde_json::from_slice(json).map_err(|e| format!("its JSON cannot be read: {e}"))?;
    let needed = document.asset.min_version.as_ref().unwrap_or(&document.asset.version);
    if !document.asset.version.starts_with("2.") || (document.asset.min_version.is_some() && needed != "2.0") {
        return Err(format!("it is glTF \"{needed}\"; only glTF 2.0 can be read").into());
    }
    passed_over::check_required(&document)?;
    let mut notes = Notes::default();
    passed_over::warn_of_contents(&document, &mut notes);
    let accessors = Accessors::open(&document, own, &mut files)?;
    let mut appearances = AppearanceReader::new(&document, &accessors, files, notes);
    let materials: &[Material] = &document.materials;
    let known =
        materials.iter().enumerate().map(|(i, m)| appearances.appearance(i, m)).collect::<Result<Vec<_>, _>>()?;
    let AppearanceReader { files, notes, .. } = appearances;
    let mut model = Model { surfaces: known.iter().map(|l| l.surface.clone()).collect(), ..Model::default() };
    // For primitives without a material.
    model.surfaces.push(Surface::default());
    let mut reader =
        Reader { document: &document, accessors: &accessors, appearances: &known, bare: BTreeMap::new(), notes };
    reader.walk(up, &mut model)?;
    model.warnings = reader.notes.words();
    model.pictures = files.pictures;
    model.files = files.read;
    Ok(model)
}

struct Reader<'a> {
    document: &'a Document,
    accessors: &'a Accessors<'a>,
    appearances: &'a [Appearance],
    /// Surfaces without pictures, for primitives without texture coordinates, by material.
    bare: BTreeMap<usize, usize>,
    notes: Notes,
}

/// A mesh in the frame of its node, or bent by its skin into the model's frame.
struct Read {
    mesh: Mesh,
    bent: bool,
    /// Whether its texture coordinates are missing.
    bare: bool,
}

impl Reader<'_> {
    /// Returns the root nodes of the scene that is shown.
    fn roots(&self) -> Result<Vec<usize>, ModelError> {
        let document = self.document;
        if let Some(scene) = document.scene.or((!document.scenes.is_empty()).then_some(0)) {
            return Ok(item(&document.scenes, scene, "scene")?.nodes.clone());
        }
        let mut child = vec![false; document.nodes.len()];
        for c in document.nodes.iter().flat_map(|n| &n.children).filter(|c| **c < document.nodes.len()) {
            child[*c] = true;
        }
        Ok((0..child.len()).filter(|i| !child[*i]).collect())
    }

    /// Visits the nodes of the scene, parents before children. Returns their indices in this order, and the transforms
    /// of all nodes into the model's frame; the identity for nodes outside the scene.
    fn nodes(&mut self, up: Up) -> Result<(Vec<usize>, Vec<DMat4>), ModelError> {
        let nodes = &self.document.nodes;
        let (mut order, mut world) = (Vec::new(), vec![DMat4::IDENTITY; nodes.len()]);
        let mut seen = vec![false; nodes.len()];
        let mut open: Vec<(usize, DMat4)> = self.roots()?.into_iter().rev().map(|node| (node, up.rotation())).collect();
        while let Some((index, above)) = open.pop() {
            let node = item(nodes, index, "node")?;
            if std::mem::replace(&mut seen[index], true) {
                return Err(format!("node {index} has two parents").into());
            }
            let name = node.name.clone().unwrap_or_else(|| format!("node {index}"));
            world[index] = above * placement(node, &name, &mut self.notes)?;
            open.extend(node.children.iter().rev().map(|child| (*child, world[index])));
            order.push(index);
        }
        Ok((order, world))
    }

    /// Adds the meshes of the scene to `model`.
    fn walk(&mut self, up: Up, model: &mut Model) -> Result<(), ModelError> {
        let (order, world) = self.nodes(up)?;
        let mut gathered = UnplacedParts::default();
        for index in order {
            let node = &self.document.nodes[index];
            let Some(mesh) = node.mesh else { continue };
            let mesh = item(&self.document.meshes, mesh, "mesh")?;
            let name = node.name.as_ref().or(mesh.name.as_ref()).cloned().unwrap_or_else(|| format!("node {index}"));
            let label = match label(&node.extras).transpose().or_else(|| label(&mesh.extras).transpose()).transpose() {
                Ok(label) => label,
                Err(fault) => {
                    model.label_fault.get_or_insert_with(|| format!("the label of `{name}` is wrong: {fault}"));
                    None
                }
            };
            let to = world[index];
            let pose = match node.skin {
                Some(skin) => {
                    if item(&self.document.skins, skin, "skin")?.joints.is_empty() {
                        self.notes.about("skins without joints, so their meshes stay in the bind pose", &name);
                    }
                    Pose::of(self.document, self.accessors, &world, skin, &to)?
                }
                None => None,
            };
            for primitive in &mesh.primitives {
                let appearance = primitive.material.map(|m| item(self.appearances, m, "material")).transpose()?;
                if let Some(appearance) = appearance.filter(|appearance| appearance.absent) {
                    let words = "left out: surfaces whose opacity is below the threshold everywhere";
                    self.notes.about(words, &appearance.surface.name);
                    continue;
                }
                let read =
                    self.primitive((node, mesh, primitive), appearance, pose.as_ref().map(|pose| (pose, &to)), &name);
                let Some(read) = read? else { continue };
                let surface = match primitive.material {
                    Some(material) if read.bare => self.bare(material, model),
                    Some(material) => material,
                    None => self.appearances.len(),
                };
                let to = if read.bent { DMat4::IDENTITY } else { to };
                gathered.add(name.clone(), read.mesh, surface, label.clone(), to)?;
            }
        }
        gathered.into_model(model, &mut self.notes)
    }

    /// Returns the index of a material's surface without its pictures.
    fn bare(&mut self, material: usize, model: &mut Model) -> usize {
        *self.bare.entry(material).or_insert_with(|| {
            model.surfaces.push(model.surfaces[material].without_pictures());
            model.surfaces.len() - 1
        })
    }

    /// Reads one primitive; `None` for points and lines.
    fn primitive(
        &mut self,
        (node, desc, primitive): (&Node, &MeshDesc, &Primitive),
        appearance: Option<&Appearance>,
        pose: Option<(&Pose, &DMat4)>,
        name: &str,
    ) -> Result<Option<Read>, ModelError> {
        let attribute = |what: &str| primitive.attributes.get(what).copied();
        let mode = primitive.mode.unwrap_or(4);
        if mode < 4 {
            self.notes.about("passed over: points and lines", name);
            return Ok(None);
        }
        self.check_compression(primitive, name)?;
        let weights = node.weights.as_ref().unwrap_or(&desc.weights);
        let accessors = self.accessors;
        let positions = attribute("POSITION").ok_or_else(|| format!("`{name}` has no positions"))?;
        let mut positions = accessors.floats::<3>(positions)?;
        morph(accessors, primitive, weights, "POSITION", &mut positions)?;
        let positions: Vec<Vec3> = positions.into_iter().map(Vec3::from).collect();
        let named = format!("TEXCOORD_{}", appearance.map_or(0, |l| l.slot.set));
        let mut uvs = match attribute(&named) {
            Some(uvs) => {
                let mut uvs = accessors.floats::<2>(uvs)?;
                morph(accessors, primitive, weights, &named, &mut uvs)?;
                uvs.into_iter().map(Vec2::from).collect()
            }
            None => vec![Vec2::ZERO; positions.len()],
        };
        let bare = attribute(&named).is_none() && appearance.is_some_and(Appearance::has_pictures);
        if bare {
            self.notes.about(format!("no texture coordinates {named}, so the pictures are passed over"), name);
        }
        if let Some(appearance) = appearance.filter(|_| !bare) {
            for uv in &mut uvs {
                *uv = appearance.slot.transformed(*uv);
            }
            if appearance.surface.mask.is_some() {
                into_one_tile(&mut uvs, appearance.wrap, name, &mut self.notes)?;
            }
        }
        let corners: Vec<u32> = match primitive.indices {
            Some(indices) => accessors.whole::<1>(indices)?.into_iter().map(|[i]| i).collect(),
            None => (0..positions.len().to_u32()).collect(),
        };
        if let Some(i) = corners.iter().find(|i| i.to_usize() >= positions.len()) {
            return Err(format!("`{name}` refers to vertex {i}, but has {}", positions.len()).into());
        }
        if uvs.len() != positions.len() {
            return Err(
                format!("`{name}` has {} vertices and {} texture coordinates", positions.len(), uvs.len()).into()
            );
        }
        let triangles =
            triangles(mode, &corners).ok_or_else(|| format!("`{name}` has the unknown primitive mode {mode}"))?;
        let mut mesh = Mesh { positions, uvs, triangles, ..Mesh::default() };
        let stored = attribute("NORMAL");
        if let Some(normals) = stored {
            let mut normals = accessors.floats::<3>(normals)?;
            morph(accessors, primitive, weights, "NORMAL", &mut normals)?;
            mesh.normals = normals.into_iter().map(Vec3::from).collect();
            if mesh.normals.len() != mesh.positions.len() {
                let (n, p) = (mesh.normals.len(), mesh.positions.len());
                return Err(format!("`{name}` has {p} vertices and {n} normals").into());
            }
            if let Some(i) = mesh.normals.iter().position(|normal| !normal.is_finite()) {
                return Err(format!("normal {i} of `{name}` is not a finite number").into());
            }
        }
        self.warn_of_colors(primitive, name)?;
        let bound = if pose.is_some() { bound(accessors, primitive, mesh.positions.len())? } else { Vec::new() };
        if pose.is_some() && bound.is_empty() {
            self.notes.about("no `JOINTS_0` and `WEIGHTS_0`, so the skin is passed over", name);
        }
        let bent = pose.filter(|_| !bound.is_empty());
        if let Some((pose, to)) = bent {
            pose.bend(&mut mesh, &bound, to)?;
        }
        if stored.is_none() {
            faceted(&mut mesh);
        }
        Ok(Some(Read { mesh, bent: bent.is_some(), bare }))
    }

    /// Returns an error if the geometry of a primitive is stored only in compressed form.
    fn check_compression(&self, primitive: &Primitive, name: &str) -> Result<(), ModelError> {
        const DRACO: &str = "KHR_draco_mesh_compression";
        let stored = |accessor: &usize| {
            self.document.accessors.get(*accessor).is_none_or(|a| a.buffer_view.is_some() || a.sparse.is_some())
        };
        if !primitive.extensions.contains_key(DRACO) || primitive.attributes.values().all(stored) {
            return Ok(());
        }
        let what = format!("`{name}` is compressed with {DRACO}, which cannot be read");
        Err(ModelError { what, help: "export it without compression and extensions" })
    }

    /// Warns of vertex colours other than white.
    fn warn_of_colors(&mut self, primitive: &Primitive, name: &str) -> Result<(), ModelError> {
        let Some(accessor) = primitive.attributes.get("COLOR_0") else { return Ok(()) };
        let wide = self.document.accessors.get(*accessor).is_some_and(|a| a.kind == "VEC4");
        let white = if wide {
            self.accessors.floats::<4>(*accessor)?.as_flattened().iter().all(|c| *c == 1.0)
        } else {
            self.accessors.floats::<3>(*accessor)?.as_flattened().iter().all(|c| *c == 1.0)
        };
        if !white {
            self.notes.about("passed over: colours of vertices", name);
        }
        Ok(())
    }
}

/// Returns the triangles of a list, a strip or a fan; `None` for an unknown mode.
fn triangles(mode: u32, corners: &[u32]) -> Option<Vec<[u32; 3]>> {
    Some(match mode {
        4 => corners.as_chunks::<3>().0.to_vec(),
        5 => corners
            .windows(3)
            .enumerate()
            .map(|(i, t)| if i % 2 == 0 { [t[0], t[1], t[2]] } else { [t[0], t[2], t[1]] })
            .collect(),
        6 => (2..corners.len()).map(|i| [corners[i - 1], corners[i], corners[0]]).collect(),
        _ => return None,
    })
}

/// Returns the label in the extras of a node or mesh: those with a class. The error says what is wrong with it.
fn label(extras: &serde_json::Value) -> Result<Option<Label>, String> {
    if extras.get("class").is_none() {
        return Ok(None);
    }
    let mut label: Label = serde_json::from_value(extras.clone()).map_err(|e| e.to_string())?;
    // Scene files write classes with a capital.
    label.class = label.class.to_lowercase();
    Ok(Some(label))
}
