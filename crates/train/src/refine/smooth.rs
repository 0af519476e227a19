//! Refinement step `smooth`: the class of a plant pixel follows from the probabilities around it.
//!
//! The probabilities of each plant class are summed over the plant pixels around with Gaussian weights, and the largest sum decides. The
//! standard deviation is [`WIDTHS`] times the mean distance of plant pixels from soil, which is about a quarter of the width of a leaf.
//! All pixels of a leaf thus take one class, as with `plants`, but touching plants keep different classes, and only the network's own
//! neighbouring pixels overrule it.

use furrow_base::geometry::distances_inside;
use furrow_base::math::{RoundTo, ToFloat};

/// Standard deviation of the weights relative to the mean distance of plant pixels from soil.
const WIDTHS: f64 = 6.0;
/// Number of box filters whose succession is nearly Gaussian. Source: Wells 1986, "Efficient synthesis of Gaussian filters by cascaded
/// uniform filters".
const BOXES: usize = 3;

/// Returns the plant class with the largest sum around each pixel. `own` holds the class of each pixel, 0 for soil; `probabilities` one
/// plane for each class, soil first.
pub(super) fn classes((width, height): (usize, usize), own: &[u8], probabilities: &[f32]) -> Vec<usize> {
    let n = width * height;
    let sd = WIDTHS * mean_distance((width, height), own);
    let sums = |class: usize| {
        let plane = &probabilities[class * n..(class + 1) * n];
        let mut sums: Vec<f64> =
            own.iter().zip(plane).map(|(own, p)| if *own > 0 { f64::from(*p) } else { 0.0 }).collect();
        blur(&mut sums, (width, height), sd);
        sums
    };
    let mut best = vec![1; n];
    let mut most = vec![0.0; n];
    for class in 1..probabilities.len() / n.max(1) {
        for ((best, most), sum) in best.iter_mut().zip(&mut most).zip(sums(class)) {
            if sum > *most {
                (*best, *most) = (class, sum);
            }
        }
    }
    best
}

/// Returns the mean distance of plant pixels from soil and from the border of the image, pixels; 0 without plants.
fn mean_distance((width, height): (usize, usize), own: &[u8]) -> f64 {
    let plants = own.iter().filter(|class| **class > 0).count();
    let distances = distances_inside((width, height), |at| own[at] > 0);
    distances.iter().map(|d| f64::from(*d)).sum::<f64>() / plants.max(1).to_f64()
}

/// Blurs a plane with nearly Gaussian weights of standard deviation `sd`, pixels; beyond the border the values are 0.
fn blur(plane: &mut [f64], (width, height): (usize, usize), sd: f64) {
    // A box of 2r + 1 pixels has the variance ((2r + 1)² − 1) / 12.
    let reach = (0.5 * ((12.0 * sd * sd / BOXES.to_f64() + 1.0).sqrt() - 1.0)).round_to::<usize>();
    if reach == 0 {
        return;
    }
    let mut line = vec![0.0; width.max(height)];
    for _ in 0..BOXES {
        for y in 0..height {
            sum_around(plane, (y * width, 1), &mut line[..width], reach);
        }
        for x in 0..width {
            sum_around(plane, (x, width), &mut line[..height], reach);
        }
    }
}

/// Replaces the values at `first`, `first + stride`, … by the means over `reach` neighbours on both sides.
fn sum_around(plane: &mut [f64], (first, stride): (usize, usize), line: &mut [f64], reach: usize) {
    let n = line.len();
    for (k, value) in line.iter_mut().enumerate() {
        *value = plane[first + k * stride];
    }
    let mut sum: f64 = line.iter().take(reach).sum();
    for k in 0..n {
        sum += line.get(k + reach).copied().unwrap_or(0.0);
        plane[first + k * stride] = sum.max(0.0) / (2 * reach + 1).to_f64();
        sum -= if k >= reach { line[k - reach] } else { 0.0 };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::math::ToInt;

    /// Expected: on a leaf, a minority of wrong pixels takes the class of the rest; two leaves of different class that touch keep theirs
    /// but for a strip along their border, though one is larger; soil pixels do not count.
    #[test]
    fn a_leaf_takes_one_class_and_a_touching_one_keeps_its_own() {
        let size = (120, 40);
        // Two leaves side by side: columns 0 to 79 crop, 80 to 119 weed, rows 10 to 29; every fifth pixel is wrong.
        let leaf = |at: usize| (10..30).contains(&(at / 120)).then_some(if at % 120 < 80 { 1 } else { 2 });
        let n = 120 * 40;
        let mut probabilities = vec![0.0f32; 3 * n];
        let mut own = vec![0u8; n];
        for at in 0..n {
            let class = leaf(at).map_or(0, |class| if at % 5 == 0 { 3 - class } else { class });
            own[at] = class.to_u8();
            // Soil is nearly a weed: that must not matter.
            let rest = if class == 0 { [0.51, 0.0, 0.49] } else { [0.2, 0.1, 0.1] };
            for (k, p) in rest.into_iter().enumerate() {
                probabilities[k * n + at] = p;
            }
            if class > 0 {
                probabilities[class * n + at] = 0.7;
            }
        }
        let found = classes(size, &own, &probabilities);
        for at in (0..n).filter(|at| leaf(*at).is_some() && !(74..92).contains(&(at % 120))) {
            assert_eq!(Some(found[at]), leaf(at), "{} {}", at % 120, at / 120);
        }
        assert!((4.0..6.0).contains(&mean_distance(size, &own)), "{}", mean_distance(size, &own));
        assert_eq!((mean_distance(size, &vec![0; n]), classes((0, 0), &[], &[])), (0.0, Vec::new()));
    }

    /// Expected: the blur of a point has the sum 1 and the standard deviation asked for, in both directions; whole pixels of the boxes
    /// round it by up to half a pixel.
    #[test]
    fn the_weights_have_the_deviation_asked_for() {
        let (w, h) = (101, 81);
        let mut plane = vec![0.0; w * h];
        plane[40 * w + 50] = 1.0;
        blur(&mut plane, (w, h), 6.0);
        let moment = |of: &dyn Fn(usize) -> f64| plane.iter().enumerate().map(|(at, v)| v * of(at)).sum::<f64>();
        assert!((moment(&|_| 1.0) - 1.0).abs() < 1e-9);
        for variance in
            [moment(&|at| ((at % w).to_f64() - 50.0).powi(2)), moment(&|at| ((at / w).to_f64() - 40.0).powi(2))]
        {
            assert!((variance.sqrt() - 6.0).abs() < 0.55, "{variance}");
        }
    }
}
