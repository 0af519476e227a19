//! Build script: sets the link arguments for libtorch and passes its path to dependent packages.
#![allow(clippy::print_stdout, reason = "Cargo reads a build script's standard output")]

#[path = "../../../build/libtorch.rs"]
mod libtorch;

fn main() {
    println!("cargo::rerun-if-changed=build");
    if let Some(folder) = libtorch::link() {
        println!("cargo::metadata=LIBTORCH={folder}");
    }
}
