//! Pixels that hang together.

/// Regions of a picture. Pixels are neighbours along sides and corners (8-connected): thin leaves run askew.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Components {
    /// Number of each pixel's region, from 1 in the order of their first pixels; 0 of none.
    pub labels: Vec<u32>,
    /// Pixels of region k + 1.
    pub areas: Vec<u32>,
}

impl Components {
    /// Regions of neighbours with equal keys, of a picture row by row; pixels without a key belong to none.
    ///
    /// Source: Rosenfeld & Pfaltz 1966, two passes and a table of equal numbers; its union–find with path halving.
    pub fn of<K: Copy + PartialEq>(width: usize, height: usize, key: impl Fn(usize) -> Option<K>) -> Self {
        let mut labels = vec![0_u32; width * height];
        // Parent of each provisional number; a root is its own. The smaller root wins, so roots come in the order of first pixels.
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
                    label = parents.len() as u32;
                    parents.push(label);
                }
                labels[at] = label;
            }
        }
        let mut numbers = vec![0_u32; parents.len()];
        let mut areas: Vec<u32> = Vec::new();
        for label in labels.iter_mut().filter(|label| **label > 0) {
            let root = root(&mut parents, *label) as usize;
            if numbers[root] == 0 {
                areas.push(0);
                numbers[root] = areas.len() as u32;
            }
            *label = numbers[root];
            areas[*label as usize - 1] += 1;
        }
        Self { labels, areas }
    }
}

fn root(parents: &mut [u32], mut label: u32) -> u32 {
    while parents[label as usize] != label {
        let grandparent = parents[parents[label as usize] as usize];
        parents[label as usize] = grandparent;
        label = grandparent;
    }
    label
}

/// Makes two roots one and returns it.
fn join(parents: &mut [u32], a: u32, b: u32) -> u32 {
    let (low, high) = (a.min(b), a.max(b));
    parents[high as usize] = low;
    low
}
