//! Networks for a named crop: the species that a user names, the scene file of fields with these crops, and the recipe of the training.
//!
//! | module | contents |
//! |---|---|
//! | `species` | a species by name or file, and the check of a network's crops |
//! | `scene` | `scenes/any-field.ron` reduced to some crops, with their relatives among the weeds |
//! | `recipe` | images and hyper-parameters |

pub mod recipe;
pub mod scene;
pub mod species;

pub use recipe::Recipe;
pub use scene::scene;
pub use species::{Species, check_crop};
