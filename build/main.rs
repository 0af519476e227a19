//! Build script: finds the libraries that are not Cargo's.
#![allow(clippy::print_stdout, reason = "so a build script speaks to Cargo")]

mod embree;
mod libtorch;

fn main() {
    println!("cargo::rerun-if-changed=build");
    embree::link();
    libtorch::link();
}
