//! From datasets on disk to batches of tensors.
//!
//! | file | idea |
//! |---|---|
//! | `bands` | input bands: red, green, blue, nir, or any grey image by name |
//! | `select` | selection of images of a dataset, in the syntax of the command line |
//! | `margin` | dilation and erosion of label masks, to match manual masks |
//! | `example` | one image at the network's size, with its labels |
//! | `store` | the selected images, cached within a memory budget |
//! | `augment` | data augmentation |
//! | `erase` | random erasing |
//! | `fourier` | Fourier style transfer from another image |
//! | `crop` | random crops, some placed around rare-class pixels |
//! | `ground` | scale augmentation by the pixel size on the ground |
//! | `normalise` | input normalization |
//! | `naming` | species named as crops, and the labels that follow |
//! | `plants` | targets of the plant decoder |
//! | `order` | parameters of batch sampling |
//! | `photos` | photographs without labels, for self-training |
//! | `paste` | pastes plants of one batch over the images of another |
//! | `resize` | input sizes of a network for an image |
//! | `loader` | loading threads; the seed alone determines the batches |

pub mod augment;
pub mod bands;
pub mod crop;
mod erase;
pub mod example;
mod fourier;
pub mod ground;
pub mod loader;
pub mod margin;
mod naming;
pub mod normalise;
mod order;
mod paste;
pub mod photos;
pub mod plants;
pub mod resize;
pub mod select;
pub mod store;

pub use augment::Augment;
pub use bands::Band;
pub use crop::{Augmented, Crop};
pub use example::{Example, Shape, Wanted};
pub use ground::{AugmentScale, Ground, PixelSizes};
pub use loader::{Batch, Loader};
pub use naming::Naming;
pub use normalise::Normalization;
pub use order::BatchSettings;
pub use paste::paste;
pub use photos::{Photos, Views};
pub use resize::Resize;
pub use select::{Pick, Selection};
pub use store::Store;
