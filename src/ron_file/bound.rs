//! What a number in a file may be. The bound is part of the type, so an impossible value is an error at its place in the file.

use std::fmt;

/// What a number must be.
pub trait Bound: Copy + Clone + fmt::Debug + PartialEq {
    /// Smallest value.
    const MIN: f64 = f64::NEG_INFINITY;
    /// Largest value.
    const MAX: f64 = f64::INFINITY;
    /// True where the smallest value itself is not allowed.
    const ABOVE_MIN: bool = false;
    /// True where only whole numbers make sense.
    const WHOLE: bool = false;
    /// In words, after "must be".
    const WORDS: &'static str;

    /// Whether `x` will do.
    fn holds(x: f64) -> bool {
        x.abs() <= LARGEST
            && (x == 0.0 || x.abs() >= SMALLEST)
            && x <= Self::MAX
            && (x > Self::MIN || (x == Self::MIN && !Self::ABOVE_MIN))
            && (!Self::WHOLE || x.fract() == 0.0)
    }

    /// Why `x` will not do.
    fn refuse(x: f64) -> String {
        if !x.is_finite() {
            format!("{x} cannot be used: it must be {}", Self::WORDS)
        } else if x.abs() > LARGEST {
            format!("{x:e} is out of range: numbers here go up to {LARGEST:e}")
        } else if x != 0.0 && x.abs() < SMALLEST {
            format!("{x:e} is too close to 0 to be told from it")
        } else {
            format!("{x} is out of range: it must be {}", Self::WORDS)
        }
    }
}

/// Largest number in a file: beyond any metre, count or watt, and its square is still a single-precision number.
const LARGEST: f64 = 1e12;
/// Smallest number above zero in a file.
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
    /// A factor on what is usual.
    Factor { const MIN: f64 = 0.0; const MAX: f64 = 10.0; const ABOVE_MIN: bool = true; const WORDS: &'static str = "above 0, at most 10"; }
    /// A whole number, 0 or above.
    Count { const MIN: f64 = 0.0; const MAX: f64 = 1e6; const WHOLE: bool = true; const WORDS: &'static str = "a whole number from 0 to 1000000"; }
    /// A whole number, 1 or above.
    PositiveCount { const MIN: f64 = 1.0; const MAX: f64 = 1e6; const WHOLE: bool = true; const WORDS: &'static str = "a whole number from 1 to 1000000"; }
    /// Degrees of elevation above the horizon.
    Elevation { const MIN: f64 = -90.0; const MAX: f64 = 90.0; const WORDS: &'static str = "between -90 and 90 degrees"; }
}
