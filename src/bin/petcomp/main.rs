//! The `petcomp` program.
fn main() {}
