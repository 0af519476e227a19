//! YOLO oriented boxes: one rectangle per plant, turned to be small, for Ultralytics.
//!
//! A row is a plant: its class (0 crop, 1 weed), then x and y of the four corners of a rectangle, in order around it, as
//! fractions of the image's width and height. The rectangle contains the plant's pixels entirely. It is the smallest one
//! that is within the image, because Ultralytics refuses images with corners outside; one parallel to the image always
//! is.
//!
//! Method: a smallest rectangle has a side along an edge of the convex hull, Freeman and Shapira 1975, "Determining the
//! minimum-area encasing rectangle for an arbitrary closed curve"; the hull is Andrew's monotone chain, 1979.
//! Source: Ultralytics documentation, "Oriented Bounding Box (OBB) Datasets Overview".

use super::{Format, SetWriter, boxes};
use crate::File;
use crate::format::labels::Labels;
use crate::model::recipe::Recipe;
use crate::model::record::Plant;
use crate::model::sample::Sample;
use crate::read::set::Set;
use furrow_base::Result;
use furrow_base::math::ToInt;

pub(super) struct Writer;

const FOLDER: &str = "yolo-obb";
/// Relative difference of areas that is rounding.
const SAME_AREA: f64 = 1e-9;

/// Distance of a corner from the image that is rounding, pixels.
const ROUNDING_PX: f64 = 1e-6;

/// Point where four pixels meet: column and row.
type Point = [i32; 2];

impl Format for Writer {
    fn image(&self, recipe: &Recipe, sample: &Sample) -> Result<Vec<File>> {
        let labels = Labels::of(recipe)?;
        let mut rows = Vec::new();
        for (plant, class) in labels.plants(&sample.record) {
            let Some(hull) = hull(sample, plant) else { continue };
            let mut row = boxes::number(&labels, class).to_string();
            boxes::shares(&mut row, sample, rectangle(&hull, sample.size()));
            rows.push(row);
        }
        boxes::files(FOLDER, sample, &rows)
    }

    fn warnings(&self, recipe: &Recipe) -> Vec<String> {
        boxes::warnings(recipe)
    }

    fn write_set(&self, set: &Set, out: &mut SetWriter<'_>) -> Result<()> {
        boxes::data(FOLDER, set, out, "")
    }
}

/// Returns the convex hull of a plant's pixels; `None` if it has none.
fn hull(sample: &Sample, plant: &Plant) -> Option<Vec<Point>> {
    let bounds = plant.seen.bounds?;
    let width = sample.record.width;
    let mut points = Vec::new();
    for y in bounds.rows() {
        let mut own = bounds.columns().filter(|x| sample.plants[(y * width + x).to_usize()] == plant.number);
        if let Some(first) = own.next() {
            let last = own.next_back().unwrap_or(first);
            let [left, right, top] = [first, last + 1, y].map(ToInt::to_i32);
            points.extend([[left, top], [left, top + 1], [right, top], [right, top + 1]]);
        }
    }
    Some(convex(points))
}

/// Returns the convex hull of points, without points along its edges.
fn convex(mut points: Vec<Point>) -> Vec<Point> {
    points.sort_unstable();
    points.dedup();
    let turn = |a: Point, b: Point, c: Point| {
        let [ab, ac] = [b, c].map(|to| [0, 1].map(|axis| i64::from(to[axis] - a[axis])));
        ab[0] * ac[1] - ab[1] * ac[0]
    };
    let half = |points: &mut dyn Iterator<Item = Point>| {
        let mut chain: Vec<Point> = Vec::new();
        for point in points {
            while let [.., a, b] = chain[..]
                && turn(a, b, point) <= 0
            {
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    let mut hull = half(&mut points.iter().copied());
    hull.extend(half(&mut points.iter().rev().copied()));
    hull
}

/// Returns the corners of the smallest rectangle around a hull that is within an image of this size, in order around it.
fn rectangle(hull: &[Point], (width, height): (u32, u32)) -> [(f64, f64); 4] {
    let edges = (0..hull.len()).map(|k| {
        let (from, to) = (hull[k], hull[(k + 1) % hull.len()]);
        let [x, y] = [0, 1].map(|axis| f64::from(to[axis] - from[axis]));
        let length = x.hypot(y);
        [x / length, y / length]
    });
    let (width, height) = (f64::from(width), f64::from(height));
    let clamped = |(x, y): (f64, f64)| (x.clamp(0.0, width), y.clamp(0.0, height));
    let inside = |(x, y): &(f64, f64)| {
        let within = clamped((*x, *y));
        (within.0 - x).hypot(within.1 - y) < ROUNDING_PX
    };
    let (mut least, mut corners) = around(hull, [1.0, 0.0]);
    for (area, turned) in edges.map(|along| around(hull, along)) {
        if area < least * (1.0 - SAME_AREA) && turned.iter().all(inside) {
            (least, corners) = (area, turned);
        }
    }
    corners.map(clamped)
}

/// Returns area and corners of the rectangle around a hull whose sides are along a unit vector.
fn around(hull: &[Point], [x, y]: [f64; 2]) -> (f64, [(f64, f64); 4]) {
    let extent = |[x, y]: [f64; 2]| {
        let along = hull.iter().map(|[px, py]| f64::from(*px) * x + f64::from(*py) * y);
        along.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], at| [low.min(at), high.max(at)])
    };
    let ([u0, u1], [v0, v1]) = (extent([x, y]), extent([-y, x]));
    let corner = |u: f64, v: f64| (u * x - v * y, u * y + v * x);
    ((u1 - u0) * (v1 - v0), [corner(u0, v0), corner(u1, v0), corner(u1, v1), corner(u0, v1)])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(found: [(f64, f64); 4], expected: [(f64, f64); 4]) -> bool {
        let is = |a: &(f64, f64)| expected.iter().any(|b| (a.0 - b.0).hypot(a.1 - b.1) < 1e-9);
        found.iter().all(is)
    }

    /// Expected: a diamond has itself, half the area of its upright box; an upright square keeps its corners exactly; in an
    /// image that a turned rectangle would leave, the box is upright. Source: drawn by hand.
    #[test]
    fn a_rectangle_is_small_and_within_the_image() {
        let diamond = convex(vec![[3, 0], [6, 3], [3, 6], [0, 3], [3, 3], [2, 2]]);
        assert_eq!(diamond.len(), 4);
        assert!(near(rectangle(&diamond, (6, 6)), [(3.0, 0.0), (6.0, 3.0), (3.0, 6.0), (0.0, 3.0)]));
        let square = convex(vec![[1, 2], [4, 2], [4, 5], [1, 5], [2, 2]]);
        assert_eq!(rectangle(&square, (9, 9)), [(1.0, 2.0), (4.0, 2.0), (4.0, 5.0), (1.0, 5.0)]);
        // A strip along the diagonal from the image's corner: its turned rectangle begins outside.
        let strip = convex(vec![[0, 0], [1, 0], [5, 4], [5, 5], [4, 5], [0, 1]]);
        let turned = rectangle(&strip.iter().map(|[x, y]| [x + 2, y + 2]).collect::<Vec<_>>(), (9, 9));
        assert!(turned.iter().any(|(x, _)| x.fract() != 0.0), "{turned:?}");
        assert_eq!(rectangle(&strip, (5, 5)), [(0.0, 0.0), (5.0, 0.0), (5.0, 5.0), (0.0, 5.0)]);
        let pixel = convex(vec![[7, 3], [8, 3], [7, 4], [8, 4]]);
        assert_eq!(rectangle(&pixel, (9, 9)), [(7.0, 3.0), (8.0, 3.0), (8.0, 4.0), (7.0, 4.0)]);
    }
}
