//! `trace leaf`: cuts a leaf out of a photograph, as a texture for a species file.

use furrow_base::Result;
use furrow_base::math::{ToFloat, ToInt};
use furrow_cli::cli;
use furrow_optics::texture::{CutoutOptions, cut_out, doubts, draw};
use furrow_output::{read_color_photo, write_atomically};
use std::path::PathBuf;

/// The photograph, and options.
#[derive(clap::Args)]
pub(crate) struct Args {
    /// Photograph (PNG or JPEG) of one leaf on white paper or on soil, lying flat.
    photo: PathBuf,
    /// Output image, a PNG with alpha channel: the blade upright, its base at the bottom.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// The base is at the other end. Default: where the petiole is; if none is seen, at the narrower end.
    #[arg(long)]
    flip: bool,
    /// Keep the petiole. Default: it is cut off, because plants of a species file have petioles of their own.
    #[arg(long)]
    stalk: bool,
    /// Keep holes. Default: they are filled, because specular highlights look like holes.
    #[arg(long)]
    holes: bool,
    /// Height of the output image, pixels. Default: as in the photograph.
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u32).range(32..=8192))]
    height: Option<u32>,
    /// Grey or white reference in the photograph: x,y,width,height in pixels. Colours are then reflectances, and the
    /// species file may use `calibrated: true`.
    #[arg(long, value_name = "X,Y,W,H", value_parser = cli::crop)]
    grey: Option<furrow_base::geometry::Window>,
    /// Reflectance of the reference: 0.18 for a grey card, about 0.85 for white paper.
    #[arg(long, value_name = "SHARE", default_value_t = 0.85, value_parser = share, requires = "grey")]
    reflectance: f32,
}

fn share(text: &str) -> Result<f32, String> {
    text.parse().ok().filter(|v: &f32| (0.01..=1.0).contains(v)).ok_or_else(|| "write a fraction from 0.01 to 1".into())
}

/// Cuts the leaf out. Returns the path of the image.
pub(crate) fn run(args: &Args) -> Result<Vec<PathBuf>> {
    cli::check_png(&args.out, &args.photo)?;
    let (width, height, rgb) = read_color_photo(&args.photo)?;
    let grey = args.grey.map(|g| ([g.x0, g.y0, g.width(), g.height()], args.reflectance));
    let cutting = CutoutOptions { flip: args.flip, stalk: args.stalk, holes: args.holes, height: args.height, grey };
    let leaf = cut_out(width, height, &rgb, &cutting).map_err(|e| e.in_file(&args.photo))?;
    for doubt in doubts(width, height, &rgb, args.flip) {
        furrow_cli::message!("warning: {}: {doubt}", args.photo.display());
    }
    furrow_cli::message!("{} × {} pixels; the blade's width/length is {:.2}", leaf.width, leaf.height, aspect(&leaf));
    write_atomically(&args.out, &draw::encode(&leaf, "cut out of a photograph by furrow"))?;
    Ok(vec![args.out.clone()])
}

/// Ratio of width to length of the opaque part: `width_mm` divided by `blade_mm` in a species file.
fn aspect(leaf: &draw::GeneratedTexture) -> f32 {
    let (mut lo, mut hi) = ([u32::MAX; 2], [0; 2]);
    for (i, _) in leaf.rgba.chunks_exact(4).enumerate().filter(|(_, p)| p[3] > 127) {
        let at = [i.to_u32() % leaf.width, i.to_u32() / leaf.width];
        lo = [lo[0].min(at[0]), lo[1].min(at[1])];
        hi = [hi[0].max(at[0]), hi[1].max(at[1])];
    }
    (hi[0].saturating_sub(lo[0]) + 1).to_f32() / (hi[1].saturating_sub(lo[1]) + 1).to_f32()
}
