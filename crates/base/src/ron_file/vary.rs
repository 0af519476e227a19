//! Numbers in a file that may be fixed, or a distribution sampled anew for every field.
//!
//! ```
//! use furrow_base::ron_file::{Positive, Vary};
//! let spacing: Vary<Positive<1000>> = ron::from_str("Normal(mean: 0.20, sd: 0.02, min: 0.1, max: 0.3)").unwrap();
//! let age: Vary<Positive<1000>> = ron::from_str("24").unwrap();
//! assert!(ron::from_str::<Vary<Positive<1000>>>("Uniform(-3, 2)").is_err());
//! ```

use super::bound::Bound;
use super::fault::{Fault, from_raw, inside, parse_in, whole};
use super::num::{DISTRIBUTIONS, Num, name_of, number};
use super::place::Step;
use super::suggest::choose;
use crate::math::ToFloat;
use crate::sampling::Stream;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de, ser};

/// Help for a number that may be sampled.
const DRAWN: &str =
    "write one number, or draw it for every field: Uniform(a, b), Normal(mean: a, sd: b), Choice([a, b])";

/// Distributions, as written in files.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub enum Distribution {
    /// Uniform between the two numbers. For whole numbers all values are equally likely, both ends included.
    Uniform(f64, f64),
    /// Normal, truncated to `min..=max`.
    Normal {
        /// Mean before truncation.
        mean: f64,
        /// Standard deviation before truncation.
        sd: f64,
        /// Smallest value.
        #[serde(default = "lowest")]
        min: f64,
        /// Largest value.
        #[serde(default = "highest")]
        max: f64,
    },
    /// Log-normal: `median · exp(sigma · z)`, truncated to `min..=max`.
    LogNormal {
        /// Median before truncation.
        median: f64,
        /// Standard deviation of the logarithm.
        sigma: f64,
        /// Smallest value.
        #[serde(default = "lowest")]
        min: f64,
        /// Largest value.
        #[serde(default = "highest")]
        max: f64,
    },
    /// One of several values with equal probability.
    Choice(Vec<f64>),
    /// One of several values, each with a weight.
    Weighted(Vec<(f64, f64)>),
}

/// Names that may occur inside a distribution.
pub const DISTRIBUTION_WORDS: [&str; 11] =
    ["Uniform", "Normal", "LogNormal", "Choice", "Weighted", "mean", "sd", "median", "sigma", "min", "max"];

const fn lowest() -> f64 {
    f64::MIN
}

const fn highest() -> f64 {
    f64::MAX
}

/// Bound of a standard deviation and of a weight.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Spread;

impl Bound for Spread {
    const MIN: f64 = 0.0;
    const MAX: f64 = f64::INFINITY;
    const WORDS: &'static str = "0 or above";
}

/// A number that is fixed or sampled from a distribution.
#[derive(Clone, Debug, PartialEq)]
pub enum Vary<B: Bound> {
    /// A constant.
    Fixed(Num<B>),
    /// A distribution to sample from.
    Drawn(Distribution),
}

impl<B: Bound> Vary<B> {
    /// Builds a constant.
    pub const fn fixed(x: f64) -> Self {
        Self::Fixed(Num::new(x))
    }

    /// Builds a uniform distribution over `lo..hi`.
    pub const fn uniform(lo: f64, hi: f64) -> Self {
        Self::Drawn(Distribution::Uniform(lo, hi))
    }

    /// Samples one value.
    pub fn draw(&self, stream: &mut Stream) -> f64 {
        let x = match self {
            Self::Fixed(x) => x.get(),
            // Every whole number between the ends, both included, has an interval of the same width.
            Self::Drawn(Distribution::Uniform(lo, hi)) if B::WHOLE => stream.range(*lo, hi + 1.0).floor().min(*hi),
            Self::Drawn(Distribution::Uniform(lo, hi)) => stream.range(*lo, *hi),
            Self::Drawn(Distribution::Normal { mean, sd, min, max }) => {
                cut::<B>(*min, *max, || mean + sd * stream.normal())
            }
            Self::Drawn(Distribution::LogNormal { median, sigma, min, max }) => {
                cut::<B>(*min, *max, || median * (sigma * stream.normal()).exp())
            }
            Self::Drawn(Distribution::Choice(of)) => of[stream.index(of.len())],
            Self::Drawn(Distribution::Weighted(of)) => {
                let mut left = stream.uniform() * of.iter().map(|(_, w)| w).sum::<f64>();
                let last = of.len() - 1;
                of.iter()
                    .position(|(_, w)| {
                        left -= w;
                        left < 0.0
                    })
                    .map_or(of[last].0, |i| of[i].0)
            }
        };
        if B::WHOLE { x.round() } else { x }
    }

    /// Samples one value in single precision.
    pub fn draw32(&self, stream: &mut Stream) -> f32 {
        self.draw(stream).to_f32()
    }

    /// Approximate range of the sampled values: the full range, or two standard deviations around the centre where the
    /// distribution is unbounded.
    pub fn usual(&self) -> (f64, f64) {
        let (lo, hi) = match self {
            Self::Fixed(x) => (x.get(), x.get()),
            Self::Drawn(Distribution::Uniform(lo, hi)) => (*lo, *hi),
            Self::Drawn(Distribution::Normal { mean, sd, min, max }) => {
                ((mean - 2.0 * sd).max(*min), (mean + 2.0 * sd).min(*max))
            }
            Self::Drawn(Distribution::LogNormal { median, sigma, min, max }) => {
                ((median * (-2.0 * sigma).exp()).max(*min), (median * (2.0 * sigma).exp()).min(*max))
            }
            Self::Drawn(Distribution::Choice(of)) => ends(of.iter().copied()),
            Self::Drawn(Distribution::Weighted(of)) => ends(of.iter().filter(|(_, w)| *w > 0.0).map(|(x, _)| *x)),
        };
        (lo.max(B::MIN), hi.min(B::MAX))
    }

    /// Largest value that is sampled. For an unbounded distribution: six standard deviations above the centre, exceeded
    /// with probability 10⁻⁹.
    pub fn largest(&self) -> f64 {
        let most = match self {
            Self::Drawn(Distribution::Normal { mean, sd, max, .. }) => (mean + 6.0 * sd).min(*max),
            Self::Drawn(Distribution::LogNormal { median, sigma, max, .. }) => (median * (6.0 * sigma).exp()).min(*max),
            _ => self.usual().1,
        };
        most.min(B::MAX)
    }

    /// Checks a distribution. The error holds the position in it, the message and the help.
    fn check(distribution: &Distribution) -> Result<(), PathError> {
        use Step::{Field, Item};
        let wrong = |at: &[Step<'static>], what: String, help: &str| Err((at.to_vec(), what, help.to_owned()));
        let within = |at: &[Step<'static>], name: &str, x: f64| {
            if B::holds(x) {
                Ok(())
            } else {
                wrong(
                    at,
                    format!("{name} {}", B::refuse(x)),
                    &format!("every value that may be drawn must be {}", B::words()),
                )
            }
        };
        let spread = |at: &[Step<'static>], name: &str, x: f64| {
            if Spread::holds(x) {
                Ok(())
            } else {
                wrong(at, format!("{name} {}", Spread::refuse(x)), "write 0 or a number above it")
            }
        };
        let bell = |name: &'static str, centre: f64, min: f64, max: f64| {
            if min.is_nan() || max.is_nan() || min >= max {
                return wrong(
                    &[Field("min")],
                    format!("min {min} is not below max {max}"),
                    "min is the smallest value that may be drawn, max the largest",
                );
            }
            if B::WHOLE && min.ceil() > max.floor() {
                return wrong(
                    &[Field("min")],
                    format!("there is no whole number between min {min} and max {max}"),
                    "write bounds with a whole number in between",
                );
            }
            if (min..=max).contains(&centre) {
                return Ok(());
            }
            wrong(&[Field(name)], format!("{name} {centre} is outside min..max"), "move it between them, or widen them")
        };
        match distribution {
            Distribution::Uniform(lo, hi) => {
                within(&[Item(0)], "the lower end", *lo)?;
                within(&[Item(1)], "the upper end", *hi)?;
                if lo <= hi {
                    return Ok(());
                }
                let help = format!("swap them: Uniform({hi}, {lo})");
                wrong(&[], format!("the lower end {lo} is above the upper end {hi}"), &help)
            }
            Distribution::Normal { mean, sd, min, max } => {
                within(&[Field("mean")], "mean", *mean)?;
                spread(&[Field("sd")], "sd", *sd)?;
                let widest = B::MAX - B::MIN;
                if *sd > widest {
                    return wrong(
                        &[Field("sd")],
                        format!("sd {sd} is larger than the range of possible values, {widest}"),
                        "write a smaller one",
                    );
                }
                bell("mean", *mean, *min, *max)
            }
            Distribution::LogNormal { median, sigma, min, max } => {
                within(&[Field("median")], "median", *median)?;
                if *median <= 0.0 {
                    return wrong(
                        &[Field("median")],
                        format!("median {median} is out of range: it must be above 0"),
                        "all values of a LogNormal are above 0",
                    );
                }
                spread(&[Field("sigma")], "sigma", *sigma)?;
                bell("median", *median, *min, *max)
            }
            Distribution::Choice(of) => {
                if of.is_empty() {
                    return wrong(&[], NOTHING.into(), "name at least one value: Choice([1, 2])");
                }
                of.iter().enumerate().try_for_each(|(i, x)| within(&[Item(0), Item(i)], "the choice", *x))
            }
            Distribution::Weighted(of) => {
                for (i, (x, weight)) in of.iter().enumerate() {
                    within(&[Item(0), Item(i), Item(0)], "the choice", *x)?;
                    spread(&[Item(0), Item(i), Item(1)], "the weight", *weight)?;
                }
                if of.iter().any(|(_, w)| *w > 0.0) {
                    return Ok(());
                }
                let help = "give one a weight above 0: Weighted([(value, weight), …])";
                wrong(
                    &[],
                    if of.is_empty() {
                        NOTHING.into()
                    } else {
                        "no weight is above 0: there is nothing to draw".into()
                    },
                    help,
                )
            }
        }
    }
}

/// Message for an empty choice.
const NOTHING: &str = "an empty choice: there is nothing to draw";

/// Position in a distribution, message and help.
type PathError = (Vec<Step<'static>>, String, String);

/// Rejection-samples until the value is within both ranges, which preserves the shape between the cuts. [`Vary::check`]
/// guarantees that the centre is inside, so a hundred consecutive rejections happen only at the far end of a bound,
/// where the value is clamped.
fn cut<B: Bound>(min: f64, max: f64, mut draw: impl FnMut() -> f64) -> f64 {
    for _ in 0..100 {
        let x = draw();
        let value = if B::WHOLE { x.round() } else { x };
        if [x, value].iter().all(|x| (min..=max).contains(x)) && B::holds(value) {
            return x;
        }
    }
    let (min, max) = if B::WHOLE { (min.ceil(), max.floor()) } else { (min, max) };
    draw().clamp(min, max).clamp(B::MIN, B::MAX)
}

impl<'de, B: Bound> Deserialize<'de> for Vary<B> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        from_raw(deserializer, |raw| {
            let Some(name) = name_of(raw) else {
                return match listed(raw) {
                    Some(fault) => Err(fault),
                    None => number::<B>(raw, DRAWN).map(Self::fixed),
                };
            };
            if let Some(fault) = unnamed(raw, name) {
                return Err(fault);
            }
            if !DISTRIBUTIONS.contains(&name) {
                let start = raw.len() - raw.trim_start().len();
                let help =
                    format!("write a number or a distribution; {}", choose("distributions", &DISTRIBUTIONS, name));
                let unknown = whole(raw, format!("`{name}` is neither a number nor a distribution"), help);
                return Err(Fault { end: start + name.len(), ..unknown });
            }
            let distribution: Distribution = parse_in(raw)?;
            Self::check(&distribution).map_err(|(at, message, help)| inside(raw, &at, message, help))?;
            Ok(Self::Drawn(distribution))
        })
    }
}

/// Minimum and maximum of some numbers.
fn ends(of: impl Iterator<Item = f64>) -> (f64, f64) {
    of.fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), x| (lo.min(x), hi.max(x)))
}

/// Splits comma-separated numbers; `None` if the text contains anything else.
fn numbers(inside: &str) -> Option<Vec<&str>> {
    inside.split(',').map(str::trim).filter(|n| !n.is_empty()).map(|n| n.parse::<f64>().ok().map(|_| n)).collect()
}

/// Help for a list such as `[100, 150]`, or for `(100, 150)`, in place of a number.
fn listed(raw: &str) -> Option<Fault> {
    let raw_list = raw.trim();
    let brackets = [('[', ']'), ('(', ')')];
    let inside = brackets.iter().find_map(|(open, close)| raw_list.strip_prefix(*open)?.strip_suffix(*close))?;
    let help = match numbers(inside)?.as_slice() {
        [a, b] => format!("write Uniform({a}, {b}) for anything between, or Choice([{a}, {b}]) for one of the two"),
        _ => format!("write Choice([{}]) for one of them", inside.trim()),
    };
    Some(whole(raw, "this is a list, but a number or a distribution belongs here", help))
}

/// Help for `Normal(150, 20)`, whose numbers need names.
fn unnamed(raw: &str, name: &str) -> Option<Fault> {
    let names = match name {
        "Normal" => ["mean", "sd", "min", "max"],
        "LogNormal" => ["median", "sigma", "min", "max"],
        _ => return None,
    };
    let inside = raw.trim().strip_prefix(name)?.trim().strip_prefix('(')?.strip_suffix(')')?;
    let given = numbers(inside).filter(|of| (1..=names.len()).contains(&of.len()))?;
    let fields = names.iter().zip(given.iter().copied().chain(["…"])).take(given.len().max(2));
    let fields: Vec<String> = fields.map(|(name, value)| format!("{name}: {value}")).collect();
    Some(whole(raw, format!("the numbers of {name} need names"), format!("write {name}({})", fields.join(", "))))
}

impl<B: Bound> Serialize for Vary<B> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Fixed(x) => x.serialize(serializer),
            Self::Drawn(Distribution::Normal { mean, sd, min, max }) => {
                bell(serializer, 1, "Normal", ("mean", *mean), ("sd", *sd), *min, *max)
            }
            Self::Drawn(Distribution::LogNormal { median, sigma, min, max }) => {
                bell(serializer, 2, "LogNormal", ("median", *median), ("sigma", *sigma), *min, *max)
            }
            Self::Drawn(distribution) => distribution.serialize(serializer),
        }
    }
}

/// Serializes a normal or log-normal distribution without the bounds that were not given.
fn bell<S: Serializer>(
    s: S,
    index: u32,
    name: &'static str,
    centre: (&'static str, f64),
    spread: (&'static str, f64),
    min: f64,
    max: f64,
) -> Result<S::Ok, S::Error> {
    use ser::SerializeStructVariant;
    let ends = usize::from(min != f64::MIN) + usize::from(max != f64::MAX);
    let mut v = s.serialize_struct_variant("Distribution", index, name, 2 + ends)?;
    v.serialize_field(centre.0, &centre.1)?;
    v.serialize_field(spread.0, &spread.1)?;
    if min != f64::MIN {
        v.serialize_field("min", &min)?;
    }
    if max != f64::MAX {
        v.serialize_field("max", &max)?;
    }
    v.end()
}

/// A fixed value, or one of several with equal probability: `"a.png"` or `Choice(["a.png", "b.png"])`.
#[derive(Clone, Debug, PartialEq)]
pub struct Pick<T>(Vec<T>);

impl<T> Pick<T> {
    /// Builds a fixed value.
    pub fn fixed(x: T) -> Self {
        Self(vec![x])
    }

    /// Samples one of the values.
    pub fn draw(&self, stream: &mut Stream) -> &T {
        // A fixed value consumes a random number too, so changing it to a choice later leaves the rest of the stream
        // unchanged.
        let i = stream.index(self.0.len());
        &self.0[i]
    }

    /// Returns all values.
    pub fn all(&self) -> &[T] {
        &self.0
    }
}

impl<'de, T: de::DeserializeOwned> Deserialize<'de> for Pick<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        enum Many<T> {
            Choice(Vec<T>),
        }
        from_raw(deserializer, |raw| {
            if !raw.trim_start().starts_with("Choice") {
                return parse_in(raw).map(Self::fixed);
            }
            let Many::Choice(of) = parse_in(raw)?;
            if of.is_empty() { Err(whole(raw, NOTHING, "name at least one: Choice([…, …])")) } else { Ok(Self(of)) }
        })
    }
}

impl<T: Serialize> Serialize for Pick<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.0.as_slice() {
            [one] => one.serialize(serializer),
            many => serializer.serialize_newtype_variant("Pick", 0, "Choice", many),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::bound::{Count, NonNegative};
    use super::*;
    use crate::math::RoundTo;
    use crate::sampling::Purpose;

    fn stream() -> Stream {
        Stream::of(3, 0, Purpose::Test, 0)
    }

    #[test]
    fn a_file_may_fix_or_draw_any_number() {
        for (text, lo, hi) in [
            ("3", 3.0, 3.0),
            ("Uniform(1, 2)", 1.0, 2.0),
            ("Normal(mean: 5, sd: 9, min: 4, max: 7)", 4.0, 7.0),
            ("LogNormal(median: 2, sigma: 3)", 0.0, f64::MAX),
            ("Choice([4, 5])", 4.0, 5.0),
            ("Weighted([(1, 0), (2, 3)])", 2.0, 2.0),
        ] {
            let v: Vary<NonNegative<1000>> = ron::from_str(text).unwrap();
            let again: Vary<NonNegative<1000>> = ron::from_str(&ron::to_string(&v).unwrap()).unwrap();
            assert_eq!(v, again, "{text}");
            let mut s = stream();
            assert!((0..500).map(|_| v.draw(&mut s)).all(|x| x >= lo && x <= hi), "{text}");
        }
    }

    #[test]
    fn impossible_numbers_are_refused() {
        for text in [
            "-1",
            "NaN",
            "inf",
            "Uniform(2, 1)",
            "Uniform(-1, 1)",
            "Choice([])",
            "Weighted([(1, 0)])",
            "Normal(mean: 1, sd: -1)",
            "Normal(mean: 1, sd: 1, min: 3, max: 2)",
            "LogNormal(median: 0, sigma: 1)",
            "Unifrom(1, 2)",
            "\"a\"",
        ] {
            assert!(ron::from_str::<Vary<NonNegative<1000>>>(text).is_err(), "{text}");
        }
    }

    /// Method: mistakes of users who know other formats. Expected: the help contains the exact text to write, and that
    /// text parses.
    #[test]
    fn the_correct_syntax_is_suggested() {
        for (wrong, right) in [
            ("Normal(150, 20)", "Normal(mean: 150, sd: 20)"),
            ("LogNormal(3, 0.5, 1)", "LogNormal(median: 3, sigma: 0.5, min: 1)"),
            ("[100, 150]", "Uniform(100, 150)"),
            ("[1, 2, 3]", "Choice([1, 2, 3])"),
        ] {
            let error_text = ron::from_str::<Vary<NonNegative<1000>>>(wrong).unwrap_err().to_string();
            assert!(error_text.contains(&format!("write {right}")), "{error_text}");
            ron::from_str::<Vary<NonNegative<1000>>>(right).unwrap();
        }
        let usual = |text: &str| ron::from_str::<Vary<NonNegative<1000>>>(text).unwrap().usual();
        assert_eq!(usual("Normal(mean: 3, sd: 2)"), (0.0, 7.0));
        assert_eq!(usual("Choice([2, 1, 5])"), (1.0, 5.0));
        assert_eq!(usual("4"), (4.0, 4.0));
    }

    #[test]
    fn counts_are_whole() {
        assert!(ron::from_str::<Vary<Count>>("2.5").is_err());
        let v: Vary<Count> = Vary::uniform(1.0, 6.0);
        let mut s = stream();
        assert!((0..50).all(|_| v.draw(&mut s).fract() == 0.0));
        // Bounds apply to the rounded value. The first range contains one whole number, the second none.
        let v: Vary<Count> = ron::from_str("Normal(mean: 13, sd: 5, min: 12.4, max: 13.6)").unwrap();
        assert!((0..500).all(|_| v.draw(&mut s) == 13.0));
        assert!(ron::from_str::<Vary<Count>>("Normal(mean: 13.5, sd: 1, min: 13.2, max: 13.8)").is_err());
    }

    /// Method: frequencies. Expected: each face of a die within five standard deviations of 1/6 (rounding a continuous
    /// sample would give 1 and 6 half as often), and one number of the stream per sample.
    #[test]
    fn every_whole_number_is_equally_likely() {
        let v: Vary<Count> = Vary::uniform(1.0, 6.0);
        let (mut s, mut plain) = (stream(), stream());
        let mut seen = [0_u32; 8];
        let n = 60_000;
        for _ in 0..n {
            seen[v.draw(&mut s).trunc_to::<usize>()] += 1;
            plain.uniform();
        }
        assert_eq!((seen[0], seen[7]), (0, 0));
        let sd = (f64::from(n) / 6.0 * 5.0 / 6.0).sqrt();
        for face in &seen[1..7] {
            assert!((f64::from(*face) - f64::from(n) / 6.0).abs() < 5.0 * sd, "{seen:?}");
        }
        assert_eq!(s.uniform(), plain.uniform(), "one number a draw");
        let one: Vary<Count> = Vary::uniform(4.0, 4.0);
        assert_eq!(one.draw(&mut s), 4.0);
    }
}
