//! Triangles of planar polygons, convex or concave.
//!
//! A convex polygon is a fan around its first corner. Of a concave one, ears are cut off: corners whose triangle lies
//! inside and holds no other corner. Source: Meisters 1975, "Polygons have ears"; Eberly, "Triangulation by ear
//! clipping".

use furrow_base::math::DVec3;

/// Largest number of corners of a concave polygon.
const MOST_CORNERS: usize = 4096;
/// Largest inward turn of a convex corner through rounding, relative to the polygon's area.
const ROUNDING: f64 = 1e-7;

/// Result of a triangulation.
#[derive(Debug, PartialEq)]
pub(super) enum Cut {
    /// Triangles of corner indices.
    Whole(Vec<[usize; 3]>),
    /// The sides cross one another, so the triangles are a fan.
    Crossed(Vec<[usize; 3]>),
    /// The polygon is concave and has more than [`MOST_CORNERS`] corners.
    TooMany,
}

/// Cuts a polygon of at least three corners into triangles.
pub(super) fn triangles(corners: &[DVec3]) -> Cut {
    let fan = || (2..corners.len()).map(|i| [0, i - 1, i]).collect();
    let normal = normal(corners);
    let area = normal.length();
    if corners.len() == 3 {
        return Cut::Whole(fan());
    }
    // Twice the area of the fan's triangles, whichever way each turns.
    let covered: f64 = (2..corners.len()).map(|i| normal_of([corners[0], corners[i - 1], corners[i]]).length()).sum();
    // A polygon of width 0 has no inside; one whose sides cross may have lobes of equal area, which cancel.
    if area.partial_cmp(&(ROUNDING * covered)) != Some(std::cmp::Ordering::Greater) {
        return if covered > 0.0 { Cut::Crossed(fan()) } else { Cut::Whole(fan()) };
    }
    // Coordinates in the polygon's plane.
    let across = normal.any_orthogonal_vector().normalize();
    let up = normal.normalize().cross(across);
    let flat: Vec<[f64; 2]> = corners.iter().map(|p| *p - corners[0]).map(|p| [p.dot(across), p.dot(up)]).collect();
    let least = -ROUNDING * area;
    let n = flat.len();
    let convex = (0..n).all(|i| turn(flat[i], flat[(i + 1) % n], flat[(i + 2) % n]) >= least)
        && (2..n).all(|i| turn(flat[0], flat[i - 1], flat[i]) >= least);
    if convex {
        return Cut::Whole(fan());
    }
    if n > MOST_CORNERS {
        return Cut::TooMany;
    }
    if sides_cross(&flat, -least) {
        return Cut::Crossed(fan());
    }
    clip(&flat).map_or_else(|| Cut::Crossed(fan()), Cut::Whole)
}

/// Returns the normal of a triangle, whose length is twice the triangle's area.
fn normal_of([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}

/// Returns whether two sides of a polygon cross between their ends; `least` is the smallest area of a triangle, twice, that is no
/// rounding error.
fn sides_cross(flat: &[[f64; 2]], least: f64) -> bool {
    let n = flat.len();
    let side = |i: usize| [flat[i], flat[(i + 1) % n]];
    let apart = |[a, b]: [[f64; 2]; 2], [p, q]: [[f64; 2]; 2]| {
        let (one, other) = (turn(a, b, p), turn(a, b, q));
        one.min(other) < -least && one.max(other) > least
    };
    (0..n).any(|i| (i + 2..n).any(|j| apart(side(i), side(j)) && apart(side(j), side(i))))
}

/// Returns the normal of a polygon, whose length is twice the polygon's area (Newell's method).
pub(super) fn normal(corners: &[DVec3]) -> DVec3 {
    let first = corners[0];
    (2..corners.len()).map(|i| normal_of([first, corners[i - 1], corners[i]])).sum()
}

/// Returns twice the signed area of a triangle; positive if it turns left.
fn turn(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Cuts ears off a polygon that turns left on the whole; `None` if there is none left, because sides cross.
fn clip(flat: &[[f64; 2]]) -> Option<Vec<[usize; 3]>> {
    let mut left: Vec<usize> = (0..flat.len()).collect();
    let mut cut = Vec::with_capacity(flat.len() - 2);
    let mut at = 0;
    while left.len() > 3 {
        let n = left.len();
        // The search goes on after the last ear, which avoids slivers.
        let ear = (0..n).map(|k| (at + k) % n).find(|k| is_ear(flat, &left, *k))?;
        let [a, b, c] = around(&left, ear);
        // A corner in the middle of a side has no triangle of its own.
        if turn(flat[a], flat[b], flat[c]) > 0.0 {
            cut.push([a, b, c]);
        }
        left.remove(ear);
        at = ear % left.len();
    }
    let last = [left[0], left[1], left[2]];
    let area = turn(flat[last[0]], flat[last[1]], flat[last[2]]);
    if area > 0.0 {
        cut.push(last);
    }
    (area >= 0.0).then_some(cut)
}

fn around(left: &[usize], k: usize) -> [usize; 3] {
    let n = left.len();
    [left[(k + n - 1) % n], left[k], left[(k + 1) % n]]
}

/// Returns whether the corner `k` can be cut off.
fn is_ear(flat: &[[f64; 2]], left: &[usize], k: usize) -> bool {
    let [a, b, c] = around(left, k).map(|i| flat[i]);
    let area = turn(a, b, c);
    if area <= 0.0 {
        // A corner on the straight line between its neighbours, or on a spike of no width.
        return area == 0.0;
    }
    // Corners at the same place join an outline to its holes.
    let elsewhere = |p: &[f64; 2]| ![a, b, c].contains(p);
    let inside = |p: [f64; 2]| turn(a, b, p) >= 0.0 && turn(b, c, p) >= 0.0 && turn(c, a, p) >= 0.0;
    !left.iter().map(|i| flat[*i]).any(|p| elsewhere(&p) && inside(p))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the polygon in a tilted plane far from the origin.
    fn tilted(flat: &[(f64, f64)]) -> Vec<DVec3> {
        flat.iter().map(|(x, y)| DVec3::new(600_000.0 + x, 5_000_000.0 + 0.8 * y, 0.6 * y)).collect()
    }

    fn area(corners: &[DVec3], cut: &[[usize; 3]]) -> f64 {
        cut.iter().map(|t| 0.5 * normal(&t.map(|i| corners[i])).length()).sum()
    }

    const L: [(f64, f64); 6] = [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 3.0), (0.0, 3.0)];

    /// Expected: quadrilaterals whose sides cross are reported, also if their lobes have the same area, whichever corner comes
    /// first; one of width 0 is whole.
    #[test]
    fn sides_that_cross_are_reported() {
        let bow = [(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)];
        let uneven = [(0.0, 0.0), (3.0, 2.0), (3.0, 0.0), (0.0, 1.0)];
        for flat in [bow, uneven] {
            for first in 0..4 {
                let mut flat = flat;
                flat.rotate_left(first);
                let cut = triangles(&tilted(&flat));
                assert!(matches!(cut, Cut::Crossed(_)), "{flat:?}: {cut:?}");
            }
        }
        assert!(matches!(triangles(&tilted(&[(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (3.0, 0.0)])), Cut::Whole(_)));
    }

    /// Expected: the triangles have the area of the polygon, whichever corner comes first and whichever way it turns.
    #[test]
    fn concave_polygons_keep_their_area() {
        let comb: Vec<(f64, f64)> = (0..20).flat_map(|k| [(f64::from(k), 0.1), (f64::from(k) + 0.5, 3.0)]).collect();
        let comb = [&[(20.0, -1.0), (0.0, -1.0)][..], &comb].concat();
        // A square with a square hole, joined by a bridge.
        let holed = [
            (0.0, 0.0),
            (3.0, 0.0),
            (3.0, 3.0),
            (0.0, 3.0),
            (0.0, 0.0),
            (1.0, 1.0),
            (1.0, 2.0),
            (2.0, 2.0),
            (2.0, 1.0),
            (1.0, 1.0),
        ];
        let star: Vec<(f64, f64)> = (0..14)
            .map(|k| (f64::from(k) * std::f64::consts::TAU / 14.0, if k % 2 == 0 { 1.0 } else { 0.3 }))
            .map(|(angle, r)| (r * angle.cos(), r * angle.sin()))
            .collect();
        let star_area = 14.0 * 0.5 * 0.3 * (std::f64::consts::TAU / 14.0).sin();
        let comb_area = 0.5 * normal(&tilted(&comb)).length();
        for (flat, whole) in [(&L[..], 4.0), (&holed, 8.0), (&star, star_area), (&comb, comb_area)] {
            for first in 0..flat.len() {
                let mut flat = flat.to_vec();
                flat.rotate_left(first);
                for _ in 0..2 {
                    let corners = tilted(&flat);
                    let Cut::Whole(cut) = triangles(&corners) else { panic!("{flat:?}") };
                    assert!((area(&corners, &cut) - whole).abs() < 1e-6 * whole, "{first}: {cut:?}");
                    flat.reverse();
                }
            }
        }
    }

    #[test]
    fn convex_polygons_are_fans_and_crossed_ones_are_reported() {
        let square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
        assert_eq!(triangles(&tilted(&square)), Cut::Whole(vec![[0, 1, 2], [0, 2, 3]]));
        let line = [(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (3.0, 0.0)];
        assert!(matches!(triangles(&tilted(&line)), Cut::Whole(cut) if cut.len() == 2));
        // A pentagram turns left at each corner, but twice around.
        let star: Vec<(f64, f64)> =
            (0..5).map(|k| f64::from(2 * k) * std::f64::consts::TAU / 5.0).map(|a| (a.cos(), a.sin())).collect();
        assert!(matches!(triangles(&tilted(&star)), Cut::Crossed(_)));
        let many: Vec<(f64, f64)> = (0..2500).flat_map(|k| [(f64::from(k), 0.0), (f64::from(k) + 0.5, 1.0)]).collect();
        assert_eq!(triangles(&tilted(&[&many[..], &[(2500.0, 9.0), (0.0, 9.0)]].concat())), Cut::TooMany);
    }
}
