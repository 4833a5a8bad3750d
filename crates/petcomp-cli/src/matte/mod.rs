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
    /// Find the object; write every intermediate image, and a garbage and a core matte for a keyer
    Segment(segment::SegmentArgs),
    /// Find and key the object, and write it without its background
    Cut(cut::CutArgs),
    /// Key an image or the frames of a sequence against a screen colour or plate, like Blender's
    /// Keying node
    Key(Box<key::KeyArgs>),
    /// Solve for an object's reflected light and transmittance from one photo on a coloured screen
    Film(film::FilmArgs),
    /// Solve exactly for reflected light and transmittance, from two or more photos on different
    /// screens
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
