//! Makes a small dataset with labels in two formats of other tools, as `trace dataset` does. If it is stopped, the same command resumes.
//!
//! ```sh
//! cargo run --release --example dataset                                       # 10 images
//! cargo run --release --example dataset -- scenes/01-one-leaf.ron 2 1 48      # 2 images, 48 pixels wide, 1 sample per pixel
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
