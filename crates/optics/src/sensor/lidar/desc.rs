//! LiDAR description in a scene file.

use super::{HALF_LIGHT_M_NS, Lidar, Returns, Rosette};
use crate::sensor::given::{Given, layered};
use furrow_base::math::{Mat3, RoundTo, ToFloat, Vec3, vec3};
use furrow_base::ron_file::{Elevation, NonNegative, Num, Positive, PositiveCount, Signed, Vary};
use furrow_base::sampling::Stream;
use furrow_base::{Error, Result};
use serde::{Deserialize, Serialize};

/// Largest number of beams of a LiDAR.
const MOST_BEAMS: usize = 1024;
/// Largest number of pulses in a turn.
const MOST_PULSES: f64 = 1e7;

layered! {
    /// LiDAR: a name, `Vlp16`, `Os164` or `Mid40`, or a name with fields that override its values. Without a name the
    /// values are those of `Vlp16`.
    ///
    /// ```
    /// use furrow_base::sampling::{Purpose, Stream};
    /// use furrow_optics::sensor::LidarDesc;
    /// for text in [
    ///     "Vlp16",
    ///     "Os164(position_m: (0, 0.4, 1.6), pitch_deg: -15, returns: All)",
    ///     "Mid40(pitch_deg: -40, rotation_hz: 2)",
    ///     "(
    ///         position_m: (0, 0, Uniform(1.4, 1.6)),
    ///         beams: Angles([-40, -30, -20]),
    ///         azimuth_deg: (-60, 60),
    ///         rotation_hz: 20,
    ///         pulses: StepDeg(0.1),
    ///         divergence_mrad: 0.3,
    ///         exit_mm: 7,
    ///         range_noise_m: 0.003,
    ///         pulse_ns: 3,
    ///         returns: FirstAndLast,
    ///     )",
    /// ] {
    ///     let desc: LidarDesc = ron::from_str(text)?;
    ///     desc.build(&mut Stream::of(1, 0, Purpose::Page, 0))?;
    /// }
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[derive(Clone, Debug, PartialEq, Serialize, schemars::JsonSchema)]
    #[schemars(default)]
    pub struct LidarDesc, LidarWritten = "LidarDesc" {
        /// Point where its beams cross, metres east, north and above the ground's mean level; default 1.2 above the
        /// origin.
        #[schemars(extend("x-example" = "(0, 0.4, 1.5)"))]
        pub position_m: (Vary<Signed<1000>>, Vary<Signed<1000>>, Vary<Positive<1000>>) = Given<(Vary<Signed<1000>>, Vary<Signed<1000>>, Vary<Positive<1000>>)>,
        /// Rotates its front clockwise from north; default 0.
        pub yaw_deg: Vary<Signed<360>> = Given<Vary<Signed<360>>>,
        /// Raises its front, or lowers it if negative; default 0.
        pub pitch_deg: Vary<Signed<360>> = Given<Vary<Signed<360>>>,
        /// Lowers its right side; default 0.
        pub roll_deg: Vary<Signed<360>> = Given<Vary<Signed<360>>>,
        /// Elevations of the beams; default 16 from -15° to 15°.
        #[schemars(extend("x-example" = "Fan(count: 32, from_deg: -30, to_deg: 10)"))]
        pub beams: BeamsDesc = Given<BeamsDesc>,
        /// Range of azimuths in which it emits pulses, degrees clockwise from its front, from -360 to 360; default a
        /// full turn from 0 to 360. Without effect for a `Rosette`.
        #[schemars(extend("x-example" = "(-60, 60)"))]
        pub azimuth_deg: (Num<Signed<360>>, Num<Signed<360>>) = Given<(Num<Signed<360>>, Num<Signed<360>>)>,
        /// Rotation rate, turns per second, or scans per second of a `Rosette`; default 10.
        pub rotation_hz: Num<Positive<1000>> = Given<Num<Positive<1000>>>,
        /// Pulse rate; default 289,352 per second of all beams.
        #[schemars(extend("x-example" = "StepDeg(0.2)"))]
        pub pulses: PulsesDesc = Given<PulsesDesc>,
        /// Full divergence of a beam between the directions of 1/e² of its intensity, milliradians, which is 1.7 times
        /// the full width at half maximum; default 3.
        pub divergence_mrad: Num<NonNegative<100>> = Given<Num<NonNegative<100>>>,
        /// Diameter of a beam at the exit, also at 1/e², millimetres; default 12.7.
        pub exit_mm: Num<NonNegative<1000>> = Given<Num<NonNegative<1000>>>,
        /// Standard deviation of a range, metres; default 0.01. Ranges measured below `min_m` or above `max_m` are
        /// dropped.
        pub range_noise_m: Num<NonNegative<10>> = Given<Num<NonNegative<10>>>,
        /// Shortest range, metres; default 1.
        pub min_m: Num<NonNegative<1000>> = Given<Num<NonNegative<1000>>>,
        /// Longest range, metres; default 100.
        pub max_m: Num<Positive<10_000>> = Given<Num<Positive<10_000>>>,
        /// Detection threshold of intensity, with 1 for a white, matt wall at 1 m: reflectance divided by the square of
        /// the range at which it is just detected; default 0.00001, a reflectance of a tenth at 100 m.
        pub min_intensity: Num<NonNegative<1000>> = Given<Num<NonNegative<1000>>>,
        /// Length of a pulse, nanoseconds. Echoes closer than half the distance that light travels in that time, 0.15 m
        /// per nanosecond, merge; default 6.67, which is 1 m.
        pub pulse_ns: Num<NonNegative<10_000>> = Given<Num<NonNegative<10_000>>>,
        /// Which echoes of a pulse are reported; default `Strongest`.
        pub returns: Returns = Given<Returns>,
    }
}

/// Elevations of a LiDAR's beams.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum BeamsDesc {
    /// Equally spaced elevations.
    Fan {
        /// Number of beams.
        #[schemars(extend("x-example" = "32"))]
        count: Num<PositiveCount>,
        /// First elevation, degrees above its horizon, negative below it.
        #[schemars(extend("x-example" = "-30"))]
        from_deg: Num<Elevation>,
        /// Last elevation.
        #[schemars(extend("x-example" = "10"))]
        to_deg: Num<Elevation>,
    },
    /// List of elevations, degrees above its horizon.
    #[schemars(extend("x-example" = "([-30, -20, -12, -6])"))]
    Angles(Vec<Num<Elevation>>),
    /// One beam behind two rotating prisms, which covers a circle around its front with a rosette. The phases of the
    /// prisms are drawn for each field; `pulses` must be `PerSecond`.
    Rosette {
        /// Largest angle from its front, degrees.
        #[schemars(extend("x-example" = "19.2"))]
        radius_deg: Num<Positive<80>>,
        /// Turns per second of the prisms, of opposite signs if they turn against each other.
        #[schemars(extend("x-example" = "(121.57, -77.73)"))]
        speeds_hz: (Num<Signed<10_000>>, Num<Signed<10_000>>),
    },
}

/// Pulse rate of a LiDAR.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub enum PulsesDesc {
    /// All beams fire each time the head has turned by this many degrees.
    #[schemars(extend("x-example" = "(0.2)"))]
    StepDeg(Num<Positive<360>>),
    /// Total pulses per second of all beams; the angle between them follows from `rotation_hz`.
    #[schemars(extend("x-example" = "(300000)"))]
    PerSecond(Num<Positive<1_000_000_000>>),
}

impl BeamsDesc {
    fn elevations_deg(&self) -> Vec<f64> {
        match self {
            Self::Angles(all) => all.iter().map(|angle| angle.get()).collect(),
            Self::Rosette { .. } => vec![0.0],
            Self::Fan { count, from_deg, to_deg } => {
                let (last, from, to) = (count.get().trunc_to::<u32>() - 1, from_deg.get(), to_deg.get());
                if last == 0 {
                    return vec![0.5 * (from + to)];
                }
                (0..=last).map(|k| from + (to - from) * f64::from(k) / f64::from(last)).collect()
            }
        }
    }

    /// Returns the number of beams.
    fn count(&self) -> usize {
        match self {
            Self::Angles(all) => all.len(),
            Self::Rosette { .. } => 1,
            Self::Fan { count, .. } => count.get().trunc_to::<usize>(),
        }
    }
}

impl BeamsDesc {
    /// Samples the prisms, if there are any.
    fn rosette(&self, pulses: PulsesDesc, stream: &mut Stream) -> Result<Option<Rosette>> {
        let Self::Rosette { radius_deg, speeds_hz } = self else { return Ok(None) };
        if matches!(pulses, PulsesDesc::StepDeg(_)) {
            return Err(Error::input("a Rosette has no rotating head, so its pulses have no step in degrees")
                .help("write pulses: PerSecond(100000)"));
        }
        let phases = [stream.uniform(), stream.uniform()];
        Ok(Some(Rosette { radius_deg: radius_deg.get(), speeds_hz: [speeds_hz.0.get(), speeds_hz.1.get()], phases }))
    }
}

impl LidarDesc {
    /// Returns the LiDAR at another position, metres.
    #[must_use]
    pub fn at(self, place: Vec3) -> Self {
        let [x, y, z] = place.to_array().map(f64::from);
        Self { position_m: (Vary::fixed(x), Vary::fixed(y), Vary::fixed(z)), ..self }
    }

    /// Samples the LiDAR. Returns a [`Kind::Input`](furrow_base::error::Kind::Input) error if it could not emit pulses
    /// or could not report anything.
    pub fn build(&self, stream: &mut Stream) -> Result<Lidar> {
        let (x, y, z) = &self.position_m;
        let position = vec3(x.draw32(stream), y.draw32(stream), z.draw32(stream));
        let turns = [&self.yaw_deg, &self.pitch_deg, &self.roll_deg];
        let [yaw, pitch, roll] = turns.map(|turn| turn.draw32(stream).to_radians());
        if !(1..=MOST_BEAMS).contains(&self.beams.count()) {
            let words = format!("a LiDAR of {} beams", self.beams.count());
            return Err(Error::input(words).help(format!("`beams` takes 1 to {MOST_BEAMS} elevations")));
        }
        let elevations_deg = self.beams.elevations_deg();
        let mut sorted = elevations_deg.clone();
        sorted.sort_by(f64::total_cmp);
        if let Some([twice, ..]) = sorted.windows(2).find(|pair| matches!(pair, [lower, upper] if lower >= upper)) {
            return Err(Error::input(format!("two of its beams have the elevation {twice} degrees"))
                .help("list each elevation in `Angles` once; the first and the last of a `Fan` must differ"));
        }
        let rosette = self.beams.rosette(self.pulses, stream)?;
        let (from, to) = match rosette {
            Some(_) => (0.0, 360.0),
            None => (self.azimuth_deg.0.get(), self.azimuth_deg.1.get()),
        };
        if !(to > from && to - from <= 360.0) {
            let words = format!("azimuth_deg goes from {from} to {to}");
            return Err(Error::input(words)
                .help("write a smaller and a larger angle from -360 to 360, at most 360 apart, such as (-60, 60)"));
        }
        let rotation_hz = self.rotation_hz.get();
        let step_deg = match self.pulses {
            PulsesDesc::StepDeg(step) => step.get(),
            PulsesDesc::PerSecond(rate) => 360.0 * rotation_hz * elevations_deg.len().to_f64() / rate.get(),
        };
        // The end of a full turn is its start; rounding must not add a column.
        let columns = ((to - from) / step_deg - 1e-6).ceil().max(1.0);
        if columns * elevations_deg.len().to_f64() > MOST_PULSES {
            let words = format!("{:.0} pulses in a turn are too many", columns * elevations_deg.len().to_f64());
            return Err(Error::input(words)
                .help(format!("at most {MOST_PULSES:.0}: use fewer beams or a larger step in `pulses`")));
        }
        let (near, far) = (self.min_m.get(), self.max_m.get());
        if near >= far {
            return Err(Error::input(format!("min_m, {near}, is not below max_m, {far}"))
                .help("min_m is the shortest range that is reported, max_m the longest"));
        }
        Ok(Lidar {
            position,
            axes: Mat3::from_rotation_z(-yaw) * Mat3::from_rotation_x(pitch) * Mat3::from_rotation_y(roll),
            velocity: Vec3::ZERO,
            elevations_deg,
            first_deg: from,
            step_deg,
            columns: columns.trunc_to::<u32>(),
            rotation_hz,
            rosette,
            divergence: (1e-3 * self.divergence_mrad.get()).to_f32(),
            exit: (1e-3 * self.exit_mm.get()).to_f32(),
            noise: self.range_noise_m.get(),
            range: [near.to_f32(), far.to_f32()],
            least: self.min_intensity.f32(),
            separation: (HALF_LIGHT_M_NS * self.pulse_ns.get()).to_f32(),
            returns: self.returns,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::ron_file::RonFile;
    use furrow_base::sampling::Purpose;

    fn built(text: &str) -> Result<Lidar> {
        RonFile::of(text).parse::<LidarDesc>()?.build(&mut Stream::of(1, 0, Purpose::Test, 0))
    }

    /// Expected: a pulse for each 10 µs of a tenth of a second within the circle, from a random phase; a step in degrees is
    /// refused.
    #[test]
    fn a_rosette_fires_at_its_rate_within_its_circle() {
        let mid = built("Mid40(rotation_hz: 10)").unwrap();
        assert_eq!((mid.columns(), mid.beams()), (10_000, 1));
        let last = mid.pulse(9999, 0);
        assert!((last.time_s - 0.09999).abs() < 1e-6, "{}", last.time_s);
        let widest = (0..10_000).map(|k| mid.pulse(k, 0).direction.y).fold(1.0, f32::min);
        assert!((widest.acos().to_degrees() - 19.2).abs() < 0.05, "{widest}");
        assert_ne!(mid.pulse(0, 0).direction.x, 19.2_f32.to_radians().sin());
        let error = built("Mid40(pulses: StepDeg(1))").unwrap_err().to_string();
        assert!(error.contains("a Rosette has no rotating head"), "{error}");
    }

    /// Expected, by the frame's definition: azimuth 0 faces north at yaw 0, azimuth 90 faces east; a lowered front
    /// faces down, and so does a lowered right side; a quarter of a turn at 10 Hz takes 25 ms.
    #[test]
    fn pulses_go_where_azimuth_elevation_and_pose_say() {
        let level = built("(beams: Angles([0, -30]), pulses: StepDeg(90), rotation_hz: 10)").unwrap();
        assert_eq!((level.columns(), level.beams()), (4, 2));
        let close = |a: Vec3, b: Vec3| assert!((a - b).length() < 1e-6, "{a} {b}");
        close(level.pulse(0, 0).direction, Vec3::Y);
        close(level.pulse(1, 0).direction, Vec3::X);
        close(level.pulse(0, 1).direction, vec3(0.0, 0.75_f32.sqrt(), -0.5));
        assert!((level.pulse(1, 0).time_s - 0.025).abs() < 1e-7);
        close(level.pulse(1, 0).origin, vec3(0.0, 0.0, 1.2));
        let of = |pose: &str, column| {
            built(&format!("(beams: Angles([0]), pulses: StepDeg(90), {pose})")).unwrap().pulse(column, 0).direction
        };
        close(of("yaw_deg: 90", 0), Vec3::X);
        close(of("pitch_deg: -90", 0), Vec3::NEG_Z);
        close(of("roll_deg: 90", 1), Vec3::NEG_Z);
        let moved = level.carried(Mat3::from_rotation_z(-std::f32::consts::FRAC_PI_2), Vec3::X, Vec3::X);
        close(moved.pulse(0, 0).direction, Vec3::X);
        close(moved.pulse(1, 0).origin, vec3(1.025, 0.0, 1.2));
    }

    /// Expected: 360° × 10 Hz × 16 beams divided by 288,000 pulses per second gives 0.2° between columns and 1800
    /// columns; a third of a turn has a third of them.
    #[test]
    fn a_rate_of_pulses_becomes_a_step() {
        assert_eq!(built("(pulses: PerSecond(288000))").unwrap().columns(), 1800);
        assert_eq!(built("(pulses: PerSecond(288000), azimuth_deg: (-60, 60))").unwrap().columns(), 600);
        let fan = built("(beams: Fan(count: 5, from_deg: -20, to_deg: 20))").unwrap();
        assert_eq!(fan.elevations_deg, [-20.0, -10.0, 0.0, 10.0, 20.0]);
    }

    #[test]
    fn what_could_not_shoot_is_refused() {
        for (text, words) in [
            ("(beams: Angles([]))", "of 0 beams"),
            ("(beams: Angles([-5, 3, -5]))", "two of its beams have the elevation -5"),
            ("(beams: Fan(count: 3, from_deg: 4, to_deg: 4))", "two of its beams have the elevation 4"),
            ("(beams: Fan(count: 5000, from_deg: 0, to_deg: 10))", "of 5000 beams"),
            ("(azimuth_deg: (60, -60))", "from 60 to -60"),
            ("(azimuth_deg: (-200, 300))", "from -200 to 300"),
            ("(azimuth_deg: (0, 400))", "between -360 and 360"),
            ("(pulses: StepDeg(0.0001))", "pulses in a turn are too many"),
            ("(pulses: PerSecond(1000000000))", "100000000 pulses"),
            ("(divergence_mrad: 3000)", "between 0 and 100"),
            ("(exit_mm: 2000)", "between 0 and 1000"),
            ("(range_noise_m: NaN)", "NaN"),
            ("(pulses: StepDeg(0))", "above 0"),
            ("(beams: Fan(count: 0, from_deg: 0, to_deg: 10))", "whole number from 1"),
            ("(min_m: 5, max_m: 2)", "min_m, 5, is not below max_m, 2"),
            ("(beams: Angles([-95]))", "between -90 and 90"),
            ("Vlp17", "unknown LiDAR `Vlp17`"),
            ("Vlp16(divergence: 3)", "unknown field `divergence`"),
        ] {
            let error = built(text).unwrap_err().to_string();
            assert!(error.contains(words), "{text}: {error}");
        }
    }
}
