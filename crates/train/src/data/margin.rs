//! Dilation and erosion of label masks by some pixels.
//!
//! Rendered masks end at the edge of the leaf. Manual masks are dilated by about 1 px, because annotators draw outside of the leaf. A
//! network that is evaluated on manual masks should be trained on masks of the same kind: one pixel around a leaf of 40 pixels
//! diameter is a tenth of its area.

use furrow_base::math::{ToInt, disc};

/// Largest dilation or erosion of a mask, pixels.
pub const MOST: f32 = 16.0;

/// Parses a margin such as `+1.4` or `-2`.
pub fn parse(text: &str) -> Result<f32, String> {
    let margin = text.parse().ok().filter(|margin: &f32| margin.abs() <= MOST);
    margin.ok_or_else(|| {
        format!("masks cannot be dilated by `{text}` pixels: write +1.4px, or -2px to erode; at most {MOST}")
    })
}

/// Returns the labels (row by row) with the plant masks dilated by `margin` pixels, or eroded if it is negative, at most [`MOST`] in
/// either direction. Only outlines between the first class (soil) and all others (plants) move; outlines between plants and pixels
/// without a label stay.
///
/// A pixel changes if the moved outline passes its centre: it takes the class of the nearest pixel on the other side (of equally near
/// ones, the first by rows).
pub(super) fn moved(labels: &[u8], (w, h): (u32, u32), margin: f32) -> Vec<u8> {
    let reach = margin.abs().min(MOST) + 0.5;
    // Labels that are replaced, and labels that replace them.
    let gives = |label| if margin > 0.0 { is_soil(label) } else { is_plant(label) };
    let comes = |label| if margin > 0.0 { is_plant(label) } else { is_soil(label) };
    let disc = disc(reach);
    let (w, h) = (i64::from(w), i64::from(h));
    let at = |x: i64, y: i64| {
        if (0..w).contains(&x) && (0..h).contains(&y) { Some(labels[(y * w + x).to_usize()]) } else { None }
    };
    let pixel = |i: usize| {
        let (x, y) = (i.to_i64() % w, i.to_i64() / w);
        let nearest = || disc.iter().find_map(|(dx, dy)| at(x + dx, y + dy).filter(|label| comes(*label)));
        if gives(labels[i]) { nearest().unwrap_or(labels[i]) } else { labels[i] }
    };
    (0..labels.len()).map(pixel).collect()
}

fn is_soil(label: u8) -> bool {
    label == 0
}

fn is_plant(label: u8) -> bool {
    label != 0 && label != furrow_dataset::model::sample::IGNORE
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::math::ToFloat;
    use furrow_dataset::model::sample::IGNORE;

    /// Draws a disc of `class` with a radius of `radius` pixels around a point.
    fn plant(class: u8, radius: f32, (cx, cy): (f32, f32), labels: &mut [u8]) {
        for (i, label) in labels.iter_mut().enumerate() {
            let (x, y) = ((i % 80).to_f32() + 0.5, (i / 80).to_f32() + 0.5);
            if (x - cx).hypot(y - cy) < radius {
                *label = class;
            }
        }
    }

    /// Rationale: a network that is evaluated on dilated masks must be trained on such masks. Expected: a disc of radius 12 gets
    /// the radius 12 plus the margin, to within 0.4 pixels; no other class appears; a margin of 0 changes nothing. Source: areas of
    /// discs.
    #[test]
    fn a_disc_grows_and_shrinks_by_the_margin() {
        let mut labels = vec![0; 80 * 60];
        plant(2, 12.0, (40.3, 30.1), &mut labels);
        for margin in [-3.0f32, -1.4, -0.6, 0.6, 1.4, 2.5, 5.0] {
            let moved = moved(&labels, (80, 60), margin);
            let area: u32 = moved.iter().map(|l| u32::from(*l == 2)).sum();
            let radius = (area.to_f32() / std::f32::consts::PI).sqrt();
            assert!((radius - 12.0 - margin).abs() < 0.4, "{margin}: {radius}");
            assert!(moved.iter().all(|l| [0, 2].contains(l)));
        }
        assert_eq!(moved(&labels, (80, 60), 0.0), labels);
    }

    /// Expected: plants that touch keep the line between them; soil between two plants goes to the nearer one; pixels without a label
    /// stay so and do not spread; plants at the edge of the image are not eroded from there. Source: the rule.
    #[test]
    fn only_soil_and_plants_meet_at_outlines_that_move() {
        let row = |labels: &[u8], margin| moved(labels, (labels.len().to_u32(), 1), margin);
        assert_eq!(row(&[1, 1, 1, 2, 2, 0, 0, 0, 0], 1.0), [1, 1, 1, 2, 2, 2, 0, 0, 0]);
        assert_eq!(row(&[1, 1, 1, 2, 2, 0, 0, 0, 0], -1.0), [1, 1, 1, 2, 0, 0, 0, 0, 0]);
        assert_eq!(row(&[1, 0, 0, 0, 0, 2, IGNORE, 0], 3.0), [1, 1, 1, 2, 2, 2, IGNORE, 2]);
        assert_eq!(row(&[IGNORE, 1, 1, IGNORE, 0], -2.0), [IGNORE, 1, 0, IGNORE, 0]);
    }
}
