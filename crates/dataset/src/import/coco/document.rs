//! The parts of a COCO file that are read, in the spellings of different labelling tools.
//!
//! Ids may be numbers or texts. Whole numbers may be written as floats. A polygon may stand without the brackets of the
//! list of polygons. Everything else that does not match is an error, which names the entry and its key.

use super::spot;
use crate::model::rle::Rle;
use furrow_base::math::{RoundTo, ToFloat};
use furrow_base::{Error, Result, input};
use serde::de::{Error as _, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use serde_json::Value;
use std::fmt;
use std::path::Path;

#[derive(Deserialize)]
pub(super) struct Document {
    pub(super) images: Vec<Image>,
    pub(super) annotations: Vec<Annotation>,
    pub(super) categories: Vec<Category>,
}

#[derive(Deserialize)]
pub(super) struct Image {
    pub(super) id: Id,
    pub(super) file_name: String,
    /// `None` or 0 if the tool does not know it.
    #[serde(default)]
    pub(super) width: Option<Whole>,
    #[serde(default)]
    pub(super) height: Option<Whole>,
}

impl Image {
    /// Returns width and height, if both are given. A picture can be smaller than them.
    pub(super) fn size(&self) -> Option<(u64, u64)> {
        let side = |side: Option<Whole>| side.map(|side| side.0).filter(|side| *side > 0);
        Some((side(self.width)?, side(self.height)?))
    }
}

#[derive(Deserialize)]
pub(super) struct Annotation {
    #[serde(default)]
    pub(super) id: Option<Id>,
    pub(super) image_id: Id,
    pub(super) category_id: Id,
    #[serde(default)]
    pub(super) segmentation: Option<Segmentation>,
    #[serde(default)]
    pub(super) iscrowd: Option<Flag>,
    #[serde(default)]
    pub(super) keypoints: Option<Vec<f32>>,
    #[serde(default)]
    pub(super) attributes: Value,
}

#[derive(Deserialize)]
pub(super) struct Category {
    pub(super) id: Id,
    pub(super) name: String,
    #[serde(default)]
    pub(super) keypoints: Option<Vec<String>>,
}

/// Help of the errors about an entry.
pub(super) const HELP: &str = "correct it in the program that wrote the file, or remove the entry";

/// Returns the document in these bytes of the file `path`.
pub(super) fn parse(path: &Path, bytes: &[u8]) -> Result<Document> {
    let text = input::utf8(bytes).map_err(|wrong| wrong.in_file(path))?;
    serde_json::from_str(text).map_err(|e| {
        // The position is known to the spot.
        let mut what = e.to_string();
        what.truncate(what.rfind(" at line ").unwrap_or(what.len()));
        for (rust, words) in [("expected f64", "expected a number"), ("expected f32", "expected a number")] {
            what = what.replace(rust, words);
        }
        // The error about a missing key is at the bracket that closes the entry.
        let lacks = what.starts_with("missing field");
        match spot::of(text, e.line(), e.column().saturating_sub(usize::from(lacks))) {
            Some(spot) => Error::input(format!("{}: {what}", spot.within(!lacks))).help(HELP),
            None => Error::input(format!("this is not a COCO file of instances: {e}")),
        }
        .in_file(path)
    })
}

/// Identifier of an entry: a number or a text.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Id(pub(super) String);

impl<'de> Deserialize<'de> for Id {
    fn deserialize<D: Deserializer<'de>>(from: D) -> std::result::Result<Self, D::Error> {
        struct Text;
        impl Visitor<'_> for Text {
            type Value = Id;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a whole number or a text")
            }

            fn visit_u64<E>(self, n: u64) -> std::result::Result<Id, E> {
                Ok(Id(n.to_string()))
            }

            fn visit_i64<E>(self, n: i64) -> std::result::Result<Id, E> {
                Ok(Id(n.to_string()))
            }

            fn visit_f64<E: serde::de::Error>(self, n: f64) -> std::result::Result<Id, E> {
                whole(n).map(|n| Id(n.to_string()))
            }

            fn visit_str<E>(self, text: &str) -> std::result::Result<Id, E> {
                Ok(Id(text.to_owned()))
            }
        }
        from.deserialize_any(Text)
    }
}

/// A whole number that is not negative, possibly written as a float.
#[derive(Clone, Copy, Debug)]
pub(super) struct Whole(pub(super) u64);

impl<'de> Deserialize<'de> for Whole {
    fn deserialize<D: Deserializer<'de>>(from: D) -> std::result::Result<Self, D::Error> {
        struct Number;
        impl Visitor<'_> for Number {
            type Value = Whole;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a whole number from 0")
            }

            fn visit_u64<E>(self, n: u64) -> std::result::Result<Whole, E> {
                Ok(Whole(n))
            }

            fn visit_f64<E: serde::de::Error>(self, n: f64) -> std::result::Result<Whole, E> {
                let n = whole(n)?;
                u64::try_from(n).map(Whole).map_err(|_| E::custom(format!("{n} is negative")))
            }
        }
        from.deserialize_any(Number)
    }
}

/// Returns the whole number that a float holds exactly.
fn whole<E: serde::de::Error>(n: f64) -> std::result::Result<i64, E> {
    let exact = (1_u64 << f64::MANTISSA_DIGITS).to_f64();
    if n.fract() == 0.0 && n.abs() <= exact {
        Ok(n.trunc_to::<i64>())
    } else {
        Err(E::custom(format!("{n:?} is no whole number")))
    }
}

/// A truth value, written as one or as a number.
#[derive(Clone, Copy, Debug)]
pub(super) struct Flag(pub(super) bool);

impl<'de> Deserialize<'de> for Flag {
    fn deserialize<D: Deserializer<'de>>(from: D) -> std::result::Result<Self, D::Error> {
        struct Truth;
        impl Visitor<'_> for Truth {
            type Value = Flag;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("0 or 1")
            }

            fn visit_bool<E>(self, is: bool) -> std::result::Result<Flag, E> {
                Ok(Flag(is))
            }

            fn visit_u64<E: serde::de::Error>(self, n: u64) -> std::result::Result<Flag, E> {
                self.visit_f64(n.to_f64())
            }

            fn visit_f64<E: serde::de::Error>(self, n: f64) -> std::result::Result<Flag, E> {
                if n == 0.0 || n == 1.0 {
                    Ok(Flag(n == 1.0))
                } else {
                    Err(E::custom(format!("{n:?} is neither 0 nor 1")))
                }
            }
        }
        from.deserialize_any(Truth)
    }
}

/// A mask in one of COCO's encodings.
#[derive(Debug)]
pub(super) enum Segmentation {
    Runs(Rle),
    Polygons(Vec<Vec<f64>>),
}

impl<'de> Deserialize<'de> for Segmentation {
    fn deserialize<D: Deserializer<'de>>(from: D) -> std::result::Result<Self, D::Error> {
        struct Mask;
        impl<'de> Visitor<'de> for Mask {
            type Value = Segmentation;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a list of polygons, or run lengths with `size` and `counts`")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut all: A) -> std::result::Result<Segmentation, A::Error> {
                let (mut polygons, mut single) = (Vec::new(), Vec::new());
                while let Some(element) = all.next_element()? {
                    match element {
                        Element::Polygon(polygon) => polygons.push(polygon),
                        Element::Number(number) => single.push(number),
                    }
                }
                match (polygons.is_empty(), single.is_empty()) {
                    (false, false) => Err(A::Error::custom("numbers and polygons are mixed")),
                    (true, false) => Ok(Segmentation::Polygons(vec![single])),
                    _ => Ok(Segmentation::Polygons(polygons)),
                }
            }

            fn visit_map<A: MapAccess<'de>>(self, mut all: A) -> std::result::Result<Segmentation, A::Error> {
                let (mut size, mut counts) = (None, None);
                while let Some(key) = all.next_key::<String>()? {
                    match key.as_str() {
                        "size" => size = Some(all.next_value::<[Whole; 2]>()?),
                        "counts" => counts = Some(all.next_value::<Counts>()?),
                        _ => drop(all.next_value::<IgnoredAny>()?),
                    }
                }
                let size = size.ok_or_else(|| A::Error::custom("the run lengths lack `size`"))?;
                let side = |n: Whole| u32::try_from(n.0).map_err(|_| A::Error::custom(format!("{} is too large", n.0)));
                let size = [side(size[0])?, side(size[1])?];
                Ok(Segmentation::Runs(match counts {
                    None => return Err(A::Error::custom("the run lengths lack `counts`")),
                    Some(Counts::Packed(counts)) => Rle { size, counts },
                    Some(Counts::Runs(runs)) => Rle::of_runs(size, &runs),
                }))
            }
        }
        from.deserialize_any(Mask)
    }
}

/// An element of a list of polygons, or of a polygon that is not in a list.
enum Element {
    Polygon(Vec<f64>),
    Number(f64),
}

impl<'de> Deserialize<'de> for Element {
    fn deserialize<D: Deserializer<'de>>(from: D) -> std::result::Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = Element;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a polygon: numbers x, y, x, y, …")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut all: A) -> std::result::Result<Element, A::Error> {
                let mut polygon = Vec::new();
                while let Some(number) = all.next_element()? {
                    polygon.push(number);
                }
                Ok(Element::Polygon(polygon))
            }

            fn visit_u64<E>(self, n: u64) -> std::result::Result<Element, E> {
                Ok(Element::Number(n.to_f64()))
            }

            fn visit_i64<E>(self, n: i64) -> std::result::Result<Element, E> {
                Ok(Element::Number(n.to_f64()))
            }

            fn visit_f64<E>(self, n: f64) -> std::result::Result<Element, E> {
                Ok(Element::Number(n))
            }
        }
        from.deserialize_any(Either)
    }
}

/// Run lengths: packed into a text, or as numbers.
enum Counts {
    Packed(String),
    Runs(Vec<u64>),
}

impl<'de> Deserialize<'de> for Counts {
    fn deserialize<D: Deserializer<'de>>(from: D) -> std::result::Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = Counts;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("run lengths: a text or a list of whole numbers")
            }

            fn visit_str<E>(self, text: &str) -> std::result::Result<Counts, E> {
                Ok(Counts::Packed(text.to_owned()))
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut all: A) -> std::result::Result<Counts, A::Error> {
                let mut runs = Vec::new();
                while let Some(Whole(run)) = all.next_element()? {
                    // No image has more pixels, and packed run lengths cannot be longer.
                    let small = i64::try_from(run).is_ok();
                    runs.push(if small { run } else { return Err(A::Error::custom(format!("{run} is too large"))) });
                }
                Ok(Counts::Runs(runs))
            }
        }
        from.deserialize_any(Either)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wrong(entry: &str) -> String {
        let text = format!(
            "{{\"images\": [{{\"id\": 1, \"file_name\": \"a.png\"}}], \"categories\": [],\n \
             \"annotations\": [{{\"id\": 6, \"image_id\": 1, \"category_id\": 1}},\n {entry}]}}"
        );
        let error = parse(Path::new("a.json"), text.as_bytes()).err().expect("an error");
        assert_eq!(error.exit_code(), 2);
        error.to_string()
    }

    /// Rationale: serde names neither the entry nor the key. Expected: each error of an annotation names its id, wherever
    /// the id is in the entry, its line and the key.
    #[test]
    fn a_damaged_annotation_is_named_with_its_key() {
        for (entry, words) in [
            (r#"{"id": 7, "image_id": "x", "category_id": [], "segmentation": []}"#, "`category_id`: invalid type"),
            (r#"{"id": 7, "image_id": 1.5, "category_id": 1}"#, "`image_id`: 1.5 is no whole number"),
            (
                r#"{"image_id": 1, "category_id": 1, "segmentation": "none", "id": 7}"#,
                "a list of polygons, or run lengths",
            ),
            (r#"{"segmentation": [["1", 2]], "id": 7, "image_id": 1, "category_id": 1}"#, "expected a number"),
            (
                r#"{"segmentation": [1, [2]], "id": 7, "image_id": 1, "category_id": 1}"#,
                "numbers and polygons are mixed",
            ),
            (r#"{"segmentation": {"counts": "04"}, "id": 7}"#, "the run lengths lack `size`"),
            (r#"{"segmentation": {"size": [2, 2]}, "id": 7}"#, "the run lengths lack `counts`"),
            (r#"{"segmentation": {"size": [2, 2], "counts": [1, -1]}, "id": 7}"#, "a whole number from 0"),
            (r#"{"segmentation": {"size": [2], "counts": [1]}, "id": 7}"#, "`segmentation`: invalid length 1"),
            (
                r#"{"segmentation": {"size": [2, 2], "counts": [18446744073709551615, 5]}, "id": 7}"#,
                "`segmentation`: 18446744073709551615 is too large",
            ),
            (
                r#"{"segmentation": {"size": [2, 4294967296], "counts": [1]}, "id": 7}"#,
                "`segmentation`: 4294967296 is too large",
            ),
            (r#"{"id": 7, "image_id": 1, "category_id": 1, "iscrowd": 2}"#, "`iscrowd`: 2.0 is neither 0 nor 1"),
            (r#"{"id": 7, "category_id": 1}"#, "line 3: missing field `image_id`"),
            (r#"{"id": 7, "bbox": [NaN, 1], "image_id": 1}"#, "`bbox`: expected value"),
            (r#"{"id": 7, "image_id": 1, "category_id": 1, "segmentation": [[1, 2"#, "`segmentation`: expected"),
        ] {
            let shown = wrong(entry);
            assert!(shown.starts_with("a.json: annotation 7 in line 3") && shown.contains(words), "{shown}");
        }
        let shown = wrong(r#"{"id": {}, "image_id": 1}"#);
        assert!(shown.contains("annotation at position 2 of the list in line 3, `id`"), "{shown}");
        // Behind the last annotation no entry is to blame.
        for (damaged, words) in [
            ("X\n", "trailing characters at line 4 column 1"),
            ("\0", "trailing characters"),
            ("{\"images\": []}", "trailing characters"),
        ] {
            let text = "{\"images\": [], \"categories\": [],\n\"annotations\":\n [{\"id\": 6, \"image_id\": 1, \"category_id\": 1}]}\n";
            let shown = parse(Path::new("a.json"), (text.to_owned() + damaged).as_bytes()).err().unwrap().to_string();
            assert!(shown.starts_with("a.json: this is not a COCO file") && shown.contains(words), "{shown}");
        }
        let lacking = b"{\"images\": [], \"categories\": [{\"id\": 2, \"name\": \"crop\"}]}";
        let shown = parse(Path::new("a.json"), lacking).err().unwrap().to_string();
        assert!(shown.contains("instances: missing field `annotations`"), "{shown}");
        assert!(parse(Path::new("a.json"), b"[1").err().unwrap().message().contains("not a COCO file"));
    }

    #[test]
    fn the_spellings_of_labelling_tools_are_read() {
        let text = "\u{feff}{\"images\": [{\"id\": \"a\", \"file_name\": \"a.png\", \"width\": 60.0, \"height\": 40},
            {\"id\": 2.0, \"file_name\": \"b.png\", \"width\": 0, \"height\": 0},
            {\"id\": 3, \"file_name\": \"c.png\", \"width\": 4294967336, \"height\": 1e12}],
            \"categories\": [{\"id\": -1, \"name\": \"crop\", \"keypoints\": null}],
            \"annotations\": [{\"image_id\": 2, \"category_id\": -1, \"iscrowd\": false, \"segmentation\": [1, 2, 3, 4, 5, 6]},
            {\"id\": 4, \"image_id\": 2, \"category_id\": -1, \"iscrowd\": null, \"keypoints\": null, \"segmentation\": null}]}";
        let read = parse(Path::new("a.json"), text.as_bytes()).unwrap();
        assert_eq!((read.images[0].size(), read.images[1].size()), (Some((60, 40)), None));
        assert_eq!(read.images[2].size(), Some((4_294_967_336, 1_000_000_000_000)));
        assert_eq!((&read.images[1].id, &read.categories[0].id), (&Id("2".into()), &Id("-1".into())));
        let [first, second] = &read.annotations[..] else { unreachable!("two annotations") };
        assert!(
            matches!(&first.segmentation, Some(Segmentation::Polygons(all)) if all.len() == 1 && all[0].len() == 6)
        );
        assert!(first.id.is_none() && second.segmentation.is_none() && second.iscrowd.is_none());
    }
}
