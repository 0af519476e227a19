//! What a scene file says: the field and the species, composed of what each module can read.

use crate::film::Filter;
use crate::light::LightDesc;
use crate::material::LeafDesc;
use crate::model::Up;
use crate::plant::{ConditionDesc, PlantDesc, Stage};
use crate::ron_file::{self, Finite, Fraction, NonNegative, Num, Pick, Positive, PositiveCount, Vary};
use crate::sampling::Stream;
use crate::scatter::{RowsDesc, WeedsDesc};
use crate::scene::days::DaysDesc;
use crate::scene::drive::{DriveDesc, MountedDesc};
use crate::scene::tag::Class;
use crate::sensor::{CameraDesc, LidarDesc, SensorDesc};
use crate::soil::SoilDesc;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A distribution over fields. Every number may be fixed or drawn; paths are relative to the scene file.
///
/// ```
/// let text = r#"Field(
///     seed: 7,
///     camera: JaiAd130(height_m: 0.85),
///     lights: [Daylight(sun: Angles(elevation_deg: Uniform(30, 60), azimuth_deg: 140))],
///     plants: [(species: "species/sugar_beet.ron", growth: Bbch(14))],
/// )"#;
/// let field: furrow::scene::desc::FieldDesc = ron::from_str(text).unwrap();
/// assert_eq!(field.plants.len(), 1);
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename = "Field")]
pub struct FieldDesc {
    /// Seed of everything that is drawn; `--seed` overrides it.
    #[serde(default)]
    #[schemars(extend("x-example" = "7"))]
    pub seed: u64,
    /// Who looks.
    pub camera: CameraDesc,
    /// Further cameras that are carried with it: a stereo pair, a camera of near infrared with a lens of its own.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cameras: Vec<MountedDesc>,
    /// A vehicle that carries them through the field and takes several images of it; one image of each camera unless given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "(frames: 20, path: AlongRows(speed_m_s: 0.5))"))]
    pub drive: Option<DriveDesc>,
    /// A rotating LiDAR, carried with the cameras; `trace scan` writes its points, of a field that is made as finely as its beams are wide. Images
    /// do not depend on it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "Vlp16(position_m: (0, 0, 1.5))"))]
    pub lidar: Option<LidarDesc>,
    /// Days on which all images are taken again, while the field grows; as the growth of its plants says unless given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "(from: 8, to: 40, every: 4)"))]
    pub days: Option<DaysDesc>,
    /// How the film becomes a picture.
    #[serde(default)]
    pub sensor: SensorDesc,
    /// How finely the field is made.
    #[serde(default, skip_serializing_if = "Detail::is_full")]
    pub detail: Detail,
    /// How far from the point below each camera, and for a scan below the LiDAR, the field is grown, metres to the east, north, west and south; at most 100.
    #[serde(default = "reach", skip_serializing_if = "is_reach")]
    pub reach_m: Num<Positive>,
    /// How a pixel gathers light.
    #[serde(default = "point_spread")]
    pub filter: Filter,
    /// What shines.
    #[serde(default)]
    pub lights: Vec<LightDesc>,
    /// The ground; none unless given, and then plants stand in a black void. `soil: ()` is a natural seedbed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "(colors: [Loess], moisture: (mean: 0.4))"))]
    pub soil: Option<SoilDesc>,
    /// Sown in rows.
    #[serde(default)]
    pub crops: Vec<CropDesc>,
    /// Which of the crops a field has; all of them unless given.
    #[serde(default, skip_serializing_if = "Sown::is_all")]
    pub sown: Sown,
    /// What came by itself.
    #[serde(default)]
    pub weeds: Vec<WeedDesc>,
    /// Single plants in their places.
    #[serde(default)]
    pub plants: Vec<PlacedDesc>,
    /// Models from disk in their places.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub models: Vec<ModelDesc>,
}

/// How finely a field is made.
///
/// From a drone most of what a field camera sees is smaller than a pixel. By pixels, the cells of leaves, of the ground and of its maps
/// grow with the pixels on the ground, and aggregates shorter than three pixels become heights of the ground instead of bodies. Plants
/// stand and grow as they do in full detail, their leaves moved by less than a cell; what lies on the ground is another draw. Of instances
/// the places are the same, and the leaves are others.
///
/// ```
/// use furrow::scene::desc::{Detail, FieldDesc};
/// let text = "Field(camera: JaiAd130(height_m: 10), reach_m: 8, detail: ByPixel)";
/// let field: FieldDesc = ron::from_str(text).unwrap();
/// assert_eq!((field.detail, field.reach_m.get()), (Detail::ByPixel, 8.0));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
pub enum Detail {
    /// As a field camera a metre over the ground sees it, whatever the camera: images of all sizes show the same field.
    #[default]
    Full,
    /// As the pixels need it, for cameras high above: 144 m² in seconds.
    ByPixel,
    /// The same, and plants of which a pixel shows more than 2.5 mm share their meshes: each is an instance of one of 64 plants of its
    /// population, turned by an angle and larger or smaller by a factor of its own, with its own chlorophyll. For fields of thousands of
    /// plants, to a hectare. Such plants have the leaves, the age and the stage of that one: their pixels and traits are not those of the same
    /// field in `Full`. With images of another size, other plants are instances.
    Instanced,
}

impl Detail {
    #[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks by reference")]
    fn is_full(&self) -> bool {
        *self == Self::Full
    }
}

/// Reach of a field unless given, metres: 144 m² at most, some 1,500 beets. A camera 10 m up with a view of 60° sees as much.
const REACH_M: f64 = 6.0;

fn reach() -> Num<Positive> {
    Num::new(REACH_M)
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks by reference")]
fn is_reach(reach_m: &Num<Positive>) -> bool {
    reach_m.get() == REACH_M
}

/// Which of a scene file's crops a field has.
///
/// ```
/// use furrow::scene::desc::{FieldDesc, Sown};
/// let text = r#"Field(camera: JaiAd130(), sown: One, crops: [
///     (species: "species/maize.ron", growth: Bbch(14), rows: (spacing_m: 0.75)),
///     (species: "species/carrot.ron", growth: AgeDays(30), rows: (spacing_m: 0.3)),
/// ])"#;
/// let field: FieldDesc = ron::from_str(text).unwrap();
/// assert_eq!(field.sown, Sown::One);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
pub enum Sown {
    /// All of them, each in its rows.
    #[default]
    All,
    /// One of them, drawn for every field with equal probabilities: one scene file for the fields of many farms.
    One,
}

impl Sown {
    #[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks by reference")]
    fn is_all(&self) -> bool {
        *self == Self::All
    }

    /// Places of the crops that a field has, of so many that its scene file lists.
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

/// A good lens on small pixels: about half a pixel of blur.
fn point_spread() -> Filter {
    Filter::Gaussian(0.4)
}

/// How far a plant has grown.
///
/// ```
/// use furrow::scene::desc::Growth;
/// let g: Growth = ron::from_str("AgeDays(Normal(mean: 24, sd: 2))").unwrap();
/// let g: Growth = ron::from_str("Bbch(Choice([12, 14]))").unwrap();
/// let g: Growth = ron::from_str("EmergesOn(Normal(mean: 12, sd: 2))").unwrap();
/// // A field that was photographed in its first weeks or a month later: this crop and its weeds are all young or all old.
/// let g: Growth = ron::from_str("Either([AgeDays(Uniform(8, 14)), AgeDays(Uniform(30, 40))])").unwrap();
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub enum Growth {
    /// Days after emergence.
    #[schemars(extend("x-example" = "(Uniform(18, 28))"))]
    AgeDays(Vary<NonNegative>),
    /// Growth stage, BBCH scale (Meier 2001).
    #[schemars(extend("x-example" = "(Choice([12, 14]))"))]
    Bbch(Vary<PositiveCount>),
    /// The day on which it emerges, where the field has `days`; they count from the emergence of the first crop.
    #[schemars(extend("x-example" = "(Normal(mean: 12, sd: 2))"))]
    EmergesOn(Vary<Finite>),
    /// One of these, drawn once a field: the same place in every such list of the scene file, so all of them have the same length.
    Either(Vec<Growth>),
}

impl Growth {
    /// Draws one plant's stage; `place` is the one that the field has drawn for every list. A plant that emerges on a day is just emerging: how
    /// old it is then, the field's day tells.
    ///
    /// # Panics
    /// Where a list is not that long, which [`super::assemble`] refuses before anything grows.
    pub fn draw(&self, place: usize, stream: &mut Stream) -> Stage {
        match self {
            Self::AgeDays(days) => Stage::Age(days.draw32(stream)),
            Self::Bbch(code) => Stage::Bbch(code.draw(stream) as u32),
            Self::EmergesOn(_) => Stage::Age(0.0),
            Self::Either(of) => of[place].draw(place, stream),
        }
    }

    /// The growth itself, or of a list the one at `place`.
    ///
    /// # Panics
    /// As [`Self::draw`].
    pub fn at(&self, place: usize) -> &Self {
        if let Self::Either(of) = self { &of[place] } else { self }
    }

    /// Whether it is told by the day on which the plant emerges, or may be.
    pub fn emerges(&self) -> bool {
        match self {
            Self::EmergesOn(_) => true,
            Self::Either(of) => of.iter().any(Self::emerges),
            Self::AgeDays(_) | Self::Bbch(_) => false,
        }
    }
}

/// A crop in rows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename = "Crop")]
pub struct CropDesc {
    /// A species that ships, by its name (`trace species` lists them), or the path of a species file.
    #[schemars(extend("x-example" = "\"sugar beet\""))]
    pub species: String,
    /// How far each plant has grown.
    pub growth: Growth,
    /// Factor on its sizes, beyond that of the species file: below 1 where cold or drought kept plants small for their leaves.
    #[serde(default = "as_it_is", skip_serializing_if = "is_as_it_is")]
    #[schemars(extend("x-example" = "Uniform(0.9, 1.1)"))]
    pub vigour: Vary<Positive>,
    /// Where they stand.
    pub rows: RowsDesc,
    /// Age, health and damage of its plants; as the species file has it unless given.
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
    /// How far each plant has grown.
    pub growth: Growth,
    /// Factor on its sizes, beyond that of the species file: below 1 where cold or drought kept plants small for their leaves.
    #[serde(default = "as_it_is", skip_serializing_if = "is_as_it_is")]
    #[schemars(extend("x-example" = "Uniform(0.9, 1.1)"))]
    pub vigour: Vary<Positive>,
    /// How many and how they gather.
    #[serde(default)]
    pub spread: WeedsDesc,
    /// Age, health and damage of its plants; as the species file has it unless given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub condition: Option<ConditionDesc>,
}

/// One plant in its place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename = "Plant")]
pub struct PlacedDesc {
    /// A species that ships, by its name (`trace species` lists them), or the path of a species file.
    #[schemars(extend("x-example" = "\"maize\""))]
    pub species: String,
    /// How far it has grown.
    pub growth: Growth,
    /// Factor on its sizes, beyond that of the species file: below 1 where cold or drought kept plants small for their leaves.
    #[serde(default = "as_it_is", skip_serializing_if = "is_as_it_is")]
    #[schemars(extend("x-example" = "Uniform(0.9, 1.1)"))]
    pub vigour: Vary<Positive>,
    /// Where its stem meets the ground, metres east and north.
    #[serde(default = "origin")]
    #[schemars(extend("x-example" = "(0.1, Uniform(-0.1, 0.1))"))]
    pub position_m: (Vary<Finite>, Vary<Finite>),
    /// Turns it about its axis, degrees clockwise from above.
    #[serde(default = "no_turn")]
    pub turn_deg: Vary<Finite>,
    /// Only this leaf of it, counted from 1 with the seed leaves; the whole plant unless given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "3"))]
    pub only_leaf: Option<Num<PositiveCount>>,
    /// Age, health and damage of it; as the species file has it unless given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub condition: Option<ConditionDesc>,
}

/// A model from disk in its place: a scanned plant, a stone, a tool. Each is one plant, or one thing, in the labels.
///
/// ```
/// use furrow::{ron_file::RonFile, scene::desc::ModelDesc};
/// let file = RonFile::of(r#"Model(file: "thistle.glb", class: Weed, position_m: (0.1, Uniform(-0.1, 0.1)), scale: 0.01)"#);
/// let model: ModelDesc = file.parse().unwrap();
/// assert!(RonFile::of(r#"Model(file: "thistle.glb", clas: Weed)"#).parse::<ModelDesc>().is_err());
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename = "Model")]
pub struct ModelDesc {
    /// glTF (`.glb`, `.gltf`) or Wavefront OBJ with its materials; lengths in metres.
    #[schemars(extend("x-example" = "\"thistle.glb\""))]
    pub file: String,
    /// What it is called: classes of datasets tell it by `model:NAME`, tables of species by the name alone. Without one
    /// it is of the class `model`, and tables tell the file's name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "\"robot\""))]
    pub name: Option<String>,
    /// Whether the file may name pictures and other parts outside its own folder, by absolute paths or by `..`: for a model of your own.
    /// In a dataset they stay within the dataset's folder in any case.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub allow_outside: bool,
    /// What its pixels are. Not needed where the file carries labels, as those that `trace export` writes do.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub class: Option<Class>,
    /// Where its origin stands, metres east and north.
    #[serde(default = "origin")]
    #[schemars(extend("x-example" = "(0.1, Uniform(-0.1, 0.1))"))]
    pub position_m: (Vary<Finite>, Vary<Finite>),
    /// Height of its origin over the ground there, metres; below 0 sinks it in.
    #[serde(default = "no_turn")]
    pub lift_m: Vary<Finite>,
    /// Turns it about the upright, degrees clockwise from above.
    #[serde(default = "no_turn")]
    pub turn_deg: Vary<Finite>,
    /// Factor on its size: 0.001 for a file in millimetres.
    #[serde(default = "as_it_is")]
    pub scale: Vary<Positive>,
    /// Which of the file's axes points up: Y, as glTF has it and most OBJ files, or Z.
    #[serde(default)]
    pub up: Up,
    /// GGX roughness α, instead of the file's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub roughness: Option<Num<Fraction>>,
    /// Share of light that passes in R, G, B, NIR, instead of the file's: (0.05, 0.12, 0.03, 0.45) for a green leaf.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "(0.05, 0.12, 0.03, 0.45)"))]
    pub transmission: Option<Shares>,
    /// Reflectance in near infrared. Unless given: 0.45 for what lets light through, as much as in red for what does not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nir: Option<Num<Fraction>>,
}

/// A fraction in each of R, G, B, NIR.
pub type Shares = (Num<Fraction>, Num<Fraction>, Num<Fraction>, Num<Fraction>);

fn as_it_is() -> Vary<Positive> {
    Vary::fixed(1.0)
}

fn is_as_it_is(factor: &Vary<Positive>) -> bool {
    *factor == as_it_is()
}

fn origin() -> (Vary<Finite>, Vary<Finite>) {
    (Vary::fixed(0.0), Vary::fixed(0.0))
}

fn no_turn() -> Vary<Finite> {
    Vary::fixed(0.0)
}

/// A species, as its file writes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, rename = "Species")]
pub struct SpeciesDesc {
    /// English name.
    #[schemars(extend("x-example" = "\"creeping thistle\""))]
    pub name: String,
    /// Scientific name; empty where the file does not say it.
    #[schemars(extend("x-example" = "\"Cirsium arvense\""))]
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub scientific: String,
    /// EPPO code.
    #[schemars(extend("x-example" = "\"CIRAR\""))]
    pub eppo: String,
    /// Crop or weed.
    pub role: Role,
    /// Another species file from which all is taken that this one does not write, but `name`, `scientific`, `eppo` and `role`: fields, materials,
    /// kinds of leaves and flowers one by one; lists, distributions and all other values whole. A path from this file's folder, or the name of a file that ships.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("x-example" = "\"capsella.ron\""))]
    pub like: Option<String>,
    /// What its organs look like, by the names that the plant uses.
    #[serde(alias = "skins", deserialize_with = "ron_file::entries")]
    #[schemars(extend("x-example" = "{\"leaf\": Leaf(texture: \"../../textures/leaf/cirsium.png\", calibrated: true)}"))]
    pub materials: BTreeMap<String, LeafDesc>,
    /// How it grows.
    pub plant: PlantDesc,
    /// Relative spread of the chlorophyll from plant to plant.
    #[serde(default = "spread")]
    pub chlorophyll_sd: Num<Fraction>,
    /// Age, health and damage of its plants; flawless unless given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub condition: Option<ConditionDesc>,
    /// Whether all its plants are one individual: of one shape in all fields, of one age in each, so that a field has one mesh of it
    /// many times. Place, lean, turn and green stay each plant's own. Scene files do not say so, experiments do.
    #[serde(skip)]
    pub alike: bool,
}

const fn spread() -> Num<Fraction> {
    Num::new(0.12)
}

/// What a plant is to the farmer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
pub enum Role {
    /// Sown.
    Crop,
    /// Not sown.
    Weed,
}

impl Role {
    /// The class of its pixels.
    pub fn class(self) -> Class {
        match self {
            Self::Crop => Class::Crop,
            Self::Weed => Class::Weed,
        }
    }
}

impl SpeciesDesc {
    /// The textures that the scene file names.
    pub fn textures(&self) -> impl Iterator<Item = &str> {
        self.materials.values().flat_map(|leaf| leaf.texture.iter().flat_map(Pick::all)).map(String::as_str)
    }
}
