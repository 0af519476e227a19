//! Text in images, in the 8 × 8 bitmap font of the crate `font8x8`.

use font8x8::legacy::BASIC_LEGACY;

/// Height of a letter in dots.
pub const HEIGHT: usize = 8;
/// Distance between letters in dots.
pub const PITCH: usize = 8;

/// Draws text into an image of this width, with its top left corner at (x, y). A dot is `dot` × `dot` pixels. Text
/// outside the image is clipped; characters outside ASCII are blank.
pub fn draw(pixels: &mut [[u8; 3]], width: usize, words: &str, (x, y): (usize, usize), dot: usize, ink: [u8; 3]) {
    for (i, letter) in words.chars().enumerate() {
        let glyph = BASIC_LEGACY.get(letter as usize).copied().unwrap_or_default();
        for (row, bits) in glyph.into_iter().enumerate() {
            // Bit 0 is the leftmost dot.
            for across in (0..PITCH).filter(|across| bits >> across & 1 == 1) {
                let left = x + (i * PITCH + across) * dot;
                for down in (0..dot).map(|down| y + row * dot + down) {
                    if left + dot <= width
                        && let Some(line) = pixels.get_mut(down * width + left..down * width + left + dot)
                    {
                        line.fill(ink);
                    }
                }
            }
        }
    }
}
