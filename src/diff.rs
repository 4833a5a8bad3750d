//! Comparing two pictures the way `idiff` does.
