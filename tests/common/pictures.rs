//! What a failed test leaves behind to look at: `target/test-failures/<name>/`, the picture, the reference and where they differ.

use furrow::output::{Picture, write_png};
use std::path::{Path, PathBuf};

/// Where failures of this name are written.
pub fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("target/test-failures").join(name)
}

/// A colour for every number; 0 is black.
fn color(id: u32) -> [u8; 3] {
    if id == 0 {
        return [0; 3];
    }
    let hash = furrow::sampling::rng::mix(u64::from(id));
    [hash, hash >> 8, hash >> 16].map(|v| 64 + (v & 0xff) as u8 / 4 * 3)
}

/// Writes two maps of numbers and a map of where they differ (white), and says where.
pub fn keep(name: &str, width: u32, image: &[u32], reference: &[u32]) -> String {
    let folder = folder(name);
    let height = image.len() as u32 / width;
    let paint = |of: &[u32]| of.iter().map(|id| color(*id)).collect::<Vec<_>>();
    let difference: Vec<[u8; 3]> =
        image.iter().zip(reference).map(|(a, b)| if a == b { [0; 3] } else { [255; 3] }).collect();
    for (file, pixels) in [("image", paint(image)), ("reference", paint(reference)), ("difference", difference)] {
        write_png(&folder.join(format!("{file}.png")), width, height, &Picture::Rgb(&pixels), name).expect("a picture");
    }
    folder.display().to_string()
}

/// Panics where two maps of numbers differ, and leaves pictures of them.
pub fn same(name: &str, width: u32, image: &[u32], reference: &[u32]) {
    if image != reference {
        let differ: Vec<usize> = (0..image.len().min(reference.len())).filter(|i| image[*i] != reference[*i]).collect();
        let first = differ.first().map(|i| (*i as u32 % width, *i as u32 / width, image[*i], reference[*i]));
        let folder = keep(name, width, image, reference);
        panic!("{name}: {} pixels differ, first (x, y, is, should be) {first:?}; see {folder}", differ.len());
    }
}
