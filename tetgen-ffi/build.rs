//! Compiles the C++ shim if TetGen's header is found, and links it into the worker only.
//!
//! TetGen is AGPL and may crash, so neither the library crate nor any test is linked with it.

use std::path::Path;

/// Folders where packages install `tetgen.h`. If `TETGEN_INCLUDE` is set, only that folder is
/// searched.
const INCLUDE_FOLDERS: [&str; 3] = ["/usr/include", "/usr/local/include", "/opt/homebrew/include"];

fn main() {
    println!("cargo::rustc-check-cfg=cfg(tetgen)");
    println!("cargo::rerun-if-changed=src/shim.cpp");
    println!("cargo::rerun-if-env-changed=TETGEN_INCLUDE");
    let chosen = std::env::var("TETGEN_INCLUDE").ok();
    let folders = chosen.as_deref().map_or(INCLUDE_FOLDERS.to_vec(), |folder| vec![folder]);
    let Some(folder) = folders.into_iter().find(|folder| Path::new(folder).join("tetgen.h").exists()) else {
        println!("cargo::warning=tetgen.h was not found (Debian: libtet1.5-dev): built without TetGen");
        return;
    };
    println!("cargo::rustc-cfg=tetgen");
    cc::Build::new()
        .cpp(true)
        .file("src/shim.cpp")
        .include(folder)
        .define("TETLIBRARY", None)
        .warnings(false)
        .cargo_metadata(false)
        .compile("tetgen_shim");
    let out = std::env::var("OUT_DIR").expect("cargo sets OUT_DIR");
    let standard_library = if cfg!(target_vendor = "apple") { "c++" } else { "stdc++" };
    for argument in
        [format!("-L{out}"), "-ltetgen_shim".into(), "-ltet".into(), format!("-l{standard_library}")]
    {
        println!("cargo::rustc-link-arg-bins={argument}");
    }
}
