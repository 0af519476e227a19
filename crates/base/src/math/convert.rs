//! Conversions between number types, named by what they do with values that the target cannot represent.
//!
//! | from → to | call | a value without exact counterpart |
//! |---|---|---|
//! | any type → a type that holds all its values | `f64::from(x)` | does not exist |
//! | integer → integer | `n.to_u32()`, [`ToInt`] | is a mistake of the caller: panics with debug assertions |
//! | integer or `f64` → float | `n.to_f32()`, [`ToFloat`] | becomes the nearest float |
//! | float → integer | `x.floor_to::<i32>()`, [`RoundTo`] | is rounded as the name says, and saturates |
//! | integer → integer of the other sign | `n.cast_unsigned()` of the standard library | keeps its bits |
//!
//! In release builds each of these is the machine code of `as`, bit for bit. This file is the only one where `as` between numbers needs
//! no reason.

#![expect(
    clippy::cast_lossless,
    clippy::cast_possible_truncation,
    clippy::cast_possible_wrap,
    clippy::cast_precision_loss,
    clippy::cast_sign_loss,
    reason = "the conversions that replace these casts elsewhere"
)]

/// Conversion to the nearest floating-point number, ties to even.
pub trait ToFloat: Copy {
    /// Returns the nearest `f32`. Integers are exact up to 2²⁴; an `f64` beyond the range becomes infinite.
    fn to_f32(self) -> f32;
    /// Returns the nearest `f64`. Integers are exact up to 2⁵³.
    fn to_f64(self) -> f64;
}

/// Conversion of an integer whose value is known to fit the target type.
///
/// A value that does not fit panics where debug assertions are on and keeps only its low bits elsewhere. Numbers from
/// outside, such as a length in a file, are therefore checked with `try_from` first.
pub trait ToInt: Copy {
    /// Returns the same number as `u8`.
    fn to_u8(self) -> u8;
    /// Returns the same number as `u16`.
    fn to_u16(self) -> u16;
    /// Returns the same number as `u32`.
    fn to_u32(self) -> u32;
    /// Returns the same number as `u64`.
    fn to_u64(self) -> u64;
    /// Returns the same number as `usize`, such as an index.
    fn to_usize(self) -> usize;
    /// Returns the same number as `i32`.
    fn to_i32(self) -> i32;
    /// Returns the same number as `i64`.
    fn to_i64(self) -> i64;
    /// Returns the same number as `isize`, such as the distance between two indices.
    fn to_isize(self) -> isize;
    /// Returns the low 32 bits, such as those of a hash. Every value is allowed.
    fn low_u32(self) -> u32;
}

/// Conversion of a floating-point number to an integer type.
///
/// A number beyond the range of the target becomes the target's smallest or largest value; NaN becomes 0.
pub trait RoundTo: Copy {
    /// Returns the integer part: rounds towards zero.
    fn trunc_to<I: FromFloat>(self) -> I;
    /// Returns the largest integer that is not greater.
    fn floor_to<I: FromFloat>(self) -> I;
    /// Returns the smallest integer that is not less.
    fn ceil_to<I: FromFloat>(self) -> I;
    /// Returns the nearest integer; half-way cases are rounded away from zero.
    fn round_to<I: FromFloat>(self) -> I;
}

/// An integer type to which [`RoundTo`] converts.
pub trait FromFloat: Copy {
    /// Returns the integer part of `x`, clamped to the range of the type; 0 for NaN.
    fn from_f32(x: f32) -> Self;
    /// Returns the integer part of `x`, clamped to the range of the type; 0 for NaN.
    fn from_f64(x: f64) -> Self;
}

macro_rules! to_float {
    ($($from:ty)*) => {$(
        impl ToFloat for $from {
            #[inline]
            fn to_f32(self) -> f32 {
                self as f32
            }

            #[inline]
            fn to_f64(self) -> f64 {
                self as f64
            }
        }
    )*};
}

macro_rules! to_int {
    ($($from:ty)*) => {$(
        impl ToInt for $from {
            to_int!($from: to_u8 u8, to_u16 u16, to_u32 u32, to_u64 u64, to_usize usize, to_i32 i32, to_i64 i64, to_isize isize);

            #[inline]
            fn low_u32(self) -> u32 {
                self as u32
            }
        }
    )*};
    ($from:ty: $($name:ident $to:ty),*) => {$(
        #[inline]
        #[track_caller]
        fn $name(self) -> $to {
            debug_assert!(<$to>::try_from(self).is_ok(), "{self} does not fit {}", stringify!($to));
            self as $to
        }
    )*};
}

macro_rules! round_to {
    ($($from:ty, $convert:ident;)*) => {$(
        impl RoundTo for $from {
            #[inline]
            fn trunc_to<I: FromFloat>(self) -> I {
                I::$convert(self)
            }

            #[inline]
            fn floor_to<I: FromFloat>(self) -> I {
                I::$convert(self.floor())
            }

            #[inline]
            fn ceil_to<I: FromFloat>(self) -> I {
                I::$convert(self.ceil())
            }

            #[inline]
            fn round_to<I: FromFloat>(self) -> I {
                I::$convert(self.round())
            }
        }
    )*};
}

macro_rules! from_float {
    ($($to:ty)*) => {$(
        impl FromFloat for $to {
            #[inline]
            fn from_f32(x: f32) -> Self {
                x as Self
            }

            #[inline]
            fn from_f64(x: f64) -> Self {
                x as Self
            }
        }
    )*};
}

to_float!(i32 i64 isize u32 u64 u128 usize f64);
to_int!(i8 i16 i32 i64 isize u16 u32 u64 u128 usize);
round_to!(f32, from_f32; f64, from_f64;);
from_float!(i8 i16 i32 i64 isize u8 u16 u32 u64 usize);

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_number_that_fits_is_unchanged(n in any::<u32>()) {
            prop_assert_eq!(u64::from(n).to_u32(), n);
            prop_assert_eq!(u128::from(n).to_u64(), u64::from(n));
            prop_assert_eq!(i64::from(n.to_usize().to_isize().to_i64().to_u32()), i64::from(n));
            prop_assert_eq!((n >> 1).to_i32().to_u32(), n >> 1);
            prop_assert_eq!(u32::from((n >> 16).to_u16()), n >> 16);
            prop_assert_eq!(u32::from((n >> 24).to_u8()), n >> 24);
            prop_assert_eq!((u64::from(n) << 32 | 0x4d).low_u32(), 0x4d);
        }

        /// Expected: the nearest number in `f64`'s and `f32`'s grid, as `as` returns it.
        #[test]
        fn floats_are_nearest(n in any::<u64>(), x in any::<f64>()) {
            prop_assert_eq!(n.to_f32(), n as f32);
            prop_assert_eq!(n.to_f64(), n as f64);
            prop_assert_eq!(x.to_f32().to_bits(), (x as f32).to_bits());
        }

        #[test]
        fn rounding_is_as_the_name_says(x in -1e6_f64..1e6) {
            let down: i32 = x.floor_to();
            prop_assert!(f64::from(down) <= x && x < f64::from(down) + 1.0);
            prop_assert_eq!(x.ceil_to::<i32>(), -(-x).floor_to::<i32>());
            prop_assert!((f64::from(x.round_to::<i32>()) - x).abs() <= 0.5);
            prop_assert_eq!(x.trunc_to::<i32>(), x.signum().trunc_to::<i32>() * x.abs().floor_to::<i32>());
        }
    }

    #[test]
    fn floats_beyond_the_range_saturate() {
        assert_eq!(
            [-0.9_f32, 255.9, 256.0, f32::INFINITY, f32::NAN].map(RoundTo::trunc_to::<u8>),
            [0, 255, 255, 255, 0]
        );
        assert_eq!([-0.5_f64, -1e300, 1e300].map(RoundTo::floor_to::<i64>), [-1, i64::MIN, i64::MAX]);
        assert_eq!([-0.5_f32, 0.5, 1.4].map(RoundTo::ceil_to::<usize>), [0, 1, 2]);
        assert_eq!([-2.5_f32, 2.5, 2.4].map(RoundTo::round_to::<i16>), [-3, 3, 2]);
    }

    #[test]
    #[cfg(debug_assertions)]
    #[should_panic(expected = "-1 does not fit usize")]
    fn a_number_that_does_not_fit_panics() {
        (-1_i32).to_usize();
    }
}
