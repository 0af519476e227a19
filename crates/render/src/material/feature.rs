//! Material features that can be removed individually, to show their effect on an image.

/// A feature that distinguishes a surface from a coloured Lambertian sheet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feature {
    /// Transmission through leaves. Without it, transmitted light is absorbed.
    Transmission,
    /// Wax of leaves and gloss of models. Without it, the coat's reflectance at normal incidence is reflected
    /// diffusely.
    Coat,
    /// Microfacets of soil, stones and straw, and the water film on soil. Without them these surfaces are Lambertian.
    Facets,
    /// Normal maps: leaf veins, ground relief finer than its mesh, relief of models.
    Relief,
    /// Colours of a leaf image. Without them the leaf has the uniform colour of its pigments; outline and relief are
    /// kept.
    Texture,
}
