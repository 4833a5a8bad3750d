//! Builds the OpenImageIO shim, and only where it was asked for.

fn main() {
    println!("cargo:rerun-if-changed=cpp/build.rs");
    #[cfg(feature = "oiio")]
    build_shim();
}

/// Oldest OpenImageIO that the shim was tried with (Debian 12).
#[cfg(feature = "oiio")]
const MIN_OIIO_VERSION: &str = "2.4";

#[cfg(feature = "oiio")]
fn build_shim() {
    for file in [
        "cpp/oiio_shim.h",
        "cpp/oiio_shim.cpp",
        "src/io/worker/ffi.rs",
    ] {
        println!("cargo:rerun-if-changed={file}");
    }
    let oiio = pkg_config::Config::new()
        .atleast_version(MIN_OIIO_VERSION)
        .cargo_metadata(false)
        .probe("OpenImageIO");
    let oiio = oiio.unwrap_or_else(|_| {
        println!(
            "cargo:error=the feature `oiio` needs OpenImageIO {MIN_OIIO_VERSION} or newer, a C++ compiler and pkg-config: \
             `apt-get install g++ pkg-config libopenimageio-dev`, or build with `--no-default-features`"
        );
        std::process::exit(1)
    });
    cxx_build::bridge("src/io/worker/ffi.rs")
        .file("cpp/oiio_shim.cpp")
        .std("c++17")
        .includes(&oiio.include_paths)
        .flag_if_supported("-Wno-deprecated-declarations")
        // Otherwise the inline members of its classes are exported for the library to use, which
        // makes every program that contains the shim need the library, called or not.
        .flag_if_supported("-fvisibility-inlines-hidden")
        .compile("petcomp_oiio");
    for path in &oiio.link_paths {
        println!("cargo:rustc-link-search=native={}", path.display());
    }
    // Behind compile(): the linker looks for what the shim lacks in what follows it, and leaves out
    // what nobody calls.
    for lib in &oiio.libs {
        println!("cargo:rustc-link-lib=dylib={lib}");
    }
}
