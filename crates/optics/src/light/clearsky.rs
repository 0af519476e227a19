//! Irradiance of a clear sky: direct and diffuse per band, as a function of the sun's zenith angle and the aerosol
//! optical depth.
//!
//! The table contains results of the simple spectral model of Bird & Riordan 1986 ("Simple Solar Spectral Model for
//! Direct and Diffuse Irradiance", J. Climate Appl. Meteor. 25, 87–97), computed by pvlib 0.16.1 (`spectrl2`) and
//! averaged over the bands of the JAI AD-130. Conditions: 1.5 cm of water, 0.33 atm-cm of ozone, ground albedo 0.2, sea
//! level, day 135 of the year.
//!
//! Two nearly linear quantities are interpolated, and extrapolated outside the table: the logarithm of the direct beam,
//! linear in air mass and optical depth (Beer's law), and the fraction of the lost beam that arrives as diffuse light.
//! At a node the result equals the table.
//!
//! Scene files give turbidity, as sky models do. The aerosol optical depth at 500 nm is τ = 0.10 ((T − 1)/2)^1.30: zero
//! at T = 1, the pure molecular sky, and matching the diffuse light of Hosek & Wilkie at T = 3 (τ 0.10) and T = 6 (τ
//! 0.33).

use furrow_base::math::{Spectrum, ToFloat};

/// Aerosol optical depths at 500 nm of the table.
const DEPTHS: [f64; 4] = [0.05, 0.1, 0.2, 0.4];

/// Zenith angles of the table, degrees.
const ZENITHS_DEG: [f64; 10] = [0.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 75.0, 80.0, 85.0];

/// Extraterrestrial beam on day 135: ASTM G173 extraterrestrial band means times 1/1.011².
const OUTSIDE: [f64; 4] = [1.649, 1.821, 1.863, 1.049];

#[expect(clippy::approx_constant, reason = "0.318 is an irradiance here")]
/// Direct normal and diffuse horizontal irradiance in R, G, B, NIR, W·m⁻²·nm⁻¹.
const TABLE: [[([f64; 4], [f64; 4]); 10]; 4] = [
    // Optical depth 0.05.
    [
        ([1.4261, 1.5136, 1.4416, 0.9241], [0.1146, 0.1893, 0.2703, 0.0353]),
        ([1.4135, 1.4955, 1.4184, 0.9191], [0.1121, 0.1849, 0.2637, 0.0347]),
        ([1.396, 1.4703, 1.3862, 0.9122], [0.1089, 0.1794, 0.2553, 0.0338]),
        ([1.3674, 1.4294, 1.3344, 0.9011], [0.1042, 0.1712, 0.243, 0.0326]),
        ([1.3213, 1.3641, 1.2529, 0.8837], [0.0977, 0.1598, 0.226, 0.0308]),
        ([1.2441, 1.2562, 1.1211, 0.8548], [0.0886, 0.1441, 0.2026, 0.0284]),
        ([1.1002, 1.0612, 0.8931, 0.8016], [0.0753, 0.1213, 0.169, 0.0249]),
        ([0.9748, 0.8979, 0.713, 0.7542], [0.0658, 0.1051, 0.1455, 0.0225]),
        ([0.7743, 0.6518, 0.4627, 0.6739], [0.0526, 0.083, 0.1138, 0.0192]),
        ([0.4361, 0.2885, 0.1524, 0.5093], [0.0325, 0.0498, 0.0674, 0.0136]),
    ],
    // Optical depth 0.1.
    [
        ([1.3708, 1.4445, 1.366, 0.8981], [0.162, 0.247, 0.3301, 0.0575]),
        ([1.3553, 1.423, 1.3394, 0.8916], [0.1583, 0.2408, 0.3213, 0.0564]),
        ([1.3337, 1.3931, 1.3027, 0.8826], [0.1535, 0.2329, 0.3099, 0.055]),
        ([1.2986, 1.3449, 1.244, 0.8682], [0.1463, 0.2211, 0.2931, 0.0528]),
        ([1.2426, 1.2688, 1.1525, 0.8453], [0.1361, 0.2044, 0.2695, 0.0497]),
        ([1.1498, 1.1448, 1.0073, 0.8075], [0.1216, 0.181, 0.2368, 0.0453]),
        ([0.9813, 0.9273, 0.7647, 0.7378], [0.1002, 0.147, 0.1903, 0.0389]),
        ([0.839, 0.7525, 0.5819, 0.6764], [0.0851, 0.1235, 0.1589, 0.0344]),
        ([0.622, 0.5038, 0.3442, 0.5745], [0.0649, 0.0927, 0.119, 0.0283]),
        ([0.292, 0.1804, 0.0891, 0.3796], [0.0364, 0.0512, 0.0665, 0.0185]),
    ],
    // Optical depth 0.2.
    [
        ([1.2665, 1.3158, 1.2266, 0.8483], [0.2506, 0.3534, 0.4393, 0.0997]),
        ([1.2458, 1.2884, 1.1944, 0.8391], [0.2443, 0.3435, 0.4258, 0.0976]),
        ([1.2173, 1.2509, 1.1505, 0.8264], [0.236, 0.3306, 0.4082, 0.0949]),
        ([1.1713, 1.1908, 1.0811, 0.8059], [0.2234, 0.3111, 0.382, 0.0907]),
        ([1.099, 1.0977, 0.9753, 0.7736], [0.2053, 0.2834, 0.345, 0.0847]),
        ([0.9823, 0.9508, 0.8134, 0.7206], [0.1795, 0.2442, 0.2939, 0.0761]),
        ([0.7807, 0.7084, 0.5608, 0.6252], [0.1415, 0.1881, 0.2229, 0.0633]),
        ([0.6218, 0.5288, 0.3878, 0.5442], [0.1153, 0.1507, 0.1776, 0.0542]),
        ([0.4016, 0.3013, 0.1908, 0.4178], [0.0818, 0.1049, 0.1244, 0.0421]),
        ([0.1311, 0.0708, 0.0306, 0.2112], [0.0397, 0.0511, 0.0636, 0.0241]),
    ],
    // Optical depth 0.4.
    [
        ([1.0812, 1.0919, 0.9891, 0.7568], [0.4051, 0.5346, 0.6207, 0.1759]),
        ([1.0529, 1.0566, 0.9501, 0.7432], [0.3931, 0.5168, 0.5976, 0.1716]),
        ([1.0143, 1.0087, 0.8977, 0.7245], [0.3771, 0.4932, 0.5673, 0.166]),
        ([0.9532, 0.9339, 0.8169, 0.6945], [0.3529, 0.4577, 0.5222, 0.1573]),
        ([0.86, 0.8221, 0.6988, 0.648], [0.318, 0.4072, 0.4589, 0.1448]),
        ([0.7173, 0.6565, 0.5307, 0.574], [0.2684, 0.3367, 0.3731, 0.1266]),
        ([0.4946, 0.414, 0.3021, 0.449], [0.1974, 0.2398, 0.2603, 0.0998]),
        ([0.3419, 0.2619, 0.1727, 0.3524], [0.1511, 0.1795, 0.1939, 0.0813]),
        ([0.1679, 0.1084, 0.0589, 0.2212], [0.0965, 0.1126, 0.1241, 0.0576]),
        ([0.0266, 0.0111, 0.0037, 0.0656], [0.0387, 0.047, 0.0567, 0.027]),
    ],
];

/// Irradiance under a clear sky.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClearSky {
    /// Irradiance from the sun's disc alone on a plane that faces the sun, W·m⁻²·nm⁻¹ per band.
    pub direct_normal: Spectrum,
    /// Irradiance from the sky alone on a horizontal plane, W·m⁻²·nm⁻¹ per band.
    pub diffuse_horizontal: Spectrum,
}

/// Returns the aerosol optical depth at 500 nm for a turbidity ≥ 1.
pub fn optical_depth(turbidity: f64) -> f64 {
    0.10 * ((turbidity.max(1.0) - 1.0) / 2.0).powf(1.303)
}

/// Returns the clear-sky irradiance for the sun's zenith angle (degrees, 0 to 90) and an aerosol optical depth at 500
/// nm (0 to 0.8).
///
/// Within the table, 0.05 to 0.4 and up to 85°, this is SPCTRL2. Outside it is an extrapolation that stays positive and
/// does not exceed the extraterrestrial beam.
pub fn clear_sky(zenith_deg: f64, optical_depth: f64) -> ClearSky {
    let zenith = zenith_deg.clamp(0.0, 90.0);
    let mass = air_mass(zenith);
    let (z, along_mass) = bracket(&ZENITHS_DEG.map(air_mass), mass);
    let (_, along_log_mass) = bracket(&ZENITHS_DEG.map(|z| air_mass(z).ln()), mass.ln());
    // Below the lowest sun of the table the fraction is held constant: extrapolating its slope would soon give negative
    // values.
    let along_log_mass = along_log_mass.min(1.0);
    let (d, along_depth) = bracket(&DEPTHS, optical_depth);
    let share_axis = |tau: f64| (tau + 0.05).ln();
    let (_, along_log_depth) = bracket(&DEPTHS.map(share_axis), share_axis(optical_depth));
    let mut direct = [0.0; 4];
    let mut diffuse = [0.0; 4];
    for band in 0..4 {
        let log_beam = |d: usize, z: usize| TABLE[d][z].0[band].ln();
        let share = |d: usize, z: usize| {
            let (beam, sky) = TABLE[d][z];
            sky[band] * air_mass(ZENITHS_DEG[z]) / (OUTSIDE[band] - beam[band])
        };
        let beam = bilinear(log_beam, d, z, along_depth, along_mass).exp();
        direct[band] = beam.to_f32();
        let share = bilinear(share, d, z, along_log_depth, along_log_mass);
        diffuse[band] = (share * (OUTSIDE[band] - beam) / mass).to_f32();
    }
    ClearSky { direct_normal: direct.into(), diffuse_horizontal: diffuse.into() }
}

/// Returns the relative optical air mass. Source: Kasten & Young 1989, "Revised optical air mass tables and
/// approximation formula".
fn air_mass(zenith_deg: f64) -> f64 {
    1.0 / (zenith_deg.to_radians().cos() + 0.50572 * (96.07995 - zenith_deg).powf(-1.6364))
}

/// Returns the lower node of the cell that contains `x` and the position within the cell; below 0 or above 1 outside
/// the nodes.
fn bracket(nodes: &[f64], x: f64) -> (usize, f64) {
    let cell = nodes[1..nodes.len() - 1].partition_point(|&n| n <= x);
    (cell, (x - nodes[cell]) / (nodes[cell + 1] - nodes[cell]))
}

fn bilinear(f: impl Fn(usize, usize) -> f64, i: usize, j: usize, s: f64, t: f64) -> f64 {
    let along = |i: usize| f(i, j) * (1.0 - t) + f(i, j + 1) * t;
    along(i) * (1.0 - s) + along(i + 1) * s
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_a_node_the_table_stands() {
        for (d, &depth) in DEPTHS.iter().enumerate() {
            for (z, &zenith) in ZENITHS_DEG.iter().enumerate() {
                let sky = clear_sky(zenith, depth);
                let (direct, diffuse) = TABLE[d][z];
                for band in 0..4 {
                    let near = |got: f32, want: f64| assert!((f64::from(got) / want - 1.0).abs() < 1e-5);
                    near(sky.direct_normal.to_array()[band], direct[band]);
                    near(sky.diffuse_horizontal.to_array()[band], diffuse[band]);
                }
            }
        }
    }

    /// Rationale: an interpolated table has no reference between its nodes, but a node that is left out has one.
    /// Expected: every inner node is predicted from its neighbours in zenith within 5 % in every band, although that
    /// gap is twice as wide as any real one. Source: the table.
    #[test]
    fn a_zenith_left_out_is_predicted_by_its_neighbours() {
        for row in &TABLE {
            for z in 1..ZENITHS_DEG.len() - 1 {
                let mass = |z: usize| air_mass(ZENITHS_DEG[z]);
                let t = (mass(z) - mass(z - 1)) / (mass(z + 1) - mass(z - 1));
                let s = (mass(z) / mass(z - 1)).ln() / (mass(z + 1) / mass(z - 1)).ln();
                for (band, outside) in OUTSIDE.into_iter().enumerate() {
                    let blend = |f: &dyn Fn(usize) -> f64, t: f64| f(z - 1) * (1.0 - t) + f(z + 1) * t;
                    let beam = blend(&|z| row[z].0[band].ln(), t).exp();
                    let share = blend(&|z| row[z].1[band] * mass(z) / (outside - row[z].0[band]), s);
                    let sky = share * (outside - beam) / mass(z);
                    assert!((beam / row[z].0[band] - 1.0).abs() < 0.05, "{z} {band} {beam} {}", row[z].0[band]);
                    assert!((sky / row[z].1[band] - 1.0).abs() < 0.05, "{z} {band} {sky} {}", row[z].1[band]);
                }
            }
        }
    }

    #[test]
    fn beyond_the_table_light_stays_positive_and_below_the_beam_outside() {
        for depth in [0.0, 0.02, 0.3, 0.6, 0.8] {
            for zenith in [0.0_f64, 10.0, 65.0, 84.0, 86.0, 88.0, 90.0] {
                let sky = clear_sky(zenith, depth);
                let bands = sky.direct_normal.to_array().into_iter().zip(sky.diffuse_horizontal.to_array());
                for ((direct, diffuse), outside) in bands.zip(OUTSIDE) {
                    assert!(direct >= 0.0 && diffuse > 0.0, "{zenith} {depth}");
                    let down = f64::from(direct) / air_mass(zenith) + f64::from(diffuse);
                    assert!(down < outside / air_mass(zenith), "{zenith} {depth}");
                }
            }
        }
    }

    #[test]
    fn more_aerosol_dims_the_sun_and_whitens_the_sky() {
        let (clean, hazy) = (clear_sky(40.0, optical_depth(2.0)), clear_sky(40.0, optical_depth(7.0)));
        let ratio = |s: Spectrum, a: usize, b: usize| s.to_array()[a] / s.to_array()[b];
        assert!(clean.direct_normal.mean() > hazy.direct_normal.mean());
        assert!(ratio(clean.diffuse_horizontal, 2, 0) > ratio(hazy.diffuse_horizontal, 2, 0));
        assert!((optical_depth(3.0) - 0.10).abs() < 1e-9 && (optical_depth(6.0) - 0.33).abs() < 0.005);
    }
}
