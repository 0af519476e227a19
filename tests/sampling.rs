//! Warps and tables sample according to their densities.
//!
//! Rationale: every integral of the renderer relies on pairs of a sample and its density; a mismatch gives a wrong
//! image that looks plausible. Expected: χ² tests pass for each pair, densities integrate to one, and no sample leaves
//! its domain, even at the ends of [0, 1). Source: the warps' references, closed-form areas.

use crate::common::chi2::{check_counts, check_sphere, check_square, upper_gamma};
use furrow_base::math::Vec3;
use furrow_base::sampling::distribution::{Distribution1D, Distribution2D, pick};
use furrow_base::sampling::{Purpose, Stream, warp};

const N: usize = 100_000;
const ENDS: [f32; 4] = [0.0, 1e-38, 0.5, 1.0 - f32::EPSILON / 2.0];

#[test]
fn the_test_itself_knows_the_chi_square_distribution() {
    // Critical values from standard tables: degrees of freedom, and χ² exceeded with probability 0.05 and 0.001.
    for (k, x05, x001) in [(1.0, 3.841, 10.828), (10.0, 18.307, 29.588), (100.0, 124.342, 149.449)] {
        // One unit of the last printed digit changes the probability by less than 3e-5 and 1e-6.
        let (p05, p001) = (upper_gamma(k / 2.0, x05 / 2.0), upper_gamma(k / 2.0, x001 / 2.0));
        assert!((p05 - 0.05).abs() < 3e-5 && (p001 - 0.001).abs() < 1e-6, "{k} {p05} {p001}");
    }
}

#[test]
#[should_panic(expected = "χ²")]
fn the_test_itself_finds_a_wrong_density() {
    let tilted = |d: Vec3| if d.z > 0.0 { (0.9 + 0.2 * d.z) * warp::UNIFORM_HEMISPHERE_PDF } else { 0.0 };
    check_sphere("wrong", N, |u| Some(warp::uniform_hemisphere([u[0], u[1]])), tilted);
}

#[test]
fn directions_follow_their_densities() {
    let upper = |d: Vec3, pdf: f32| if d.z > 0.0 { pdf } else { 0.0 };
    check_sphere(
        "cosine hemisphere",
        N,
        |u| Some(warp::cosine_hemisphere([u[0], u[1]])),
        |d| warp::cosine_hemisphere_pdf(d.z),
    );
    check_sphere(
        "uniform hemisphere",
        N,
        |u| Some(warp::uniform_hemisphere([u[0], u[1]])),
        |d| upper(d, warp::UNIFORM_HEMISPHERE_PDF),
    );
    check_sphere("sphere", N, |u| Some(warp::uniform_sphere([u[0], u[1]])), |_| warp::UNIFORM_SPHERE_PDF);
    for angle in [1.2_f32, 0.1, 4.65e-3] {
        let one_minus_cos = 2.0 * (angle / 2.0).sin().powi(2);
        let pdf = |d: Vec3| {
            let inside = d.z > 0.0 && d.x.hypot(d.y) < angle.sin();
            if inside { warp::uniform_cone_pdf(one_minus_cos) } else { 0.0 }
        };
        check_sphere("cone", N, |u| Some(warp::uniform_cone([u[0], u[1]], one_minus_cos)), pdf);
    }
}

#[test]
fn points_follow_their_densities() {
    let disc = |p: [f32; 2]| if p[0].hypot(p[1]) < 1.0 { warp::DISC_PDF } else { 0.0 };
    check_square("disc", N, [-1.0, 1.0], |u| warp::disc(u).to_array(), disc);
    let triangle = |b: [f32; 2]| if b[0] + b[1] < 1.0 { 2.0 } else { 0.0 };
    check_square("triangle", N, [0.0, 1.0], warp::triangle, triangle);
}

#[test]
fn no_draw_leaves_its_domain() {
    for u in ENDS.iter().flat_map(|&x| ENDS.map(|y| [x, y])) {
        assert!(warp::disc(u).length() <= 1.0 + 1e-6, "{u:?}");
        for d in [warp::cosine_hemisphere(u), warp::uniform_hemisphere(u), warp::uniform_cone(u, 1e-5)] {
            assert!(d.z >= 0.0 && (d.length() - 1.0).abs() < 1e-6, "{u:?} {d}");
        }
        assert!((warp::uniform_sphere(u).length() - 1.0).abs() < 1e-6, "{u:?}");
        let [b1, b2] = warp::triangle(u);
        assert!(b1 >= 0.0 && b2 >= 0.0 && b1 + b2 <= 1.0 + 1e-6, "{u:?} {b1} {b2}");
    }
}

#[test]
fn a_table_draws_each_cell_by_its_weight() {
    let weights = [0.0, 3.0, 1.0, 0.0, 0.0, 2.5, 1e-3, 0.0];
    let table = Distribution1D::new(&weights).unwrap();
    assert!((table.integral() - 6.501 / 8.0).abs() < 1e-6);
    let mut stream = Stream::of(1, 0, Purpose::Test, 0);
    let mut observed = [0.0; 8];
    for u in (0..N).map(|_| stream.uniform32()).chain(ENDS) {
        let (x, pdf) = table.sample(u);
        assert!(pdf > 0.0 && (0.0..1.0).contains(&x), "{u}");
        assert_eq!(pdf, table.pdf(x), "{u}");
        observed[(x * 8.0) as usize] += 1.0;
    }
    let expected = weights.map(|w| f64::from(w) / 6.501 * (N + ENDS.len()) as f64);
    check_counts("table", &observed, &expected);
    assert!(Distribution1D::new(&[0.0, 0.0]).is_none());
    assert!(Distribution1D::new(&[1.0, -1.0]).is_none());
    assert!(Distribution1D::new(&[1.0, f32::NAN]).is_none());
    assert!(Distribution1D::new(&[]).is_none());
}

#[test]
fn a_table_of_tables_follows_its_density() {
    let (width, height) = (10, 5);
    let weights: Vec<f32> =
        (0..width * height).map(|i| if i / width == 2 || i % 7 == 0 { 0.0 } else { (i % 13) as f32 + 0.5 }).collect();
    let table = Distribution2D::new(&weights, width).unwrap();
    check_square("table of tables", N, [0.0, 1.0], |u| table.sample(u).0, |p| table.pdf(p));
    for u in ENDS.iter().flat_map(|&x| ENDS.map(|y| [x, y])) {
        let (p, pdf) = table.sample(u);
        assert!(pdf > 0.0 && p.iter().all(|v| (0.0..1.0).contains(v)), "{u:?}");
        assert!((table.pdf(p) / pdf - 1.0).abs() < 1e-6, "{u:?}");
    }
    assert!(Distribution2D::new(&[0.0; 6], 3).is_none());
    assert!(Distribution2D::new(&[1.0; 5], 3).is_none());
    assert!(Distribution2D::new(&[], 0).is_none());
}

#[test]
fn a_table_of_a_million_cells_keeps_its_small_ones() {
    let weights: Vec<f32> = (0..1024 * 1024).map(|i| if i % 1024 == 512 { 1e4 } else { 1.0 }).collect();
    let table = Distribution2D::new(&weights, 1024).unwrap();
    let mut stream = Stream::of(1, 0, Purpose::Test, 0);
    // ∫ 1 dA by importance sampling: the mean of 1/pdf, if every cell is sampled with its density.
    let mean = (0..N).map(|_| 1.0 / f64::from(table.sample([stream.uniform32(), stream.uniform32()]).1)).sum::<f64>()
        / N as f64;
    // E[1/pdf²] = ∫ 1/pdf ≈ 1 · (10.77/1): the standard error is √(9.8/N).
    assert!((mean - 1.0).abs() < 4.0 * (10.0 / N as f64).sqrt(), "{mean}");
}

#[test]
fn one_of_several_is_picked_by_weight_and_leaves_a_fresh_number() {
    let weights = [0.0, 1.0, 5.0, -2.0, 0.5];
    let mut stream = Stream::of(1, 0, Purpose::Test, 0);
    let mut observed = [0.0; 5];
    let mut left = [0.0; 10];
    for _ in 0..N {
        let (i, p, u) = pick(&weights, stream.uniform32()).unwrap();
        assert!((p - weights[i] / 6.5).abs() < 1e-6);
        observed[i] += 1.0;
        left[(u * 10.0) as usize] += 1.0;
    }
    check_counts("pick", &observed, &weights.map(|w| f64::from(w.max(0.0)) / 6.5 * N as f64));
    check_counts("left of pick", &left, &[N as f64 / 10.0; 10]);
    for u in ENDS {
        let (i, p, _) = pick(&weights, u).unwrap();
        assert!(weights[i] > 0.0 && p > 0.0);
    }
    assert!(pick(&[0.0, -1.0], 0.5).is_none());
    assert!(pick(&[], 0.5).is_none());
}
