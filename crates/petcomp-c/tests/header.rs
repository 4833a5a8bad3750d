//! The header that C reads is what the crate says.

use std::path::Path;

#[test]
fn header_is_that_of_the_functions() {
    let crate_folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let path = crate_folder.join("include/petcomp.h");
    let bindings = cbindgen::generate(crate_folder).unwrap();
    let mut header = Vec::new();
    bindings.write(&mut header);
    if std::env::var_os("PETCOMP_UPDATE_HEADER").is_some() {
        std::fs::write(&path, &header).unwrap();
    }
    assert_eq!(
        std::fs::read_to_string(&path).unwrap_or_default(),
        String::from_utf8(header).unwrap(),
        "PETCOMP_UPDATE_HEADER=1 cargo test -p petcomp-c header"
    );
}
