//! The worker that reads what only OpenImageIO can.
fn main() {}
