//! `trace leaf`: cuts a leaf out of a photograph, as a texture for a species file.

use furrow::output::{read_color_photo, write_atomically};
use furrow::texture::{Cutting, cut_out, doubts, draw};
use furrow::{Result, cli};
use std::path::PathBuf;

/// Which photograph, and how.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Photograph (PNG or JPEG) of one leaf on white paper or on soil, lying flat.
    photo: PathBuf,
    /// The picture to write, a PNG with opacity: the blade upright, its base at the bottom.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// The base is at the wider end; the narrower one, the stalk's, is taken unless given.
    #[arg(long)]
    flip: bool,
    /// Keep the petiole; it is cut off unless given, for a species file grows one of its own.
    #[arg(long)]
    stalk: bool,
    /// Keep holes; they are filled unless given, since mirrored light looks like holes.
    #[arg(long)]
    holes: bool,
    /// Height of the picture, pixels; as in the photograph unless given.
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u32).range(32..=8192))]
    height: Option<u32>,
    /// Something grey or white in the photograph: x,y,width,height in pixels. Colours then are reflectances, and the species file may say
    /// `calibrated: true`.
    #[arg(long, value_name = "X,Y,W,H", value_parser = cli::crop)]
    grey: Option<furrow::geometry::Window>,
    /// Reflectance of that: 0.18 of a grey card, about 0.85 of white paper.
    #[arg(long, value_name = "SHARE", default_value_t = 0.85, value_parser = share, requires = "grey")]
    reflectance: f32,
}

fn share(text: &str) -> Result<f32, String> {
    text.parse().ok().filter(|v: &f32| *v > 0.0 && *v <= 1.0).ok_or_else(|| "write a share above 0, at most 1".into())
}

/// Cuts the leaf out; returns the picture's path.
pub(crate) fn run(args: &Args) -> Result<Vec<PathBuf>> {
    cli::check_png(&args.out, &args.photo)?;
    let (width, height, rgb) = read_color_photo(&args.photo)?;
    let grey = args.grey.map(|g| ([g.x0, g.y0, g.width(), g.height()], args.reflectance));
    let cutting = Cutting { flip: args.flip, stalk: args.stalk, holes: args.holes, height: args.height, grey };
    let leaf = cut_out(width, height, &rgb, &cutting).map_err(|e| e.in_file(&args.photo))?;
    for doubt in doubts(width, height, &rgb) {
        furrow::tell!("warning: {}: {doubt}", args.photo.display());
    }
    furrow::tell!("{} × {} pixels; width over length of the blade {:.2}", leaf.width, leaf.height, aspect(&leaf));
    write_atomically(&args.out, &draw::encode(&leaf, "cut out of a photograph by furrow"))?;
    Ok(vec![args.out.clone()])
}

/// Width over length of what is opaque: `width_mm` over `blade_mm` in a species file.
fn aspect(leaf: &draw::Drawn) -> f32 {
    let (mut lo, mut hi) = ([u32::MAX; 2], [0; 2]);
    for (i, _) in leaf.rgba.chunks_exact(4).enumerate().filter(|(_, p)| p[3] > 127) {
        let at = [i as u32 % leaf.width, i as u32 / leaf.width];
        lo = [lo[0].min(at[0]), lo[1].min(at[1])];
        hi = [hi[0].max(at[0]), hi[1].max(at[1])];
    }
    (hi[0].saturating_sub(lo[0]) + 1) as f32 / (hi[1].saturating_sub(lo[1]) + 1) as f32
}
