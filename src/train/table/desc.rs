//! An experiment file: the types that RON is read into.

use crate::train::fit::Settings;
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;
use std::marker::PhantomData;

/// An experiment: each network is trained on each training set with each seed, and evaluated on each test set.
///
/// ```
/// use furrow::train::table::ExperimentDesc;
/// let file = furrow::ron_file::RonFile::of(r#"Experiment(
///     networks: ["basic-segnet", "unet"],
///     seeds: [1, 2],
///     hyperparameters: (size: (240, 180), steps: 400, batch: 4),
///     sets: {
///         "synthetic-d": Scene(file: "../synthetic-d.ron", count: 100, size: (480, 360)),
///         "jai": Real(about: "20 frames of SugarBeets2016"),
///     },
///     train: [
///         (name: "Synthetic D", from: [(set: "synthetic-d")]),
///         (name: "Real", from: [(set: "jai", images: "0..8")], validation: [(set: "jai", images: "8..10")]),
///         (name: "Real-Augmented", from: [(set: "synthetic-d"), (set: "jai", images: "0..10", repeat: 4)]),
///     ],
///     test: [(name: "Test A", set: "jai", images: "12..20")],
///     scales: {"paper": (count: 1300, hyperparameters: (size: (480, 360), steps: 20000))},
/// )"#);
/// let experiment: ExperimentDesc = file.parse().unwrap();
/// assert_eq!(experiment.train.len(), 3);
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename = "Experiment")]
pub struct ExperimentDesc {
    /// Networks by name, as `train fit --network` takes them; at least one.
    pub networks: Vec<String>,
    /// Colour baselines by name, `exg` or `exg-size`, fitted to each training set; all unless given, none with `[]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub baselines: Option<Vec<String>>,
    /// Seeds; each is one training of every network on every training set.
    #[serde(default = "one_seed")]
    pub seeds: Vec<u64>,
    /// Hyper-parameters of all networks.
    #[serde(default, alias = "learn")]
    pub hyperparameters: Settings,
    /// Datasets, by the names of their folders.
    pub sets: Named<SetDesc>,
    /// Training sets: rows of the tables.
    pub train: Vec<TrainDesc>,
    /// Test sets: columns of the tables.
    pub test: Vec<TestDesc>,
    /// The training set, by its name, that all others are compared with, seed by seed: what does each change do? Unless given, none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub against: Option<String>,
    /// The same experiment, larger or smaller, by name: `train table --scale NAME`.
    #[serde(default, skip_serializing_if = "Named::is_empty")]
    pub scales: Named<ScaleDesc>,
}

fn one_seed() -> Vec<u64> {
    vec![1]
}

/// A set of images.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum SetDesc {
    /// Rendered from a scene by `trace dataset`, into `sets/NAME` of the experiment's folder.
    Scene {
        /// The scene file; its path counts from the folder of this file.
        #[serde(alias = "page")]
        file: String,
        /// Images, 1 or more.
        count: u64,
        /// Pixels of an image: width, height. As large as networks see them unless given.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        size: Option<(u32, u32)>,
        /// Samples a pixel, 1 or more; 16 unless given.
        #[serde(default = "some_samples")]
        spp: u32,
        /// Seed, instead of the scene's.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        seed: Option<u64>,
        /// One thing of the fields that is changed, by its name in `trace ablate --list`; nothing unless given.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        edit: Option<String>,
        /// Shares of training, validation and test set; 8 to 1 to 1 unless given.
        #[serde(default = "usual_split")]
        split: (u32, u32, u32),
    },
    /// A dataset that is there already, such as `trace ablate` makes.
    Dataset {
        /// Its folder; counts from the folder of this experiment file.
        path: String,
    },
    /// Real images with labels, which `train table --real NAME=DIR` leads to: a dataset that `trace dataset import` made, or a
    /// folder with `images/` and with masks in `labels/` (0 soil, 1 crop, 2 weed, 255 no label), which is then imported into `sets/NAME`.
    Real {
        /// What the set is, for whoever has to find it.
        #[serde(default)]
        about: String,
    },
}

fn is_usual(settings: &Settings) -> bool {
    *settings == Settings::default()
}

fn some_samples() -> u32 {
    16
}

fn usual_split() -> (u32, u32, u32) {
    (8, 1, 1)
}

/// A training set, with its validation set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename = "Train")]
pub struct TrainDesc {
    /// Its name in the tables.
    pub name: String,
    /// Its images; of a part that names no `images`, those to train on.
    pub from: Vec<PartDesc>,
    /// Validation set, by which a training ends early and keeps its best step; unless given, the validation images of the parts of
    /// `from` that name no `images`. Where it is empty, all steps are done and the last counts.
    #[serde(default, alias = "watch", skip_serializing_if = "Option::is_none")]
    pub validation: Option<Vec<PartDesc>>,
    /// Hyper-parameters that differ on this set from those of the experiment and its scale: the same images learnt from in another way. All but
    /// `classes`, `bands` and `size`, by which sets are compared.
    #[serde(default, skip_serializing_if = "is_usual")]
    pub hyperparameters: Settings,
}

/// Images of a set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename = "Part")]
pub struct PartDesc {
    /// The set.
    pub set: String,
    /// Which of its images: `all`, `train`, `val`, `test`, by number as `0..10` (without the last) or `1/2` (every second from
    /// number 1 on), or at random as `random:100`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub images: Option<String>,
    /// By how much label masks are dilated, pixels of the set's images, negative to erode them, at most 16: manual masks are dilated by
    /// about 1 px, rendered ones end where the leaf ends.
    #[serde(default, alias = "margin_px", skip_serializing_if = "Option::is_none")]
    pub dilate_px: Option<f32>,
    /// Oversampling: how often each image is in an epoch, 1 or more; few real images beside many rendered ones hardly count otherwise.
    #[serde(default = "once")]
    pub repeat: u32,
}

fn once() -> u32 {
    1
}

/// A test set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename = "Test")]
pub struct TestDesc {
    /// Its name in the tables.
    pub name: String,
    /// The set.
    pub set: String,
    /// Which of its images, as in [`PartDesc::images`]; all unless given. None that is in a training or validation set.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub images: Option<String>,
}

/// What is otherwise at another scale.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default, rename = "Scale")]
pub struct ScaleDesc {
    /// Images of each scene.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub count: Option<u64>,
    /// Pixels of an image of each scene: width, height.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size: Option<(u32, u32)>,
    /// Samples a pixel.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spp: Option<u32>,
    /// Networks.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub networks: Option<Vec<String>>,
    /// Seeds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seeds: Option<Vec<u64>>,
    /// Hyper-parameters that differ.
    #[serde(alias = "learn")]
    pub hyperparameters: Settings,
}

/// Values by name, in the order of the file; a name that stands there twice is kept twice, so that an error can show where.
#[derive(Clone, Debug, PartialEq)]
pub struct Named<T>(pub Vec<(String, T)>);

impl<T> Default for Named<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T> Named<T> {
    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// All names, in order.
    pub fn names(&self) -> Vec<&str> {
        self.0.iter().map(|(name, _)| name.as_str()).collect()
    }

    /// The place of a name.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.0.iter().position(|(n, _)| n == name)
    }
}

impl<T: Serialize> Serialize for Named<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(name, value)| (name, value)))
    }
}

impl<T: schemars::JsonSchema> schemars::JsonSchema for Named<T> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Named".into()
    }

    fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
        let value = generator.subschema_for::<T>();
        schemars::json_schema!({ "type": "object", "additionalProperties": value })
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Named<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct InOrder<T>(PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for InOrder<T> {
            type Value = Named<T>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("names in quotes with values: {\"name\": …}")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let mut all = Vec::new();
                while let Some(entry) = map.next_entry()? {
                    all.push(entry);
                }
                Ok(Named(all))
            }
        }
        deserializer.deserialize_map(InOrder(PhantomData))
    }
}
