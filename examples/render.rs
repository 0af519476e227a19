//! One field, rendered and labelled, as `trace --scene scenes/field.ron` does it.
//!
//! ```sh
//! cargo run --release --example render                                   # the main scene, 64 samples a pixel
//! cargo run --release --example render -- scenes/02-one-plant.ron 4 96   # another one, 4 samples a pixel, 96 pixels wide
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
