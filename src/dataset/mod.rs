//! Dataset: images and labels in the layouts that trainers read.
