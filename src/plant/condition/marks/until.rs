//! What of its marks a leaf has met by a day.
//!
//! All that a leaf will ever meet is drawn at once, on the leaf as large as it will be; each mark comes at a moment of its own, uniform over
//! the time in which the leaf meets them. So the marks of a later day are those of an earlier one and more, each where it was.

use super::Marks;
use crate::sampling::{Purpose, Stream};

/// The first of the leaf's streams from which moments are drawn, one for each kind of mark.
const MOMENTS: u64 = 40;

impl Marks {
    /// Those of the marks that come within the first `share` of the time, 0 to 1; `stream` is the leaf's.
    pub(super) fn until(mut self, share: f32, stream: &Stream) -> Self {
        let whole = self.holes.len() - self.bites;
        let bites = self.holes.split_off(whole);
        keep(&mut self.holes, share, stream, 0);
        let mut kept = bites;
        keep(&mut kept, share, stream, 1);
        self.bites = kept.len();
        self.holes.append(&mut kept);
        keep(&mut self.tears, share, stream, 2);
        keep(&mut self.blotches, share, stream, 3);
        keep(&mut self.spots, share, stream, 4);
        self
    }
}

fn keep<T>(marks: &mut Vec<T>, share: f32, stream: &Stream, kind: u64) {
    let mut moments = stream.child(Purpose::Condition, MOMENTS + kind);
    marks.retain(|_| moments.uniform32() < share);
}
