//! Procedural plants and soil. This crate does not depend on materials, lights or cameras.
//!
//! | module | contents |
//! |---|---|
//! | [`plant`] | growth forms, leaves, flowers; leaf condition |
//! | [`soil`] | relief, clods, stones, litter; baked ground maps |
//! | [`scatter`] | positions of plants: rows and weeds |
//! | [`model`] | plant models from glTF and OBJ files |
//! | [`tree`] | trees and shrubs for distant views |

pub mod model;
pub mod plant;
pub mod scatter;
pub mod soil;
pub mod tree;
