//! Rows that shape the ground and guide vehicles.

use crate::desc::FieldDesc;
use furrow_base::math::ToInt;
use furrow_base::sampling::{Purpose, Stream};
use furrow_grow::scatter::Rows;
use std::ops::Range;

/// Random stream address of the positions of the first model, after those of crops, weeds and single plants.
pub(super) const MODELS: u64 = 3000;

/// Returns the rows that shape the ground and guide vehicles: those of the first crop in `sown`, or else of the first model in rows.
pub(super) fn first_rows(
    desc: &FieldDesc,
    sown: Range<usize>,
    stream: &dyn Fn(Purpose, u64) -> Stream,
) -> Option<Rows> {
    let crop = sown.into_iter().next().map(|k| (&desc.crops[k].rows, k.to_u64()));
    let model = || desc.models.iter().zip(MODELS..).find_map(|(model, address)| Some((model.rows.as_ref()?, address)));
    crop.or_else(model).map(|(rows, address)| Rows::draw(rows, &stream(Purpose::Scatter, address)))
}
