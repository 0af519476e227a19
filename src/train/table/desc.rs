//! What an experiment's page says.

use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;
use std::marker::PhantomData;

/// An experiment: each network learns from each training set with each seed, and is judged on each test set.
///
/// ```
/// use furrow::train::table::ExperimentDesc;
/// let page = furrow::ron_file::RonFile::of(r#"Experiment(
///     networks: ["basic-segnet", "unet"],
///     seeds: [1, 2],
///     learn: (size: (240, 180), steps: 400, batch: 4),
///     sets: {
///         "synthetic-d": Scene(page: "../synthetic-d.ron", count: 100, size: (480, 360)),
///         "jai": Real(about: "20 frames of SugarBeets2016"),
///     },
///     train: [
///         (name: "Synthetic D", from: [(set: "synthetic-d")]),
///         (name: "Real", from: [(set: "jai", images: "0..8")], watch: [(set: "jai", images: "8..10")]),
///         (name: "Real-Augmented", from: [(set: "synthetic-d"), (set: "jai", images: "0..10", repeat: 4)]),
///     ],
///     test: [(name: "Test A", set: "jai", images: "12..20")],
///     scales: {"paper": (count: 1300, learn: (size: (480, 360), steps: 20000))},
/// )"#);
/// let experiment: ExperimentDesc = page.parse().unwrap();
/// assert_eq!(experiment.train.len(), 3);
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
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
    /// How networks learn.
    #[serde(default)]
    pub learn: LearnDesc,
    /// Images, by the names of their folders.
    pub sets: Named<SetDesc>,
    /// What is learnt from: rows of the tables.
    pub train: Vec<TrainDesc>,
    /// What is judged on: columns of the tables.
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

/// How networks learn. What is left out is as in `train fit`, whose `--help` tells more of each.
///
/// ```
/// use furrow::train::table::LearnDesc;
/// let learn: LearnDesc = ron::from_str(r#"(optimiser: Some("sgd"), balance: Some("root"), augment: Some("flip,rotate"))"#).unwrap();
/// ```
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default, rename = "Learn")]
pub struct LearnDesc {
    /// What networks see images at, pixels: width, height; each from 32 to 8192.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size: Option<(u32, u32)>,
    /// Width and height of the part of each image that a step learns from; all of it unless given. Not larger than `size`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub window: Option<(u32, u32)>,
    /// Share of the windows that are laid about a pixel of a rare class, 0 to 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rare: Option<f64>,
    /// Most steps.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub steps: Option<u64>,
    /// Images a step, 1 to 1024.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub batch: Option<usize>,
    /// `sgd` or `adam`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub optimiser: Option<String>,
    /// First learning rate; one that suits the optimiser unless given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rate: Option<f64>,
    /// Weight decay, from 0 to below 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub decay: Option<f64>,
    /// `poly`, `cosine` or `constant`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub schedule: Option<String>,
    /// What is made small: `entropy` or `dice`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub loss: Option<String>,
    /// What makes up for rare classes: `median`, `root`, `fading` or `none`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub balance: Option<String>,
    /// Images to learn from on which, in the end, it is set how readily each class is answered; 0 for none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub calibrate: Option<u64>,
    /// What is varied: `all`, `none`, or some of `flip,rotate,scale,crop,colour,blur,noise`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub augment: Option<String>,
    /// What is taken out of each image: `band`, `image` or `fixed`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub normalise: Option<String>,
    /// Steps between two looks at the images that a training is watched by.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub watch_every: Option<u64>,
    /// Looks without a better result after which a training ends early.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub patience: Option<u64>,
    /// What is told apart, such as `soil; crop; weed`. Baselines know only these three.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub classes: Option<String>,
    /// What a pixel holds: `rgb`, `rgbn` or bands with commas between.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bands: Option<String>,
}

/// A set of images.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum SetDesc {
    /// Rendered from a scene by `trace dataset`, into `sets/NAME` of the experiment's folder.
    Scene {
        /// The scene's page; its path counts from the folder of this page.
        page: String,
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
        /// Shares of the images to train on, to watch by and to test on; 8 to 1 to 1 unless given.
        #[serde(default = "usual_split")]
        split: (u32, u32, u32),
    },
    /// A dataset that is there already, such as `trace ablate` makes.
    Dataset {
        /// Its folder; counts from the folder of this page.
        path: String,
    },
    /// Images of the world with labels, which `train table --real NAME=DIR` leads to: a dataset that `trace dataset import` made, or a
    /// folder with `images/` and with masks in `labels/` (0 soil, 1 crop, 2 weed, 255 no label), which is then imported into `sets/NAME`.
    Real {
        /// What the set is, for whoever has to find it.
        #[serde(default)]
        about: String,
    },
}

fn some_samples() -> u32 {
    16
}

fn usual_split() -> (u32, u32, u32) {
    (8, 1, 1)
}

/// What is learnt from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename = "Train")]
pub struct TrainDesc {
    /// Its name in the tables.
    pub name: String,
    /// Its images; of a part that names no `images`, those to train on.
    pub from: Vec<PartDesc>,
    /// Images that the training is watched by, so that it ends early and keeps its best step; unless given those to watch by of the parts
    /// of `from` that name no `images`. Where there are none, all steps are done and the last counts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub watch: Option<Vec<PartDesc>>,
}

/// Images of a set.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename = "Part")]
pub struct PartDesc {
    /// The set.
    pub set: String,
    /// Which of its images: `all`, `train`, `val`, `test`, by number as `0..10` (without the last) or `1/2` (every second from
    /// number 1 on), or by chance as `random:100`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub images: Option<String>,
    /// How far outside of the leaves their outlines are taken to lie, pixels of the set's images, negative for inside, at most 16: people
    /// draw so, and rendered labels end where the leaf ends.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub margin_px: Option<f32>,
    /// How often each is there, 1 or more: few real images beside many rendered ones must be repeated to be heard.
    #[serde(default = "once")]
    pub repeat: u32,
}

fn once() -> u32 {
    1
}

/// What is judged on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename = "Test")]
pub struct TestDesc {
    /// Its name in the tables.
    pub name: String,
    /// The set.
    pub set: String,
    /// Which of its images, as in [`PartDesc::images`]; all unless given. None that a network has learnt from or was watched by.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub images: Option<String>,
}

/// What is otherwise at another scale.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
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
    /// How networks learn, where it differs.
    pub learn: LearnDesc,
}

/// Values by name, in the order of the page; a name that stands there twice is kept twice, so that it can be told where.
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
