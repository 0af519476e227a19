//! `trace preview`: several fields of a scene file on one sheet, each with its index.

use crate::field::{MemoryArgs, SetArgs, scene_file};
use crate::quality::{samples, threads};
use crate::render::plants;
use furrow_base::math::ToInt;
use furrow_base::{Error, Result};
use furrow_cli::cli::{self, signal::Signals};
use furrow_job::{Renderer, Request, SceneFile, Threads};
use furrow_output::ImageData;
use furrow_output::letters;
use furrow_render::render::RenderMonitor;
use furrow_render::settings::{Quality, RenderOptions};
use std::collections::BTreeSet;
use std::ops::Range;
use std::path::{Path, PathBuf};

const PAPER: [u8; 3] = [251, 250, 247];
const INK: [u8; 3] = [34, 38, 31];
/// Gap between images, pixels.
const GAP: usize = 8;
/// Size of a letter's dot, pixels.
const DOT: usize = 2;
/// Height of the line of text above an image, pixels.
const LINE: usize = DOT * letters::HEIGHT + GAP;
/// Maximum number of fields on a sheet.
const MOST: u64 = 400;
/// Maximum number of pixels of a sheet.
const MOST_PIXELS: usize = 1 << 28;

/// Fields to render, and rendering options.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Scene file (RON).
    #[arg(value_name = "FILE", value_parser = scene_file())]
    scene: PathBuf,
    #[command(flatten)]
    set: SetArgs,
    /// Indices of the fields: from the first, up to but excluding the last.
    #[arg(long, value_name = "FROM..TO", value_parser = indices, default_value = "0..12")]
    indices: Range<u64>,
    /// The sheet, a PNG file. Default: `out/` and the scene file's name with `-sheet.png`.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Seed that overrides the scene file's.
    #[arg(long)]
    seed: Option<u64>,
    /// Width of each image in pixels. The field of view is unchanged.
    #[arg(long, default_value_t = 320, value_parser = clap::value_parser!(u32).range(16..=4096))]
    width: u32,
    /// Number of images side by side.
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=64))]
    columns: u32,
    /// Samples per pixel.
    #[arg(long, default_value_t = 8, value_parser = samples())]
    spp: u32,
    #[command(flatten)]
    memory: MemoryArgs,
    /// Number of threads; 0 for one per core. The file does not depend on it.
    #[arg(long, default_value_t = 0, value_parser = threads)]
    threads: usize,
    /// Print nothing but errors, warnings and the path of the sheet.
    #[arg(long)]
    quiet: bool,
}

/// Parses a range such as `0..12`.
fn indices(text: &str) -> std::result::Result<Range<u64>, String> {
    let range = text.split_once("..").and_then(|(from, to)| Some(from.trim().parse().ok()?..to.trim().parse().ok()?));
    match range {
        Some(range) if !range.is_empty() && range.end - range.start <= MOST => Ok(range),
        Some(range) if !range.is_empty() => Err(format!("a sheet has room for at most {MOST} fields")),
        _ => Err("write the first index and the one after the last, such as 0..12".into()),
    }
}

/// Image of one field.
struct Thumbnail {
    words: String,
    width: usize,
    pixels: Vec<[u8; 3]>,
}

/// Renders the fields and writes the sheet. Returns its path.
pub(crate) fn run(args: &Args, signals: &Signals) -> Result<Vec<PathBuf>> {
    cli::check_scene(&args.scene)?;
    let out = args.out.clone().unwrap_or_else(|| {
        let name = args.scene.file_stem().unwrap_or_default().to_string_lossy();
        Path::new("out").join(format!("{name}-sheet.png"))
    });
    cli::check_png(&out, &args.scene)?;
    let renderer = Renderer::open(&RenderOptions::path_traced(Quality::spp(args.spp)))?;
    let scene = SceneFile::open(&args.scene)?
        .assign(&args.set.values)?
        .seed(args.seed)
        .width(args.width)
        .memory(args.memory.bytes);
    let stop = signals.catch();
    let scene = scene.threads(&Threads::new(args.threads)?).until(stop);
    if !args.quiet
        && let Some(plants) = scene.plants_in_view(MOST)
    {
        furrow_cli::message!("{}", plants.message());
    }
    let (mut thumbnails, mut seed, mut warned) = (Vec::new(), 0, BTreeSet::new());
    let mut warn = |words: &String| {
        // Most warnings are the same for all fields of a scene file.
        if warned.insert(words.clone()) {
            furrow_cli::message!("warning: {words}");
        }
    };
    for index in args.indices.clone() {
        scene.expected_warnings(index)?.iter().for_each(&mut warn);
        let field = scene.field(index)?;
        let request = Request { watch: RenderMonitor { done: &|_| (), stop }, ..Request::default() };
        let photograph = renderer.render(&field, &request)?.photograph();
        let grown = field.grown();
        seed = grown.seed;
        if !args.quiet {
            furrow_cli::message!("index {index}: {}", plants(grown.plants.len()));
        }
        grown.warnings.iter().for_each(&mut warn);
        thumbnails.push(Thumbnail {
            words: format!("index {index}"),
            width: photograph.width.to_usize(),
            pixels: photograph.rgb.as_chunks::<3>().0.to_vec(),
        });
    }
    let sheet = compose(&thumbnails, args.columns.to_usize())?;
    let Range { start, end } = args.indices;
    let text = format!(
        "program: furrow {}\nseed: {seed}\nindices: {start}..{end}\nspp: {}",
        env!("CARGO_PKG_VERSION"),
        args.spp
    );
    furrow_output::write_png(
        &out,
        sheet.width.to_u32(),
        (sheet.pixels.len() / sheet.width).to_u32(),
        &ImageData::Rgb(&sheet.pixels),
        &text,
    )?;
    Ok(vec![out])
}

/// An RGB image.
struct ContactSheet {
    width: usize,
    pixels: Vec<[u8; 3]>,
}

/// Arranges images in a grid, each below its text.
fn compose(thumbnails: &[Thumbnail], columns: usize) -> Result<ContactSheet> {
    let columns = columns.min(thumbnails.len()).max(1);
    let wide = thumbnails
        .iter()
        .map(|thumbnail| thumbnail.width.max(thumbnail.words.len() * letters::PITCH * DOT))
        .max()
        .unwrap_or(0);
    let tall = thumbnails.iter().map(|thumbnail| thumbnail.pixels.len() / thumbnail.width.max(1)).max().unwrap_or(0);
    let width = GAP + columns * (wide + GAP);
    let height = GAP + thumbnails.len().div_ceil(columns) * (LINE + tall + GAP);
    if width * height > MOST_PIXELS {
        let help = "a smaller --width or fewer --indices";
        return Err(Error::misuse(format!("a sheet of {width} × {height} pixels is too large")).help(help));
    }
    let mut sheet = ContactSheet { width, pixels: vec![PAPER; width * height] };
    for (i, thumbnail) in thumbnails.iter().enumerate() {
        let (x, y) = (GAP + i % columns * (wide + GAP), GAP + i / columns * (LINE + tall + GAP));
        letters::draw(&mut sheet.pixels, width, &thumbnail.words, (x, y), DOT, INK);
        for (row, pixels) in thumbnail.pixels.chunks_exact(thumbnail.width).enumerate() {
            let start = (y + LINE + row) * width + x;
            sheet.pixels[start..start + thumbnail.width].copy_from_slice(pixels);
        }
    }
    Ok(sheet)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn indices_are_checked() {
        assert_eq!(indices("0..12"), Ok(0..12));
        for bad in ["", "12", "3..3", "4..2", "a..b", "0..100000", "-1..3"] {
            assert!(indices(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn every_picture_stands_below_its_words() {
        let thumbnail =
            |n: u8| Thumbnail { words: format!("index {n}"), width: 120, pixels: vec![[n, 0, 0]; 120 * 40] };
        let sheet = compose(&[thumbnail(1), thumbnail(2), thumbnail(3)], 2).unwrap();
        assert_eq!(
            (sheet.width, sheet.pixels.len() / sheet.width),
            (GAP + 2 * (120 + GAP), GAP + 2 * (LINE + 40 + GAP))
        );
        let at = |x: usize, y: usize| sheet.pixels[y * sheet.width + x];
        assert_eq!(at(GAP, GAP + LINE), [1, 0, 0]);
        assert_eq!(at(2 * GAP + 120, GAP + LINE), [2, 0, 0]);
        assert_eq!(at(GAP, 2 * GAP + 2 * LINE + 40), [3, 0, 0]);
        assert!(sheet.pixels.iter().filter(|p| **p == INK).count() > 100);
    }
}
