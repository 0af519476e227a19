//! Command-line options of inference: input sizes, and refinement of predictions.

use furrow_base::{Error, Result};
use furrow_train::ModelCard;
use furrow_train::data::Resize;
use furrow_train::refine::Refine;

/// Explains the steps of `--refine`, behind the options.
pub(crate) const AFTER: &str = "\
Steps of --refine:
  colour      pixels of similar colour tend to be of the same kind, plant or soil
  smooth      the class of a plant pixel follows from the plant pixels within about a leaf around it
  plants      connected plant pixels are of one class; instead of smooth
  separate    plants are those of the plant decoder, not connected pixels; needs plants
  rows        crop rows and plant sizes help to separate crop from weed; needs plants
  appearance  so do appearance features, learnt from all images given, which should be of one field; needs rows";

/// Input sizes and refinement.
#[derive(clap::Args)]
pub(crate) struct InferenceArgs {
    /// Sizes that images are resized to: stretch (the network's training size), or a comma-separated list of lengths of the longer side in
    /// pixels, which keep the aspect ratio; probabilities are averaged over the sizes. Default: as set in training.
    #[arg(long, value_name = "SIDES", value_parser = Resize::parse, conflicts_with = "pixel_mm")]
    resize: Option<Resize>,
    /// Ground sampling distance of the images in millimetres a pixel: they are resized to that of the network's training images.
    #[arg(long, value_name = "MM")]
    pixel_mm: Option<f64>,
    /// Refinement of predictions: none, or a comma-separated list of the steps below. Default: as set in training; colour,smooth for a
    /// network of `train make`, which knows the crop.
    #[arg(long, value_name = "NAMES", value_parser = Refine::parse)]
    refine: Option<Refine>,
}

impl InferenceArgs {
    /// Replaces the refinement of a model card by the one that learns from points on plants; fails if another was given.
    pub(crate) fn with_appearance(&self, card: &mut ModelCard) -> Result<()> {
        if let Some(refine) = self.refine {
            return Err(Error::misuse(format!(
                "--like needs the refinement appearance, not --refine {}",
                refine.name()
            ))
            .help("leave --refine out, or write --refine colour,plants,rows,appearance"));
        }
        card.refine = Refine { colour: true, smooth: false, plants: true, rows: true, appearance: true, ..card.refine };
        card.refine.check(&card.classes, &card.input.bands).map_err(|what| Error::misuse(format!("--like: {what}")))
    }

    /// Returns the ground sampling distance of the images in millimetres a pixel, if it was given.
    pub(crate) fn pixel_mm(&self) -> Option<f64> {
        self.pixel_mm
    }

    /// Applies the options to a model card.
    pub(crate) fn apply(&self, card: &mut ModelCard) -> Result<()> {
        if let Some(resize) = &self.resize {
            card.resize = resize.clone();
        }
        if let Some(refine) = self.refine {
            card.refine = refine;
            refine.check(&card.classes, &card.input.bands).map_err(|what| {
                Error::misuse(format!("--refine {}: {what}", refine.name())).help("use --refine none with this network")
            })?;
        }
        if card.refine.separate && !card.plants && self.refine.is_some() {
            return Err(Error::misuse("--refine separate: this network has no plant decoder")
                .help("leave separate out, or add a decoder: train plants RUN --set DIR --out NET"));
        }
        let Some(mm) = self.pixel_mm else { return Ok(()) };
        let trained = card.pixel_mm.ok_or_else(|| {
            Error::misuse("--pixel-mm: the network's training images do not record their ground sampling distance")
                .help("use --resize: with --resize 640 the longer side of images is 640 pixels")
        })?;
        card.resize = Resize::Scale(mm / trained);
        card.resize.check().map_err(|what| {
            Error::misuse(format!("--pixel-mm {mm}: {what}"))
                .help(format!("the network was trained on pixels of {trained:.2} mm"))
        })
    }
}
