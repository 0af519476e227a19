//! Ground that a field's images or scans see.

use super::drawn::Drawn;
use super::scanner;
use super::view::{self, View, VisibleGround};
use furrow_base::Result;

/// Returns the ground that all images or scans see together, and adds a warning if some of it is not planted. Returns [`View::NONE`] for
/// a scene of single plants and models.
pub(super) fn sight(drawn: &Drawn<'_>, warnings: &mut Vec<String>) -> Result<VisibleGround> {
    if !drawn.desc.has_ground() {
        return Ok(VisibleGround { view: View::NONE, each: Vec::new() });
    }
    if drawn.scanners.is_empty() { view::by_cameras(drawn, warnings) } else { scanner::scanned(drawn, warnings) }
}
