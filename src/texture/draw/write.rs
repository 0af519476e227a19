//! Writes drawn textures, with their provenance inside.

use super::{Drawn, Grey, Recipe, draw, read};
use crate::error::{Error, Result};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// Who may use a drawn texture, and how.
const LICENCE: &str = "CC0-1.0 OR MIT OR Apache-2.0";

/// Where the drawing of a recipe goes: its picture, its relief and the words on its source. An error where nothing can be written there.
pub fn targets(recipe_path: &Path) -> Result<[PathBuf; 3]> {
    // One of another name may be where its own picture goes.
    if !recipe_path.extension().is_some_and(|e| e.eq_ignore_ascii_case("ron")) {
        return Err(Error::misuse("the name of a texture recipe must end in .ron")
            .help("NAME.ron is drawn to NAME.png beside it")
            .in_file(recipe_path));
    }
    let targets = ["png", "height.png", "source.md"].map(|ending| recipe_path.with_extension(ending));
    match targets.iter().find(|target| target.exists() && !target.is_file()) {
        None => Ok(targets),
        Some(taken) => {
            let error = Error::misuse(format!("this is no file, and what {} draws goes there", recipe_path.display()));
            Err(error.help("move it away, or give the recipe another name").in_file(taken))
        }
    }
}

/// Draws the recipe in a file and writes, beside it, `NAME.png`, `NAME.height.png` where it has relief, and
/// `NAME.source.md` unless a `SOURCE.md` in its folder or the one above names it. Returns what was written.
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
    // All of them before the first gets its name: a picture does not stand beside the relief of another.
    let whole = files.iter().map(|(path, bytes)| unfinished(path, bytes)).collect::<Result<Vec<_>>>()?;
    let mut written = Vec::new();
    for (file, (path, _)) in whole.into_iter().zip(files) {
        file.persist(&path).map_err(|e| Error::io(&path)(e.error))?;
        written.push(path);
    }
    Ok(written)
}

/// Where a texture comes from, in words.
pub(super) fn source(recipe: &Recipe, name: &str) -> String {
    let kind = match recipe {
        Recipe::Leaf(_) => "leaf",
        Recipe::Soil(_) => "soil",
    };
    format!("drawn by furrow from the {kind} recipe {name}.ron; no photograph went into it")
}

/// The PNG file of a drawn texture's colour: sRGB, with opacity unless it is opaque. `source` goes into the file.
pub fn encode(drawn: &Drawn, source: &str) -> Vec<u8> {
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

/// The PNG file of a relief: 16-bit grey, linear; its range stands inside as `HeightRange`.
pub fn encode_height(relief: &Grey, source: &str) -> Vec<u8> {
    let bytes: Vec<u8> = relief.values.iter().flat_map(|v| v.to_be_bytes()).collect();
    png_file(relief.width, relief.height, png::ColorType::Grayscale, png::BitDepth::Sixteen, &bytes, |info| {
        text(info, "Source", source);
        text(info, "HeightRange", &format!("{} mm", relief.range_mm));
    })
}

/// PNG texts are Latin-1; a file's name may hold more.
fn text(encoder: &mut png::Encoder<'_, &mut Vec<u8>>, keyword: &str, words: &str) {
    let latin = words.chars().map(|c| if u32::from(c) < 256 { c } else { '?' }).collect();
    encoder.add_text_chunk(keyword.to_owned(), latin).expect("keywords are short");
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
    let mut writer = encoder.write_header().expect("a drawn image has a size, and memory takes it");
    writer.write_image_data(bytes).expect("as many bytes as pixels");
    writer.finish().expect("memory takes the end");
    file
}

/// A file that is whole or not there: written under another name, flushed, renamed.
/// A whole file under a temporary name beside its own.
fn unfinished(path: &Path, bytes: &[u8]) -> Result<NamedTempFile> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut builder = tempfile::Builder::new();
    // Temporary files are private by default; a texture is as public as any file its user makes.
    #[cfg(unix)]
    let public = std::os::unix::fs::PermissionsExt::from_mode(0o666);
    #[cfg(unix)]
    builder.permissions(public);
    let mut file = builder.prefix(".furrow-").tempfile_in(folder).map_err(Error::io(path))?;
    file.write_all(bytes).and_then(|()| file.as_file().sync_all()).map_err(Error::io(path))?;
    Ok(file)
}

fn named_above(recipe_path: &Path, name: &str) -> bool {
    let needle = format!("`{name}`");
    // Made absolute: of a name alone there is no folder above.
    std::path::absolute(recipe_path)
        .unwrap_or_else(|_| recipe_path.to_owned())
        .ancestors()
        .skip(1)
        .take(2)
        .filter_map(|folder| std::fs::read_to_string(folder.join("SOURCE.md")).ok())
        .any(|text| text.contains(&needle))
}
