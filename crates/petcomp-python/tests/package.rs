//! What the package says of itself. (Its own tests are in Python: `make python-package`.)

/// A project has one version, and the package is of this one.
#[test]
fn versions_agree() {
    let version = env!("CARGO_PKG_VERSION");
    let project = include_str!("../pyproject.toml");
    assert!(project.contains(&format!("\nversion = \"{version}\"\n")));
    let package = include_str!("../python/petcomp/__init__.py");
    assert!(package.contains(&format!("\n__version__ = \"{version}\"\n")));
}

/// What an extension of cargo's has, but for OpenImageIO.
#[test]
fn the_wheel_has_markers_and_the_studio() {
    let project = include_str!("../pyproject.toml");
    assert!(project.contains("\nfeatures = [\"markers\", \"studio\"]\n"));
    let package = include_str!("../Cargo.toml");
    assert!(package.contains("\ndefault = [\"markers\", \"oiio\", \"studio\"]\n"));
}
