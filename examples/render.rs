//! Renders and labels one field, as `trace --scene scenes/field.ron` does.
//!
//! ```sh
//! cargo run --release --example render                                   # the main scene, 64 samples per pixel
//! cargo run --release --example render -- scenes/02-one-plant.ron 4 96   # another scene, 4 samples per pixel, 96 pixels wide
//! ```

#![expect(clippy::print_stdout, reason = "the paths are the result")]

use furrow::prelude::*;

fn main() -> furrow::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let scene = arguments.next().unwrap_or_else(|| "scenes/field.ron".into());
    let spp = arguments.next().and_then(|n| n.parse().ok()).unwrap_or(Quality::SPP);
    let width: Option<u32> = arguments.next().and_then(|n| n.parse().ok());

    let field = SceneFile::open(&scene)?.width(width).field(0)?;
    let image = field.render(&Quality::spp(spp))?;
    for path in image.write("out/example")? {
        println!("{}", path.display());
    }
    Ok(())
}
