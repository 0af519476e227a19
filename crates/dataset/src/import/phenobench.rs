//! Source for PhenoBench: `SPLIT/{images,semantics,plant_instances,leaf_instances}/NAME.png`. Its `test` split has no
//! labels and is skipped.
//!
//! Classes 3 and 4, partial crop and partial weed, become 1 and 2; 255 is unlabelled. A crop plant and a weed may have
//! the same number; leaves are numbered throughout the image. Visibilities are not imported: they describe the fraction
//! of an instance within a crop of a larger image. Source: Weyler et al. 2024, and its loader, version 0.1.0.

use super::files::{length, photograph, pictures, same_size};
use super::instances::instances;
use super::{Labelled, Source, SourceImage};
use crate::model::sample::IGNORE;
use crate::model::split::Split;
use furrow_base::math::ToInt;
use furrow_base::{Error, Result};
use furrow_output::Map;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// A PhenoBench folder.
pub struct PhenoBench {
    root: PathBuf,
    images: Vec<SourceImage>,
    paths: Vec<PathBuf>,
    words: String,
    warnings: Vec<String>,
}

/// Folders of labels.
const LABELS: [&str; 3] = ["semantics", "plant_instances", "leaf_instances"];

impl PhenoBench {
    /// Opens a PhenoBench folder and lists the images that have labels.
    pub fn open(root: &Path) -> Result<Self> {
        let mut all = Self {
            root: root.into(),
            images: Vec::new(),
            paths: Vec::new(),
            words: String::new(),
            warnings: Vec::new(),
        };
        for split in Split::ALL {
            let folder = root.join(split.name());
            if !folder.join("images").is_dir() {
                continue;
            }
            let found = pictures(&folder.join("images"), "")?;
            if !folder.join(LABELS[0]).is_dir() {
                all.warnings.push(format!("{}: {} images without labels were skipped", folder.display(), found.len()));
                continue;
            }
            for (name, path) in found {
                let mut lengths = vec![length(&path)?];
                for kind in LABELS.iter().filter(|k| folder.join(k).is_dir()) {
                    lengths.push(length(&folder.join(kind).join(format!("{name}.png")))?);
                }
                let one = SourceImage { split: Some(split), name };
                let _ = writeln!(all.words, "{one:?} {lengths:?}");
                all.images.push(one);
                all.paths.push(path);
            }
        }
        if all.images.is_empty() {
            return Err(Error::input("this folder contains no images with labels")
                .in_file(root)
                .help("give --from the folder that contains train/images, train/semantics, …"));
        }
        Ok(all)
    }
}

impl Source for PhenoBench {
    fn name(&self) -> &'static str {
        "phenobench"
    }

    fn images(&self) -> &[SourceImage] {
        &self.images
    }

    fn words(&self) -> &str {
        &self.words
    }

    fn warnings(&self) -> &[String] {
        &self.warnings
    }

    fn read(&self, place: usize) -> Result<Labelled> {
        let SourceImage { split, name } = &self.images[place];
        let folder = self.root.join(split.unwrap_or(Split::Train).name());
        let photo = photograph(furrow_output::open_photo(&self.paths[place])?);
        let numbers = |kind: &str| -> Result<Vec<u32>> {
            if !folder.join(kind).is_dir() {
                return Ok(vec![0; photo.pixels.len()]);
            }
            let path = folder.join(kind).join(format!("{name}.png"));
            let (x, y, map) = furrow_output::read_map(&path)?;
            same_size(&path, (x, y), &photo)?;
            match map {
                Map::Numbers(numbers) | Map::Indexed(numbers, _) => Ok(numbers.into_iter().map(u32::from).collect()),
                Map::Colors(_) => Err(Error::input("this is a colour image, not a map of numbers").in_file(path)),
            }
        };
        let path = folder.join(LABELS[0]).join(format!("{name}.png"));
        let semantics: Vec<u8> = numbers(LABELS[0])?
            .into_iter()
            .enumerate()
            .map(|(i, n)| class(&path, photo.size.0, i, n))
            .collect::<Result<_>>()?;
        let found = instances(&path, &semantics, &numbers(LABELS[1])?, &numbers(LABELS[2])?)?;
        Ok(Labelled {
            size: photo.size,
            rgb: photo.pixels,
            semantics,
            plants: found.plants,
            leaves: found.leaves,
            warnings: [photo.warnings, found.warnings].concat(),
            ..Labelled::default()
        })
    }
}

/// Returns the class of a PhenoBench number.
fn class(path: &Path, width: u32, place: usize, number: u32) -> Result<u8> {
    match number {
        0..=2 => Ok(number.to_u8()),
        3 | 4 => Ok(number.to_u8() - 2),
        255 => Ok(IGNORE),
        other => Err(Error::input(format!(
            "pixel {},{} has the number {other}; PhenoBench has 0 to 4 and 255",
            place.to_u32() % width,
            place.to_u32() / width
        ))
        .in_file(path)),
    }
}
