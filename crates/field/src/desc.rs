//! Types of scene files and species files, composed of the description types of the other modules.

use crate::days::DaysDesc;
use crate::drive::{DriveDesc, MountedDesc};
use crate::horizon::HorizonDesc;
use furrow_base::math::RoundTo;
use furrow_base::ron_file::{self, Bound, Fraction, NonNegative, Num, Pick, Positive, PositiveCount, Signed, Vary};
use furrow_base::sampling::Stream;
use furrow_grow::model::Up;
use furrow_grow::plant::{ConditionDesc, Form, PlantDesc, Stage};
use furrow_grow::scatter::{RowsDesc, WeedsDesc};
use furrow_grow::soil::SoilDesc;
use furrow_optics::light::LightDesc;
use furrow_optics::sensor::{CameraDesc, LidarDesc, SensorDesc};
use furrow_render::film::Filter;
use furrow_render::material::LeafDesc;
use furrow_render::scene::tag::Class;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A distribution over fields. Every number is fixed or drawn from a distribution; paths are relative to the scene file.
///
/// ```
/// let text = r#"Field(
///     seed: 7,
///     camera: JaiAd130(height_m: 0.85),
///     lights: [Daylight(sun: Angles(elevation_deg: Uniform(30, 60), azimuth_deg: 140))],
///     plants: [(species: "species/sugar_beet.ron", growth: Bbch(14))],
/// )"#;
/// let field: furrow_field::desc::FieldDesc = furrow_base::ron_file::RonFile::of(text).parse().unwrap();
/// assert_eq!(field.plants.len(), 1);
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename = "Field")]
pub struct FieldDesc {
    /// Seed of all random numbers; `--seed` overrides it.
    #[serde(default)]
    #[schemars(extend("x-example" = "7"))]
    pub seed: u64,
    /// Camera that takes the images.
    pub camera: CameraDesc,
    /// Additional cameras on the same vehicle: for a stereo pair, or a near-infrared camera with its own lens.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cameras: Vec<MountedDesc>,
    /// Vehicle that carries the cameras through the field and takes several images of it. Without it, each camera takes one image.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "(frames: 20, path: AlongRows(speed_m_s: 0.5))"))]
    pub drive: Option<DriveDesc>,
    /// Rotating LiDAR, carried with the cameras. `trace scan` writes its points; the field is then built at the resolution of its beams.
    /// Images do not depend on it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "Vlp16(position_m: (0, 0, 1.5))"))]
    pub lidar: Option<LidarDesc>,
    /// Days on which all images are taken again while the field grows. Without it, the field is imaged once, with ages given by `growth`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "(from: 8, to: 40, every: 4)"))]
    pub days: Option<DaysDesc>,
    /// Sensor: conversion of the film to an image.
    #[serde(default)]
    pub sensor: SensorDesc,
    /// Level of geometric detail; by default the field chooses between `Full` and `ByPixel`.
    #[serde(default, skip_serializing_if = "Detail::is_auto")]
    pub detail: Detail,
    /// Planted distance to the east, north, west and south of the point below each camera (for a scan, below the LiDAR), metres; at
    /// most 100.
    #[serde(default = "reach", skip_serializing_if = "is_reach")]
    pub reach_m: Num<Positive<100>>,
    /// Pixel reconstruction filter.
    #[serde(default = "point_spread")]
    pub filter: Filter,
    /// Lights.
    #[serde(default)]
    pub lights: Vec<LightDesc>,
    /// Ground. Without it, plants are in a black void. `soil: ()` is a natural seedbed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "(colors: [Loess], moisture: (mean: 0.4))"))]
    pub soil: Option<SoilDesc>,
    /// Hedges, trees and haze beyond the field, for views that show the horizon. Without it, bare ground ends at a clear sky.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "(distance_m: 250)"))]
    pub horizon: Option<HorizonDesc>,
    /// Crops, sown in rows.
    #[serde(default)]
    pub crops: Vec<CropDesc>,
    /// Selection of crops for each field; all of them by default.
    #[serde(default, skip_serializing_if = "Sown::is_all")]
    pub sown: Sown,
    /// Weeds.
    #[serde(default)]
    pub weeds: Vec<WeedDesc>,
    /// Single plants at given positions.
    #[serde(default)]
    pub plants: Vec<PlacedDesc>,
    /// Models from disk: single ones at given positions, or plants sown in rows or by density.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub models: Vec<ModelDesc>,
}

impl FieldDesc {
    /// Returns `true` if the scene has ground, crops, weeds or sown models, so that its extent depends on the view.
    pub(crate) fn has_ground(&self) -> bool {
        let sown = || self.models.iter().any(ModelDesc::is_sown);
        self.soil.is_some() || !self.crops.is_empty() || !self.weeds.is_empty() || sown()
    }
}

/// Level of geometric detail of a field.
///
/// From a drone, most details that a field camera resolves are smaller than a pixel. With `ByPixel`, the cells of leaves, of the ground and
/// of its maps grow with the pixels on the ground, and aggregates shorter than three pixels become heights of the ground instead of
/// meshes. Plants have the same positions and shapes as in full detail, with leaves moved by less than a cell; clods and debris are drawn
/// anew. Instances have the same positions, but other leaves.
///
/// ```
/// use furrow_field::desc::{Detail, FieldDesc};
/// let text = "Field(camera: JaiAd130(height_m: 10), reach_m: 8, detail: ByPixel)";
/// let field: FieldDesc = ron::from_str(text).unwrap();
/// assert_eq!((field.detail, field.reach_m.get()), (Detail::ByPixel, 8.0));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
pub enum Detail {
    /// `ByPixel` if an image shows more than 12 m² of planted ground, otherwise `Full`. The area is that of the rectangle around the view with
    /// sides to north and east. It depends on the cameras, not on the image size. The record of an image has `detail: ByPixel` where it was
    /// chosen.
    #[default]
    Auto,
    /// The detail that a field camera 1 m above the ground needs, whatever the camera: images of all sizes show the same field.
    Full,
    /// The detail that the pixels need, for cameras high above the ground: builds 144 m² in seconds.
    ByPixel,
    /// Like `ByPixel`, and plants share their meshes if a pixel shows more than 2.5 mm of them. Each is an instance of one of 64 plants of
    /// its population, with its own rotation, size and chlorophyll. For fields of thousands of plants, up to a hectare. An instance has the
    /// leaves, age and stage of its bank plant, so its pixels and traits differ from those of the same field in `Full`. Which plants are
    /// instances depends on the image size.
    Instanced,
}

impl Detail {
    #[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks by reference")]
    fn is_auto(&self) -> bool {
        *self == Self::Auto
    }
}

/// Default of `reach_m`, metres: at most 144 m², about 1,500 beets. A camera at 10 m with a 60° angle of view sees this area.
const REACH_M: f64 = 6.0;

fn reach() -> Num<Positive<100>> {
    Num::new(REACH_M)
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks by reference")]
fn is_reach(reach_m: &Num<Positive<100>>) -> bool {
    reach_m.get() == REACH_M
}

/// Selection of the scene file's crops for each field.
///
/// ```
/// use furrow_field::desc::{FieldDesc, Sown};
/// let text = r#"Field(camera: JaiAd130(), sown: One, crops: [
///     (species: "species/maize.ron", growth: Bbch(14), rows: (spacing_m: 0.75)),
///     (species: "species/carrot.ron", growth: AgeDays(30), rows: (spacing_m: 0.3)),
/// ])"#;
/// let field: FieldDesc = ron::from_str(text).unwrap();
/// assert_eq!(field.sown, Sown::One);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
pub enum Sown {
    /// All crops, each in its rows.
    #[default]
    All,
    /// One crop, drawn for every field with equal probabilities: one scene file then covers the fields of many farms.
    One,
}

impl Sown {
    #[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks by reference")]
    fn is_all(&self) -> bool {
        *self == Self::All
    }

    /// Draws the indices of the crops that a field has, from the `crops` entries of its scene file.
    pub fn draw(self, crops: usize, stream: &mut Stream) -> std::ops::Range<usize> {
        match self {
            Self::One if crops > 1 => {
                let k = stream.index(crops);
                k..k + 1
            }
            _ => 0..crops,
        }
    }
}

/// Default filter, a Gaussian of σ = 0.4 pixels: a good lens on small pixels, with about half a pixel of blur.
fn point_spread() -> Filter {
    Filter::Gaussian(0.4)
}

/// Age or growth stage of a plant.
///
/// ```
/// use furrow_field::desc::Growth;
/// let g: Growth = ron::from_str("AgeDays(Normal(mean: 24, sd: 2))").unwrap();
/// let g: Growth = ron::from_str("Bbch(Choice([12, 14]))").unwrap();
/// let g: Growth = ron::from_str("EmergesOn(Normal(mean: 12, sd: 2))").unwrap();
/// // A field imaged in its first weeks or a month later: this crop and its weeds are either all young or all old.
/// let g: Growth = ron::from_str("Either([AgeDays(Uniform(8, 14)), AgeDays(Uniform(30, 40))])").unwrap();
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub enum Growth {
    /// Age in days after emergence.
    #[schemars(extend("x-example" = "(Uniform(18, 28))"))]
    AgeDays(Vary<NonNegative<1000>>),
    /// Growth stage, BBCH scale (Meier 2001).
    #[schemars(extend("x-example" = "(Choice([12, 14]))"))]
    Bbch(Vary<PositiveCount>),
    /// Day of emergence, for a field with `days`; days count from the emergence of the first crop.
    #[schemars(extend("x-example" = "(Normal(mean: 12, sd: 2))"))]
    EmergesOn(Vary<Signed<1000>>),
    /// One of these growths. One index is drawn per field and used for every such list of the scene file, so all lists have the same
    /// length.
    Either(Vec<Growth>),
}

impl Growth {
    /// Draws the stage of one plant. `place` is the index that the field has drawn for all lists. For [`Self::EmergesOn`] the result is age
    /// 0; the age then follows from the field's day.
    ///
    /// # Panics
    /// If `place` is not a valid index of a list, which [`super::assemble`] rules out before a field is built.
    pub fn draw(&self, place: usize, stream: &mut Stream) -> Stage {
        match self {
            Self::AgeDays(days) => Stage::Age(days.draw32(stream)),
            Self::Bbch(code) => Stage::Bbch(code.draw(stream).trunc_to::<u32>()),
            Self::EmergesOn(_) => Stage::Age(0.0),
            Self::Either(of) => of[place].draw(place, stream),
        }
    }

    /// Returns the growth itself, or the entry at `place` of a list.
    ///
    /// # Panics
    /// Under the same condition as [`Self::draw`].
    pub fn at(&self, place: usize) -> &Self {
        if let Self::Either(of) = self { &of[place] } else { self }
    }

    /// Returns `true` if the growth is, or a list contains, a day of emergence.
    pub fn emerges(&self) -> bool {
        match self {
            Self::EmergesOn(_) => true,
            Self::Either(of) => of.iter().any(Self::emerges),
            Self::AgeDays(_) | Self::Bbch(_) => false,
        }
    }
}

/// A crop sown in rows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename = "Crop")]
pub struct CropDesc {
    /// A species that ships, by its name (`trace species` lists them), or the path of a species file.
    #[schemars(extend("x-example" = "\"sugar beet\""))]
    pub species: String,
    /// Age or growth stage of each plant.
    pub growth: Growth,
    /// Factor on plant sizes, in addition to that of the species file: below 1 if cold or drought kept plants small for their leaf number.
    #[serde(default = "as_it_is::<Positive<100>>", skip_serializing_if = "is_as_it_is")]
    #[schemars(extend("x-example" = "Uniform(0.9, 1.1)"))]
    pub vigour: Vary<Positive<100>>,
    /// Seed rows.
    pub rows: RowsDesc,
    /// Age, health and damage of the plants; that of the species file by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub condition: Option<ConditionDesc>,
}

/// A weed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename = "Weed")]
pub struct WeedDesc {
    /// A species that ships, by its name (`trace species` lists them), or the path of a species file.
    #[schemars(extend("x-example" = "\"galium\""))]
    pub species: String,
    /// Age or growth stage of each plant.
    pub growth: Growth,
    /// Factor on plant sizes, in addition to that of the species file: below 1 if cold or drought kept plants small for their leaf number.
    #[serde(default = "as_it_is::<Positive<100>>", skip_serializing_if = "is_as_it_is")]
    #[schemars(extend("x-example" = "Uniform(0.9, 1.1)"))]
    pub vigour: Vary<Positive<100>>,
    /// Density and clustering.
    #[serde(default)]
    pub spread: WeedsDesc,
    /// Age, health and damage of the plants; that of the species file by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub condition: Option<ConditionDesc>,
}

/// A single plant at a given position.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename = "Plant")]
pub struct PlacedDesc {
    /// A species that ships, by its name (`trace species` lists them), or the path of a species file.
    #[schemars(extend("x-example" = "\"maize\""))]
    pub species: String,
    /// Age or growth stage.
    pub growth: Growth,
    /// Factor on plant sizes, in addition to that of the species file: below 1 if cold or drought kept the plant small for its leaf number.
    #[serde(default = "as_it_is::<Positive<100>>", skip_serializing_if = "is_as_it_is")]
    #[schemars(extend("x-example" = "Uniform(0.9, 1.1)"))]
    pub vigour: Vary<Positive<100>>,
    /// Point where the stem meets the ground, metres east and north.
    #[serde(default = "origin")]
    #[schemars(extend("x-example" = "(0.1, Uniform(-0.1, 0.1))"))]
    pub position_m: (Vary<Signed<1000>>, Vary<Signed<1000>>),
    /// Rotation about its axis, degrees clockwise when seen from above.
    #[serde(default = "no_turn::<Signed<360>>")]
    pub turn_deg: Vary<Signed<360>>,
    /// Number of the only leaf to keep, counted from 1 including cotyledons; by default the whole plant.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "3"))]
    pub only_leaf: Option<Num<PositiveCount>>,
    /// Age, health and damage of the plant; that of the species file by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub condition: Option<ConditionDesc>,
}

/// A model from disk: a scanned plant, a stone, a tool. Each is one plant, or one object, in the labels. It is placed once, at
/// `position_m`, unless it is sown in `rows` or by its `spread`; each copy then draws its own scale, rotation and height.
///
/// ```
/// use furrow_base::ron_file::RonFile;
/// use furrow_field::desc::ModelDesc;
/// let file = RonFile::of(r#"Model(file: "thistle.glb", class: Weed, position_m: (0.1, Uniform(-0.1, 0.1)), scale: 0.01)"#);
/// let model: ModelDesc = file.parse().unwrap();
/// let crop = RonFile::of(r#"Model(file: "beet.glb", class: Crop, rows: (spacing_m: 0.5), scale: Uniform(0.8, 1.2))"#);
/// assert!(crop.parse::<ModelDesc>().unwrap().is_sown());
/// assert!(RonFile::of(r#"Model(file: "thistle.glb", clas: Weed)"#).parse::<ModelDesc>().is_err());
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename = "Model")]
pub struct ModelDesc {
    /// glTF (`.glb`, `.gltf`) or Wavefront OBJ with its materials; lengths in metres.
    #[schemars(extend("x-example" = "\"thistle.glb\""))]
    pub file: String,
    /// Name of the model: dataset classes refer to it by `model:NAME`, species tables by the name alone. A model without a name has the
    /// class `model`, and tables list its file name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "\"robot\""))]
    pub name: Option<String>,
    /// Whether the file may refer to images and other files outside its own folder, by absolute paths or by `..`. Set it only for
    /// models that you trust. In a dataset, files always stay within the dataset's folder.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub allow_outside: bool,
    /// Class of its pixels. Not needed if the file has labels, like those that `trace export` writes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub class: Option<Class>,
    /// Seed rows: the model is then a crop, and each seed that emerged is a copy of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "(spacing_m: 0.5, in_row_m: 0.2)"))]
    pub rows: Option<RowsDesc>,
    /// Density and clustering: the model is then placed like a weed, with as many copies as the density gives.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "(per_m2: 20)"))]
    pub spread: Option<WeedsDesc>,
    /// Position of its origin, metres east and north; not for a model with `rows` or `spread`.
    #[serde(default = "origin")]
    #[schemars(extend("x-example" = "(0.1, Uniform(-0.1, 0.1))"))]
    pub position_m: (Vary<Signed<1000>>, Vary<Signed<1000>>),
    /// Height of its origin above the ground there, metres; a negative value sinks it in.
    #[serde(default = "no_turn::<Signed<100>>")]
    pub lift_m: Vary<Signed<100>>,
    /// Rotation about the vertical axis, degrees clockwise when seen from above. Default: 0; with `rows` or `spread`, each copy has a
    /// random direction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "Uniform(0, 360)"))]
    pub turn_deg: Option<Vary<Signed<360>>>,
    /// Scale factor: 0.001 for a file in millimetres.
    #[serde(default = "as_it_is::<Positive<1_000_000>>")]
    pub scale: Vary<Positive<1_000_000>>,
    /// Axis of the file that points up: Y, as in glTF and most OBJ files, or Z.
    #[serde(default)]
    pub up: Up,
    /// GGX roughness α; replaces the file's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub roughness: Option<Num<Fraction>>,
    /// Transmittance in R, G, B, NIR; replaces the file's. (0.05, 0.12, 0.03, 0.45) for a green leaf.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "(0.05, 0.12, 0.03, 0.45)"))]
    pub transmission: Option<Shares>,
    /// Factor on the reflectance of the file's colours and images; default 1. The colours of photographs are brighter than
    /// the surface: 0.2 for a photograph of a leaf. Reflectances above 0.95 are cut to 0.95.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "0.2"))]
    pub gain: Option<Num<Positive<100>>>,
    /// Reflectance in near infrared. Default: 0.45 for materials that transmit light, the red reflectance for opaque ones.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nir: Option<Num<Fraction>>,
}

impl ModelDesc {
    /// Returns `true` if the model is sown in rows or by density instead of placed once.
    pub fn is_sown(&self) -> bool {
        self.rows.is_some() || self.spread.is_some()
    }

    /// Returns `true` if the model has the default position.
    pub(crate) fn at_origin(&self) -> bool {
        self.position_m == origin()
    }
}

/// A fraction in each of R, G, B, NIR.
pub type Shares = (Num<Fraction>, Num<Fraction>, Num<Fraction>, Num<Fraction>);

fn as_it_is<B: Bound>() -> Vary<B> {
    Vary::fixed(1.0)
}

fn is_as_it_is<B: Bound>(factor: &Vary<B>) -> bool {
    *factor == as_it_is()
}

fn origin() -> (Vary<Signed<1000>>, Vary<Signed<1000>>) {
    (Vary::fixed(0.0), Vary::fixed(0.0))
}

fn no_turn<B: Bound>() -> Vary<B> {
    Vary::fixed(0.0)
}

/// A species file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename = "Species")]
pub struct SpeciesDesc {
    /// English name.
    #[schemars(extend("x-example" = "\"creeping thistle\""))]
    pub name: String,
    /// Scientific name; empty if the file does not give it.
    #[schemars(extend("x-example" = "\"Cirsium arvense\""))]
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub scientific: String,
    /// EPPO code.
    #[schemars(extend("x-example" = "\"CIRAR\""))]
    pub eppo: String,
    /// Crop or weed.
    pub role: Role,
    /// Base species file: everything that this file does not define is inherited from it, except `name`, `scientific`, `eppo` and `role`.
    /// Fields, materials and kinds of leaves and flowers are merged one by one; lists, distributions and all other values are replaced
    /// as a whole. A path relative to this file's folder, or the name of a built-in file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "\"capsella.ron\""))]
    pub like: Option<String>,
    /// Materials of the organs, by the names that `plant` uses.
    #[serde(deserialize_with = "ron_file::entries")]
    #[schemars(extend("x-example" = "{\"leaf\": Leaf(texture: \"../../textures/leaf/cirsium.png\", calibrated: true)}"))]
    pub materials: BTreeMap<String, LeafDesc>,
    /// Growth and shape of the plant.
    pub plant: PlantDesc,
    /// Standard deviation of the chlorophyll content from plant to plant, relative to its mean.
    #[serde(default = "spread")]
    pub chlorophyll_sd: Num<Fraction>,
    /// Age, health and damage of the plants; flawless by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub condition: Option<ConditionDesc>,
    /// Whether all plants of the species are one individual: one shape in all fields, one age in each field, so that a field has the same
    /// mesh many times. Position, lean, rotation and chlorophyll remain each plant's own. Set by experiments, not by files.
    #[serde(skip)]
    pub alike: bool,
}

const fn spread() -> Num<Fraction> {
    Num::new(0.12)
}

/// Agronomic role of a species.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
pub enum Role {
    /// A sown crop.
    Crop,
    /// A weed.
    Weed,
}

impl Role {
    /// Returns the class of its pixels.
    pub fn class(self) -> Class {
        match self {
            Self::Crop => Class::Crop,
            Self::Weed => Class::Weed,
        }
    }
}

impl SpeciesDesc {
    /// Returns `true` if both species have the same growth form; maize and the small grasses count as one.
    pub fn grows_like(&self, other: &Self) -> bool {
        let grass = |form| matches!(form, Form::Tuft | Form::Cane);
        let (own, other) = (self.plant.form, other.plant.form);
        own == other || grass(own) && grass(other)
    }

    /// Returns the paths of all leaf textures that the species file names.
    pub fn textures(&self) -> impl Iterator<Item = &str> {
        self.materials.values().flat_map(|leaf| leaf.texture.iter().flat_map(Pick::all)).map(String::as_str)
    }
}
