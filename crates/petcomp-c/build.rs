//! The name under which programs look for the shared library when they start.

fn main() {
    let major = std::env::var("CARGO_PKG_VERSION_MAJOR").unwrap_or_default();
    println!("cargo::rustc-cdylib-link-arg=-Wl,-soname,libpetcomp.so.{major}");
    println!("cargo::rerun-if-changed=build.rs");
}
