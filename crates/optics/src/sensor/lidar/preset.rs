//! Named LiDARs.

use super::desc::{BeamsDesc, LidarDesc, LidarWritten, PulsesDesc};
use super::returns::Returns;
use crate::sensor::given;
use furrow_base::ron_file::{self, Num, Vary};
use serde::{Deserialize, Deserializer};

/// Names of LiDARs.
pub const LIDARS: [&str; 3] = ["Vlp16", "Os164", "Mid40"];

impl Default for LidarDesc {
    fn default() -> Self {
        vlp16()
    }
}

impl LidarDesc {
    /// Returns the LiDAR of a name.
    pub fn named(name: &str) -> Option<Self> {
        match name {
            "Vlp16" => Some(vlp16()),
            "Os164" => Some(os1_64()),
            "Mid40" => Some(mid40()),
            _ => None,
        }
    }
}

/// Parses `(…)`, or a LiDAR's name with fields that override its values.
impl<'de> Deserialize<'de> for LidarDesc {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        ron_file::from_raw(deserializer, |raw| {
            let preset = |name: &str| match name {
                "" | "LidarDesc" => Some(Self::default()),
                name => Self::named(name),
            };
            let (preset, written) = given::over_a_name(raw, ("LiDAR", "LiDARs"), &LIDARS, preset)?;
            Ok(LidarWritten::over(written, preset))
        })
    }
}

/// Returns the Velodyne VLP-16.
///
/// From its user manual (63-9243 Rev. D): 16 beams from −15° to 15°, 5 to 20 turns per second, a firing cycle of 55.296
/// µs, 100 m, ±3 cm, 903 nm, strongest or last return or both, which must be 1 m apart. Divergence and diameter are its
/// horizontal values, used for a round beam. Estimates: ±3 cm is interpreted as three standard deviations; a
/// reflectance of a tenth is just detected at 100 m; no range below 1 m.
fn vlp16() -> LidarDesc {
    let zero = || Vary::fixed(0.0);
    LidarDesc {
        position_m: (zero(), zero(), Vary::fixed(1.2)),
        yaw_deg: Vary::fixed(0.0),
        pitch_deg: Vary::fixed(0.0),
        roll_deg: Vary::fixed(0.0),
        beams: BeamsDesc::Fan { count: Num::new(16.0), from_deg: Num::new(-15.0), to_deg: Num::new(15.0) },
        azimuth_deg: (Num::new(0.0), Num::new(360.0)),
        rotation_hz: Num::new(10.0),
        pulses: PulsesDesc::PerSecond(Num::new(16.0 / 55.296e-6)),
        divergence_mrad: Num::new(3.0),
        exit_mm: Num::new(12.7),
        range_noise_m: Num::new(0.01),
        min_m: Num::new(1.0),
        max_m: Num::new(100.0),
        min_intensity: Num::new(1e-5),
        pulse_ns: Num::new(6.67),
        returns: Returns::Strongest,
    }
}

/// Returns the Ouster OS1-64 of the first generation.
///
/// From its data sheet: 64 beams within ±16.6°, 1024 columns at 10 Hz, 0.13° (full width at half maximum, 3.85 mrad
/// between 1/e²), 10 mm, a standard deviation of 1.5 cm on bright targets, 0.8 to 120 m, a reflectance of a tenth at 40
/// m, 850 nm, one return, the strongest. The pulse length is an estimate, that of the VLP-16.
fn os1_64() -> LidarDesc {
    LidarDesc {
        beams: BeamsDesc::Fan { count: Num::new(64.0), from_deg: Num::new(-16.6), to_deg: Num::new(16.6) },
        pulses: PulsesDesc::StepDeg(Num::new(360.0 / 1024.0)),
        divergence_mrad: Num::new(3.85),
        exit_mm: Num::new(10.0),
        range_noise_m: Num::new(0.015),
        min_m: Num::new(0.8),
        max_m: Num::new(120.0),
        min_intensity: Num::new(0.1 / (40.0 * 40.0)),
        ..vlp16()
    }
}

/// Returns the Livox Mid-40.
///
/// From its data sheet: a circle of 38.4°, 100,000 points per second, a standard deviation of 2 cm at 20 m, 1 to 260 m, a
/// reflectance of a tenth at 90 m, 905 nm, one return. Estimates: the beam, 0.28° × 0.03°, is round with the same area;
/// the speeds of the prisms, 7294 and 4664 turns per minute against each other, are those that authors of simulators
/// measured; the pulse length is that of the VLP-16.
fn mid40() -> LidarDesc {
    LidarDesc {
        beams: BeamsDesc::Rosette {
            radius_deg: Num::new(19.2),
            speeds_hz: (Num::new(7294.0 / 60.0), Num::new(-4664.0 / 60.0)),
        },
        pulses: PulsesDesc::PerSecond(Num::new(1e5)),
        divergence_mrad: Num::new(2.7),
        exit_mm: Num::new(10.0),
        range_noise_m: Num::new(0.02),
        max_m: Num::new(260.0),
        min_intensity: Num::new(0.1 / (90.0 * 90.0)),
        ..vlp16()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Expected: a name is valid alone and with empty or non-empty brackets; the serialised form parses to the same
    /// value.
    #[test]
    fn a_lidar_has_a_name_and_what_differs_from_it() {
        for name in LIDARS {
            let plain = LidarDesc::named(name).unwrap();
            let read = |text: &str| ron::from_str::<LidarDesc>(text).unwrap();
            assert_eq!(read(name), plain);
            assert_eq!(read(&format!(" {name}() ")), plain);
            let wider = LidarDesc { divergence_mrad: Num::new(9.0), ..plain.clone() };
            assert_eq!(read(&format!("{name}(divergence_mrad: 9)")), wider);
            assert_eq!(read(&ron::to_string(&wider).unwrap()), wider);
        }
        assert_eq!(ron::from_str::<LidarDesc>("()").unwrap(), vlp16());
    }
}
