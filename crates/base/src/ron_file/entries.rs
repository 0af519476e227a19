//! Tables in RON files, whose keys must be unique.

use serde::de::{Error as _, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::collections::BTreeMap;
use std::fmt;
use std::marker::PhantomData;

/// Ending of the message about a duplicate key.
pub(super) const TWICE: &str = " is given twice";

/// Deserializes a table with string keys. A duplicate key is an error: otherwise one of its entries would be lost.
pub fn entries<'de, D: Deserializer<'de>, V: Deserialize<'de>>(
    deserializer: D,
) -> Result<BTreeMap<String, V>, D::Error> {
    struct Entries<V>(PhantomData<V>);

    impl<'de, V: Deserialize<'de>> Visitor<'de> for Entries<V> {
        type Value = BTreeMap<String, V>;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("a table such as {\"leaf\": …, \"stalk\": …}")
        }

        fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
            let mut all = BTreeMap::new();
            while let Some(name) = map.next_key::<String>()? {
                if all.contains_key(&name) {
                    return Err(A::Error::custom(format!("\"{name}\"{TWICE}")));
                }
                all.insert(name, map.next_value()?);
            }
            Ok(all)
        }
    }

    deserializer.deserialize_map(Entries(PhantomData))
}
