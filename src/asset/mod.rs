//! Asset: a cut-out with its real size, outline and class, kept in a folder with one manifest.
//!
//! An asset folder holds `assets.toml` ([`Manifest`]) and, in a folder for each asset, its cut-outs
//! (half-float EXR, scene-linear: `R G B A` premultiplied, `TR TG TB` transmittance as measured,
//! `VR VG VB` that of the line of sight) with a thumbnail PNG beside each and, where stripes
//! measured it, the refraction (`NAME.flow.exr`). The manifest is written last and whole, so that a
//! folder never names a missing picture, and with a checksum of each cut-out, so that one that it
//! does not list is noticed.
//!
//! ```text
//! photos.toml -build-> folder and Library        folder -Library::open-> Library        photo -add_photo-> the same folder
//! ```

mod body;
mod build;
mod capture_entry;
mod captured;
mod concave;
mod contact_sheet;
mod entry;
mod equirectangular;
mod files;
mod flow_file;
mod flow_sheet;
mod folder;
mod inpaint;
mod inputs;
mod journal;
mod library;
mod list;
mod manifest;
mod measure;
mod moments;
mod open_photo;
mod panorama;
mod pixels;
mod rectified;
mod review;
mod role;
mod scale;
mod screen_pose;
mod screen_source;
mod size;
pub(crate) mod spreadsheet;
mod surface;
mod texture;
mod thumbnail;
mod top_view;

#[doc(hidden)]
pub use build::Built;
pub use build::{build, resume};
#[doc(hidden)]
pub use capture_entry::CaptureEntry;
#[doc(hidden)]
pub use contact_sheet::{contact_sheet_page, contact_sheets, remove_contact_sheet};
pub use entry::PhotoEntry;
#[cfg(test)]
pub(crate) use equirectangular::direction_to_uv;
#[doc(hidden)]
pub use equirectangular::uv_to_direction;
pub use folder::add_photo;
pub use library::{Library, Photo};
pub use list::List;
#[doc(hidden)]
pub use list::{check_cut_out_files, check_not_written_over, with_actual_spelling};
pub use manifest::Asset;
#[doc(hidden)]
pub use manifest::{CaptureRecord, Manifest, PhotoRecord, is_class_name};
#[doc(hidden)]
pub use moments::{Moments, Piece};
#[doc(hidden)]
pub use open_photo::OpenPhoto;
pub use panorama::Panorama;
pub(crate) use panorama::warn_of_bits;
pub use pixels::Pixels;
pub(crate) use pixels::{check_unchanged, most_bytes};
pub use review::{Review, Verdict};
#[doc(hidden)]
pub use role::Role;
pub use scale::Scale;
pub use screen_source::ScreenSource;
#[doc(hidden)]
pub use surface::{SurfaceCache, SurfaceTexel};
pub use texture::Texture;

/// Name of the manifest in an asset folder.
pub const MANIFEST: &str = "assets.toml";

/// Name of the contact sheet that the program draws in an asset folder: of its first page.
#[doc(hidden)]
pub const CONTACT_SHEET: &str = "contact_sheet.png";

/// Thickness of an asset where none is given, metres: the thin box of the paper's colliders.
pub(crate) const DEFAULT_THICKNESS: f64 = 0.005;

/// Mass of an asset where none is given, kilograms: a PET bottle of half a litre to a litre.
pub(crate) const DEFAULT_MASS: f64 = 0.025;
