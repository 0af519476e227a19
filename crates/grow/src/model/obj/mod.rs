//! Reader of Wavefront OBJ files with their MTL files.
//!
//! Source: Alias|Wavefront, "Object Files (.obj)" and "Material Library File (.mtl)", 1995. v increases upwards in OBJ
//! files and downwards here.

mod faces;
mod lines;
mod materials;
mod polygon;
#[cfg(test)]
mod tests;

use super::files::Files;
use super::gather::{UnplacedParts, moved, offset};
use super::notes::Notes;
use super::parts::{Model, Up};
use super::settle::{ModelError, into_one_tile};
use faces::Faces;
use furrow_base::math::DVec3;
use furrow_optics::texture::Surface;
use lines::text;
use materials::{Appearance, Materials};
use std::collections::BTreeMap;

/// Reads a model, or returns an error.
pub(super) fn read(mut files: Files<'_>, up: Up) -> Result<Model, ModelError> {
    let mut notes = Notes::default();
    let file = files.own()?;
    let faces = Faces::read(&text(&file)?, &mut notes)?;
    drop(file);
    let mut materials = Materials::open(files);
    for library in &faces.libraries {
        materials.load(library, &mut notes)?;
    }
    let mut model = Model::default();
    let appearances = materials.appearances(&mut notes)?;
    model.surfaces.extend(appearances.iter().map(|appearance| appearance.surface.clone()));
    // For faces without a material.
    model.surfaces.push(Surface::default());
    let numbers: BTreeMap<&str, usize> =
        appearances.iter().enumerate().map(|(k, l)| (l.surface.name.as_str(), k)).collect();

    // Positions are reduced to single precision around the model's own foot.
    let rotation = up.rotation();
    let foot = offset(faces.bounds(&rotation));
    let origin = foot.map_or(DVec3::ZERO, |at| rotation.inverse().transform_point3(at));
    if let Some(at) = foot {
        notes.add(moved(at));
    }
    let mut gathered = UnplacedParts::default();
    let mut bare: BTreeMap<usize, usize> = BTreeMap::new();
    for piece in &faces.pieces {
        let number = piece.material.as_ref().and_then(|name| numbers.get(name.as_str()).copied());
        if let (Some(name), None) = (&piece.material, number) {
            notes.about("materials that its MTL files lack, replaced by white", name);
        }
        let appearance: Option<&Appearance> = number.map(|number| &appearances[number]);
        if let Some(appearance) = appearance.filter(|appearance| appearance.is_absent()) {
            notes.about("left out: materials whose opacity `d` is below ½", &appearance.surface.name);
            continue;
        }
        let mut mesh = faces.mesh(piece, origin);
        let mut surface = number.unwrap_or(appearances.len());
        if let Some(appearance) = appearance.filter(|appearance| appearance.has_pictures()) {
            if piece.textured {
                mesh.uvs.iter_mut().for_each(|uv| *uv = appearance.transformed(*uv));
                if appearance.surface.mask.is_some() {
                    into_one_tile(&mut mesh.uvs, appearance.wrap(), &piece.name, &mut notes)?;
                }
            } else {
                notes.about("no texture coordinates, so the pictures of its material are passed over", &piece.name);
                surface = *bare.entry(surface).or_insert_with(|| {
                    model.surfaces.push(appearance.surface.without_pictures());
                    model.surfaces.len() - 1
                });
            }
        }
        gathered.add(piece.name.clone(), mesh, surface, None, rotation)?;
    }
    gathered.into_model(&mut model, &mut notes)?;
    model.warnings = notes.words();
    model.pictures = materials.files.pictures;
    model.files = materials.files.read;
    Ok(model)
}
