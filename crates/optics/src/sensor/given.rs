//! Parsing of settings where a scene file overrides some values of a named preset.

use furrow_base::ron_file::{self, Fault};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer};

/// Value that a scene file may leave to the preset.
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
    /// Returns the value if given, otherwise the preset's.
    pub(in crate::sensor) fn over(self, preset: T) -> T {
        self.0.unwrap_or(preset)
    }
}

/// Parses a name with or without brackets, or brackets alone. Returns the preset of that name (empty if there is none)
/// and the values in the brackets. `one` and `several` are the singular and plural used in errors. `preset` also
/// accepts the struct's own name, in which case the text is parsed unchanged.
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
    // The name is replaced by spaces so that error positions stay correct.
    let fields = [" ".repeat(start + len).as_str(), &raw[start + len..]].concat();
    let written = if fields.trim().is_empty() { W::default() } else { ron_file::parse_in(&fields)? };
    Ok((preset, written))
}

/// Defines a struct and its counterpart as written in a scene file. Each field lists its type and the counterpart's
/// type, which is [`Given`] or the counterpart of another such struct.
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
        #[allow(clippy::struct_field_names, reason = "fields of a scene file carry their units")]
        pub(in crate::sensor) struct $written {
            $($field: $given,)*
        }

        impl $written {
            /// Returns the given values, completed from a preset.
            pub(in crate::sensor) fn over(self, preset: $name) -> $name {
                $name { $($field: self.$field.over(preset.$field),)* }
            }
        }
    };
}

pub(in crate::sensor) use layered;
