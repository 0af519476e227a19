//! Refinement of a prediction by what its picture says as a whole, after the network and without training.
//!
//! A network on photographs of another kind than it was trained on finds leaves in part, and in one plant says crop here and weed there.
//! Within one picture the leaves that it found tell what leaves look like today, and a plant is of one class.
//!
//! | step | rule |
//! |---|---|
//! | `colour` | pixels of equal colour are rather of equal kind, plant or soil |
//! | `plants` | plant pixels that hang together are of one class |
//!
//! The rules' constants were chosen on the even images of five sets of photographs; `docs/results.md` reports the odd ones.

mod colour;
mod plants;

use super::data::Band;
use crate::dataset::classes::Classes;
use serde::{Deserialize, Serialize};

/// Which steps are done, in the order of the table above.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Refine {
    /// Whether pixels of equal colour become rather of equal kind.
    pub colour: bool,
    /// Whether plant pixels that hang together become of one class.
    pub plants: bool,
}

impl Refine {
    /// Reads `none`, or `colour` and `plants` with commas between.
    pub fn parse(text: &str) -> Result<Self, String> {
        let names: Vec<&str> = text.split(',').map(str::trim).collect();
        let help = "write none, colour, plants or colour,plants";
        match names.as_slice() {
            ["none"] => Ok(Self::default()),
            ["colour"] => Ok(Self { colour: true, plants: false }),
            ["plants"] => Ok(Self { colour: false, plants: true }),
            ["colour", "plants"] | ["plants", "colour"] => Ok(Self { colour: true, plants: true }),
            [name] => Err(format!("there is no refinement `{name}`: {help}")),
            _ => Err(format!("`{text}` is no refinement: {help}")),
        }
    }

    /// As it is written.
    pub fn name(self) -> &'static str {
        match (self.colour, self.plants) {
            (false, false) => "none",
            (true, false) => "colour",
            (false, true) => "plants",
            (true, true) => "colour,plants",
        }
    }

    /// Whether nothing is done.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Whether predictions of these classes by a network that sees these bands can be refined.
    pub fn check(self, classes: &Classes, bands: &[Band]) -> Result<(), String> {
        if !self.is_none() && !classes.begins_with_soil() {
            return Err("refinement tells plants from soil, and the first class is not soil".into());
        }
        if self.colour && colour_bands(bands).is_none() {
            return Err("refinement by colour needs the bands red, green and blue".into());
        }
        Ok(())
    }

    /// Refines the probabilities of a picture, classes × height × width, whose `pixels` hold these bands side by side. Where it was seen at
    /// several sizes, `finest` are the probabilities at the largest of them, which decide of which class a plant is.
    pub fn apply(
        self,
        pixels: &[f32],
        (width, height): (u32, u32),
        bands: &[Band],
        probabilities: &mut [f32],
        finest: Option<&[f32]>,
    ) {
        if let (true, Some(rgb)) = (self.colour, colour_bands(bands)) {
            colour::refine(pixels, bands.len(), rgb, probabilities);
        }
        if self.plants {
            plants::refine((width as usize, height as usize), probabilities, finest);
        }
    }
}

/// Places of red, green and blue among the bands.
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
        refine.name().into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_again_and_other_words_are_not() {
        for text in ["none", "colour", "plants", "colour,plants"] {
            assert_eq!(Refine::parse(text).unwrap().name(), text);
        }
        assert_eq!(Refine::parse("plants, colour").unwrap().name(), "colour,plants");
        for bad in ["", "color", "colour;plants", "all", "colour,none", "colour,colour", "colour,plants,plants"] {
            assert!(Refine::parse(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn it_is_refused_without_soil_or_colours() {
        let both = Refine { colour: true, plants: true };
        let (soil, gray) = (Classes::default(), [Band::Red, Band::Gray("nir".into())]);
        assert!(both.check(&soil, &Band::RGB).is_ok());
        assert!(both.check(&soil, &gray).is_err());
        assert!(Refine { colour: false, plants: true }.check(&soil, &gray).is_ok());
        assert!(both.check(&Classes::parse("crop; weed; soil").unwrap(), &Band::RGB).is_err());
        assert!(Refine::default().check(&Classes::parse("crop; weed").unwrap(), &gray).is_ok());
    }
}
