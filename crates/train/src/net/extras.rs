//! Optional parts of a network: the crop as an input, and the plant decoder.

use super::{Network, Parameter, film, parameters, plants};
use crate::weights::Array;

/// Optional parts of a network, with parameters of their own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Extras {
    /// Number of species that it takes as the crop; see [`film`].
    pub species: usize,
    /// Whether it has a plant decoder; see [`plants`].
    pub plants: bool,
}

impl Extras {
    /// Returns the optional parts that these arrays contain.
    pub fn of(arrays: &[Array]) -> Self {
        Self { species: film::species(arrays), plants: plants::has_plants(arrays) }
    }

    /// Returns all parameters of a network with these parts.
    pub fn parameters(self, network: Network, bands: usize, classes: usize) -> Vec<Parameter> {
        let mut all = parameters(network, bands, classes);
        all.extend(film::film(network, bands, classes, self.species));
        all.extend(self.plants.then(|| plants::plants(network, bands, classes)).into_iter().flatten());
        all
    }
}
