//! Bounds of numbers in files. The bound is part of the type, so an invalid value is reported at its place in the file.

use std::fmt;

/// Range of valid values of a number.
pub trait Bound: Copy + Clone + fmt::Debug + PartialEq {
    /// Smallest value.
    const MIN: f64;
    /// Largest value.
    const MAX: f64;
    /// `true` if the smallest value itself is not allowed.
    const ABOVE_MIN: bool = false;
    /// `true` if only whole numbers are allowed.
    const WHOLE: bool = false;
    /// The range in words, to follow "must be"; empty for words made of the limits.
    const WORDS: &'static str = "";

    /// Returns the range in words, to follow "must be".
    fn words() -> String {
        let (min, max) = (Self::MIN, Self::MAX);
        match Self::WORDS {
            "" if Self::WHOLE => format!("a whole number from {min} to {max}"),
            "" if Self::ABOVE_MIN => format!("above {min}, at most {max}"),
            "" => format!("between {min} and {max}"),
            words => words.into(),
        }
    }

    /// Returns `true` if `x` is within the bound.
    fn holds(x: f64) -> bool {
        x.abs() <= LARGEST
            && (x == 0.0 || x.abs() >= SMALLEST)
            && x <= Self::MAX
            && (x > Self::MIN || (x == Self::MIN && !Self::ABOVE_MIN))
            && (!Self::WHOLE || x.fract() == 0.0)
    }

    /// Returns the message for a value `x` that is not within the bound.
    fn refuse(x: f64) -> String {
        if !x.is_finite() {
            format!("{x} cannot be used: it must be {}", Self::words())
        } else if x.abs() > LARGEST {
            format!("{x:e} is out of range: numbers here go up to {LARGEST:e}")
        } else if x != 0.0 && x.abs() < SMALLEST {
            format!("{x:e} is too close to 0 to be distinguished from it")
        } else {
            format!("{x} is out of range: it must be {}", Self::words())
        }
    }
}

/// Largest magnitude of a number in a file: beyond any length, count or power in use, and its square still fits single
/// precision.
const LARGEST: f64 = 1e12;
/// Smallest magnitude of a nonzero number in a file.
const SMALLEST: f64 = 1e-12;

macro_rules! bounds {
    ($($(#[$doc:meta])* $name:ident { $($body:tt)* })*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq)]
        pub struct $name;
        impl Bound for $name { $($body)* }
    )*};
}

bounds! {
    /// Between 0 and 1.
    Fraction { const MIN: f64 = 0.0; const MAX: f64 = 1.0; }
    /// A factor relative to the usual value.
    Factor { const MIN: f64 = 0.0; const MAX: f64 = 10.0; const ABOVE_MIN: bool = true; }
    /// A whole number, 0 or above.
    Count { const MIN: f64 = 0.0; const MAX: f64 = 1e6; const WHOLE: bool = true; }
    /// A whole number, 1 or above.
    PositiveCount { const MIN: f64 = 1.0; const MAX: f64 = 1e6; const WHOLE: bool = true; }
    /// Elevation above the horizon, degrees.
    Elevation { const MIN: f64 = -90.0; const MAX: f64 = 90.0; const WORDS: &'static str = "between -90 and 90 degrees"; }
}

/// Returns the largest value that a bound is declared with. All are far below 2⁵³ and exact.
#[expect(clippy::cast_precision_loss, reason = "`From` is not const")]
const fn largest(max: u64) -> f64 {
    max as f64
}

/// From `-MAX` to `MAX`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Signed<const MAX: u64>;

impl<const MAX: u64> Bound for Signed<MAX> {
    const MIN: f64 = -largest(MAX);
    const MAX: f64 = largest(MAX);
}

/// Above zero, at most `MAX`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Positive<const MAX: u64>;

impl<const MAX: u64> Bound for Positive<MAX> {
    const MIN: f64 = 0.0;
    const MAX: f64 = largest(MAX);
    const ABOVE_MIN: bool = true;
}

/// From zero to `MAX`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NonNegative<const MAX: u64>;

impl<const MAX: u64> Bound for NonNegative<MAX> {
    const MIN: f64 = 0.0;
    const MAX: f64 = largest(MAX);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_bound_has_two_ends_and_says_them() {
        for (words, holds) in [
            (Signed::<360>::words(), [Signed::<360>::holds(-360.0), Signed::<360>::holds(360.5)]),
            (Positive::<20>::words(), [Positive::<20>::holds(20.0), Positive::<20>::holds(0.0)]),
            (NonNegative::<20>::words(), [NonNegative::<20>::holds(0.0), NonNegative::<20>::holds(20.1)]),
            (Count::words(), [Count::holds(3.0), Count::holds(3.5)]),
        ] {
            assert_eq!(holds, [true, false], "{words}");
        }
        assert_eq!(Signed::<360>::words(), "between -360 and 360");
        assert_eq!(Positive::<20>::words(), "above 0, at most 20");
        assert_eq!(NonNegative::<20>::words(), "between 0 and 20");
        assert_eq!(PositiveCount::words(), "a whole number from 1 to 1000000");
        assert_eq!(Elevation::refuse(91.0), "91 is out of range: it must be between -90 and 90 degrees");
    }
}
