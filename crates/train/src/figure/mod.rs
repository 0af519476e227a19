//! Figures and report pages of trained networks.
//!
//! | module | contents |
//! |---|---|
//! | `shot`, `sheet` | image, ground truth and predictions side by side: the paper's figure, as one PNG |
//! | `shots` | selection of the images to show |
//! | `page` | numbers, curves and images of a run or an evaluation on one HTML page |

mod layout;
mod page;
mod thumbnail;
mod thumbnails;

pub use layout::{Figure, compose};
pub use page::{Page, Plot};
pub use thumbnail::{Thumbnail, spread};
pub use thumbnails::Thumbnails;
