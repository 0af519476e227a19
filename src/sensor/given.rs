//! What a scene file gives of a thing whose other values come from a preset.

use crate::ron_file::{self, Fault};
use serde::de::DeserializeOwned;
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
    pub(in crate::sensor) fn over(self, preset: T) -> T {
        self.0.unwrap_or(preset)
    }
}

/// Reads a name with or without brackets, or brackets alone: the preset of that name, empty where there is none, and what the brackets give.
/// `what` is such a thing and several of them in words; `preset` knows the struct's own name too, before which text is read as it is.
pub(in crate::sensor) fn over_a_name<W: DeserializeOwned + Default, T>(
    raw: &str,
    (one, several): (&str, &str),
    names: &[&str],
    preset: impl Fn(&str) -> Option<T>,
) -> Result<(T, W), Fault> {
    let start = raw.len() - raw.trim_start().len();
    let len = raw[start..].find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(raw.len() - start);
    let name = &raw[start..start + len];
    let Some(preset) = preset(name) else {
        let help = ron_file::choose(several, names, name);
        return Err(Fault { end: start + len, ..ron_file::whole(raw, format!("unknown {one} `{name}`"), help) });
    };
    if !names.contains(&name) {
        return Ok((preset, ron_file::parse_in(raw)?));
    }
    // Spaces for the name keep the places of what follows.
    let fields = [" ".repeat(start + len).as_str(), &raw[start + len..]].concat();
    let written = if fields.trim().is_empty() { W::default() } else { ron_file::parse_in(&fields)? };
    Ok((preset, written))
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

pub(in crate::sensor) use layered;
