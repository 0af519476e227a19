//! Changes by refinement in the prediction of an image, so that users see which rule decided, and where none could.

use furrow_base::math::{ToFloat, ToInt};
use serde::{Deserialize, Serialize};

/// Changes that refinement made to the prediction of one image, for `prediction.json`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Evidence {
    /// Fraction of the pixels that the network alone predicts as plant.
    pub vegetation: f64,
    /// Fraction of the pixels that `colour` changed from soil to plant.
    pub to_plant: f64,
    /// Fraction of the pixels that `colour` changed from plant to soil.
    pub to_soil: f64,
    /// `true` if the colours of plants were learnt from this image, because they separate plants from soil here.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub learnt_colours: bool,
    /// Fraction of the remaining plant pixels whose class `plants`, `rows` and `appearance` changed.
    pub reclassified: f64,
    /// Score of the row pattern: standard deviations above random positions of the same plants. Rows are ignored below 1, and are as likely as
    /// not at 2. `None` without the step `rows`, and in images without plants.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub row_score: Option<f64>,
}

impl Evidence {
    /// Compares the classes of the pixels from the network, after `colour`, and after all steps; 0 is soil.
    pub(super) fn of(network: &[u8], coloured: &[u8], refined: &[u8]) -> Self {
        let fraction = |count: usize, all: usize| count.to_f64() / all.max(1).to_f64();
        let pairs = || network.iter().zip(coloured);
        let plants = coloured.iter().filter(|class| **class > 0).count();
        let changed = coloured.iter().zip(refined).filter(|(before, after)| before != after).count();
        Self {
            vegetation: fraction(network.iter().filter(|class| **class > 0).count(), network.len()),
            to_plant: fraction(pairs().filter(|(before, after)| **before == 0 && **after > 0).count(), network.len()),
            to_soil: fraction(pairs().filter(|(before, after)| **before > 0 && **after == 0).count(), network.len()),
            reclassified: fraction(changed, plants),
            ..Self::default()
        }
    }

    /// Describes the changes to a set of images in one line; `rows` and `appearance` are the steps that were asked for, `learnt` says whether an
    /// appearance model was found. Returns `None` for no images.
    pub fn summary(all: &[&Self], rows: bool, appearance: bool, learnt: bool) -> Option<String> {
        let n = (!all.is_empty()).then_some(all.len().to_f64())?;
        let percent = |value: &dyn Fn(&Self) -> f64| 100.0 * all.iter().map(|one| value(one)).sum::<f64>() / n;
        let count = |which: &dyn Fn(&Self) -> bool| all.iter().filter(|one| which(one)).count().to_u64();
        let mut parts = vec![format!(
            "refinement: plants {:.1} % of the pixels by the network, {:.1} % after colour",
            percent(&|one| one.vegetation),
            percent(&|one| one.vegetation + one.to_plant - one.to_soil),
        )];
        let pale = count(&|one| one.learnt_colours);
        if pale > 0 {
            parts.push(format!("colours of pale plants learnt in {pale} of {} images", all.len()));
        }
        if rows {
            let found = count(&|one| one.row_score.is_some_and(|score| score >= super::plants::LIKELY));
            parts.push(format!("rows found in {found} of {} images", all.len()));
        }
        parts.push(format!("class changed for {:.0} % of the plant pixels", percent(&|one| one.reclassified)));
        if appearance && !learnt {
            parts.push(
                "appearance skipped: there are fewer than two images with plants, or crop and weeds look alike in them"
                    .into(),
            );
        }
        Some(parts.join("; "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: of ten pixels, four plants by the network, one more and two fewer by colour, and one of the remaining three reclassified.
    #[test]
    fn changes_are_counted_by_step() {
        let network = [1, 1, 2, 2, 0, 0, 0, 0, 0, 0];
        let coloured = [1, 0, 2, 0, 1, 0, 0, 0, 0, 0];
        let refined = [1, 0, 1, 0, 1, 0, 0, 0, 0, 0];
        let found = Evidence::of(&network, &coloured, &refined);
        assert_eq!((found.vegetation, found.to_plant, found.to_soil), (0.4, 0.1, 0.2));
        assert!((found.reclassified - 1.0 / 3.0).abs() < 1e-12);
        assert_eq!(Evidence::of(&[], &[], &[]), Evidence::default());
    }

    /// Expected: counts and means over the images, and a note where appearance was asked for and not learnt.
    #[test]
    fn the_summary_says_what_was_found() {
        let pale = Evidence { vegetation: 0.1, to_plant: 0.1, learnt_colours: true, ..Evidence::default() };
        let rows = Evidence { vegetation: 0.3, reclassified: 0.5, row_score: Some(3.0), ..Evidence::default() };
        let words = Evidence::summary(&[&pale, &rows], true, true, false).unwrap();
        for part in [
            "20.0 %",
            "25.0 %",
            "learnt in 1 of 2 images",
            "rows found in 1 of 2 images",
            "for 25 %",
            "appearance skipped",
        ] {
            assert!(words.contains(part), "{part}: {words}");
        }
        let words = Evidence::summary(&[&rows], false, true, true).unwrap();
        assert!(!words.contains("learnt in") && !words.contains("rows") && !words.contains("skipped"), "{words}");
        assert!(Evidence::summary(&[], true, true, true).is_none());
    }
}
