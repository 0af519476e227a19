//! Positions of models that a scene file sows in rows or by density, with the same functions as those of species.

use super::census::{Census, Population};
use super::detail::MeshDetail;
use super::drawn::Drawn;
use super::extent::PLANT_MARGIN;
use super::identity;
use super::seed_rows::MODELS;
use super::view::{self, VisibleGround};
use crate::desc::ModelDesc;
use furrow_base::math::ToInt;
use furrow_base::ron_file::{RonFile, Step};
use furrow_base::sampling::{Purpose, Stream};
use furrow_base::{Error, Result};
use furrow_grow::scatter::{self, Disc, Rows, Spot, WeedsRecord};

/// Returns the random stream of the position of model `k`, or of the positions of its copies.
pub(super) fn stream(drawn: &Drawn<'_>, k: usize) -> Stream {
    drawn.stream(Purpose::Scatter, MODELS + k.to_u64())
}

/// Returns the random stream of the copy of model `k` at a position.
pub(super) fn copy_stream(drawn: &Drawn<'_>, k: usize, spot: Spot) -> Stream {
    drawn.stream(Purpose::Plant, identity::MODELS + k.to_u64()).child(Purpose::Plant, spot.key)
}

/// Returns the positions of the copies of model `k` that may be in view, none of them in the discs `stones`; `None` for a single model.
pub(super) fn spots(drawn: &Drawn<'_>, k: usize, sight: &VisibleGround, stones: &[Disc]) -> Result<Option<Vec<Spot>>> {
    let desc = &drawn.desc.models[k];
    contradiction(drawn.page, k, desc)?;
    let (area, stream) = (sight.view.area.grown(PLANT_MARGIN).corners(), stream(drawn, k));
    let mut census = Census::new(drawn.page, drawn.detail != MeshDetail::Full, drawn.memory());
    let mut spots = match (&desc.rows, &desc.spread) {
        (Some(rows), _) => {
            census.open(Population::Model(k, "rows"), scatter::rows_looked_at(rows, area, &stream), 0)?;
            scatter::rows(rows, area, stones, &stream)
        }
        (None, Some(spread)) => {
            census.open(Population::Model(k, "spread"), scatter::weeds_looked_at(spread, area, &stream), 0)?;
            scatter::weeds(spread, area, stones, &stream)
        }
        (None, None) => return Ok(None),
    };
    spots.retain(|spot| view::may_be_seen(drawn, sight, spot.at));
    census.close(spots.len())?;
    Ok(Some(spots))
}

/// Returns an error if a model has several placements.
fn contradiction(page: &RonFile, k: usize, desc: &ModelDesc) -> Result<()> {
    let (field, words, help) = match (&desc.rows, &desc.spread) {
        (Some(_), Some(_)) => {
            ("spread", "a model has `rows` or `spread`, not both", "write two entries to sow it in rows and by density")
        }
        (None, None) => return Ok(()),
        _ if desc.at_origin() => return Ok(()),
        _ => (
            "position_m",
            "a model that is sown has no position of its own",
            "remove position_m; rows.offset_m moves the rows",
        ),
    };
    let at = [Step::Field("models"), Step::Item(k), Step::Field(field)];
    Err(page.blame(&at, Error::input(words).help(help)))
}

/// Returns the rows of model `k`, if it is sown in rows.
pub(super) fn rows(drawn: &Drawn<'_>, k: usize) -> Option<Rows> {
    drawn.desc.models[k].rows.as_ref().map(|rows| Rows::draw(rows, &stream(drawn, k)))
}

/// Returns the density of model `k`, if it is sown by density.
pub(super) fn spread(drawn: &Drawn<'_>, k: usize) -> Option<WeedsRecord> {
    drawn.desc.models[k].spread.as_ref().map(|spread| WeedsRecord::draw(spread, &stream(drawn, k)))
}
