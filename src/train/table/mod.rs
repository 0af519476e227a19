//! An experiment from one file to the paper's tables.
//!
//! An experiment file ([`ExperimentDesc`]) names networks, seeds, datasets, training sets and test sets. Every network (and every
//! baseline) with every training set and every seed is a row; [`run`] makes the datasets, trains the rows, evaluates them on
//! every test set, and [`tables`] prints what is there.
//!
//! ```text
//! OUT/experiment.ron                           the experiment file
//! OUT/sets/NAME/                               rendered and imported images
//! OUT/runs/NETWORK/TRAIN/seed-1/               one training, as `train fit` leaves it
//! OUT/runs/NETWORK/TRAIN/seed-1/eval/TEST.json its evaluation on a test set
//! OUT/runs/NETWORK/TRAIN/seed-1/eval/TEST.png  images, truth, prediction, errors
//! OUT/runs/NETWORK/TRAIN/seed-1/time/TEST.json how long that took
//! OUT/runs/BASELINE/TRAIN/                     a baseline, with the same eval/
//! OUT/table-1.md, .csv, .json                  GA, CA and mean I/U, as Table I of the paper
//! OUT/table-2.*                                P and R of vegetation, as its Table II
//! OUT/table-3.*                                I/U of each class that is a plant and of vegetation, with its spread over seeds
//! OUT/runs.*                                   every run by itself
//! OUT/against.*                                what each training set changes against one of them, where the file names one
//! OUT/distance/                                how far the images of each are from those, measured once
//! OUT/times.*                                  how long networks take, as its Table III
//! OUT/results.html                             all but times on one page
//! ```
//!
//! Whatever is there is not made again: an experiment that was stopped or killed goes on with the same command and ends with the same
//! files, `time/`, `times.*` and what a run tells of its speed (`result.json`, `report.html`) apart. An evaluation is used only if it is of these weights and these
//! images; one that is not, or that cannot be read, is reported and made again. A training that cannot be read is an error: hours are
//! not thrown away unasked. An experiment file may get longer; a training whose plan has changed is refused.
//!
//! | file | idea |
//! |---|---|
//! | `desc`, `experiment` | an experiment file; the same, checked |
//! | `renamed` | fields that had another name |
//! | `names` | names of folders |
//! | `rows` | what is to be done, in which order, in which folder |
//! | `sets` | images, rendered and imported |
//! | `pixels` | whether sets tell the pixels by which their crops are to be scaled |
//! | `evaluation` | a row's evaluation on a test set, stored |
//! | `work` | all of it, as far as it is missing |
//! | `seen`, `print` | rows as far as they are; tables |
//! | `against` | what changes do: every training set against one |
//! | `variants` | the file of an experiment on datasets that lie beside it |

mod against;
mod desc;
mod evaluation;
mod experiment;
mod names;
mod pixels;
mod print;
mod renamed;
mod rows;
mod seen;
mod sets;
mod variants;
mod work;

pub use desc::{ExperimentDesc, Named, PartDesc, ScaleDesc, SetDesc, TestDesc, TrainDesc};
#[doc(hidden)]
pub use evaluation::StoredEvaluation;
#[doc(hidden)]
pub use experiment::{Experiment, Part, Source, TestSet, TrainSet};
#[doc(hidden)]
pub use names::slug;
#[doc(hidden)]
pub use pixels::check_pixel_sizes;
#[doc(hidden)]
pub use print::{RUNS, TIMES, Tables, listing, tables};
#[doc(hidden)]
pub use renamed::RENAMED;
#[doc(hidden)]
pub use rows::{Learner, Row, rows};
#[doc(hidden)]
pub use sets::{Bound, Real};
#[doc(hidden)]
pub use variants::variants;
pub use work::{Callbacks, Only, Order, PAGE, Predictor, State, check_weights, run};
