//! Names the shared library as it is installed, so that programs find the version they were linked
//! with.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let os = std::env::var("CARGO_CFG_TARGET_OS").expect("set by cargo");
    if matches!(os.as_str(), "linux" | "freebsd" | "netbsd" | "openbsd") {
        // Versions 0.x are compatible within one x.
        let [major, minor] = ["MAJOR", "MINOR"]
            .map(|part| std::env::var(format!("CARGO_PKG_VERSION_{part}")).expect("set by cargo"));
        println!("cargo::rustc-cdylib-link-arg=-Wl,-soname,libtetmill.so.{major}.{minor}");
    }
}
