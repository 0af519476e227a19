//! Development: from the chip's integers to the bytes of an image.
//!
//! | file | contents |
//! |---|---|
//! | `balance` | white balance |
//! | `matrix` | conversion of filter colours to display colours |
//! | `tone` | tone curve |
//! | `sharpen` | unsharp mask |
//! | `jpeg` | compression loss |

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
