//! Link arguments for libtorch, for the programs, tests and benches of any crate that links it.

/// Makes programs remember where libtorch is, as `RUNPATH`, so that `LD_LIBRARY_PATH` still puts another libtorch of the same version (one
/// with CUDA) first. Returns the folder.
///
/// `torch-sys` passes the folder to its direct dependants, and `furrow-train` to its own.
pub(crate) fn link() -> Option<String> {
    let folder =
        ["DEP_TCH_LIBTORCH_LIB", "DEP_FURROW_TRAIN_LIBTORCH"].iter().find_map(|name| std::env::var(name).ok())?;
    println!("cargo::rustc-link-arg=-Wl,--enable-new-dtags,-rpath,{folder}");
    // `torch-sys` and `nv-flip-sys` both contain stb_image_write; neither is called here.
    println!("cargo::rustc-link-arg=-Wl,--allow-multiple-definition");
    // nv-flip's library contains a miniz, which libtorch would call instead of its own and crash when it reads weights.
    println!("cargo::rustc-link-arg=-Wl,--exclude-libs,ALL");
    Some(folder)
}
