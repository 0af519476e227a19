//! Collects the parts of a model in either format: moves a model with large coordinates to the origin, settles its
//! meshes, and warns of surfaces that are invisible.

use super::notes::Notes;
use super::parts::{Label, MOST_TRIANGLES, Model, ModelPart};
use super::settle::{ModelError, settle, too_many_triangles};
use furrow_base::geometry::{AlphaMask, Coverage, Mesh};
use furrow_base::math::{DMat4, DVec3, ToInt};
use furrow_optics::texture::Surface;

/// Distance from the origin, in the file's unit, above which a model may be moved: national grids begin there.
const FAR: f64 = 1e5;
/// Ratio of that distance to the model's size above which it is moved: single precision would lose its shape.
const REMOTE: f64 = 100.0;

/// Parts whose meshes are not yet in the model's frame.
#[derive(Default)]
pub(super) struct UnplacedParts {
    parts: Vec<(ModelPart, DMat4)>,
    triangles: usize,
    /// Bounding box in the model's frame.
    bounds: Option<(DVec3, DVec3)>,
}

impl UnplacedParts {
    /// Adds a part whose mesh `to` transforms into the model's frame. Returns an error if there are too many triangles.
    pub(super) fn add(
        &mut self,
        name: String,
        mesh: Mesh,
        surface: usize,
        label: Option<Label>,
        to: DMat4,
    ) -> Result<(), ModelError> {
        self.triangles += mesh.triangles.len();
        if self.triangles > MOST_TRIANGLES {
            return Err(too_many_triangles());
        }
        if let Some((lo, hi)) = mesh.bounds() {
            let corner = |k: usize| {
                let side = |i: usize| f64::from(if k >> i & 1 == 0 { lo[i] } else { hi[i] });
                to.transform_point3(DVec3::new(side(0), side(1), side(2)))
            };
            for at in (0..8).map(corner) {
                let (lo, hi) = self.bounds.unwrap_or((at, at));
                self.bounds = Some((lo.min(at), hi.max(at)));
            }
        }
        self.parts.push((ModelPart { name, mesh, surface, label }, to));
        Ok(())
    }

    /// Settles the parts and appends them to `model`, whose surfaces are complete.
    pub(super) fn into_model(self, model: &mut Model, notes: &mut Notes) -> Result<(), ModelError> {
        let offset = self.bounds.and_then(offset);
        if let Some(at) = offset {
            notes.add(moved(at));
        }
        for (mut part, to) in self.parts {
            let to = offset.map_or(to, |at| DMat4::from_translation(-at) * to);
            settle(&mut part.mesh, &to, &part.name)?;
            model.parts.push(part);
        }
        warn_of_invisible(model, notes);
        Ok(())
    }
}

/// Returns the foot of a bounding box that is far from the origin for its size: the middle of its lower side.
pub(super) fn offset((lo, hi): (DVec3, DVec3)) -> Option<DVec3> {
    let (away, size) = (lo.abs().max(hi.abs()).max_element(), (hi - lo).max_element());
    // Also false for numbers that are not finite.
    let remote = away > FAR && size > 0.0 && away > REMOTE * size && away.is_finite();
    remote.then(|| (0.5 * (lo + hi)).with_z(lo.z))
}

/// Returns the warning about a model that was moved from `at` to the origin.
pub(super) fn moved(at: DVec3) -> String {
    format!(
        "its coordinates are far from the origin: the point {:.2} east, {:.2} north, {:.2} up becomes its foot",
        at.x, at.y, at.z
    )
}

/// Warns of parts without area, and of those that are cut away by the opacity of their pictures.
fn warn_of_invisible(model: &Model, notes: &mut Notes) {
    let gone =
        |part: &&ModelPart| model.surfaces[part.surface].mask.as_deref().is_some_and(|mask| is_cut_away(part, mask));
    let all: Vec<&ModelPart> = model.parts.iter().filter(|part| !part.mesh.triangles.is_empty()).collect();
    let (flat, others): (Vec<&ModelPart>, Vec<&ModelPart>) =
        all.iter().copied().partition(|part| part.mesh.area() == 0.0);
    for part in &flat {
        notes.about("parts whose triangles have no area", &part.name);
    }
    let invisible: Vec<&ModelPart> = others.into_iter().filter(gone).collect();
    for part in &invisible {
        let Surface { name, .. } = &model.surfaces[part.surface];
        notes.about(format!("the opacity of the material `{name}` cuts away every triangle"), &part.name);
    }
    if !all.is_empty() && all.len() == invisible.len() + flat.len() {
        notes.add("it has no visible surface: no pixel of any label will show it");
    }
}

fn is_cut_away(part: &ModelPart, mask: &AlphaMask) -> bool {
    let Mesh { triangles, uvs, .. } = &part.mesh;
    triangles.iter().all(|t| mask.coverage(t.map(|k| uvs[k.to_usize()])) == Coverage::Transparent)
}
