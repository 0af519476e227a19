//! Finds Embree and links it; see `search.rs` for the search path.
#![allow(clippy::print_stdout, reason = "Cargo reads a build script's standard output")]

mod search;

use search::Found;
use std::path::PathBuf;

fn main() {
    println!("cargo::rerun-if-changed=build");
    println!("cargo::rerun-if-env-changed=EMBREE_DIR");
    println!("cargo::rustc-check-cfg=cfg(embree, values(\"3\", \"4\"))");
    let own = std::env::var_os("EMBREE_DIR").map(PathBuf::from);
    let Found { version, file } = match search::find(own.as_deref(), &search::SYSTEM.map(PathBuf::from)) {
        Ok(found) => found,
        Err(message) => return println!("cargo::error={message}"),
    };
    let (Some(folder), Some(name)) = (file.parent(), file.file_name().and_then(|name| name.to_str())) else { return };
    println!("cargo::rerun-if-changed={}", file.display());
    println!("cargo::rustc-cfg=embree=\"{version}\"");
    println!("cargo::rustc-link-search=native={}", folder.display());
    // Links by file name, since libraries in Python packages do not follow the pattern `libNAME.so`.
    println!("cargo::rustc-link-lib=dylib:+verbatim={name}");
    if own.is_some() {
        println!("cargo::rustc-link-arg=-Wl,--enable-new-dtags,-rpath,{}", folder.display());
        // Link arguments do not apply to dependent packages; their build scripts read this value as DEP_EMBREE_RPATH.
        println!("cargo::metadata=RPATH={}", folder.display());
    }
}
