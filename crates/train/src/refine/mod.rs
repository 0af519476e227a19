//! Refinement of a prediction from the image as a whole, after the network and without training it.
//!
//! Outside its training domain a network finds only parts of leaves, and predicts crop and weed within one plant. Within an image, the leaf
//! pixels that it did find show the current colour of leaves, and every plant is of one class.
//!
//! | step | rule |
//! |---|---|
//! | `colour` | pixels of similar colour tend to be of the same kind, plant or soil |
//! | `smooth` | the class of a plant pixel follows from the plant pixels around it |
//! | `plants` | connected plant pixels are of one class |
//! | `separate` | plants are those that the plant decoder separates, not connected regions |
//! | `rows` | crop rows and plant sizes also decide which plants are crop and which are weed |
//! | `appearance` | plants of one field with similar appearance features tend to be of one class |
//!
//! The constants were chosen on the even images of five sets of photographs. `docs/results/networks.md` reports results on the odd
//! images, and which of those had been looked at before.

mod appearance;
mod colour;
mod evidence;
mod plants;
mod rows;
mod self_training;
mod separate;
mod smooth;

use super::data::Band;
use furrow_base::math::ToInt;
use furrow_dataset::model::classes::Classes;
use serde::{Deserialize, Serialize};

pub use appearance::{Appearance, Examples, Features, Point};
pub use evidence::Evidence;
pub use separate::{Vectors, fill, instances};

/// Refinement steps to apply, in the order of the table above.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
#[expect(clippy::struct_excessive_bools, reason = "each is an independent step, not a state")]
pub struct Refine {
    /// Pixels of similar colour are moved towards the same kind, plant or soil.
    pub colour: bool,
    /// The class of a plant pixel follows from the plant pixels around it; excludes `plants`.
    pub smooth: bool,
    /// Connected plant pixels take one class.
    pub plants: bool,
    /// Plants are those that the plant decoder separates instead of connected regions; needs `plants`. No effect without a plant decoder.
    pub separate: bool,
    /// Rows and plant sizes decide together with the network which plants are crop and which are weed; needs `plants`.
    pub rows: bool,
    /// Appearance features decide as well. The appearance model is learnt from all images of a field, with labels by rows and plant sizes;
    /// needs `rows`.
    pub appearance: bool,
}

/// Input of the network for one image, and the further outputs that refinement uses.
pub struct Seen<'a> {
    /// Pixels, bands interleaved.
    pub pixels: &'a [f32],
    /// Width and height, pixels.
    pub size: (u32, u32),
    /// Bands of a pixel, in order.
    pub bands: &'a [Band],
    /// Probabilities at the largest input size, if the image was predicted at several: they decide the class of a plant.
    pub finest: Option<&'a [f32]>,
    /// Encoder features, if the step `appearance` is on.
    pub features: Option<&'a Features>,
    /// Output of the plant decoder, if the network has one.
    pub vectors: Option<&'a Vectors>,
    /// Points on plants of known class.
    pub points: &'a [Point],
}

impl Seen<'_> {
    fn extent(&self) -> (usize, usize) {
        (self.size.0.to_usize(), self.size.1.to_usize())
    }
}

impl Refine {
    /// Parses `none`, or a comma-separated list of `colour`, `smooth`, `plants`, `separate`, `rows` and `appearance`. `rows` and
    /// `separate` require `plants`; `appearance` requires `rows`; `smooth` excludes `plants`.
    pub fn parse(text: &str) -> Result<Self, String> {
        let help = "write none, or a comma-separated list of colour, smooth, plants, separate, rows and appearance";
        if text.trim() == "none" {
            return Ok(Self::default());
        }
        let mut refine = Self::default();
        for name in text.split(',').map(str::trim) {
            let step = match name {
                "colour" => &mut refine.colour,
                "smooth" => &mut refine.smooth,
                "plants" => &mut refine.plants,
                "separate" => &mut refine.separate,
                "rows" => &mut refine.rows,
                "appearance" => &mut refine.appearance,
                _ => return Err(format!("there is no refinement `{name}`: {help}")),
            };
            if std::mem::replace(step, true) {
                return Err(format!("`{text}` names a step twice: {help}"));
            }
        }
        if refine.rows && !refine.plants {
            return Err("rows needs plants: write plants,rows".into());
        }
        if refine.separate && !refine.plants {
            return Err("separate needs plants: write plants,separate".into());
        }
        if refine.appearance && !refine.rows {
            return Err("appearance needs rows: write plants,rows,appearance".into());
        }
        if refine.smooth && refine.plants {
            return Err("smooth and plants both decide the class of plants: leave one out".into());
        }
        Ok(refine)
    }

    /// Returns the steps in the syntax that [`Self::parse`] reads.
    pub fn name(self) -> String {
        let names = [
            (self.colour, "colour"),
            (self.smooth, "smooth"),
            (self.plants, "plants"),
            (self.separate, "separate"),
            (self.rows, "rows"),
            (self.appearance, "appearance"),
        ];
        let names: Vec<&str> = names.iter().filter(|(done, _)| *done).map(|(_, name)| *name).collect();
        if names.is_empty() { "none".into() } else { names.join(",") }
    }

    /// Returns `true` if no step is on.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Checks that the steps can be applied to a network with these classes and bands; the error says what is missing.
    pub fn check(self, classes: &Classes, bands: &[Band]) -> Result<(), String> {
        if !self.is_none() && !classes.begins_with_soil() {
            return Err("refinement separates plants from soil: the first class must be soil".into());
        }
        let known: Vec<&[String]> = classes.counted().iter().map(|class| class.labels.as_slice()).collect();
        if self.rows && !matches!(known.as_slice(), [_, [crop], [weed]] if crop == "crop" && weed == "weed") {
            return Err("refinement by rows needs the classes soil, crop and weed, in this order".into());
        }
        if self.colour && colour_bands(bands).is_none() {
            return Err("refinement by colour needs the bands red, green and blue".into());
        }
        Ok(())
    }

    /// Returns the steps that can be applied to crops of images: without `rows`, which needs whole images, and `appearance`, which
    /// needs rows.
    #[must_use]
    pub fn of_crops(self) -> Self {
        Self { rows: false, appearance: false, ..self }
    }

    /// Refines the probabilities of an image in place, classes × height × width. `appearance` is the result of
    /// [`Appearance::learn`] for its field; the step is skipped if it is `None`. Returns what changed.
    pub fn apply(self, seen: &Seen<'_>, probabilities: &mut [f32], appearance: Option<&Appearance>) -> Evidence {
        let n = seen.extent().0 * seen.extent().1;
        let network = plants::classes(n, probabilities);
        let learnt_colours = self.recolour(seen, probabilities);
        let coloured = plants::classes(n, probabilities);
        let row_score = self.vote(seen, probabilities, appearance);
        let found = Evidence::of(&network, &coloured, &plants::classes(n, probabilities));
        Evidence { learnt_colours, row_score, ..found }
    }

    /// Applies `smooth`, or `plants`, `rows` and `appearance`. Returns the row score.
    fn vote(self, seen: &Seen<'_>, probabilities: &mut [f32], appearance: Option<&Appearance>) -> Option<f64> {
        if self.smooth {
            let n = seen.extent().0 * seen.extent().1;
            let own = plants::classes(n, probabilities);
            let won = smooth::classes(seen.extent(), &own, seen.finest.unwrap_or(probabilities));
            plants::assign(n, probabilities, |at| (own[at] > 0).then(|| won[at]));
        }
        if !self.plants {
            return None;
        }
        let found =
            plants::PlantRegions::of(seen.extent(), probabilities, seen.finest, seen.vectors.filter(|_| self.separate));
        if !self.rows {
            let classes = found.voted();
            found.write(probabilities, |_, region| classes[region]);
            return None;
        }
        let (odds, row_score) = found.arranged();
        let Some((appearance, features)) = appearance.filter(|_| self.appearance).zip(seen.features) else {
            found.write(probabilities, |_, region| plants::crop_or_weed(odds[region]));
            return row_score;
        };
        let odds = appearance.log_odds(&found.regions, seen.extent(), &odds, features, seen.points);
        found.write(probabilities, |at, _| plants::crop_or_weed(odds[at]));
        row_score
    }

    /// Returns the plants of an image as examples for [`Appearance::learn`]; the probabilities are refined by `colour` in place.
    /// Returns `None` if `appearance` is off.
    pub fn examples(self, seen: &Seen<'_>, probabilities: &mut [f32]) -> Option<Examples> {
        let features = seen.features.filter(|_| self.appearance)?;
        self.recolour(seen, probabilities);
        let found =
            plants::PlantRegions::of(seen.extent(), probabilities, seen.finest, seen.vectors.filter(|_| self.separate));
        Some(Examples::of(&found.regions, seen.extent(), &found.arranged().0, features, seen.points))
    }

    /// Applies `colour`. Returns `true` if the colours of plants were learnt from the image.
    fn recolour(self, seen: &Seen<'_>, probabilities: &mut [f32]) -> bool {
        let rgb = colour_bands(seen.bands).filter(|_| self.colour);
        rgb.is_some_and(|rgb| colour::refine(seen.pixels, seen.bands.len(), rgb, probabilities))
    }
}

/// Returns the indices of red, green and blue among the bands; `None` if one is missing.
fn colour_bands(bands: &[Band]) -> Option<[usize; 3]> {
    let [red, green, blue] = Band::RGB.map(|color| bands.iter().position(|band| *band == color));
    Some([red?, green?, blue?])
}

impl TryFrom<String> for Refine {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        Self::parse(&text)
    }
}

impl From<Refine> for String {
    fn from(refine: Refine) -> Self {
        refine.name()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_again_and_other_words_are_not() {
        for text in [
            "none",
            "colour",
            "plants",
            "colour,plants",
            "plants,rows",
            "colour,plants,rows",
            "colour,plants,rows,appearance",
            "colour,smooth",
            "plants,separate",
            "colour,plants,separate,rows,appearance",
        ] {
            assert_eq!(Refine::parse(text).unwrap().name(), text);
        }
        assert_eq!(Refine::parse("rows, plants, colour").unwrap().name(), "colour,plants,rows");
        for bad in [
            "rows",
            "colour,rows",
            "colour,plants,appearance",
            "",
            "color",
            "colour;plants",
            "all",
            "colour,none",
            "colour,colour",
            "colour,plants,plants",
            "smooth,plants",
            "colour,separate",
        ] {
            assert!(Refine::parse(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn it_is_refused_without_soil_or_colours() {
        let both = Refine::parse("colour,plants").unwrap();
        let (soil, gray) = (Classes::default(), [Band::Red, Band::Gray("nir".into())]);
        assert!(both.check(&soil, &Band::RGB).is_ok());
        assert!(both.check(&soil, &gray).is_err());
        assert!(Refine { colour: false, ..both }.check(&soil, &gray).is_ok());
        assert!(both.check(&Classes::parse("crop; weed; soil").unwrap(), &Band::RGB).is_err());
        let rows = Refine { rows: true, ..both };
        assert!(rows.check(&soil, &Band::RGB).is_ok());
        assert!(rows.check(&Classes::parse("soil; beet=crop; weed; ignore=stone").unwrap(), &Band::RGB).is_ok());
        for other in ["soil; weed; crop", "soil; plant=crop,weed", "soil; BEAVX; crop; weed"] {
            assert!(rows.check(&Classes::parse(other).unwrap(), &Band::RGB).is_err(), "{other}");
        }
        assert!(Refine::default().check(&Classes::parse("crop; weed").unwrap(), &gray).is_ok());
    }
}
