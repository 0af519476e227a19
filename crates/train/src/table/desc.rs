//! Types of an experiment file, deserialized from RON.

use crate::fit::Settings;
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;
use std::marker::PhantomData;

/// An experiment: every network is trained on every training set with every seed, and evaluated on every test set.
///
/// ```
/// use furrow_train::table::ExperimentDesc;
/// let file = furrow_base::ron_file::RonFile::of(r#"Experiment(
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
    /// Names of the networks, as in `train fit --network`; at least one.
    pub networks: Vec<String>,
    /// Names of the colour baselines, `exg` or `exg-size`, which are fitted to each training set. Default: all; `[]` for none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub baselines: Option<Vec<String>>,
    /// Seeds; every network is trained on every training set once per seed.
    #[serde(default = "one_seed")]
    pub seeds: Vec<u64>,
    /// Hyper-parameters of all networks.
    #[serde(default)]
    pub hyperparameters: Settings,
    /// Datasets by name; the name is that of the folder in `sets/`.
    pub sets: Named<SetDesc>,
    /// Training sets: rows of the tables.
    pub train: Vec<TrainDesc>,
    /// Test sets: columns of the tables.
    pub test: Vec<TestDesc>,
    /// Name of the reference training set that all others are compared with, seed by seed. Default: no comparison.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub against: Option<String>,
    /// Larger or smaller variants of the experiment by name, selected with `train table --scale NAME`.
    #[serde(default, skip_serializing_if = "Named::is_empty")]
    pub scales: Named<ScaleDesc>,
}

fn one_seed() -> Vec<u64> {
    vec![1]
}

/// Dataset of an experiment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum SetDesc {
    /// Images rendered from a scene file as by `trace dataset`, into `sets/NAME` of the experiment's folder.
    Scene {
        /// Path of the scene file, relative to this experiment file.
        file: String,
        /// Number of images, 1 or more.
        count: u64,
        /// Width and height of the images in pixels. Default: the input size of the networks.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        size: Option<(u32, u32)>,
        /// Samples per pixel, 1 or more. Default: 16.
        #[serde(default = "some_samples")]
        spp: u32,
        /// Seed that replaces the scene's.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        seed: Option<u64>,
        /// Ablation edit of the fields, by its name in `trace ablate --list`. Default: none.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        edit: Option<String>,
        /// Shares of training, validation and test set. Default: 8 to 1 to 1.
        #[serde(default = "usual_split")]
        split: (u32, u32, u32),
    },
    /// Existing dataset, such as one made by `trace ablate`.
    Dataset {
        /// Path of its folder, relative to this experiment file.
        path: String,
    },
    /// Real images with labels; their folder is given with `train table --real NAME=DIR`. It is a dataset made by `trace dataset
    /// import`, or a folder with `images/` and masks in `labels/` (0 soil, 1 crop, 2 weed, 255 no label), which is then imported
    /// into `sets/NAME`.
    Real {
        /// Description of the images, for users who have to obtain them.
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

/// Training set with its validation set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename = "Train")]
pub struct TrainDesc {
    /// Name in the tables.
    pub name: String,
    /// Training images. A part without `images` selects the training images of its dataset.
    pub from: Vec<PartDesc>,
    /// Validation set, used to stop training early and to keep the best step. Default: the validation images of the parts of `from` without
    /// `images`. If it is empty, all steps are run and the last one is kept.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub validation: Option<Vec<PartDesc>>,
    /// Hyper-parameters of this training set that differ from those of the experiment and its scale. `classes`, `bands` and `size` cannot
    /// differ, because all training sets are evaluated on the same test sets.
    #[serde(default, skip_serializing_if = "is_usual")]
    pub hyperparameters: Settings,
}

/// Selection of images of a dataset.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename = "Part")]
pub struct PartDesc {
    /// Name of the dataset.
    pub set: String,
    /// Images to select: `all`, `train`, `val`, `test`, a range of numbers such as `0..10` (excludes the last), `1/2` (every second image
    /// from number 1 on), or `random:100` (100 random images).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub images: Option<String>,
    /// Dilation of the label masks in pixels of the dataset's images, -16 to 16; negative values erode. Manual masks are dilated by about 1
    /// px, rendered ones end at the leaf edge.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dilate_px: Option<f32>,
    /// Oversampling: number of times that each image is in an epoch, 1 or more. Use it if a few real images are mixed with many
    /// rendered ones.
    #[serde(default = "once")]
    pub repeat: u32,
}

fn once() -> u32 {
    1
}

/// Test set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename = "Test")]
pub struct TestDesc {
    /// Name in the tables.
    pub name: String,
    /// Name of the dataset.
    pub set: String,
    /// Images to select, as in [`PartDesc::images`]; images of a training or validation set are not allowed. Default: all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub images: Option<String>,
}

/// Values that differ at another scale of the experiment.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default, rename = "Scale")]
pub struct ScaleDesc {
    /// Number of images of each rendered dataset.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub count: Option<u64>,
    /// Width and height of the rendered images in pixels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size: Option<(u32, u32)>,
    /// Samples per pixel of the rendered images.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spp: Option<u32>,
    /// Networks.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub networks: Option<Vec<String>>,
    /// Seeds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seeds: Option<Vec<u64>>,
    /// Hyper-parameters that differ.
    pub hyperparameters: Settings,
}

/// Values by name, in the order of the file. Duplicate names are kept, so that an error can point at them.
#[derive(Clone, Debug, PartialEq)]
pub struct Named<T>(pub Vec<(String, T)>);

impl<T> Default for Named<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T> Named<T> {
    /// Returns `true` if there are no values.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns all names, in order.
    pub fn names(&self) -> Vec<&str> {
        self.0.iter().map(|(name, _)| name.as_str()).collect()
    }

    /// Returns the index of a name.
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
