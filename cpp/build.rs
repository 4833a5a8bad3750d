//! Builds the OpenImageIO shim, and only where it was asked for.

fn main() {
    println!("cargo:rerun-if-changed=cpp/build.rs");
}
