//! Predictions that can hardly be right: a network that was trained for a named crop finds plants, but almost no crop.
//!
//! The photographs may show another crop, or the crop at an age or from a camera that the network does not know. A user who only sees a
//! table of one per cent of crop would take it for a result.

use crate::run::ModelCard;
use crate::zoo::ANY_FIELD;
use furrow_base::math::ToFloat;
use serde::{Deserialize, Serialize};

/// Smallest plausible fraction of crop among the vegetation pixels of a set of photographs. A crop that was sown and has emerged covers
/// more than a twentieth of what all plants cover, unless weeds have overgrown it. An estimate, not fitted to any set.
pub const LEAST_CROP: f64 = 0.05;
/// Smallest fraction of vegetation among all pixels for this check: with less, there may be no crop yet.
pub const LEAST_VEGETATION: f64 = 0.005;

/// An implausible result for a set of photographs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Implausible {
    /// Fraction of crop among the vegetation pixels.
    pub crop_of_vegetation: f64,
    /// Fraction of vegetation among all pixels.
    pub vegetation: f64,
    /// Subfolder with the predictions of the network of the same name, which knows no crop in particular.
    pub beside: String,
}

impl Implausible {
    /// Checks the numbers of pixels of each class in all photographs. Returns `None` for a plausible result, and for networks without a
    /// named crop or without the classes soil and crop.
    pub fn of(card: &ModelCard, pixels: &[u64]) -> Option<Self> {
        let classes = card.classes.counted();
        let crop = classes.iter().position(|class| class.labels == ["crop"])?;
        if card.crops.is_empty() || !card.classes.begins_with_soil() {
            return None;
        }
        let all: u64 = pixels.iter().sum();
        let plants: u64 = pixels.iter().skip(1).sum();
        let vegetation = plants.to_f64() / all.max(1).to_f64();
        let crop_of_vegetation = pixels.get(crop)?.to_f64() / plants.max(1).to_f64();
        let found = vegetation >= LEAST_VEGETATION && crop_of_vegetation < LEAST_CROP;
        found.then(|| Self { crop_of_vegetation, vegetation, beside: ANY_FIELD.into() })
    }

    /// Returns the warning for the user.
    pub fn warning(&self, card: &ModelCard) -> String {
        format!(
            "{} of the plants' pixels are {}, although plants cover {} of the images: this network probably does not fit these photographs (another crop, age or camera); the predictions of the network `{}`, which knows no crop in particular, are beside them in {}/",
            percent(self.crop_of_vegetation),
            card.crops.join(" or "),
            percent(self.vegetation),
            self.beside,
            self.beside,
        )
    }
}

fn percent(fraction: f64) -> String {
    format!("{:.1} %", 100.0 * fraction)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::TrainedModel;
    use std::path::Path;

    /// Expected: a network for maize that labels less than a twentieth of at least half a per cent of plants as crop is reported with
    /// both fractions; more crop, fewer plants, or a network without a named crop are not.
    #[test]
    fn almost_no_crop_is_implausible_only_for_a_network_that_names_it() {
        let any = TrainedModel::open(Path::new("any-field")).unwrap().card;
        let maize = ModelCard { crops: vec!["maize".into()], ..any.clone() };
        let found = Implausible::of(&maize, &[9000, 40, 960]).unwrap();
        assert_eq!((found.crop_of_vegetation, found.vegetation), (0.04, 0.1));
        let warning = found.warning(&maize);
        assert!(warning.contains("4.0 % of the plants' pixels are maize") && warning.contains("10.0 %"), "{warning}");
        for (card, pixels) in [(&maize, [9000, 50, 950]), (&maize, [9960, 0, 40]), (&any, [9000, 0, 1000])] {
            assert_eq!(Implausible::of(card, &pixels), None, "{pixels:?}");
        }
    }
}
