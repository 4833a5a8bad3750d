//! `petcomp matte`: photo -> matte and cut-out.

mod cut;
mod film;
mod key;
mod nodes;
mod picture;
mod segment;

use crate::common::Common;

#[derive(clap::Subcommand)]
pub(crate) enum Command {
    /// Find the object and write every intermediate picture, and the garbage and core matte that a keyer takes
    Segment(segment::Args),
    /// Find the object, key it, and write it without its background
    Cut(cut::Args),
    /// Key a picture against a screen colour or plate, as Blender's Keying node does
    Key(Box<key::Args>),
    /// Solve one photo on a coloured screen for what it reflects and what it lets through
    Film(film::Film),
    /// The same, exactly, from two or more photos of one object on different screens
    Triangulate(film::Triangulate),
    #[command(flatten)]
    Node(nodes::Command),
}

pub(crate) fn run(command: &Command, common: &Common) -> anyhow::Result<()> {
    match command {
        Command::Segment(args) => segment::run(args, common),
        Command::Cut(args) => cut::run(args, common),
        Command::Key(args) => key::run(args),
        Command::Film(args) => args.run(common),
        Command::Triangulate(args) => args.run(common),
        Command::Node(command) => nodes::run(command),
    }
}
