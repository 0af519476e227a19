//! From truth and prediction to numbers, in one pass over the images.
//!
//! A map holds one class a pixel, row by row from the top, as numbers from 0; 255 in the truth is no label, and such a pixel counts
//! nowhere. Every ratio is a share from 0 to 1 (tables show percent), and `None`, in JSON `null`, where it is of nothing.
//!
//! | file | idea |
//! |---|---|
//! | `confusion` | the confusion matrix: the sums that most scores follow from |
//! | `scores` | GA, CA, I/U, P, R, F1 |
//! | `boundary` | how well outlines agree |
//! | `components`, `size` | pixels that hang together; what is found of small and of large plants |
//! | `bootstrap` | confidence intervals of the scores over images |
//! | `report`, `evaluation` | scores and tables of an evaluation; all of it over a set of images |

pub mod bootstrap;
pub mod boundary;
pub mod components;
pub mod confusion;
pub mod evaluation;
pub mod report;
pub mod scores;
pub mod size;

pub use bootstrap::Interval;
pub use confusion::Confusion;
pub use evaluation::{Evaluation, Prediction};
pub use report::Report;
pub use scores::{ClassMeasures, Measures, Scores};
