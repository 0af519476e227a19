//! Development: from the chip's numbers to the bytes of a picture.
//!
//! | file | idea |
//! |---|---|
//! | `balance` | white balance |
//! | `matrix` | colours of the filters to colours of a screen |
//! | `tone` | tone curve |
//! | `sharpen` | unsharp mask |
//! | `jpeg` | what compression loses |

mod balance;
mod jpeg;
mod matrix;
mod sharpen;
mod tone;

pub use balance::{WhiteBalance, WhiteBalanceDesc};
pub use jpeg::{Jpeg, JpegDesc, Quality};
pub(super) use matrix::apply as apply_matrix;
pub use matrix::{MatrixDesc, MatrixRow};
pub(super) use sharpen::SharpenWritten;
pub use sharpen::{Sharpen, SharpenDesc};
pub use tone::Tone;
