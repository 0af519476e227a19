//! Build script: where libtorch is, for the tests of this crate.
#![allow(clippy::print_stdout, reason = "Cargo reads a build script's standard output")]

mod libtorch;

fn main() {
    println!("cargo::rerun-if-changed=build");
    libtorch::link();
}
