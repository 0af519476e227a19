//! Link arguments of the feature `train`: programs store the folder of libtorch, which `torch-sys` passes to its direct dependents.
//! It is stored as `RUNPATH`, so that `LD_LIBRARY_PATH` can still select another libtorch of the same version (such as one with
//! CUDA).

pub(crate) fn link() {
    if let Ok(lib) = std::env::var("DEP_TCH_LIBTORCH_LIB") {
        println!("cargo::rustc-link-arg=-Wl,--enable-new-dtags,-rpath,{lib}");
        // `torch-sys` and `nv-flip-sys` both contain stb_image_write, which is not used here.
        println!("cargo::rustc-link-arg=-Wl,--allow-multiple-definition");
        // FLIP's library contains its own miniz; if libtorch resolved symbols to it, reading weights would crash.
        println!("cargo::rustc-link-arg=-Wl,--exclude-libs,ALL");
    }
}
