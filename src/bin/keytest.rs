//! x
#[path = "petcomp/matte_key.rs"]
mod matte_key;
use clap::Parser;
#[derive(Parser)]
enum Cli { Key(matte_key::Args) }
fn main() -> anyhow::Result<()> { env_logger::init(); match Cli::parse() { Cli::Key(a) => matte_key::run(&a) } }
