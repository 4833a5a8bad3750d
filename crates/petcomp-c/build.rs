//! The name under which programs look for the shared library when they start, and what it exports.

fn main() {
    let major = std::env::var("CARGO_PKG_VERSION_MAJOR").unwrap_or_default();
    println!("cargo::rustc-cdylib-link-arg=-Wl,-soname,libpetcomp.so.{major}");
    // Its own functions alone: the shim's, which come from the crates below, would take the place
    // of those of another library with a shim.
    println!("cargo::rustc-cdylib-link-arg=-Wl,--exclude-libs,ALL");
    println!("cargo::rerun-if-changed=build.rs");
}
