//! Experiments: from one experiment file to the tables of a paper.
//!
//! An experiment file ([`ExperimentDesc`]) names networks, seeds, datasets, training sets and test sets. Every combination of network (or
//! baseline), training set and seed is a row. [`run`] makes the datasets, trains the rows and evaluates them on every test set; [`tables`]
//! builds the tables from the results so far.
//!
//! ```text
//! OUT/experiment.ron                           the experiment file
//! OUT/sets/NAME/                               rendered and imported images
//! OUT/runs/NETWORK/TRAIN/seed-1/               one training run, as written by `train fit`
//! OUT/runs/NETWORK/TRAIN/seed-1/eval/TEST.json its evaluation on a test set
//! OUT/runs/NETWORK/TRAIN/seed-1/eval/TEST.png  images, ground truth, prediction, errors
//! OUT/runs/NETWORK/TRAIN/seed-1/time/TEST.json duration of the evaluation
//! OUT/runs/BASELINE/TRAIN/                     a baseline, with the same eval/
//! OUT/table-1.md, .csv, .json                  GA, CA and mean I/U, as Table I of the paper
//! OUT/table-2.*                                P and R of vegetation, as its Table II
//! OUT/table-3.*                                I/U of each plant class and of vegetation, with its standard deviation over seeds
//! OUT/runs.*                                   every run on every test set
//! OUT/against.*                                change of I/U against the reference training set, if the file names one
//! OUT/distance/                                image distance of each training set from the reference, measured once
//! OUT/times.*                                  prediction and training times, as its Table III
//! OUT/results.html                             all tables but times on one page
//! ```
//!
//! Files that exist are not made again: an experiment that was stopped or killed resumes with the same command and ends with the
//! same files. Only `time/`, `times.*` and the speed in `result.json` and `report.html` differ. A stored evaluation is used only if
//! it is of the same weights and images; otherwise, or if it cannot be read, it is reported and made again. A training run that
//! cannot be read is an error, so that hours of work are not discarded silently. An experiment file may get longer; a training run
//! whose plan has changed is refused.
//!
//! | module | contents |
//! |---|---|
//! | `desc`, `experiment` | types of an experiment file; the validated experiment |
//! | `names` | folder names |
//! | `rows` | rows of an experiment, their order and folders |
//! | `sets` | datasets, rendered and imported |
//! | `pixels` | check that images record their ground sampling distance, if crops are scaled by it |
//! | `evaluation` | stored evaluation of a row on a test set |
//! | `work` | runs everything that is missing |
//! | `seen`, `print` | results of the rows so far; the tables |
//! | `against` | effect of each training set compared with a reference |

mod against;
mod desc;
mod evaluation;
mod experiment;
mod names;
mod pixels;
mod print;
mod rows;
mod seen;
mod sets;
mod work;

pub use desc::{ExperimentDesc, Named, PartDesc, ScaleDesc, SetDesc, TestDesc, TrainDesc};
pub use evaluation::StoredEvaluation;
pub use experiment::{Experiment, ImageSelection, Source, TestSet, TrainSet};
pub use names::slug;
pub use pixels::check_pixel_sizes;
pub use print::{RUNS, TIMES, Tables, listing, tables};
pub use rows::{Learner, Row, rows};
pub use sets::{BoundExperiment, RealSet};
pub use work::{Callbacks, PAGE, Predictor, State, TableOptions, WorkPart, check_weights, run};
