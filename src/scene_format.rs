//! Types of scene files and species files, with fields, units, ranges and defaults.
//!
//! A scene file contains one [`FieldDesc`], a species file one [`SpeciesDesc`]. A [`Num`] is a fixed number; a [`Vary`] is a number or a
//! [`Distribution`]. Their type parameter is the allowed range: [`Positive`], [`Fraction`] and so on. A value outside the range is an
//! error with line and column.
//!
//! ```
//! # use furrow_base::ron_file::RonFile;
//! use furrow::scene_format::FieldDesc;
//!
//! let text = r#"Field(
//!     camera: JaiAd130(height_m: Normal(mean: 0.85, sd: 0.03)),
//!     lights: [Daylight(sun: Angles(elevation_deg: Uniform(30, 60), azimuth_deg: 140))],
//!     soil: (layers: [(albedo: "dirt.png", height: "dirt.height.png", size_m: 0.5, height_mm: (-4, 8))]),
//!     crops: [(species: "species/sugar_beet.ron", growth: AgeDays(Uniform(18, 28)), rows: (spacing_m: 0.45, in_row_m: 0.18))],
//! )"#;
//! let field: FieldDesc = RonFile::of(text).parse()?;
//! assert_eq!(field.crops.len(), 1);
//! # Ok::<(), furrow::Error>(())
//! ```

#[doc(inline)]
pub use furrow_base::ron_file::{
    Bound, Count, Distribution, Elevation, Fraction, NonNegative, Num, Pick, Positive, PositiveCount, Signed, Vary,
};
#[doc(inline)]
pub use furrow_field::desc::{CropDesc, FieldDesc, Growth, ModelDesc, PlacedDesc, Role, SpeciesDesc, WeedDesc};
#[doc(inline)]
pub use furrow_field::drive::{DriveDesc, MountedDesc, PathDesc, ShakeDesc};
#[doc(inline)]
pub use furrow_grow::plant::{ConditionDesc, LayerDesc, LeafKind, PlantDesc, Shape, Stage, StageDesc};
#[doc(inline)]
pub use furrow_grow::scatter::{ClustersDesc, RowsDesc, WeedsDesc};
#[doc(inline)]
pub use furrow_grow::soil::{
    BlendDesc, ClodsDesc, CracksDesc, CrumbsDesc, LayerDesc as SoilLayerDesc, LitterDesc, MoistureDesc, ReliefDesc,
    RowReliefDesc, SoilColor, SoilDesc, StonesDesc, ToolDesc, WheelDesc,
};
#[doc(inline)]
pub use furrow_optics::light::desc::*;
#[doc(inline)]
pub use furrow_optics::sensor::{
    AdcDesc, ApertureDesc, CameraDesc, DistortionDesc, ExposureDesc, IntrinsicsDesc, JpegDesc, LimitsDesc, MatrixDesc,
    MosaicDesc, MotionDesc, NoiseDesc, PoseDesc, PsfDesc, SensorDesc, SharpenDesc, Tone, WhiteBalanceDesc,
};
#[doc(inline)]
pub use furrow_optics::sensor::{BeamsDesc, LidarDesc, PulsesDesc, Returns};
#[doc(inline)]
pub use furrow_render::material::LeafDesc;
