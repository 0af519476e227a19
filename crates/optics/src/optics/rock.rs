//! Colours of the rocks of field stones.

use super::Munsell;
use furrow_base::math::Spectrum;
use serde::{Deserialize, Serialize};

/// Rock of a field stone.
///
/// Visible bands: the colour that geologists' charts give for the weathered rock, in Munsell notation (Goddard et al.
/// 1948, "Rock-Color Chart", Geological Society of America). Near infrared over red: estimates. Quartz and carbonates
/// absorb at neither; iron oxides redden sandstone, and absorb around 0.88 µm in brick (Clark 1999, "Spectroscopy of rocks
/// and minerals"; Kokaly et al. 2017, USGS Spectral Library 7, sample GDS350).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
pub enum Rock {
    /// Vein quartz and quartzite: very pale orange.
    Quartz,
    /// Flint: brownish grey.
    Flint,
    /// Limestone: yellowish grey, pale.
    Limestone,
    /// Sandstone: greyish orange.
    Sandstone,
    /// Granite and other grey rocks: medium light grey.
    Granite,
    /// Pieces of brick: reddish brown.
    Brick,
}

impl Rock {
    /// All rocks.
    pub const ALL: [Self; 6] =
        [Self::Quartz, Self::Flint, Self::Limestone, Self::Sandstone, Self::Granite, Self::Brick];

    /// Returns the Munsell notation and the ratio of near infrared to red.
    fn color(self) -> (&'static str, f32) {
        match self {
            Self::Quartz => ("10YR 8/2", 1.05),
            Self::Flint => ("5YR 4/1", 1.05),
            Self::Limestone => ("5Y 8/1", 1.05),
            Self::Sandstone => ("10YR 7/4", 1.15),
            Self::Granite => ("N 6", 1.05),
            Self::Brick => ("10R 4/6", 1.3),
        }
    }

    /// Returns the reflectance of the dry rock in R, G, B, NIR.
    pub fn reflectance(self) -> Spectrum {
        let (notation, ratio) = self.color();
        let [r, g, b, _] = Munsell::parse(notation).expect("a colour of the table").reflectance().to_array();
        Spectrum::new(r, g, b, r * ratio)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::soil::STONE;

    /// Expected: pale, grey and red rocks differ as their names say; the mix of the shipped scene files, with twice as
    /// much flint and granite, is the glacial gravel of [`STONE`] within a third.
    #[test]
    fn rocks_differ_and_are_field_stones_on_average() {
        let all = Rock::ALL.map(Rock::reflectance);
        let mix = all.iter().chain([&all[1], &all[4]]);
        let mean = mix.fold(Spectrum::ZERO, |sum, rock| sum + *rock * (1.0 / 8.0));
        assert!((0..4).all(|k| (0.75..1.35).contains(&(mean.0[k] / STONE.0[k]))), "{mean:?}");
        let [quartz, flint, _, sandstone, granite, brick] = all;
        assert!(quartz.luminance() > 3.0 * flint.luminance() && quartz.luminance() > 1.5 * granite.luminance());
        assert!((granite.0.x / granite.0.z - 1.0).abs() < 0.02, "{granite:?}");
        assert!(brick.0.x > 2.0 * brick.0.y && sandstone.0.x > 1.5 * sandstone.0.z, "{brick:?} {sandstone:?}");
        assert!(all.iter().all(|rock| rock.0.max_element() < 0.9));
    }
}
