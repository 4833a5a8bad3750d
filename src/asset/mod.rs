//! Asset: a cut-out with its real size, outline and class, kept in a folder with one manifest.
