//! Build script: link arguments of this crate's tests for libtorch.
#![allow(clippy::print_stdout, reason = "Cargo reads a build script's standard output")]

#[path = "../../../build/libtorch.rs"]
mod libtorch;

fn main() {
    println!("cargo::rerun-if-changed=build");
    libtorch::link();
}
