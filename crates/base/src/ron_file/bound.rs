//! Bounds of numbers in files. The bound is part of the type, so an invalid value is reported at its place in the file.

use std::fmt;

/// Range of valid values of a number.
pub trait Bound: Copy + Clone + fmt::Debug + PartialEq {
    /// Smallest value.
    const MIN: f64 = f64::NEG_INFINITY;
    /// Largest value.
    const MAX: f64 = f64::INFINITY;
    /// `true` if the smallest value itself is not allowed.
    const ABOVE_MIN: bool = false;
    /// `true` if only whole numbers are allowed.
    const WHOLE: bool = false;
    /// The range in words, to follow "must be".
    const WORDS: &'static str;

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
            format!("{x} cannot be used: it must be {}", Self::WORDS)
        } else if x.abs() > LARGEST {
            format!("{x:e} is out of range: numbers here go up to {LARGEST:e}")
        } else if x != 0.0 && x.abs() < SMALLEST {
            format!("{x:e} is too close to 0 to be distinguished from it")
        } else {
            format!("{x} is out of range: it must be {}", Self::WORDS)
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
    /// Any finite number.
    Finite { const WORDS: &'static str = "a finite number"; }
    /// Above zero.
    Positive { const MIN: f64 = 0.0; const ABOVE_MIN: bool = true; const WORDS: &'static str = "above 0"; }
    /// Zero or above.
    NonNegative { const MIN: f64 = 0.0; const WORDS: &'static str = "0 or above"; }
    /// Between 0 and 1.
    Fraction { const MIN: f64 = 0.0; const MAX: f64 = 1.0; const WORDS: &'static str = "between 0 and 1"; }
    /// A factor relative to the usual value.
    Factor { const MIN: f64 = 0.0; const MAX: f64 = 10.0; const ABOVE_MIN: bool = true; const WORDS: &'static str = "above 0, at most 10"; }
    /// A whole number, 0 or above.
    Count { const MIN: f64 = 0.0; const MAX: f64 = 1e6; const WHOLE: bool = true; const WORDS: &'static str = "a whole number from 0 to 1000000"; }
    /// A whole number, 1 or above.
    PositiveCount { const MIN: f64 = 1.0; const MAX: f64 = 1e6; const WHOLE: bool = true; const WORDS: &'static str = "a whole number from 1 to 1000000"; }
    /// Elevation above the horizon, degrees.
    Elevation { const MIN: f64 = -90.0; const MAX: f64 = 90.0; const WORDS: &'static str = "between -90 and 90 degrees"; }
}
