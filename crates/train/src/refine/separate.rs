//! Groups plant pixels to plants by the vectors of the plant decoder; see [`crate::net::plants`].
//!
//! Each plant pixel votes for the place that its vector points to. The places with most votes, relative to the squared radius that the
//! votes agree on, become plants one after the other: each takes all votes within 1.25 radii. Then each vote belongs to the plant that is
//! nearest relative to its radius, within twice that. Pixels whose votes are farther away are plants of their own, one for each connected
//! region.

use crate::measure::components::Components;
use furrow_base::math::{RoundTo, ToFloat, ToInt};
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Side of the cells that votes are counted in, pixels.
const CELL: f32 = 2.0;
/// Reach of the votes that are counted for a place, in radii.
const CORE: f32 = 0.5;
/// Reach of the votes that a plant takes, in radii.
const REACH: f32 = 1.25;
/// Reach within which votes belong to the nearest plant, in radii.
const FAR: f32 = 2.0;
/// Smallest number of votes of a plant, in squared radii. A disc has 2π, sparse leaves a tenth of that.
const LEAST: f32 = 0.6;

/// Output of the plant decoder for an image: three planes in pixels: vector to the right, vector downwards, radius of the plant.
#[derive(Clone, Debug, PartialEq)]
pub struct Vectors {
    /// Planes, one after the other.
    pub planes: Vec<f32>,
}

impl Vectors {
    /// Returns vector and radius of a pixel of `n`.
    fn of(&self, at: usize, n: usize) -> [f32; 3] {
        [0, 1, 2].map(|plane| self.planes[plane * n + at])
    }
}

/// Votes of plant pixels, sorted by cell.
struct Votes {
    columns: usize,
    rows: usize,
    /// First vote of each cell in `list`, and the end.
    starts: Vec<usize>,
    list: Vec<Vote>,
}

#[derive(Clone, Copy)]
struct Vote {
    /// Index of the pixel.
    at: usize,
    x: f32,
    y: f32,
    radius: f32,
    /// Plant that has taken it, 0 for none.
    plant: u32,
}

/// Mean of the votes within a reach of a place.
#[derive(Clone, Copy, Default)]
struct Mean {
    count: f32,
    x: f32,
    y: f32,
    radius: f32,
}

impl Votes {
    fn of((width, height): (usize, usize), own: &[u8], vectors: &Vectors) -> Self {
        let n = width * height;
        let (columns, rows) = (cell(width.to_f32()) + 1, cell(height.to_f32()) + 1);
        let vote = |at: usize| {
            let [dx, dy, radius] = vectors.of(at, n);
            let x = ((at % width).to_f32() + 0.5 + dx).clamp(0.0, width.to_f32());
            let y = ((at / width).to_f32() + 0.5 + dy).clamp(0.0, height.to_f32());
            Vote { at, x, y, radius: radius.max(1.0), plant: 0 }
        };
        let mut list: Vec<Vote> = (0..n).filter(|at| own[*at] > 0).map(vote).collect();
        let place = |vote: &Vote| cell(vote.y) * columns + cell(vote.x);
        list.sort_by_key(place);
        let mut starts = vec![0; columns * rows + 1];
        for vote in &list {
            starts[place(vote) + 1] += 1;
        }
        (1..starts.len()).for_each(|k| starts[k] += starts[k - 1]);
        Self { columns, rows, starts, list }
    }

    /// Calls `visit` with the index of each vote within `reach` pixels of a place.
    fn within(&self, (x, y): (f32, f32), reach: f32, mut visit: impl FnMut(usize)) {
        let (first, last) = (cell((y - reach).max(0.0)), cell(y + reach).min(self.rows - 1));
        let (left, right) = (cell((x - reach).max(0.0)), cell(x + reach).min(self.columns - 1));
        for row in first..=last {
            let row = row * self.columns;
            for k in self.starts[row + left]..self.starts[row + right + 1] {
                let vote = self.list[k];
                if (vote.x - x).powi(2) + (vote.y - y).powi(2) <= reach * reach {
                    visit(k);
                }
            }
        }
    }

    /// Returns the mean of the free votes within `reach` of a place.
    fn mean(&self, place: (f32, f32), reach: f32) -> Mean {
        let mut sum = Mean::default();
        self.within(place, reach, |k| {
            let vote = self.list[k];
            if vote.plant == 0 {
                sum.count += 1.0;
                sum.x += vote.x;
                sum.y += vote.y;
                sum.radius += vote.radius;
            }
        });
        let n = sum.count.max(1.0);
        Mean { count: sum.count, x: sum.x / n, y: sum.y / n, radius: sum.radius / n }
    }

    /// Returns the candidate of a cell: the mean of its free votes and those around; `None` without any.
    fn candidate(&self, cell: usize) -> Option<Candidate> {
        let free = self.list[self.starts[cell]..self.starts[cell + 1]].iter().filter(|vote| vote.plant == 0);
        let (count, sum) = free
            .fold((0.0f32, [0.0f32; 3]), |(n, [x, y, r]), vote| (n + 1.0, [x + vote.x, y + vote.y, r + vote.radius]));
        let [x, y, radius] = sum.map(|v| v / count.max(1.0));
        let found = (count > 0.0).then(|| self.mean((x, y), (CORE * radius).max(CELL)))?;
        Some(Candidate { support: found.count / found.radius.powi(2), cell, mean: found })
    }
}

/// Place that may be the centre of a plant.
#[derive(Clone, Copy)]
struct Candidate {
    /// Votes in squared radii.
    support: f32,
    cell: usize,
    mean: Mean,
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Candidate {}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        self.support.total_cmp(&other.support).then(other.cell.cmp(&self.cell))
    }
}

/// Returns the plants of an image of this width and height. `own` holds the class of each pixel, 0 for soil. Without vectors, plants are
/// the connected regions of plant pixels.
pub fn instances(size: (usize, usize), own: &[u8], vectors: Option<&Vectors>) -> Components {
    let (width, height) = size;
    let Some(vectors) = vectors else {
        return Components::of(width, height, |at| (own[at] > 0).then_some(()));
    };
    let mut votes = Votes::of(size, own, vectors);
    let mut plants: Vec<Mean> = Vec::new();
    let filled = (0..votes.starts.len() - 1).filter(|cell| votes.starts[*cell] < votes.starts[cell + 1]);
    let mut heap: BinaryHeap<Candidate> = filled.filter_map(|cell| votes.candidate(cell)).collect();
    while let Some(found) = heap.pop() {
        // Votes that were taken since are missing now.
        let Some(now) = votes.candidate(found.cell) else { continue };
        if now.support < found.support {
            heap.push(now);
            continue;
        }
        let mean = now.mean;
        let mut taken = Vec::new();
        votes.within((mean.x, mean.y), REACH * mean.radius, |k| taken.push(k));
        taken.retain(|k| votes.list[*k].plant == 0);
        if taken.len().to_f32() < LEAST * mean.radius.powi(2) {
            continue;
        }
        plants.push(mean);
        for k in taken {
            votes.list[k].plant = plants.len().to_u32();
        }
    }
    let mut labels = vec![0u32; own.len()];
    for vote in &votes.list {
        labels[vote.at] = nearest(vote, &plants);
    }
    // Pixels of no plant.
    let rest = Components::of(width, height, |at| (own[at] > 0 && labels[at] == 0).then_some(()));
    let first = plants.len().to_u32();
    labels.iter_mut().zip(&rest.labels).filter(|(_, rest)| **rest > 0).for_each(|(label, rest)| *label = first + rest);
    numbered(labels, plants.len() + rest.areas.len())
}

/// Returns the number of the plant that a vote belongs to, of those within [`FAR`]; 0 for none.
fn nearest(vote: &Vote, plants: &[Mean]) -> u32 {
    let distance = |plant: &Mean| (vote.x - plant.x).hypot(vote.y - plant.y) / plant.radius;
    let all = plants.iter().enumerate().map(|(k, plant)| (distance(plant), k.to_u32() + 1));
    all.filter(|(distance, _)| *distance <= FAR).min_by(|a, b| a.0.total_cmp(&b.0)).map_or(0, |(_, plant)| plant)
}

/// Makes a plant map, which was enlarged, agree with the classes of a prediction, 0 for soil: soil has no plant, and plant pixels without
/// one, at the outlines, take that of a neighbour. Regions that no neighbour reaches become plants of their own.
pub fn fill(plants: &mut [u32], classes: &[u8], (width, height): (u32, u32)) {
    let (width, height) = (width.to_usize(), height.to_usize());
    plants.iter_mut().zip(classes).filter(|(_, class)| **class == 0).for_each(|(plant, _)| *plant = 0);
    let mut front: Vec<usize> = (0..plants.len()).filter(|at| plants[*at] > 0).collect();
    while !front.is_empty() {
        let mut next = Vec::new();
        for at in front {
            let (x, y) = (at % width, at / width);
            let around = [
                (x > 0).then(|| at - 1),
                (x + 1 < width).then_some(at + 1),
                (y > 0).then(|| at - width),
                (y + 1 < height).then_some(at + width),
            ];
            for other in around.into_iter().flatten().filter(|other| classes[*other] > 0) {
                if plants[other] == 0 {
                    plants[other] = plants[at];
                    next.push(other);
                }
            }
        }
        front = next;
    }
    let most = plants.iter().copied().max().unwrap_or(0);
    let rest = Components::of(width, height, |at| (classes[at] > 0 && plants[at] == 0).then_some(()));
    plants.iter_mut().zip(&rest.labels).filter(|(_, rest)| **rest > 0).for_each(|(plant, rest)| *plant = most + rest);
}

/// Numbers the regions of a map in the order of their first pixels.
fn numbered(mut labels: Vec<u32>, most: usize) -> Components {
    let mut numbers = vec![0u32; most + 1];
    let mut areas: Vec<u32> = Vec::new();
    for label in labels.iter_mut().filter(|label| **label > 0) {
        let number = &mut numbers[label.to_usize()];
        if *number == 0 {
            areas.push(0);
            *number = areas.len().to_u32();
        }
        *label = *number;
        areas[label.to_usize() - 1] += 1;
    }
    Components { labels, areas }
}

fn cell(position: f32) -> usize {
    (position / CELL).trunc_to::<usize>()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Paints discs (x, y, radius) and returns the class of each pixel, its disc from 1, and the exact vectors; later discs cover others.
    fn discs(width: usize, height: usize, discs: &[(f32, f32, f32)]) -> (Vec<u8>, Vec<u32>, Vectors) {
        let n = width * height;
        let (mut own, mut truth, mut planes) = (vec![0u8; n], vec![0u32; n], vec![0.0f32; 3 * n]);
        for at in 0..n {
            let (x, y) = ((at % width).to_f32() + 0.5, (at / width).to_f32() + 0.5);
            for (k, (cx, cy, r)) in discs.iter().enumerate().filter(|(_, (cx, cy, r))| (x - cx).hypot(y - cy) < *r) {
                (own[at], truth[at]) = (1, k.to_u32() + 1);
                (planes[at], planes[n + at], planes[2 * n + at]) = (cx - x, cy - y, r / 2.0f32.sqrt());
            }
        }
        (own, truth, Vectors { planes })
    }

    /// Returns the fraction of plant pixels whose pairs agree: same plant in both, or different in both; and the number of plants.
    fn agreement(truth: &[u32], found: &Components) -> (f64, usize) {
        let pixels: Vec<usize> = (0..truth.len()).filter(|at| truth[*at] > 0).step_by(7).collect();
        let pairs = pixels.iter().flat_map(|a| pixels.iter().map(move |b| (*a, *b)));
        let same = pairs.filter(|(a, b)| (truth[*a] == truth[*b]) == (found.labels[*a] == found.labels[*b])).count();
        (same.to_f64() / (pixels.len() * pixels.len()).max(1).to_f64(), found.areas.len())
    }

    /// Expected: discs that touch are separated by their vectors, large and small ones, and those whose vectors are off by a fifth of
    /// their radius; without vectors they are one region. A disc in two pieces stays one. Source: the construction.
    #[test]
    fn touching_plants_are_separated_and_pieces_joined() {
        let all = [(40.0, 40.0, 30.0), (95.0, 42.0, 26.0), (66.0, 66.0, 8.0), (150.0, 60.0, 5.0)];
        let (mut own, truth, mut vectors) = discs(180, 110, &all);
        assert_eq!(instances((180, 110), &own, None).areas.len(), 2);
        let found = instances((180, 110), &own, Some(&vectors));
        assert_eq!(agreement(&truth, &found), (1.0, 4));
        let n = own.len();
        for at in 0..n {
            let off = vectors.planes[2 * n + at] * 0.2;
            let turn = (at * 7919 % 628).to_f32() / 100.0;
            vectors.planes[at] += off * turn.cos();
            vectors.planes[n + at] += off * turn.sin();
        }
        let (agreement_off, count) = agreement(&truth, &instances((180, 110), &own, Some(&vectors)));
        assert!(agreement_off > 0.99 && count == 4, "{agreement_off} {count}");
        // A bar of soil through the first disc.
        (0..110).for_each(|row| own[row * 180 + 35..row * 180 + 42].fill(0));
        assert_eq!(instances((180, 110), &own, None).areas.len(), 3);
        let found = instances((180, 110), &own, Some(&vectors));
        assert_eq!((found.labels[40 * 180 + 30], found.areas.len()), (found.labels[40 * 180 + 45], 4));
    }

    /// Expected: no plant without plant pixels; pixels whose vectors agree on nothing are plants by connected region.
    #[test]
    fn votes_without_agreement_are_regions() {
        let (own, _, vectors) = discs(64, 48, &[]);
        assert!(instances((64, 48), &own, Some(&vectors)).areas.is_empty());
        assert!(instances((0, 0), &[], Some(&Vectors { planes: Vec::new() })).areas.is_empty());
        let (own, _, mut vectors) = discs(64, 48, &[(10.0, 10.0, 4.0), (50.0, 30.0, 4.0)]);
        // Each pixel claims a plant of 40 pixels' radius far away.
        let n = own.len();
        for at in 0..n {
            vectors.planes[2 * n + at] = 40.0;
            (vectors.planes[at], vectors.planes[n + at]) =
                ((at * 31 % 64).to_f32() - 32.0, (at * 17 % 48).to_f32() - 24.0);
        }
        assert_eq!(instances((64, 48), &own, Some(&vectors)).areas.len(), 2);
    }
}
