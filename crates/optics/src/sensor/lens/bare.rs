//! Serde functions for an optional field that is written without `Some`.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

pub(super) fn deserialize<'de, D: Deserializer<'de>, T: Deserialize<'de>>(d: D) -> Result<Option<T>, D::Error> {
    T::deserialize(d).map(Some)
}

#[expect(clippy::ref_option, reason = "serde calls it with a reference to the field")]
pub(super) fn serialize<S: Serializer, T: Serialize>(of: &Option<T>, s: S) -> Result<S::Ok, S::Error> {
    match of {
        Some(of) => of.serialize(s),
        None => s.serialize_unit(),
    }
}
