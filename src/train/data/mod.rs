//! From datasets on disk to batches of tensors.
//!
//! | file | idea |
//! |---|---|
//! | `bands` | what a pixel holds: red, green, blue, nir, or any grey picture by name |
//! | `select` | which images of which set, as a command line writes them |
//! | `margin` | label masks dilated or eroded, as manual masks are |
//! | `example` | one image at the network's size, with its labels |
//! | `store` | the selected images, decoded once and cached within a memory budget |
//! | `augment` | data augmentation |
//! | `erase` | random erasing |
//! | `fourier` | the style of another image |
//! | `crop` | random crops, some centred on rare-class pixels |
//! | `ground` | scale by the size of pixels on the ground |
//! | `normalise` | input normalization |
//! | `order` | how batches are drawn |
//! | `photos` | photographs without labels, for self-training |
//! | `paste` | plants of one batch over the pictures of another |
//! | `resize` | how a picture of any size is brought to a network |
//! | `loader` | threads that are ahead of the network, in an order that the seed alone decides |

pub mod augment;
pub mod bands;
pub mod crop;
mod erase;
pub mod example;
mod fourier;
pub mod ground;
pub mod loader;
pub mod margin;
pub mod normalise;
mod order;
mod paste;
pub mod photos;
pub mod resize;
pub mod select;
pub mod store;

pub use augment::Augment;
pub use bands::Band;
pub use crop::Crop;
pub use example::{Example, Shape};
pub use ground::{AugmentScale, Ground, PixelSizes};
pub use loader::{Batch, Loader};
pub use normalise::Normalization;
pub use order::Order;
pub use paste::paste;
pub use photos::{Photos, Views};
pub use resize::Resize;
pub use select::{Pick, Selection};
pub use store::Store;
