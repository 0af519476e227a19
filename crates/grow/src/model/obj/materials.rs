//! Materials of MTL files.
//!
//! Keywords: `Kd`, `map_Kd`, `d`, `Tr`, `map_d`, `Ns`, `Pr`. The alpha channel of a texture cuts the surface as `map_d`
//! does; `map_d` uses its alpha channel if it has one, else its brightness.

use super::super::files::Files;
use super::super::notes::Notes;
use super::super::settle::{ModelError, fraction, warn_of_color};
use super::lines::{Statement, statements, text};
use furrow_base::geometry::AlphaMask;
use furrow_base::math::Vec2;
use furrow_optics::texture::Surface;
use furrow_optics::texture::{ColorSpace, Header, Texture, Wrap};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Keywords that do not concern the diffuse colour, or repeat it.
const HARMLESS: [&str; 11] =
    ["Ka", "Ks", "Ni", "illum", "sharpness", "Km", "map_Ka", "map_Ks", "map_Ns", "map_aat", "Tf"];

/// A picture and how it is laid.
#[derive(Clone, Debug, PartialEq)]
struct Map {
    file: String,
    scale: [f32; 2],
    offset: [f32; 2],
    clamp: bool,
}

impl Map {
    fn is_laid_like(&self, other: &Self) -> bool {
        (self.scale, self.offset, self.clamp) == (other.scale, other.offset, other.clamp)
    }
}

/// A material as its file describes it.
#[derive(Clone, Debug, Default, PartialEq)]
struct Material {
    name: String,
    color: Option<[f32; 3]>,
    /// Opacity, by `d` or else by `Tr`.
    dissolve: Option<f32>,
    transparency: Option<f32>,
    shininess: Option<f32>,
    roughness: Option<f32>,
    picture: Option<Map>,
    cut: Option<Map>,
}

/// Surface of a material, and how to read the faces that use it.
pub(super) struct Appearance {
    pub(super) surface: Surface,
    map: Option<Map>,
    opacity: f32,
}

impl Appearance {
    /// Returns whether its opacity is below one half everywhere.
    pub(super) fn is_absent(&self) -> bool {
        self.opacity < 0.5
    }

    /// Returns whether the surface has any picture.
    pub(super) fn has_pictures(&self) -> bool {
        self.map.is_some()
    }

    /// Returns the wrap modes of its pictures.
    pub(super) fn wrap(&self) -> [Wrap; 2] {
        [wrap(self.map.as_ref()); 2]
    }

    /// Applies the options `-s` and `-o` of its pictures to texture coordinates, whose v increases downwards.
    pub(super) fn transformed(&self, uv: Vec2) -> Vec2 {
        let Some(Map { scale: [sx, sy], offset: [ox, oy], .. }) = &self.map else { return uv };
        if [*sx, *sy, *ox, *oy] == [1.0, 1.0, 0.0, 0.0] {
            return uv;
        }
        Vec2::new(uv.x * sx + ox, 1.0 - ((1.0 - uv.y) * sy + oy))
    }
}

fn wrap(map: Option<&Map>) -> Wrap {
    if map.is_some_and(|map| map.clamp) { Wrap::Clamp } else { Wrap::Repeat }
}

/// Materials of a model, and its pictures, each decoded once.
pub(super) struct Materials<'a> {
    pub(super) files: Files<'a>,
    all: Vec<Material>,
    known: BTreeMap<(String, bool), Arc<Texture>>,
}

impl<'a> Materials<'a> {
    pub(super) fn open(files: Files<'a>) -> Self {
        Self { files, all: Vec::new(), known: BTreeMap::new() }
    }

    /// Reads the libraries that a statement `mtllib` names: one whose name may have spaces, or several.
    pub(super) fn load(&mut self, names: &str, notes: &mut Notes) -> Result<(), ModelError> {
        let whole = self.files.named(&slashed(names));
        let several: Vec<&str> = names.split_whitespace().collect();
        let read: Vec<(&str, Vec<u8>)> = match whole {
            Ok(bytes) => vec![(names, bytes)],
            Err(_) if several.len() > 1 => {
                let each = several.into_iter().map(|name| Ok((name, self.files.named(&slashed(name))?)));
                each.collect::<Result<_, ModelError>>()?
            }
            Err(wrong) => return Err(wrong),
        };
        for (name, bytes) in read {
            let wrong = |what: String| ModelError::from(format!("its materials {}: {what}", slashed(name)));
            let found = materials(&text(&bytes).map_err(wrong)?, notes).map_err(wrong)?;
            // The first material of a name counts, as in other programs.
            for material in found {
                match self.all.iter().find(|known| known.name == material.name) {
                    None => self.all.push(material),
                    Some(known) if *known == material => {}
                    Some(_) => {
                        notes.about(
                            "materials that are described twice and differently; the first counts",
                            &material.name,
                        );
                    }
                }
            }
        }
        Ok(())
    }

    /// Returns the surfaces of all materials.
    pub(super) fn appearances(&mut self, notes: &mut Notes) -> Result<Vec<Appearance>, ModelError> {
        let materials = std::mem::take(&mut self.all);
        materials.iter().map(|material| self.appearance(material, notes)).collect()
    }

    fn appearance(&mut self, material: &Material, notes: &mut Notes) -> Result<Appearance, ModelError> {
        let picture = material.picture.as_ref().map(|map| self.picture(map)).transpose()?;
        let cut = material.cut.as_ref().map(|map| self.picture(map)).transpose()?;
        if let (Some(picture), Some(cut)) = (&material.picture, &material.cut)
            && !picture.is_laid_like(cut)
        {
            notes.about("options of `map_d` that differ from those of `map_Kd` are passed over", &material.name);
        }
        let mask = match (&cut, &picture) {
            (Some(cut), _) => cut.alpha_mask().or_else(|| bright(cut)),
            (None, Some(picture)) => picture.alpha_mask(),
            (None, None) => None,
        };
        // Some writers leave the colour black if there is a texture.
        let color = match material.color.unwrap_or([1.0; 3]).map(fraction) {
            [0.0, 0.0, 0.0] if picture.is_some() => [1.0; 3],
            color => color,
        };
        // The Blinn–Phong exponent n corresponds to GGX α = √(2 / (n + 2)). Source: Walter et al. 2007. The roughness of
        // physically based extensions is that of glTF, α = roughness².
        let shiny = material.shininess.map(|n| (2.0 / (n + 2.0)).sqrt());
        let rough = material.roughness.map(|roughness| roughness.powi(2));
        Ok(Appearance {
            surface: Surface {
                name: material.name.clone(),
                color,
                picture,
                mask: mask.map(Arc::new),
                roughness: rough.or(shiny),
                ..Surface::default()
            },
            map: material.picture.clone().or_else(|| material.cut.clone()),
            opacity: material.dissolve.or(material.transparency.map(|t| 1.0 - t)).unwrap_or(1.0),
        })
    }

    fn picture(&mut self, map: &Map) -> Result<Arc<Texture>, ModelError> {
        let key = (map.file.clone(), map.clamp);
        if let Some(known) = self.known.get(&key) {
            return Ok(known.clone());
        }
        let name = &map.file;
        let data = self.files.named(&slashed(name))?;
        self.files.count(&format!("`{name}`"), &data, Header::color)?;
        let picture =
            Texture::decode(&data, ColorSpace::Srgb).map_err(|what| format!("its picture `{name}`: {what}"))?;
        let picture = Arc::new(picture.wrapped(wrap(Some(map))));
        self.known.insert(key, picture.clone());
        Ok(picture)
    }
}

/// Reads the materials of a library.
fn materials(text: &str, notes: &mut Notes) -> Result<Vec<Material>, String> {
    let mut all: Vec<Material> = Vec::new();
    for statement in statements(text) {
        if statement.keyword == "newmtl" {
            all.push(Material { name: statement.rest.into_owned(), ..Material::default() });
            continue;
        }
        match all.last_mut() {
            Some(material) => read(material, &statement, notes)?,
            None if HARMLESS.contains(&statement.keyword) => {}
            None => notes.about("passed over: statements of the MTL file before the first `newmtl`", statement.keyword),
        }
    }
    Ok(all)
}

fn read(material: &mut Material, of: &Statement<'_>, notes: &mut Notes) -> Result<(), String> {
    let last = || of.finite(of.words().last().unwrap_or_default());
    match of.keyword {
        "Kd" if of.rest.starts_with("spectral") || of.rest.starts_with("xyz") => {
            notes.about("passed over: colours as spectra or XYZ", &material.name);
        }
        "Kd" => {
            let color = color(of)?;
            warn_of_color(color, &material.name, notes);
            material.color = Some(color);
        }
        "d" => {
            if of.rest.starts_with("-halo") {
                notes.about("passed over: the option -halo of `d`", &material.name);
            }
            material.dissolve = Some(share(of, last()?, &material.name, notes));
        }
        "Tr" => material.transparency = Some(share(of, last()?, &material.name, notes)),
        "Ns" => match last()? {
            exponent if exponent >= 0.0 => material.shininess = Some(exponent),
            _ => notes.about("passed over: negative exponents `Ns`", &material.name),
        },
        "Pr" => material.roughness = Some(share(of, last()?, &material.name, notes)),
        "map_Kd" => material.picture = Some(map(of, &material.name, notes)?),
        "map_d" => material.cut = Some(map(of, &material.name, notes)?),
        "Ke" | "Pm" if of.rest.split_whitespace().all(|word| word.parse() == Ok(0.0)) => {}
        keyword if HARMLESS.contains(&keyword) => {}
        keyword => notes.about(format!("passed over: `{keyword}` of the MTL file"), &material.name),
    }
    Ok(())
}

/// Cuts a number to 0 to 1, with a warning if it is beyond.
fn share(of: &Statement<'_>, number: f32, material: &str, notes: &mut Notes) -> f32 {
    if !(0.0..=1.0).contains(&number) {
        notes.about(format!("numbers `{}` that are not between 0 and 1, cut to them", of.keyword), material);
    }
    fraction(number)
}

/// Reads one number for grey, or three.
fn color(of: &Statement<'_>) -> Result<[f32; 3], String> {
    let few = if of.words().count() == 1 { 1 } else { 3 };
    of.numbers::<3>(few)?;
    let mut color = [0.0; 3];
    for (band, word) in color.iter_mut().zip(of.words()) {
        *band = of.finite(word)?;
    }
    Ok(if few == 1 { [color[0]; 3] } else { color })
}

/// Reads the options of a picture and its file name, which may have spaces.
fn map(of: &Statement<'_>, material: &str, notes: &mut Notes) -> Result<Map, String> {
    let mut map = Map { file: String::new(), scale: [1.0; 2], offset: [0.0; 2], clamp: false };
    let mut rest = &*of.rest;
    while let Some(option) = rest.split_whitespace().next().filter(|word| word.starts_with('-')) {
        rest = rest[option.len()..].trim_start();
        let mut numbers: Vec<f32> = Vec::new();
        let mut word = || {
            let word = rest.split_whitespace().next().unwrap_or_default();
            rest = rest[word.len()..].trim_start();
            word
        };
        match option {
            "-s" | "-o" | "-t" | "-mm" => {
                let most = if option == "-mm" { 2 } else { 3 };
                // The last word is the file's name, even if it is a number.
                while numbers.len() < most
                    && let Some((first, _)) = rest.split_once(char::is_whitespace)
                    && first.parse::<f32>().is_ok()
                {
                    numbers.push(of.finite(first)?);
                    rest = rest[first.len()..].trim_start();
                }
                let pair =
                    |rest: f32| [numbers.first().copied().unwrap_or(rest), numbers.get(1).copied().unwrap_or(rest)];
                match option {
                    "-s" => map.scale = pair(1.0),
                    "-o" => map.offset = pair(0.0),
                    "-t" if numbers.iter().all(|n| *n == 0.0) => {}
                    "-mm" if numbers == [0.0, 1.0] => {}
                    _ => notes.about(format!("passed over: the option {option} of a picture"), material),
                }
            }
            "-clamp" => map.clamp = word() == "on",
            "-bm" | "-boost" | "-texres" | "-blendu" | "-blendv" | "-cc" => {
                word();
            }
            "-imfchan" | "-type" => {
                word();
                notes.about(format!("passed over: the option {option} of a picture"), material);
            }
            _ => return Err(of.wrong(&format!("the option {option} of a picture is unknown"))),
        }
    }
    rest.trim().trim_matches('"').clone_into(&mut map.file);
    if map.file.is_empty() {
        return Err(of.wrong(&format!("`{}` names no picture", of.keyword)));
    }
    Ok(map)
}

/// Replaces backslashes in a path by slashes. Of a path on a drive of another machine, only the file's name is left.
fn slashed(path: &str) -> String {
    let path = path.replace('\\', "/");
    match path.as_bytes() {
        [drive, b':', ..] if drive.is_ascii_alphabetic() => path.rsplit('/').next().unwrap_or_default().to_owned(),
        _ => path,
    }
}

/// Returns the mask where a grey texture is brighter than one half; `None` if it is so everywhere.
fn bright(picture: &Texture) -> Option<AlphaMask> {
    // Half of the byte's range, in linear light.
    let half = ColorSpace::Srgb.table()[127];
    let there = |x, y| picture.texel(x, y)[0] > half;
    let all = (0..picture.height()).all(|y| (0..picture.width()).all(|x| there(x, y)));
    (!all).then(|| AlphaMask::new(picture.width(), picture.height(), there))
}
