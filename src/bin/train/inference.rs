//! How a trained network is used on pictures: their sizes, and the refinement of what it says.

use furrow::train::ModelCard;
use furrow::train::data::Resize;
use furrow::train::refine::Refine;
use furrow::{Error, Result};

/// Sizes that pictures are brought to, and refinement.
#[derive(clap::Args)]
pub(crate) struct InferenceArgs {
    /// Sizes that pictures are brought to: stretch (to the size that the network was trained at), or lengths of the longer side with
    /// commas between: the shape is kept, probabilities are averaged over them. As the training said unless given.
    #[arg(long, value_name = "SIDES", value_parser = Resize::parse, conflicts_with = "pixel_mm")]
    resize: Option<Resize>,
    /// Side of the pictures' pixels on the ground, millimetres: they are brought to the pixels that the network was trained on.
    #[arg(long, value_name = "MM")]
    pixel_mm: Option<f64>,
    /// Refinement: colour (pixels of equal colour in a picture are rather of equal kind, plant or soil), plants (plant pixels that hang
    /// together are of one class), rows (crop rows and sizes of plants, too, say which are crop and which weed; only beside
    /// plants), appearance (and so do their looks, learnt from what rows say in all pictures that are given, which should be of one field;
    /// only beside rows), with commas between, or none. As the training said unless given.
    #[arg(long, value_name = "NAMES", value_parser = Refine::parse)]
    refine: Option<Refine>,
}

impl InferenceArgs {
    /// Side of the pictures' pixels on the ground, millimetres, where it is given.
    pub(crate) fn pixel_mm(&self) -> Option<f64> {
        self.pixel_mm
    }

    /// Puts what is given into a model card.
    pub(crate) fn apply(&self, card: &mut ModelCard) -> Result<()> {
        if let Some(resize) = &self.resize {
            card.resize = resize.clone();
        }
        if let Some(refine) = self.refine {
            card.refine = refine;
            refine.check(&card.classes, &card.input.bands).map_err(|what| {
                Error::misuse(format!("--refine {}: {what}", refine.name()))
                    .help("this network is used with --refine none")
            })?;
        }
        let Some(mm) = self.pixel_mm else { return Ok(()) };
        let trained = card.pixel_mm.ok_or_else(|| {
            Error::misuse("--pixel-mm: the network's training images do not tell the size of their pixels")
                .help("--resize 640 brings the pictures' longer side to 640 pixels")
        })?;
        card.resize = Resize::Scale(mm / trained);
        card.resize.check().map_err(|what| {
            Error::misuse(format!("--pixel-mm {mm}: {what}"))
                .help(format!("the network was trained on pixels of {trained:.2} mm"))
        })
    }
}
