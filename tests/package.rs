//! What is published is whole: each crate's package has what its sources include, and both licences.

use std::collections::BTreeSet;
use std::path::{Component, Path, PathBuf};
use std::process::Command;

/// The crates that are published, each with its folder.
const PUBLISHED: [(&str, &str); 4] = [
    ("petcomp", "."),
    ("petcomp-cli", "crates/petcomp-cli"),
    ("petcomp-store", "crates/petcomp-store"),
    ("petcomp-studio", "crates/petcomp-studio"),
];

fn repository() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The files of a crate's package.
fn packaged(name: &str) -> BTreeSet<PathBuf> {
    let done = Command::new(env!("CARGO"))
        .args([
            "package",
            "--list",
            "--offline",
            "--allow-dirty",
            "-p",
            name,
        ])
        .current_dir(repository())
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&done.stderr);
    assert!(done.status.success(), "{said}");
    let listed = String::from_utf8(done.stdout).unwrap();
    listed.lines().map(PathBuf::from).collect()
}

/// The files that a source includes by their names, from the root of its crate.
fn included(file: &Path, source: &str) -> Vec<PathBuf> {
    let calls = ["include_str!(\"", "include_bytes!(\""];
    let names = calls.iter().flat_map(|call| source.split(call).skip(1));
    let names = names.filter_map(|rest| rest.split('"').next());
    let folder = file.parent().unwrap();
    names.map(|name| plain(&folder.join(name))).collect()
}

/// Without `..`.
fn plain(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => assert!(plain.pop(), "{} leads out", path.display()),
            part => plain.push(part),
        }
    }
    plain
}

#[test]
fn every_file_that_is_compiled_in_is_packaged() {
    for (name, folder) in PUBLISHED {
        let files = packaged(name);
        for file in files.iter().filter(|file| file.starts_with("src")) {
            let source = std::fs::read_to_string(repository().join(folder).join(file)).unwrap();
            for target in included(file, &source) {
                assert!(
                    files.contains(&target),
                    "{name}: {} needs {}",
                    file.display(),
                    target.display()
                );
            }
        }
    }
}

#[test]
fn every_package_has_both_licences() {
    for (name, _) in PUBLISHED {
        let files = packaged(name);
        for licence in ["LICENSE-MIT", "LICENSE-APACHE"] {
            assert!(files.contains(Path::new(licence)), "{name}: {licence}");
        }
    }
}
