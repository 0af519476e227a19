//! From sets on disk to batches of numbers.
//!
//! | file | idea |
//! |---|---|
//! | `bands` | what a pixel holds: red, green, blue, nir, or any grey picture by name |
//! | `select` | which images of which set, as a command line writes them |
//! | `margin` | outlines as people draw them, outside of the leaf or inside |
//! | `example` | one image at the network's size, with its labels |
//! | `store` | all that were selected, decoded once as far as memory goes |
//! | `augment` | chance between the image and the network |
//! | `window` | which part of the image is seen: anywhere, or about a rare class |
//! | `normalise` | exposure taken out |
//! | `loader` | threads that are ahead of the network, in an order that the seed alone decides |

pub mod augment;
pub mod bands;
pub mod example;
pub mod loader;
pub mod margin;
pub mod normalise;
pub mod select;
pub mod store;
pub mod window;

pub use augment::Augment;
pub use bands::Band;
pub use example::{Example, Shape};
pub use loader::{Batch, Loader, Order};
pub use normalise::Normalisation;
pub use select::{Pick, Selection};
pub use store::Store;
pub use window::View;
