//! The macro that turns the table of lights into three enums: light sources, lights in scene files, and records.

/// Defines [`Light`](super::Light), [`LightDesc`](super::LightDesc) and [`LightRecord`](super::LightRecord) from a table
/// with one entry for each keyword of scene files: keyword, type of its fields, type and name of its record, and its own
/// light sources, if any.
macro_rules! lights {
    ($(
        $(#[$about:meta])*
        $keyword:ident($desc:ty, $record:ty as $kind:literal)
        $(=> $($(#[$doc:meta])* $source:ident($inner:ty)),+)?;
    )*) => {
        furrow_base::dispatch! {
            /// Light source.
            #[derive(Clone, Debug)]
            pub enum Light {
                $($($($(#[$doc])* $source($inner),)+)?)*
            }

            /// Samples a direction from `p` (metres, world) to the light with two numbers in [0, 1); `None` if the light
            /// does not reach the point. Visibility is not tested.
            fn sample_li(&self, p: Vec3, u: [f32; 2]) -> Option<LightSample>;

            /// Returns the density per solid angle with which [`Self::sample_li`] samples the unit direction `wi` at `p`.
            fn pdf_li(&self, p: Vec3, wi: Vec3) -> f32;

            /// Returns the radiance along a ray that left the scene in the unit direction `dir`: sun, sky, environment.
            /// Zero for lamps.
            fn le(&self, dir: Vec3) -> Spectrum;

            /// Returns the radiance that a camera sees along a ray that left the scene in the unit direction `dir`.
            fn seen(&self, dir: Vec3) -> Spectrum;

            /// Intersects a ray with the lamp; `None` for lights at infinity.
            fn hit(&self, origin: Vec3, dir: Vec3) -> Option<LampHit>;

            /// Returns a cheap estimate of the irradiance (mean of the bands) at `p` on a surface of unit normal `n`;
            /// with `two_sided`, the sum over both sides. Above zero wherever the light can contribute.
            fn importance(&self, p: Vec3, n: Vec3, two_sided: bool) -> f32;

            /// Returns the unoccluded irradiance of a horizontal plane at the world's origin, W·m⁻²·nm⁻¹ per band.
            fn horizontal_irradiance(&self) -> Spectrum;

            /// Returns `true` if neighbouring points see the whole light in nearly the same direction, so that shadow
            /// rays to it are best traced together.
            fn is_narrow(&self) -> bool;

            /// Returns `true` if rays that leave the scene see the light.
            fn is_infinite(&self) -> bool;

            /// Returns the form that exporters and the rasterizer translate.
            fn form(&self) -> Form;
        }

        impl Light {
            /// Returns the name of the kind of source.
            pub fn kind(&self) -> &'static str {
                match self {
                    $($($(Self::$source(_) => stringify!($source),)+)?)*
                }
            }

            /// Returns a light of the same irradiance whose size is scaled by `by`, 0 < `by` ≤ 1; `None` for a light
            /// without a size.
            pub fn shrunk(&self, by: f32) -> Option<Self> {
                match self {
                    $($($(Self::$source(one) => one.shrunk(by).map(Self::$source),)+)?)*
                }
            }

            /// Returns examples of every kind, including edge cases, for tests that run over all lights.
            pub fn examples() -> Vec<(&'static str, Self)> {
                let mut all = Vec::new();
                $(
                    for (name, sources) in <$desc>::examples() {
                        all.extend(sources.list().into_iter().map(|light| (name, light)));
                    }
                )*
                all
            }
        }

        $($($(
            impl From<$inner> for Light {
                fn from(one: $inner) -> Self {
                    Self::$source(one)
                }
            }
        )+)?)*

        /// Description of a light in a scene file.
        ///
        /// ```
        /// use furrow_base::ron_file::RonFile;
        /// use furrow_base::sampling::{Purpose, Stream};
        /// use furrow_optics::light::LightDesc;
        /// let mut stream = Stream::of(1, 0, Purpose::Page, 0);
        /// for (text, count) in [
        ///     (r#"Daylight(sun: At(latitude_deg: 50.6, longitude_deg: 7, utc: "2016-05-27T11:30:00Z"), turbidity: 3)"#, 2),
        ///     ("Daylight(sun: Angles(elevation_deg: Uniform(20, 65), azimuth_deg: Uniform(0, 360)), cloud: 0.4)", 2),
        ///     ("Overcast(illuminance_klx: Uniform(5, 25))", 1),
        ///     ("Constant(radiance: (1, 1, 1, Uniform(0.5, 1)))", 1),
        ///     (
        ///         "Lamp(
        ///             shape: Rectangle(width_m: 0.3, height_m: 0.1),
        ///             position_m: (0.4, 0, 0.8),
        ///             look_at_m: (0, 0, 0),
        ///             glow: WhiteLed(irradiance: Uniform(0.8, 1.2), at_m: 0.9),
        ///         )",
        ///         1,
        ///     ),
        ///     ("Lamp(shape: Disc(radius_m: 0.05), position_m: (0, 0.3, 0.8), glow: Radiance(1, 1, 1, 0.5))", 1),
        /// ] {
        ///     let desc: LightDesc = RonFile::of(text).parse()?;
        ///     assert_eq!(desc.build(&mut stream)?.len(), count);
        /// }
        /// // A robot that works by day, and at night under its own two lamps: each scene gets one list or the other.
        /// let text = "OneOf([
        ///     [Daylight(sun: Angles(elevation_deg: Uniform(20, 65), azimuth_deg: Uniform(0, 360)))],
        ///     [
        ///         Lamp(shape: Disc(radius_m: 0.05), position_m: (-0.3, 0, 0.8), glow: WhiteLed(irradiance: 1, at_m: 0.9)),
        ///         Lamp(shape: Disc(radius_m: 0.05), position_m: (0.3, 0, 0.8), glow: WhiteLed(irradiance: 1, at_m: 0.9)),
        ///     ],
        /// ])";
        /// let LightDesc::OneOf(lists) = RonFile::of(text).parse()? else { unreachable!() };
        /// assert_eq!((lists[0].len(), lists[1].len()), (1, 2));
        /// # Ok::<(), furrow_base::Error>(())
        /// ```
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
        #[expect(clippy::large_enum_variant, reason = "a scene file has a handful of lights")]
        pub enum LightDesc {
            $($(#[$about])* $keyword($desc),)*
            /// One of these lists of lights, chosen once per scene with equal probability; its lights are used as if they
            /// were listed directly. Allowed only in a scene file's list of lights; a list may not be empty or contain a
            /// `OneOf`.
            OneOf(Vec<Vec<LightDesc>>),
        }

        impl LightDesc {
            /// Returns the environment maps named by this light, including those in all lists of a `OneOf`.
            pub fn files(&self) -> Vec<&str> {
                match self {
                    $(Self::$keyword(desc) => desc.files(),)*
                    Self::OneOf(lists) => lists.iter().flatten().flat_map(Self::files).collect(),
                }
            }

            /// Returns the errors of [`LightDesc::draw`] that need neither a sky nor an environment map.
            pub fn check(&self, stream: &mut Stream) -> Result<()> {
                match self {
                    $(Self::$keyword(desc) => desc.check(stream),)*
                    Self::OneOf(_) => Err(one_of_inside()),
                }
            }

            /// Samples the lights as [`LightDesc::build`] does and also returns a record of the sampled values. `open`
            /// loads a file named in the scene file. Returns a [`Kind::Input`](furrow_base::error::Kind::Input) error
            /// for a [`LightDesc::OneOf`], which must be resolved once per scene before.
            pub fn draw(&self, stream: &mut Stream, open: &mut Open<'_>) -> Result<(LightRecord, Vec<Light>)> {
                match self {
                    $(Self::$keyword(desc) => {
                        let (record, sources) = desc.draw(stream, open)?;
                        Ok((LightRecord::$keyword(record), sources.list()))
                    })*
                    Self::OneOf(_) => Err(one_of_inside()),
                }
            }
        }

        /// Sampled values of a light, one record for each light of the scene file.
        ///
        /// Irradiance is that of an unoccluded horizontal plane at the world's origin, W·m⁻²·nm⁻¹ in R, G, B, NIR.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        #[serde(tag = "kind")]
        pub enum LightRecord {
            $($(#[$about])* #[serde(rename = $kind)] $keyword($record),)*
        }

        impl LightRecord {
            /// Returns the kind of light as written in its record: `daylight`, `overcast`, `constant`, `environment`,
            /// `lamp`.
            pub fn kind(&self) -> &'static str {
                match self {
                    $(Self::$keyword(_) => $kind,)*
                }
            }

            /// Returns the irradiance of the ground; for daylight, the sum of sun and sky.
            pub fn irradiance_w_m2_nm(&self) -> Spectrum {
                match self {
                    $(Self::$keyword(record) => record.irradiance_w_m2_nm(),)*
                }
            }
        }
    };
}
