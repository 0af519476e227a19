//! Geometry of OBJ files: corners in double precision, and faces grouped into pieces of one object and material.

use super::super::notes::Notes;
use super::super::parts::MOST_TRIANGLES;
use super::super::settle::{ModelError, faceted, too_many_triangles};
use super::lines::{Statement, statements};
use super::polygon::{Cut, normal, triangles};
use furrow_base::geometry::Mesh;
use furrow_base::math::{DMat4, DVec3, ToFloat, ToInt, Vec3, vec2};
use std::collections::{BTreeMap, HashMap};

/// Keywords that change neither the shape nor the colour.
const HARMLESS: [&str; 8] = ["mg", "lod", "c_interp", "d_interp", "stech", "ctech", "shadow_obj", "trace_obj"];

/// Corner of a face: indices of its position, texture coordinates and normal.
#[derive(Clone, Copy)]
struct Corner {
    position: u32,
    uv: Option<u32>,
    normal: Option<u32>,
}

/// Normals of a piece.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Shading {
    /// Stored at each corner.
    Stored,
    /// Averaged over the faces of a smoothing group.
    Smooth(u32),
    /// Those of the triangles.
    Flat,
}

/// Faces of one object or group with one material, which are alike.
pub(super) struct Piece {
    pub(super) name: String,
    pub(super) material: Option<String>,
    /// Whether its corners have texture coordinates.
    pub(super) textured: bool,
    shading: Shading,
    triangles: Vec<[Corner; 3]>,
}

/// All faces of a file.
#[derive(Default)]
pub(super) struct Faces {
    positions: Vec<DVec3>,
    uvs: Vec<[f32; 2]>,
    normals: Vec<Vec3>,
    /// Names of material libraries, as the file writes them.
    pub(super) libraries: Vec<String>,
    pub(super) pieces: Vec<Piece>,
    /// Sums of the normals of a smoothing group's faces at a position, weighted by area.
    smooth: HashMap<(u32, u32), DVec3>,
}

/// The object, material and smoothing group of the next face.
struct State {
    name: String,
    material: Option<String>,
    group: u32,
    /// Pieces of this object and material, by their kind.
    pieces: BTreeMap<(bool, Shading), usize>,
}

/// Polygon before it is cut: its corners must exist by the end of the file.
struct Polygon {
    piece: usize,
    line: usize,
    corners: Vec<Corner>,
}

impl Faces {
    /// Reads the text of a file.
    pub(super) fn read(text: &str, notes: &mut Notes) -> Result<Self, ModelError> {
        let mut all = Self::default();
        let mut state = State { name: "unnamed_object".into(), material: None, group: 0, pieces: BTreeMap::new() };
        let mut polygons = Vec::new();
        for statement in statements(text) {
            match statement.keyword {
                "v" => {
                    all.positions.push(DVec3::from(statement.numbers::<3>(3)?));
                    // Four numbers are a weight; six have a colour.
                    if statement.words().nth(5).is_some() {
                        notes.add("passed over: colours of vertices");
                    }
                }
                "vt" => all.uvs.push(statement.numbers::<2>(1)?.map(ToFloat::to_f32)),
                "vn" => all.normals.push(DVec3::from(statement.numbers::<3>(3)?).as_vec3()),
                "f" | "fo" => polygons.extend(all.face(&statement, &mut state, notes)?),
                "o" | "g" => {
                    state.name = statement.rest.into_owned();
                    state.pieces.clear();
                }
                "usemtl" if !statement.rest.is_empty() => {
                    let name = Some(statement.rest.into_owned());
                    if state.material != name {
                        state.material = name;
                        state.pieces.clear();
                    }
                }
                "usemtl" => {}
                "mtllib" => all.libraries.push(statement.rest.into_owned()),
                "s" => state.group = if statement.rest == "off" { 0 } else { statement.rest.parse().unwrap_or(1) },
                "l" | "p" => notes.add("passed over: points and lines"),
                keyword if HARMLESS.contains(&keyword) => {}
                keyword => notes.about("passed over: statements of the OBJ file", keyword),
            }
        }
        for polygon in polygons {
            all.cut(polygon, notes)?;
        }
        Ok(all)
    }

    /// Reads the corners of a face; `None` if it has fewer than three.
    fn face(
        &mut self,
        of: &Statement<'_>,
        state: &mut State,
        notes: &mut Notes,
    ) -> Result<Option<Polygon>, ModelError> {
        let counts = [self.positions.len(), self.uvs.len(), self.normals.len()];
        let corners: Vec<Corner> = of.words().map(|word| corner(of, word, counts)).collect::<Result<_, _>>()?;
        if corners.len() < 3 {
            notes.about("passed over: faces with fewer than three corners", &state.name);
            return Ok(None);
        }
        let textured = corners.iter().all(|corner| corner.uv.is_some());
        let shading = match state.group {
            _ if corners.iter().all(|corner| corner.normal.is_some()) => Shading::Stored,
            0 => Shading::Flat,
            group => Shading::Smooth(group),
        };
        let piece = *state.pieces.entry((textured, shading)).or_insert_with(|| {
            let (name, material) = (state.name.clone(), state.material.clone());
            self.pieces.push(Piece { name, material, textured, shading, triangles: Vec::new() });
            self.pieces.len() - 1
        });
        Ok(Some(Polygon { piece, line: of.line, corners }))
    }

    /// Cuts a polygon into triangles of its piece.
    fn cut(&mut self, polygon: Polygon, notes: &mut Notes) -> Result<(), ModelError> {
        let Polygon { piece, line, corners } = polygon;
        let there = |corner: &&Corner| {
            let within = |index: Option<u32>, n: usize| index.is_none_or(|index| index.to_usize() < n);
            within(Some(corner.position), self.positions.len())
                && within(corner.uv, self.uvs.len())
                && within(corner.normal, self.normals.len())
        };
        if !corners.iter().all(|corner| there(&corner)) {
            return Err(format!("line {line}: a corner of the face refers to a missing element").into());
        }
        let at: Vec<DVec3> = corners.iter().map(|corner| self.positions[corner.position.to_usize()]).collect();
        let piece = &mut self.pieces[piece];
        let triangles = match triangles(&at) {
            Cut::Whole(triangles) => triangles,
            Cut::Crossed(triangles) => {
                notes.about("faces whose sides cross one another, cut into a fan", &piece.name);
                triangles
            }
            Cut::TooMany => return Err(format!("line {line}: a concave face has too many corners").into()),
        };
        if let Shading::Smooth(group) = piece.shading {
            let normal = normal(&at);
            for corner in &corners {
                *self.smooth.entry((corner.position, group)).or_default() += normal;
            }
        }
        piece.triangles.extend(triangles.into_iter().map(|t| t.map(|i| corners[i])));
        if piece.triangles.len() > MOST_TRIANGLES { Err(too_many_triangles()) } else { Ok(()) }
    }

    /// Returns the bounding box of all positions after a rotation; infinite if there are none.
    pub(super) fn bounds(&self, rotation: &DMat4) -> (DVec3, DVec3) {
        let turned = self.positions.iter().map(|p| rotation.transform_point3(*p));
        turned.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(lo, hi), p| (lo.min(p), hi.max(p)))
    }

    /// Returns the mesh of a piece, with positions relative to `origin`.
    pub(super) fn mesh(&self, piece: &Piece, origin: DVec3) -> Mesh {
        let mut mesh = Mesh::default();
        let mut known: HashMap<(u32, Option<u32>, Option<u32>), u32> = HashMap::new();
        let mut vertex = |corner: &Corner| {
            let uv = corner.uv.filter(|_| piece.textured);
            let normal = corner.normal.filter(|_| piece.shading == Shading::Stored);
            *known.entry((corner.position, uv, normal)).or_insert_with(|| {
                mesh.positions.push((self.positions[corner.position.to_usize()] - origin).as_vec3());
                let [u, v] = uv.map_or([0.0, 1.0], |uv| self.uvs[uv.to_usize()]);
                mesh.uvs.push(vec2(u, 1.0 - v));
                match (piece.shading, normal) {
                    (Shading::Smooth(group), _) => {
                        let sum = self.smooth.get(&(corner.position, group)).copied().unwrap_or_default();
                        mesh.normals.push(sum.normalize_or_zero().as_vec3());
                    }
                    (_, Some(normal)) => mesh.normals.push(self.normals[normal.to_usize()]),
                    (_, None) => {}
                }
                mesh.positions.len().to_u32() - 1
            })
        };
        let triangles = piece.triangles.iter().map(|t| [vertex(&t[0]), vertex(&t[1]), vertex(&t[2])]).collect();
        mesh.triangles = triangles;
        if piece.shading == Shading::Flat {
            faceted(&mut mesh);
        }
        mesh
    }
}

/// Reads a corner such as `3/1/2`, `3//2` or `-1`. `counts` are the numbers of positions, texture coordinates and normals
/// so far, from which negative indices count backwards.
fn corner(of: &Statement<'_>, word: &str, counts: [usize; 3]) -> Result<Corner, String> {
    let mut indices = [None; 3];
    let mut parts = word.split('/');
    for ((index, part), count) in
        indices.iter_mut().zip(&mut parts).zip(counts).filter(|((_, part), _)| !part.is_empty())
    {
        let number: i64 = part.parse().map_err(|_| of.wrong(&format!("the corner `{word}` is not a face's corner")))?;
        let place = if number < 0 { number + count.to_i64() } else { number - 1 };
        let missing = || of.wrong(&format!("the corner `{word}` refers to a missing element"));
        *index = Some(u32::try_from(place).map_err(|_| missing())?);
    }
    let [Some(position), uv, normal] = indices else {
        return Err(of.wrong(&format!("the corner `{word}` is not a face's corner")));
    };
    Ok(Corner { position, uv, normal })
}
