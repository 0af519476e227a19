//! Tests that need no rendering and no other program: layers and dependencies. `cargo test` runs these and the unit tests of all crates.

mod architecture;
mod dependencies;
