//! The season of a field: which of the growths that a scene file lists side by side all its plants have.

use crate::ron_file::RonFile;
use crate::ron_file::Step;
use crate::sampling::Stream;
use crate::scene::desc::{FieldDesc, Growth};
use crate::{Error, Result};
use serde::{Deserialize, Serialize};

/// What a field drew where its scene file lists growths: `growth: Either([…, …])`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Season {
    /// Place in the lists, from 0; none where the scene file has no such list.
    pub drawn: Option<usize>,
    /// How long the lists are.
    pub of: usize,
}

impl Season {
    /// Draws the place; refuses lists that do not fit together, where they stand in the scene file.
    pub(super) fn draw(page: &RonFile, desc: &FieldDesc, stream: &mut Stream) -> Result<Self> {
        let mut of = 0;
        for (list_of, k, growth) in growths(desc) {
            let Growth::Either(list) = growth else { continue };
            let at = [Step::Field(list_of), Step::Item(k), Step::Field("growth"), Step::Item(0)];
            let fault = |at: &[Step<'_>], words: &str, help: &str| Err(page.blame(at, Error::input(words).help(help)));
            if list.is_empty() {
                return fault(&at, "an empty list: there is nothing to draw", "Either([AgeDays(12), AgeDays(40)])");
            }
            if let Some(i) = list.iter().position(|g| matches!(g, Growth::Either(_))) {
                let at = [&at[..], &[Step::Item(i)]].concat();
                return fault(&at, "an Either inside an Either", "write all growths side by side in one list");
            }
            if of > 0 && list.len() != of {
                let words = format!("this list has {} growths, an earlier one of this scene file {of}", list.len());
                let help = "one place is drawn for all lists of a scene file, so give all of them the same length; a growth may be \
                            written twice";
                return fault(&at, &words, help);
            }
            of = list.len();
        }
        Ok(Self { drawn: (of > 0).then(|| stream.index(of)), of })
    }

    /// Place in the lists; 0 where there are none.
    pub(super) fn place(self) -> usize {
        self.drawn.unwrap_or(0)
    }
}

/// Every growth of a scene file, with the list that it stands in and its place there.
pub(super) fn growths(desc: &FieldDesc) -> impl Iterator<Item = (&'static str, usize, &Growth)> {
    let crops = desc.crops.iter().enumerate().map(|(k, c)| ("crops", k, &c.growth));
    let weeds = desc.weeds.iter().enumerate().map(|(k, w)| ("weeds", k, &w.growth));
    let plants = desc.plants.iter().enumerate().map(|(k, p)| ("plants", k, &p.growth));
    crops.chain(weeds).chain(plants)
}
