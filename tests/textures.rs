//! The textures that ship with the program.
//!
//! After a change of the drawing code: `cargo test --test textures -- --ignored redraw` draws them all again.

use furrow::texture::draw;
use std::path::{Path, PathBuf};

fn recipes() -> Vec<PathBuf> {
    let mut found: Vec<PathBuf> = ["textures/leaf", "textures/soil"]
        .iter()
        .flat_map(|folder| std::fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join(folder)).unwrap())
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|e| e == "ron"))
        .collect();
    found.sort();
    found
}

#[test]
#[ignore = "writes into the working tree; run it after changing the drawing code"]
fn redraw() {
    let only = std::env::var("ONLY").unwrap_or_default();
    for recipe in recipes() {
        if recipe.to_string_lossy().contains(&only) {
            let start = std::time::Instant::now();
            draw::write(&recipe).unwrap();
            eprintln!("{} {:?}", recipe.display(), start.elapsed());
        }
    }
}
