//! `petcomp studio`: pages in the browser of this machine for what hands and eyes do better than a
//! command line. A photo's corners, the scale of a photo, mattes, a recipe, a dataset.
//!
//! Each page is a room of its own (`corners`, `scale`, `capture`, `mattes`, `recipe`, `dataset`) with routes, and
//! pages of plain HTML, CSS and modules in `pages/` that are part of the program. What rooms share:
//!
//! * [`Server`] listens on 127.0.0.1 and answers nobody without its token (`server`).
//! * `folder` turns a name from a browser into a path, never out of the folder, and never lets a
//!   page overwrite what another one has saved since.
//! * `turn` keeps heavy work away from the threads that answer, and gives up what was asked for
//!   again since.
//! * `message` reads and writes what pages send and are sent.
//! * `refusal` is what a page is told when something cannot be done.
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
