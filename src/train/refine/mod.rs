//! Refinement of a prediction by what its picture says as a whole, after the network and without training.
//!
//! A network on photographs of another kind than it was trained on finds leaves in part, and in one plant says crop here and weed there.
//! Within one picture the leaves that it found tell what leaves look like today, and a plant is of one class.
//!
//! | step | rule |
//! |---|---|
//! | `colour` | pixels of equal colour are rather of equal kind, plant or soil |
//! | `plants` | plant pixels that hang together are of one class |
//! | `rows` | crop rows and sizes of plants, too, say which are crop and which weed |
//! | `appearance` | plants of one field that look alike are rather of one class |
//!
//! The rules' constants were chosen on the even images of five sets of photographs; `docs/results.md` reports the odd ones, and for which of
//! them these had been seen before.

mod appearance;
mod colour;
mod plants;
mod rows;

use super::data::Band;
use crate::dataset::classes::Classes;
use serde::{Deserialize, Serialize};

pub use appearance::{Appearance, Examples, Features};

/// Which steps are done, in the order of the table above.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
#[expect(clippy::struct_excessive_bools, reason = "each is a step of its own, none a state")]
pub struct Refine {
    /// Whether pixels of equal colour become rather of equal kind.
    pub colour: bool,
    /// Whether plant pixels that hang together become of one class.
    pub plants: bool,
    /// Whether rows and sizes decide with the network which of them are crop and which are weed.
    pub rows: bool,
    /// Whether what plants look like decides, too: learnt from all pictures of a field by what rows and sizes say of their plants.
    pub appearance: bool,
}

/// A picture as a network saw it.
pub struct Seen<'a> {
    /// Its bands side by side.
    pub pixels: &'a [f32],
    /// Width and height, pixels.
    pub size: (u32, u32),
    /// Which bands.
    pub bands: &'a [Band],
    /// Where it was seen at several sizes, the probabilities at the largest of them, which decide of which class a plant is.
    pub finest: Option<&'a [f32]>,
    /// What the encoder makes of it, where appearance is asked for.
    pub features: Option<&'a Features>,
}

impl Seen<'_> {
    fn extent(&self) -> (usize, usize) {
        (self.size.0 as usize, self.size.1 as usize)
    }
}

impl Refine {
    /// Reads `none`, or some of `colour`, `plants`, `rows` and `appearance` with commas between; `rows` beside `plants` alone, `appearance`
    /// beside `rows` alone.
    pub fn parse(text: &str) -> Result<Self, String> {
        let help = "write none, or some of colour, plants, rows and appearance with commas between";
        if text.trim() == "none" {
            return Ok(Self::default());
        }
        let mut refine = Self::default();
        for name in text.split(',').map(str::trim) {
            let step = match name {
                "colour" => &mut refine.colour,
                "plants" => &mut refine.plants,
                "rows" => &mut refine.rows,
                "appearance" => &mut refine.appearance,
                _ => return Err(format!("there is no refinement `{name}`: {help}")),
            };
            if std::mem::replace(step, true) {
                return Err(format!("`{text}` is no refinement: {help}"));
            }
        }
        if refine.rows && !refine.plants {
            return Err("rows decide of which class a plant is: write plants,rows".into());
        }
        if refine.appearance && !refine.rows {
            return Err("appearance is learnt from what rows say: write plants,rows,appearance".into());
        }
        Ok(refine)
    }

    /// As it is written.
    pub fn name(self) -> String {
        let names =
            [(self.colour, "colour"), (self.plants, "plants"), (self.rows, "rows"), (self.appearance, "appearance")];
        let names: Vec<&str> = names.iter().filter(|(done, _)| *done).map(|(_, name)| *name).collect();
        if names.is_empty() { "none".into() } else { names.join(",") }
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
        let known: Vec<&[String]> = classes.counted().iter().map(|class| class.labels.as_slice()).collect();
        if self.rows && !matches!(known.as_slice(), [_, [crop], [weed]] if crop == "crop" && weed == "weed") {
            return Err("refinement by rows needs the classes soil, crop and weed, in this order".into());
        }
        if self.colour && colour_bands(bands).is_none() {
            return Err("refinement by colour needs the bands red, green and blue".into());
        }
        Ok(())
    }

    /// The same without what is learnt from other pictures or seen in whole ones only: for crops of pictures.
    #[must_use]
    pub fn of_crops(self) -> Self {
        Self { rows: false, appearance: false, ..self }
    }

    /// Refines the probabilities of a picture, classes × height × width. `appearance` is what [`Appearance::learn`] made of the plants of its
    /// field; without it, that step is left out.
    pub fn apply(self, seen: &Seen<'_>, probabilities: &mut [f32], appearance: Option<&Appearance>) {
        self.recolour(seen, probabilities);
        if !self.plants {
            return;
        }
        let found = plants::Found::of(seen.extent(), probabilities, seen.finest);
        if !self.rows {
            let classes = found.voted();
            return found.write(probabilities, |_, region| classes[region]);
        }
        let odds = found.arranged();
        let Some((appearance, features)) = appearance.filter(|_| self.appearance).zip(seen.features) else {
            return found.write(probabilities, |_, region| plants::crop_or_weed(odds[region]));
        };
        let looks = appearance.log_odds(&found.regions, seen.extent(), features);
        found.write(probabilities, |at, region| plants::crop_or_weed(odds[region] + looks[at]));
    }

    /// The plants of a picture as examples to learn the appearance of its field from; the probabilities become those after `colour`. None where
    /// appearance is not asked for.
    pub fn examples(self, seen: &Seen<'_>, probabilities: &mut [f32]) -> Option<Examples> {
        let features = seen.features.filter(|_| self.appearance)?;
        self.recolour(seen, probabilities);
        let found = plants::Found::of(seen.extent(), probabilities, seen.finest);
        Some(Examples::of(&found.regions, seen.extent(), &found.arranged(), features))
    }

    fn recolour(self, seen: &Seen<'_>, probabilities: &mut [f32]) {
        if let (true, Some(rgb)) = (self.colour, colour_bands(seen.bands)) {
            colour::refine(seen.pixels, seen.bands.len(), rgb, probabilities);
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
