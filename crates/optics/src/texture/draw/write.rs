//! Writes generated textures to PNG files with their provenance.

use super::{GeneratedTexture, HeightImage, Recipe, draw, read};
use furrow_base::atomic_file::write_together;
use furrow_base::error::{Error, Result};
use std::path::{Path, PathBuf};

/// Licence of generated textures.
const LICENCE: &str = "CC0-1.0 OR MIT OR Apache-2.0";

/// Returns the output paths of a recipe: colour image, height map and source note. Fails if the recipe's name does not
/// end in .ron, or if one of these paths exists but is not a file.
pub fn targets(recipe_path: &Path) -> Result<[PathBuf; 3]> {
    // With another extension, the recipe's path could equal its own output path.
    if !recipe_path.extension().is_some_and(|e| e.eq_ignore_ascii_case("ron")) {
        return Err(Error::misuse("the name of a texture recipe must end in .ron")
            .help("NAME.ron is written to NAME.png in the same folder")
            .in_file(recipe_path));
    }
    let targets = ["png", "height.png", "source.md"].map(|ending| recipe_path.with_extension(ending));
    match targets.iter().find(|target| target.exists() && !target.is_file()) {
        None => Ok(targets),
        Some(taken) => {
            let error =
                Error::misuse(format!("this is not a file, but the output of {} goes there", recipe_path.display()));
            Err(error.help("move it away, or give the recipe another name").in_file(taken))
        }
    }
}

/// Generates the texture of a recipe file and writes next to it `NAME.png`, `NAME.height.png` if it has relief, and
/// `NAME.source.md` unless a `SOURCE.md` in its folder or the parent folder lists it. Returns the written paths.
pub fn write(recipe_path: &Path) -> Result<Vec<PathBuf>> {
    let [picture, height, words] = targets(recipe_path)?;
    let recipe = read(recipe_path)?;
    let drawn = draw(&recipe).map_err(|error| error.in_file(recipe_path))?;
    let name = recipe_path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let source = source(&recipe, &name);
    let mut files = vec![(picture, encode(&drawn, &source))];
    if let Some(relief) = &drawn.relief {
        files.push((height, encode_height(relief, &source)));
    }
    if !named_above(recipe_path, &name) {
        files.push((words, format!("`{name}.png`: {source}. Licence: {LICENCE}.\n").into_bytes()));
    }
    // Replaced together, so that an image is never next to the relief of another version.
    write_together(recipe_path, |together| files.iter().try_for_each(|(path, bytes)| together.add(path, bytes)))
}

/// Returns the provenance note of a texture.
pub(super) fn source(recipe: &Recipe, name: &str) -> String {
    let kind = match recipe {
        Recipe::Leaf(_) => "leaf",
        Recipe::Soil(_) => "soil",
    };
    format!("drawn by furrow from the {kind} recipe {name}.ron; no photograph went into it")
}

/// Encodes a generated texture's colour as PNG: sRGB, with alpha unless it is opaque. `source` is stored in the file.
pub fn encode(drawn: &GeneratedTexture, source: &str) -> Vec<u8> {
    let (color, bytes) = if drawn.opaque {
        let rgb = drawn.rgba.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
        (png::ColorType::Rgb, rgb)
    } else {
        (png::ColorType::Rgba, drawn.rgba.clone())
    };
    png_file(drawn.width, drawn.height, color, png::BitDepth::Eight, &bytes, |info| {
        info.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
        text(info, "Source", source);
    })
}

/// Encodes a height map as PNG: 16-bit grey, linear, with its range in the text chunk `HeightRange`.
pub fn encode_height(relief: &HeightImage, source: &str) -> Vec<u8> {
    let bytes: Vec<u8> = relief.values.iter().flat_map(|v| v.to_be_bytes()).collect();
    png_file(relief.width, relief.height, png::ColorType::Grayscale, png::BitDepth::Sixteen, &bytes, |info| {
        text(info, "Source", source);
        text(info, "HeightRange", &format!("{} mm", relief.range_mm));
    })
}

/// Adds a text chunk. PNG texts are Latin-1, so other characters of a file name become `?`.
fn text(encoder: &mut png::Encoder<'_, &mut Vec<u8>>, keyword: &str, words: &str) {
    let latin = words.chars().map(|c| if u32::from(c) < 256 { c } else { '?' }).collect();
    encoder.add_text_chunk(keyword.to_owned(), latin).expect("keywords are constants of at most 79 characters");
}

fn png_file(
    width: u32,
    height: u32,
    color: png::ColorType,
    depth: png::BitDepth,
    bytes: &[u8],
    inform: impl FnOnce(&mut png::Encoder<'_, &mut Vec<u8>>),
) -> Vec<u8> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_color(color);
    encoder.set_depth(depth);
    encoder.set_compression(png::Compression::Balanced);
    encoder.set_filter(png::Filter::Adaptive);
    inform(&mut encoder);
    text(&mut encoder, "License", LICENCE);
    let mut writer = encoder.write_header().expect("the image has a size, and writing to memory succeeds");
    writer.write_image_data(bytes).expect("the data length matches the image size");
    writer.finish().expect("writing to memory succeeds");
    file
}

fn named_above(recipe_path: &Path, name: &str) -> bool {
    let needle = format!("`{name}`");
    // Made absolute, because a bare file name has no parent folder.
    std::path::absolute(recipe_path)
        .unwrap_or_else(|_| recipe_path.to_owned())
        .ancestors()
        .skip(1)
        .take(2)
        .filter_map(|folder| std::fs::read_to_string(folder.join("SOURCE.md")).ok())
        .any(|text| text.contains(&needle))
}
