//! Images that a failed test leaves in `target/test-failures/<name>/`: the result, the reference and their difference.

use furrow_output::{ImageData, write_png};
use std::path::{Path, PathBuf};

/// Returns the folder for failures of this name.
pub fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("target/test-failures").join(name)
}

/// Returns a distinct colour for each id; 0 is black.
fn color(id: u32) -> [u8; 3] {
    if id == 0 {
        return [0; 3];
    }
    let hash = furrow_base::sampling::rng::mix(u64::from(id));
    [hash, hash >> 8, hash >> 16].map(|v| 64 + (v & 0xff) as u8 / 4 * 3)
}

/// Writes two id maps and a map of the differing pixels (white); returns their folder.
pub fn keep(name: &str, width: u32, image: &[u32], reference: &[u32]) -> String {
    let folder = folder(name);
    let height = image.len() as u32 / width;
    let paint = |of: &[u32]| of.iter().map(|id| color(*id)).collect::<Vec<_>>();
    let difference: Vec<[u8; 3]> =
        image.iter().zip(reference).map(|(a, b)| if a == b { [0; 3] } else { [255; 3] }).collect();
    for (file, pixels) in [("image", paint(image)), ("reference", paint(reference)), ("difference", difference)] {
        write_png(&folder.join(format!("{file}.png")), width, height, &ImageData::Rgb(&pixels), name)
            .expect("an image");
    }
    folder.display().to_string()
}

/// Panics if two id maps differ, after writing images of them.
pub fn same(name: &str, width: u32, image: &[u32], reference: &[u32]) {
    if image != reference {
        let differ: Vec<usize> = (0..image.len().min(reference.len())).filter(|i| image[*i] != reference[*i]).collect();
        let first = differ.first().map(|i| (*i as u32 % width, *i as u32 / width, image[*i], reference[*i]));
        let folder = keep(name, width, image, reference);
        panic!("{name}: {} pixels differ, first (x, y, is, should be) {first:?}; see {folder}", differ.len());
    }
}
