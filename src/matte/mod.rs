//! Matte: a photo on a screen becomes a cut-out.
