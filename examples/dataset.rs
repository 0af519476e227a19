//! A small dataset with labels for other tools, as `trace dataset` makes it. Stopped, the same command goes on.
//!
//! ```sh
//! cargo run --release --example dataset                                       # 10 images
//! cargo run --release --example dataset -- scenes/01-one-leaf.ron 2 1 48      # 2 images of 48 pixels, 1 sample a pixel
//! ```

#![expect(clippy::print_stdout, reason = "the paths are the result")]

use furrow::prelude::*;

fn main() -> furrow::Result<()> {
    let mut arguments = std::env::args().skip(1);
    let scene = arguments.next().unwrap_or_else(|| "scenes/synthetic-d.ron".into());
    let count = arguments.next().and_then(|n| n.parse().ok()).unwrap_or(10);
    let spp = arguments.next().and_then(|n| n.parse().ok()).unwrap_or(16);
    let width = arguments.next().and_then(|n| n.parse().ok()).unwrap_or(480);

    let order = Order {
        width: Some(width),
        formats: vec!["coco".into(), "phenobench".into()],
        options: RenderOptions::path_traced(Quality::spp(spp)),
        ..Order::new(scene, count)
    };
    for path in furrow::dataset::make("out/example-dataset", &order)? {
        println!("{}", path.display());
    }
    Ok(())
}
