//! Blender's Keying node on a synthetic image: a semi-transparent pixel as keyed by several
//! versions.
//!
//! `cargo run --release --example key_like_blender`

use petcomp::matte::key::{KeyOptions, Keying, Profile, Screen};
use petcomp::{Image, LinearRgb, PremulRgba, Result};

fn main() -> Result<()> {
    let screen = LinearRgb::new(0.1, 0.8, 0.1);
    // 30 % grey film over the screen.
    let seen = PremulRgba::new(0.22, 0.71, 0.22, 1.0);
    let photo = Image::filled(8, 8, seen);
    for profile in [Profile::Blender34, Profile::Blender42, Profile::Blender45] {
        let options = KeyOptions {
            profile,
            ..KeyOptions::default()
        };
        let keyed = Keying::new(&photo, Screen::Color(screen)).run(&options)?;
        let (matte, color) = (keyed.matte[(4, 4)], keyed.cutout[(4, 4)]);
        println!("{profile:?}: matte {:.4}, red {:.4}", matte.0, color.r);
    }
    Ok(())
}
