//! `petcomp matte`: photo -> matte and cut-out.

mod cut;
mod film;
mod key;
mod nodes;
mod picture_files;
mod segment;

use crate::global::GlobalArgs;

#[derive(clap::Subcommand)]
pub(crate) enum MatteCommand {
    /// Find the object and write every intermediate picture, and the garbage and core matte that a
    /// keyer takes
    Segment(segment::SegmentArgs),
    /// Find the object, key it, and write it without its background
    Cut(cut::CutArgs),
    /// Key a picture, or the frames of a sequence, against a screen colour or plate, as Blender's
    /// Keying node does
    Key(Box<key::KeyArgs>),
    /// Solve one photo on a coloured screen for what it reflects and what it lets through
    Film(film::FilmArgs),
    /// The same, exactly, from two or more photos of one object on different screens
    Triangulate(film::TriangulateArgs),
    #[command(flatten)]
    Node(nodes::NodeCommand),
}

pub(crate) fn run(command: &MatteCommand, global: &GlobalArgs) -> anyhow::Result<()> {
    match command {
        MatteCommand::Segment(args) => segment::run(args, global),
        MatteCommand::Cut(args) => cut::run(args, global),
        MatteCommand::Key(args) => key::run(args, global),
        MatteCommand::Film(args) => args.run(global),
        MatteCommand::Triangulate(args) => args.run(global),
        MatteCommand::Node(command) => nodes::run(command),
    }
}
