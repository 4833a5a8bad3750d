//! Pictures in and out: what they mean, that both decoders agree, and that bad files are met with
//! one clear line.

mod bad;
mod both_paths;
mod build;
mod damaged;
mod faults;
mod fuzz;
mod heic;
mod kinds;
mod make;
mod meaning;
mod processes;
mod promptness;
mod rare;
mod sweep;
mod valid;
mod worker;
