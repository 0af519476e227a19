//! What is learned from files: networks that tell soil, crop and weed apart, and how well they do.
//!
//! It reads only what was written, by `trace dataset` or by others, and knows nothing of scenes and rays: a real set is a set.
//!
//! | room | idea |
//! |---|---|
//! | `baseline` | colour rules, to be beaten |
//! | `measure` | truth and prediction → numbers |

pub mod baseline;
pub mod measure;
