//! What a material can do without: each feature can be left out alone, to see what it does to a picture.

/// Something that makes a surface more than a coloured sheet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feature {
    /// Light that passes through leaves; without it what would pass is absorbed.
    Transmission,
    /// The wax of leaves and the gloss of models; without it what the coat reflects at normal incidence is reflected diffusely.
    Coat,
    /// The facets of soil, stones and straw, and the film of water on soil; without them they are Lambert's.
    Facets,
    /// Normal maps: veins of leaves, what is finer than the ground's mesh, reliefs of models.
    Relief,
    /// The colours of a leaf's picture; without them the leaf has the one colour of its pigments. Its outline and relief stay.
    Picture,
}
