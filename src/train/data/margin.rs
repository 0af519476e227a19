//! Label masks dilated (or eroded) by some pixels.
//!
//! Rendered masks end where the leaf ends. Manual masks are dilated by about 1 px: annotators draw outside of the leaf. A network that
//! is evaluated on manual masks must learn from masks of the same kind: of a leaf 40 pixels across, one pixel all around is a tenth.

use crate::math::disc;

/// Most that a mask is dilated or eroded, pixels.
pub const MOST: f32 = 16.0;

/// Reads `+1.4` or `-2`.
pub fn parse(text: &str) -> Result<f32, String> {
    let margin = text.parse().ok().filter(|margin: &f32| margin.abs() <= MOST);
    margin.ok_or_else(|| {
        format!("masks are not dilated by `{text}` pixels: write +1.4px, or -2px to erode them; {MOST} at most")
    })
}

/// Labels, row by row, whose outlines between the first class (soil) and all others (plants) are moved outwards by `margin` pixels,
/// inwards where it is negative, at most [`MOST`] either way. A pixel changes where the outline passes its centre: it then has the
/// class of the nearest pixel on the other side (of equally near ones, the first by rows). Outlines between plants stay, and labels
/// of no class.
pub(super) fn moved(labels: &[u8], (w, h): (u32, u32), margin: f32) -> Vec<u8> {
    let reach = margin.abs().min(MOST) + 0.5;
    // What gives way, and what comes in its place.
    let gives = |label| if margin > 0.0 { is_soil(label) } else { is_plant(label) };
    let comes = |label| if margin > 0.0 { is_plant(label) } else { is_soil(label) };
    let disc = disc(reach);
    let (w, h) = (i64::from(w), i64::from(h));
    let at = |x: i64, y: i64| {
        if (0..w).contains(&x) && (0..h).contains(&y) { Some(labels[(y * w + x) as usize]) } else { None }
    };
    let pixel = |i: usize| {
        let (x, y) = (i as i64 % w, i as i64 / w);
        let nearest = || disc.iter().find_map(|(dx, dy)| at(x + dx, y + dy).filter(|label| comes(*label)));
        if gives(labels[i]) { nearest().unwrap_or(labels[i]) } else { labels[i] }
    };
    (0..labels.len()).map(pixel).collect()
}

fn is_soil(label: u8) -> bool {
    label == 0
}

fn is_plant(label: u8) -> bool {
    label != 0 && label != crate::dataset::sample::IGNORE
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::sample::IGNORE;

    /// A disc of `class`, of `radius` pixels about a point.
    fn plant(class: u8, radius: f32, (cx, cy): (f32, f32), labels: &mut [u8]) {
        for (i, label) in labels.iter_mut().enumerate() {
            let (x, y) = ((i % 80) as f32 + 0.5, (i / 80) as f32 + 0.5);
            if (x - cx).hypot(y - cy) < radius {
                *label = class;
            }
        }
    }

    /// Rationale: a network that is evaluated on dilated masks must be trained on such masks. Expected: a disc of radius 12 gets
    /// the radius 12 plus the margin, as near as whole pixels come; nothing else changes class; and none moves nothing. Source:
    /// areas of discs.
    #[test]
    fn a_disc_grows_and_shrinks_by_the_margin() {
        let mut labels = vec![0; 80 * 60];
        plant(2, 12.0, (40.3, 30.1), &mut labels);
        for margin in [-3.0f32, -1.4, -0.6, 0.6, 1.4, 2.5, 5.0] {
            let moved = moved(&labels, (80, 60), margin);
            let area: u32 = moved.iter().map(|l| u32::from(*l == 2)).sum();
            let radius = (area as f32 / std::f32::consts::PI).sqrt();
            assert!((radius - 12.0 - margin).abs() < 0.4, "{margin}: {radius}");
            assert!(moved.iter().all(|l| [0, 2].contains(l)));
        }
        assert_eq!(moved(&labels, (80, 60), 0.0), labels);
    }

    /// Two plants that touch keep the line between them; soil between two goes to the nearer; what has no label keeps none and
    /// gives none; and plants that leave the image do not shrink from its edge.
    #[test]
    fn only_soil_and_plants_meet_at_outlines_that_move() {
        let row = |labels: &[u8], margin| moved(labels, (labels.len() as u32, 1), margin);
        assert_eq!(row(&[1, 1, 1, 2, 2, 0, 0, 0, 0], 1.0), [1, 1, 1, 2, 2, 2, 0, 0, 0]);
        assert_eq!(row(&[1, 1, 1, 2, 2, 0, 0, 0, 0], -1.0), [1, 1, 1, 2, 0, 0, 0, 0, 0]);
        assert_eq!(row(&[1, 0, 0, 0, 0, 2, IGNORE, 0], 3.0), [1, 1, 1, 2, 2, 2, IGNORE, 2]);
        assert_eq!(row(&[IGNORE, 1, 1, IGNORE, 0], -2.0), [IGNORE, 1, 0, IGNORE, 0]);
    }
}
