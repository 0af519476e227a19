//! Labels of parts: class, plant and leaf.

/// Semantic classes, with their index in the label image.
#[derive(
    Clone,
    Copy,
    Debug,
    Default,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    serde::Serialize,
    serde::Deserialize,
    schemars::JsonSchema,
)]
#[repr(u8)]
pub enum Class {
    /// Ground, clods, stones, litter, and everything that is not a plant.
    #[default]
    Soil = 0,
    /// The crop.
    Crop = 1,
    /// Any other plant.
    Weed = 2,
}

impl Class {
    /// All classes in the order of their indices.
    pub const ALL: [Self; 3] = [Self::Soil, Self::Crop, Self::Weed];

    /// Lower-case name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Soil => "soil",
            Self::Crop => "crop",
            Self::Weed => "weed",
        }
    }

    /// Returns the class with this lower-case name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|c| c.name() == name)
    }

    /// sRGB colour in label images: Di Cicco et al. 2017 paint crop green, weed red and soil black.
    pub fn color(self) -> [u8; 3] {
        match self {
            Self::Soil => [0, 0, 0],
            Self::Crop => [0, 255, 0],
            Self::Weed => [255, 0, 0],
        }
    }
}

/// Classes in records, by their lower-case names (scene files write `Crop`). For `#[serde(with = "lowercase")]`.
pub mod lowercase {
    use super::Class;
    use serde::{Deserialize, Deserializer, Serializer, de};

    /// Writes the name.
    pub fn serialize<S: Serializer>(class: &Class, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(class.name())
    }

    /// Reads the name.
    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Class, D::Error> {
        let name = String::deserialize(deserializer)?;
        Class::named(&name).ok_or_else(|| de::Error::unknown_variant(&name, &["soil", "crop", "weed"]))
    }
}

/// Largest plant number: it fits three 8-bit image channels and is exact in single precision.
pub const MOST_PLANTS: u32 = (1 << 24) - 1;

/// Label of a part. Zero means none: soil has no plant, a stem has no leaf.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tag {
    /// Semantic class.
    pub class: Class,
    /// Number of the plant in the field, from 1.
    pub plant: u32,
    /// Number of the leaf in the plant, from 1.
    pub leaf: u16,
}
