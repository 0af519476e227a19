//! Connected components of an image.

use furrow_base::math::ToInt;

/// Connected regions of an image. Pixels are neighbours across sides and corners (8-connected), because thin leaves may be diagonal.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Components {
    /// Region of each pixel, numbered from 1 in the order of their first pixels; 0 for none.
    pub labels: Vec<u32>,
    /// Areas in pixels: `areas[k]` belongs to region k + 1.
    pub areas: Vec<u32>,
}

impl Components {
    /// Finds the regions of neighbouring pixels with equal keys; `key` returns the key of a pixel (row-major index), or `None` if it
    /// belongs to no region.
    ///
    /// Source: Rosenfeld & Pfaltz 1966, two passes with a table of equivalent labels, here a union–find with path halving.
    pub fn of<K: Copy + PartialEq>(width: usize, height: usize, key: impl Fn(usize) -> Option<K>) -> Self {
        let mut labels = vec![0_u32; width * height];
        // Parent of each provisional label; a root is its own parent. The smaller root wins, so roots are in the order of first pixels.
        let mut parents = vec![0_u32];
        let (mut above, mut here): (Vec<Option<K>>, Vec<Option<K>>) = (vec![None; width], vec![None; width]);
        for y in 0..height {
            std::mem::swap(&mut above, &mut here);
            for x in 0..width {
                let at = y * width + x;
                here[x] = key(at);
                if here[x].is_none() {
                    continue;
                }
                let mut label = 0;
                let mut meet = |same: bool, neighbour: usize| {
                    if same {
                        let other = root(&mut parents, labels[neighbour]);
                        label = if label == 0 { other } else { join(&mut parents, label, other) };
                    }
                };
                meet(x > 0 && here[x - 1] == here[x], at.wrapping_sub(1));
                if y > 0 {
                    meet(x > 0 && above[x - 1] == here[x], at.wrapping_sub(width + 1));
                    meet(above[x] == here[x], at - width);
                    meet(x + 1 < width && above[x + 1] == here[x], at + 1 - width);
                }
                if label == 0 {
                    label = parents.len().to_u32();
                    parents.push(label);
                }
                labels[at] = label;
            }
        }
        let mut numbers = vec![0_u32; parents.len()];
        let mut areas: Vec<u32> = Vec::new();
        for label in labels.iter_mut().filter(|label| **label > 0) {
            let root = root(&mut parents, *label).to_usize();
            if numbers[root] == 0 {
                areas.push(0);
                numbers[root] = areas.len().to_u32();
            }
            *label = numbers[root];
            areas[label.to_usize() - 1] += 1;
        }
        Self { labels, areas }
    }
}

fn root(parents: &mut [u32], mut label: u32) -> u32 {
    while parents[label.to_usize()] != label {
        let grandparent = parents[parents[label.to_usize()].to_usize()];
        parents[label.to_usize()] = grandparent;
        label = grandparent;
    }
    label
}

/// Joins two roots and returns the common root.
fn join(parents: &mut [u32], a: u32, b: u32) -> u32 {
    let (low, high) = (a.min(b), a.max(b));
    parents[high.to_usize()] = low;
    low
}
