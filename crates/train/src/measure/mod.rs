//! Evaluation metrics: compares predictions with the ground truth, in one pass over the images.
//!
//! A map contains one class per pixel as a number from 0, row by row from the top. 255 in the truth means no label; such pixels are
//! not counted. Every ratio is from 0 to 1 (tables show percent), or `None` (in JSON `null`) if its denominator is 0.
//!
//! | file | idea |
//! |---|---|
//! | `confusion` | the confusion matrix, the basis of most scores |
//! | `scores` | GA, CA, I/U, P, R, F1 |
//! | `boundary` | boundary F-score |
//! | `components`, `size` | connected components; scores of plants by size |
//! | `instances` | panoptic quality of separated plants |
//! | `bootstrap` | confidence intervals of the scores over images |
//! | `report`, `evaluation` | results and tables of an evaluation; evaluation of a set of images |

pub mod bootstrap;
pub mod boundary;
pub mod components;
pub mod confusion;
pub mod evaluation;
pub mod instances;
pub mod report;
pub mod scores;
pub mod size;

pub use bootstrap::Interval;
pub use confusion::Confusion;
pub use evaluation::{Evaluation, Prediction};
pub use instances::Instances;
pub use report::Report;
pub use scores::{ClassMeasures, Measures, Scores};
