//! Scene files of the reference renderer: any shot can be checked against Blender's Cycles.
//!
//! `export` writes a folder that `golden/render/scene_reference.py` renders; `import` reads such
//! files, so that both programs render the same scene.

mod export;
mod file;
mod import;

pub use export::{SCRIPT, export};
pub use import::import;
