//! Is a scene possible? Asked once, before any work.
