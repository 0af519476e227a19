//! Pictures of what was learned.
//!
//! | file | idea |
//! |---|---|
//! | `shot`, `sheet` | image, truth and predictions side by side: the paper's figure, as one PNG |
//! | `page` | numbers, curves and pictures of a run or an evaluation on one HTML page |

mod page;
mod sheet;
mod shot;
mod shots;

pub use page::{Page, Plot};
pub use sheet::{Sheet, sheet};
pub use shot::{Shot, spread};
pub use shots::Shots;
