//! Build script: link arguments of the programs, tests and benches for libraries outside the system folders.
#![allow(clippy::print_stdout, reason = "Cargo reads a build script's standard output")]

mod libtorch;

fn main() {
    println!("cargo::rerun-if-changed=build");
    // Embree from EMBREE_DIR: programs store the folder as RUNPATH. `furrow-embree` links the library itself.
    if let Ok(folder) = std::env::var("DEP_EMBREE_RPATH") {
        println!("cargo::rustc-link-arg=-Wl,--enable-new-dtags,-rpath,{folder}");
    }
    libtorch::link();
}
