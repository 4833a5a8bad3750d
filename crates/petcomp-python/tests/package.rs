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
