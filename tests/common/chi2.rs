//! Pearson's χ² test of whether samples follow the density stated for them.
//!
//! Samples are counted in cells and compared with the integral of the density over each cell; cells with an expected
//! count below five are pooled. The cells adapt to the samples: rings about their mean direction, split at quantiles of
//! a pilot run, so that the sun's disc is resolved as well as a whole sphere.
//!
//! Densities are integrated by the midpoint rule; each cell is split in four until the value no longer changes, so
//! densities may be narrow or discontinuous. Seeds are fixed, so a test always passes or always fails.
//!
//! Method: conventions of pbrt, Mitsuba and nori. All tests of the project together have a false-alarm rate of 10⁻⁴
//! (Šidák 1967), so a change to a sampler, which changes every random number, rarely fails without a fault.

use furrow_base::math::{Frame, Vec3};
use furrow_base::sampling::{Purpose, Stream};
use std::f64::consts::{PI, TAU};

/// Upper bound on the number of tests in the project that share the significance level.
const TESTS: f64 = 1000.0;
/// Probability that a correct project fails any of these tests.
const ALPHA: f64 = 1e-4;
const SEEDS: [u64; 3] = [1, 2, 3];
const RINGS: usize = 16;
const SECTORS: usize = 16;
const PILOT: usize = 4096;

/// Compares `n` directions, which `sample` maps from three numbers in [0, 1), with the density `pdf` per solid angle,
/// for several seeds. `None` (no direction) counts as a separate outcome with probability 1 − ∫ pdf. Panics with the
/// worst cells.
pub(crate) fn check_sphere(
    name: &str,
    n: usize,
    mut sample: impl FnMut([f32; 3]) -> Option<Vec3>,
    pdf: impl Fn(Vec3) -> f32,
) {
    let mut draw = |stream: &mut Stream| {
        let u = [stream.uniform32(), stream.uniform32(), stream.uniform32()];
        let dir = sample(u);
        if let Some(dir) = dir {
            assert!((dir.length() - 1.0).abs() < 1e-4, "{name}: {dir} of {u:?} is not a unit vector");
        }
        dir
    };
    let mut stream = Stream::of(99, 0, Purpose::Test, 0);
    let pilot: Vec<Vec3> = (0..PILOT).filter_map(|_| draw(&mut stream)).collect();
    assert!(!pilot.is_empty(), "{name}: no sample has a direction");
    let frame = Frame::about(pilot.iter().sum::<Vec3>().try_normalize().unwrap_or(Vec3::Z));
    let rings = Rings::of(&pilot, &frame);

    let direction = |t: f64, phi: f64| {
        let sin = (t * (2.0 - t)).max(0.0).sqrt();
        let d = [sin * phi.cos(), sin * phi.sin(), 1.0 - t];
        let world =
            |i: usize| f64::from(frame.x[i]) * d[0] + f64::from(frame.y[i]) * d[1] + f64::from(frame.z[i]) * d[2];
        Vec3::new(world(0) as f32, world(1) as f32, world(2) as f32)
    };
    let density = |t: f64, phi: f64| {
        let p = f64::from(pdf(direction(t, phi)));
        assert!(p.is_finite() && p >= 0.0, "{name}: the density is {p} at {}", direction(t, phi));
        p
    };
    let probability: Vec<f64> = rings
        .ends
        .windows(2)
        .flat_map(|ring| (0..SECTORS).map(|k| (ring[0], ring[1], k)))
        .map(|(t0, t1, k)| {
            let phi = |k: usize| TAU * k as f64 / SECTORS as f64 - PI;
            integrate(&density, [t0, t1], [phi(k), phi(k + 1)])
        })
        .collect();
    let total: f64 = probability.iter().sum();
    assert!(total < 1.003, "{name}: the density integrates to {total}");

    for seed in SEEDS {
        let mut stream = Stream::of(seed, 0, Purpose::Test, 1);
        let mut observed = vec![0.0; probability.len() + 1];
        for _ in 0..n {
            let cell = draw(&mut stream).map_or(probability.len(), |dir| rings.cell(dir, &frame));
            observed[cell] += 1.0;
        }
        let absorbed = (1.0 - total).max(0.0);
        if observed[probability.len()] == 0.0 {
            assert!(absorbed < 0.003, "{name}: the density integrates to {total}, but every sample has a direction");
        }
        let expected: Vec<f64> = probability.iter().map(|p| p * n as f64).chain([absorbed * n as f64]).collect();
        check_counts(&format!("{name}, seed {seed}"), &observed, &expected);
    }
}

/// Compares `n` points, which `sample` places in the square `lo..hi`, with the density `pdf` per area.
pub(crate) fn check_square(
    name: &str,
    n: usize,
    [lo, hi]: [f64; 2],
    sample: impl Fn([f32; 2]) -> [f32; 2],
    pdf: impl Fn([f32; 2]) -> f32,
) {
    const SIDE: usize = 20;
    let at = |i: usize| lo + (hi - lo) * i as f64 / SIDE as f64;
    let density = |x: f64, y: f64| f64::from(pdf([x as f32, y as f32]));
    let probability: Vec<f64> = (0..SIDE * SIDE)
        .map(|c| integrate(&density, [at(c % SIDE), at(c % SIDE + 1)], [at(c / SIDE), at(c / SIDE + 1)]))
        .collect();
    let total: f64 = probability.iter().sum();
    assert!((total - 1.0).abs() < 0.003, "{name}: the density integrates to {total}");
    for seed in SEEDS {
        let mut stream = Stream::of(seed, 0, Purpose::Test, 2);
        let mut observed = vec![0.0; SIDE * SIDE];
        for _ in 0..n {
            let p = sample([stream.uniform32(), stream.uniform32()]);
            let [x, y] = p.map(|v| {
                let cell = (f64::from(v) - lo) / (hi - lo) * SIDE as f64;
                assert!((0.0..=SIDE as f64).contains(&cell), "{name}: {p:?} is outside the square");
                (cell as usize).min(SIDE - 1)
            });
            observed[y * SIDE + x] += 1.0;
        }
        let expected: Vec<f64> = probability.iter().map(|p| p * n as f64).collect();
        check_counts(&format!("{name}, seed {seed}"), &observed, &expected);
    }
}

/// Compares observed counts with expected counts that have the same sum.
pub(crate) fn check_counts(name: &str, observed: &[f64], expected: &[f64]) {
    let mut cells = Vec::new();
    let mut pool = (0.0, 0.0);
    for (&o, &e) in observed.iter().zip(expected) {
        if e < 5.0 {
            pool = (pool.0 + o, pool.1 + e);
        } else {
            cells.push((o, e));
        }
    }
    match cells.iter_mut().min_by(|a, b| a.1.total_cmp(&b.1)) {
        // A pool with an expected count below five joins the smallest cell.
        Some(least) if pool.1 < 5.0 => *least = (least.0 + pool.0, least.1 + pool.1),
        _ => cells.push(pool),
    }
    assert!(cells.len() > 1, "{name}: a single cell tests nothing");
    let statistic: f64 = cells.iter().map(|(o, e)| (o - e).powi(2) / e).sum();
    let p = upper_gamma((cells.len() - 1) as f64 / 2.0, statistic / 2.0);
    let threshold = 1.0 - (1.0 - ALPHA).powf(1.0 / TESTS);
    if p < threshold {
        cells.sort_by(|a, b| ((b.0 - b.1).powi(2) / b.1).total_cmp(&((a.0 - a.1).powi(2) / a.1)));
        panic!(
            "{name}: χ² {statistic:.1} in {} cells has p = {p:.1e}, below {threshold:.1e}; worst cells (counted, expected): {:?}",
            cells.len(),
            &cells[..cells.len().min(8)]
        );
    }
}

/// Cells in polar coordinates (t = 1 − cos θ, φ) about the mean direction.
struct Rings {
    ends: Vec<f64>,
}

impl Rings {
    fn of(pilot: &[Vec3], frame: &Frame) -> Self {
        let mut t: Vec<f64> = pilot.iter().map(|&d| polar(d, frame).0).collect();
        t.sort_by(f64::total_cmp);
        let mut ends = vec![0.0];
        ends.extend((1..RINGS).map(|k| t[k * t.len() / RINGS]));
        // Rings of growing width beyond the farthest pilot sample; the first catches samples just outside.
        let mut end = t[t.len() - 1] * 1.05;
        while end < 2.0 {
            ends.push(end);
            end *= 3.0;
        }
        ends.push(2.0);
        ends.dedup_by(|b, a| *b - *a < 1e-9);
        Self { ends }
    }

    fn cell(&self, dir: Vec3, frame: &Frame) -> usize {
        let (t, phi) = polar(dir, frame);
        let ring = self.ends[1..self.ends.len() - 1].partition_point(|&end| end <= t);
        let sector = ((phi + PI) / TAU * SECTORS as f64) as usize;
        ring * SECTORS + sector.min(SECTORS - 1)
    }
}

/// Returns 1 − cos θ and φ, without cancellation for small θ.
fn polar(dir: Vec3, frame: &Frame) -> (f64, f64) {
    let along = |axis: Vec3| (0..3).map(|i| f64::from(axis[i]) * f64::from(dir[i])).sum::<f64>();
    let (x, y, z) = (along(frame.x), along(frame.y), along(frame.z));
    let half = 0.5 * x.hypot(y).atan2(z);
    (2.0 * half.sin().powi(2), y.atan2(x))
}

/// Integrates `f` over a rectangle.
fn integrate(f: &impl Fn(f64, f64) -> f64, x: [f64; 2], y: [f64; 2]) -> f64 {
    fn midpoint(f: &impl Fn(f64, f64) -> f64, x: [f64; 2], y: [f64; 2]) -> f64 {
        const SIDE: usize = 4;
        let step = [(x[1] - x[0]) / SIDE as f64, (y[1] - y[0]) / SIDE as f64];
        let sum: f64 = (0..SIDE * SIDE)
            .map(|k| f(x[0] + ((k % SIDE) as f64 + 0.5) * step[0], y[0] + ((k / SIDE) as f64 + 0.5) * step[1]))
            .sum();
        sum * step[0] * step[1]
    }
    fn refine(f: &impl Fn(f64, f64) -> f64, x: [f64; 2], y: [f64; 2], coarse: f64, depth: u32) -> f64 {
        let (mx, my) = (f64::midpoint(x[0], x[1]), f64::midpoint(y[0], y[1]));
        let parts =
            [([x[0], mx], [y[0], my]), ([mx, x[1]], [y[0], my]), ([x[0], mx], [my, y[1]]), ([mx, x[1]], [my, y[1]])];
        let fine = parts.map(|(x, y)| midpoint(f, x, y));
        let sum: f64 = fine.iter().sum();
        // Refines at least twice, so that features between the points of one level are found.
        if depth >= 2 && ((sum - coarse).abs() < 1e-6 + 1e-4 * sum.abs() || depth >= 8) {
            return sum;
        }
        parts.iter().zip(fine).map(|(&(x, y), fine)| refine(f, x, y, fine, depth + 1)).sum()
    }
    refine(f, x, y, midpoint(f, x, y), 0)
}

/// Regularised upper incomplete gamma function Q(a, x): the probability that a χ² variable with 2a degrees of freedom
/// exceeds 2x. Uses the series for x < a + 1 and Lentz's continued fraction otherwise. Source: DLMF §8.7.1, §8.9.2.
pub(crate) fn upper_gamma(a: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 1.0;
    }
    let scale = (a * x.ln() - x - ln_gamma(a)).exp();
    if x < a + 1.0 {
        let (mut term, mut sum) = (1.0 / a, 1.0 / a);
        for k in 1..10_000 {
            term *= x / (a + k as f64);
            sum += term;
            if term < sum * 1e-15 {
                break;
            }
        }
        return 1.0 - scale * sum;
    }
    let mut b = x + 1.0 - a;
    let mut c = 1e300;
    let mut d = 1.0 / b;
    let mut fraction = d;
    for k in 1..10_000 {
        let k = k as f64;
        let an = -k * (k - a);
        b += 2.0;
        let guard = |v: f64| if v.abs() < 1e-300 { 1e-300 } else { v };
        d = 1.0 / guard(an * d + b);
        c = guard(b + an / c);
        fraction *= d * c;
        if (d * c - 1.0).abs() < 1e-15 {
            break;
        }
    }
    scale * fraction
}

/// ln Γ(a) for a > 0: recurrence up to 10, then Stirling's series. Source: DLMF §5.11.1.
fn ln_gamma(mut a: f64) -> f64 {
    let mut shift = 0.0;
    while a < 10.0 {
        shift -= a.ln();
        a += 1.0;
    }
    let r = 1.0 / (a * a);
    let series = (1.0 / 12.0 - r * (1.0 / 360.0 - r * (1.0 / 1260.0 - r / 1680.0))) / a;
    shift + (a - 0.5) * a.ln() - a + 0.5 * TAU.ln() + series
}
