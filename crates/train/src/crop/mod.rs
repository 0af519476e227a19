//! Networks for a named crop: the species that a user names, the scene file of fields with these crops, and the recipe of the training.
//!
//! | module | contents |
//! |---|---|
//! | `species` | a species by name or file |
//! | `named` | a trained network and the crops that a user names |
//! | `scene` | `scenes/any-field.ron` reduced to some crops, with their relatives among the weeds |
//! | `recipe` | images and hyper-parameters |

pub mod named;
pub mod recipe;
pub mod scene;
pub mod species;

pub use named::{exported, with_crops};
pub use recipe::Recipe;
pub use scene::scene;
pub use species::Species;
