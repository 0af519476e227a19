//! What a scene file gives of a thing whose other values come from a preset.

use serde::{Deserialize, Deserializer};

/// A value that a scene file may leave to its preset.
#[derive(Clone, Debug)]
pub(in crate::sensor) struct Given<T>(Option<T>);

impl<T> Default for Given<T> {
    fn default() -> Self {
        Self(None)
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Given<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        T::deserialize(deserializer).map(|value| Self(Some(value)))
    }
}

impl<T> Given<T> {
    /// The value, or the preset's.
    pub(super) fn over(self, preset: T) -> T {
        self.0.unwrap_or(preset)
    }
}

/// A struct, and beside it what a scene file gives of it: each field with its type and how it is given, which is [`Given`] or the second
/// name of another such struct.
macro_rules! layered {
    (
        $(#[$meta:meta])*
        pub struct $name:ident, $written:ident = $word:literal {
            $($(#[$doc:meta])* pub $field:ident: $type:ty = $given:ty,)*
        }
    ) => {
        $(#[$meta])*
        pub struct $name {
            $($(#[$doc])* pub $field: $type,)*
        }

        #[derive(Clone, Debug, Default, serde::Deserialize)]
        #[serde(deny_unknown_fields, default, rename = $word)]
        #[allow(clippy::struct_field_names, reason = "a page's fields carry their units")]
        pub(in crate::sensor) struct $written {
            $($field: $given,)*
        }

        impl $written {
            /// What is given, and the rest from a preset.
            pub(in crate::sensor) fn over(self, preset: $name) -> $name {
                $name { $($field: self.$field.over(preset.$field),)* }
            }
        }
    };
}

pub(super) use layered;
