//! Season of a field: the index that selects an entry from every `Either` list of growths in the scene file.

use crate::desc::{FieldDesc, Growth};
use furrow_base::ron_file::RonFile;
use furrow_base::ron_file::Step;
use furrow_base::sampling::Stream;
use furrow_base::{Error, Result};
use serde::{Deserialize, Serialize};

/// Choice that a field has drawn for all `growth: Either([…, …])` lists of its scene file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Season {
    /// Index of the drawn entry, from 0; `None` if the scene file has no `Either`.
    pub drawn: Option<usize>,
    /// Length of the lists; 0 if there are none.
    pub of: usize,
}

impl Season {
    /// Draws the index. Returns an error that points into the scene file if a list is empty or nested, or if the lengths differ.
    pub(super) fn draw(page: &RonFile, desc: &FieldDesc, stream: &mut Stream) -> Result<Self> {
        let mut of = 0;
        for (list_of, k, growth) in growths(desc) {
            let Growth::Either(list) = growth else { continue };
            let at = [Step::Field(list_of), Step::Item(k), Step::Field("growth"), Step::Item(0)];
            let fault = |at: &[Step<'_>], words: &str, help: &str| Err(page.blame(at, Error::input(words).help(help)));
            if list.is_empty() {
                return fault(
                    &at,
                    "this list is empty: there is nothing to choose from",
                    "Either([AgeDays(12), AgeDays(40)])",
                );
            }
            if let Some(i) = list.iter().position(|g| matches!(g, Growth::Either(_))) {
                let at = [&at[..], &[Step::Item(i)]].concat();
                return fault(&at, "an Either inside an Either", "write all growths side by side in one list");
            }
            if of > 0 && list.len() != of {
                let words =
                    format!("this list has {} growths, an earlier list in this scene file has {of}", list.len());
                let help = "one index is drawn for all lists of a scene file, so all of them must have the same length; a growth may be \
                            listed twice";
                return fault(&at, &words, help);
            }
            of = list.len();
        }
        Ok(Self { drawn: (of > 0).then(|| stream.index(of)), of })
    }

    /// Returns the drawn index; 0 if there are no lists.
    pub(super) fn place(self) -> usize {
        self.drawn.unwrap_or(0)
    }
}

/// Returns every growth of a scene file, with the name of the list that holds it (`crops`, `weeds`, `plants`) and its index there.
pub(super) fn growths(desc: &FieldDesc) -> impl Iterator<Item = (&'static str, usize, &Growth)> {
    let crops = desc.crops.iter().enumerate().map(|(k, c)| ("crops", k, &c.growth));
    let weeds = desc.weeds.iter().enumerate().map(|(k, w)| ("weeds", k, &w.growth));
    let plants = desc.plants.iter().enumerate().map(|(k, p)| ("plants", k, &p.growth));
    crops.chain(weeds).chain(plants)
}
