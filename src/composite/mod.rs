//! Composite: deep samples over a shadowed plate.
