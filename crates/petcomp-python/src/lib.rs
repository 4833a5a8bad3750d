//! The native half of petcomp for Python: what the package `petcomp` in `python/` is written on.
//!
//! Documents (scenes, labels, settings) cross the border as JSON, pixels as arrays of NumPy: without
//! a copy where their layout allows it. Work is done on threads of its own while the interpreter is
//! free, and can be interrupted; see [`work`].
#![warn(clippy::unwrap_used, clippy::print_stdout, clippy::print_stderr)]

mod arrays;
mod asset;
mod camera;
mod document;
mod errors;
mod evaluate;
mod foreign;
mod generate;
mod lock;
mod messages;
mod picture;
mod pipeline;
mod program;
mod sample;
mod scene;
mod shot;
mod work;

/// The native module of the package petcomp, which documents its functions.
#[pyo3::pymodule]
mod _petcomp {
    #[pymodule_export]
    use crate::{
        asset::{build_assets, is_class_name, list_assets},
        camera::{Camera, read_camera, read_label, solve_camera},
        evaluate::{evaluate_boxes, evaluate_files},
        generate::{generate_from, generate_with},
        picture::{cut_out, key, read_picture, write_picture},
        pipeline::Pipeline,
        program::run_program,
        sample::Sample,
        scene::{check_scene, read_scene, write_scene},
        shot::render_shot,
        work::{end_callers, set_threads, share_memory},
    };
}
