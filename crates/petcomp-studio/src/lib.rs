//! `petcomp studio`: pages in this machine's browser for interactive tasks: a photo's corners, the
//! scale of a photo, mattes, a recipe, a dataset.
//!
//! Each page has a module of its own (`corners`, `scale`, `capture`, `mattes`, `recipe`, `dataset`)
//! with routes; its plain HTML, CSS and JavaScript modules in `pages/` are part of the program.
//! Shared by all pages:
//!
//! * [`Server`] listens on 127.0.0.1 and rejects requests without its token (`server`).
//! * `folder` turns a name from a browser into a path, never outside the folder, and never lets a
//!   page overwrite what another one has saved since.
//! * `turn` runs heavy work outside the threads that answer, and cancels work that a newer request
//!   replaces.
//! * `message` reads requests and writes answers.
//! * `refusal` is the error that a page receives.
#![warn(clippy::unwrap_used, clippy::print_stderr, clippy::print_stdout)]

mod capture;
mod corners;
mod dataset;
mod folder;
mod mattes;
mod message;
mod overview;
mod photos;
mod picture;
mod recipe;
mod refusal;
mod scale;
mod server;
mod studio;
mod turn;

pub use server::{Server, Stop};
