//! Training of segmentation networks on datasets, rendered or real, and their evaluation.
//!
//! | module | idea |
//! |---|---|
//! | [`data`] | datasets to batches: crops, data augmentation, input normalization, oversampling |
//! | [`net`] | the networks |
//! | [`fit`] | hyper-parameters, class weights, loss, optimiser, checkpoints, the trainer, class-bias calibration |
//! | [`run`] | the folder of a training run |
//! | [`measure`] | ground truth and prediction to scores |
//! | [`figure`] | charts and pages |
//! | [`baseline`] | ExG threshold and component-size rules that a network must beat |
//! | [`deploy`] | a trained model as ONNX or TorchScript; predictions for photographs without labels |
//! | [`table`] | experiments: networks × training sets × seeds, evaluated on test sets |
//!
//! A dataset has a training set, a validation set (which decides when a training ends, and which weights are kept) and a test set.
//! Datasets are read only through files that a writer of datasets wrote, so rendered and imported ones are the same. What calls
//! libtorch needs the cargo feature `train`.

pub mod baseline;
pub mod classes;
pub mod data;
pub mod deploy;
pub mod figure;
pub mod fit;
pub mod measure;
pub mod memory;
pub mod net;
pub mod run;
#[cfg(feature = "train")]
pub mod session;
pub mod table;
#[cfg(feature = "train")]
pub mod torch;
pub mod weights;
