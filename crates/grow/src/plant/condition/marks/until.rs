//! The marks that a leaf has received up to a given day.
//!
//! All marks that a leaf will ever have are drawn at once, on the leaf at its final size. Each mark has its own moment,
//! uniform over the period in which the leaf receives marks. The marks of a later day therefore include those of an
//! earlier day, in the same places.

use furrow_base::sampling::{Purpose, Stream};
use furrow_optics::texture::marks::Marks;

/// Index of the first of the leaf's streams for the moments, one stream for each kind of mark.
const MOMENTS: u64 = 40;

/// Keeps the marks that appear within the first `share` of the period, 0 to 1; `stream` is the leaf's.
pub(super) fn until(mut marks: Marks, share: f32, stream: &Stream) -> Marks {
    let whole = marks.holes.len() - marks.bites;
    let bites = marks.holes.split_off(whole);
    keep(&mut marks.holes, share, stream, 0);
    let mut kept = bites;
    keep(&mut kept, share, stream, 1);
    marks.bites = kept.len();
    marks.holes.append(&mut kept);
    keep(&mut marks.tears, share, stream, 2);
    keep(&mut marks.blotches, share, stream, 3);
    keep(&mut marks.spots, share, stream, 4);
    marks
}

fn keep<T>(marks: &mut Vec<T>, share: f32, stream: &Stream, kind: u64) {
    let mut moments = stream.child(Purpose::Condition, MOMENTS + kind);
    marks.retain(|_| moments.uniform32() < share);
}
