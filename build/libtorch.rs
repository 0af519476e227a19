//! With the feature `train`, programs remember where libtorch lies. `torch-sys` tells its direct dependants; written as
//! `RUNPATH`, so that `LD_LIBRARY_PATH` still puts another libtorch of the same version (one with CUDA) before it.

pub(crate) fn link() {
    if let Ok(lib) = std::env::var("DEP_TCH_LIBTORCH_LIB") {
        println!("cargo::rustc-link-arg=-Wl,--enable-new-dtags,-rpath,{lib}");
        // `torch-sys` and `nv-flip-sys` both hold stb_image_write, which neither is asked to use here.
        println!("cargo::rustc-link-arg=-Wl,--allow-multiple-definition");
        // FLIP's library brings a miniz of its own, and libtorch must not take it for its: that crashes where weights are read.
        println!("cargo::rustc-link-arg=-Wl,--exclude-libs,ALL");
    }
}
