//! Builds the shim over OpenImageIO and libheif, and only where it was asked for.

fn main() {
    println!("cargo:rerun-if-changed=cpp/build.rs");
    #[cfg(feature = "oiio")]
    build_shim();
}

/// Oldest versions that the shim was tried with (Debian 12).
#[cfg(feature = "oiio")]
const LIBRARIES: [(&str, &str); 2] = [("OpenImageIO", "2.4"), ("libheif", "1.15")];

#[cfg(feature = "oiio")]
const SOURCES: [&str; 5] = [
    "cpp/heif_shim.h",
    "cpp/heif_shim.cpp",
    "cpp/oiio_shim.h",
    "cpp/oiio_shim.cpp",
    "src/io/worker/ffi.rs",
];

#[cfg(feature = "oiio")]
fn build_shim() {
    for file in SOURCES {
        println!("cargo:rerun-if-changed={file}");
    }
    let libraries = LIBRARIES.map(|(name, version)| found(name, version));
    cxx_build::bridge("src/io/worker/ffi.rs")
        .files(SOURCES.iter().filter(|file| file.ends_with(".cpp")))
        .std("c++17")
        .includes(libraries.iter().flat_map(|library| &library.include_paths))
        .flag_if_supported("-Wno-deprecated-declarations")
        // Otherwise the inline members of its classes are exported for the library to use, which
        // makes every program that contains the shim need the library, called or not.
        .flag_if_supported("-fvisibility-inlines-hidden")
        .compile("petcomp_oiio");
    // Behind compile(): the linker looks for what the shim lacks in what follows it, and leaves out
    // what nobody calls.
    libraries.iter().for_each(link);
}

#[cfg(feature = "oiio")]
fn found(name: &str, version: &str) -> pkg_config::Library {
    let library = pkg_config::Config::new()
        .atleast_version(version)
        .cargo_metadata(false)
        .probe(name);
    library.unwrap_or_else(|_| {
        println!(
            "cargo:error=the feature `oiio` needs {name} {version} or newer, a C++ compiler and pkg-config: \
             `apt-get install g++ pkg-config libopenimageio-dev libheif-dev`, or build with `--no-default-features`"
        );
        std::process::exit(1)
    })
}

#[cfg(feature = "oiio")]
fn link(library: &pkg_config::Library) {
    for path in &library.link_paths {
        println!("cargo:rustc-link-search=native={}", path.display());
    }
    for name in &library.libs {
        println!("cargo:rustc-link-lib=dylib={name}");
    }
}
