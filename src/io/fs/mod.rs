//! Files and folders: opened without blocking, written completely or not at all, never outside
//! their folder.

mod atomic;
mod checksum;
mod distinct;
mod listing;
mod natural_order;
mod open;
mod own_file;
mod sanitize_path;
mod text_name;

pub use atomic::{absolute, check_folder_of, create_folder, relative, relative_on_disk};
pub use checksum::{Checksum, copy};
pub use distinct::check_distinct;
pub use listing::entries;
pub use sanitize_path::{below, inside};
pub use text_name::path_text;

pub(crate) use atomic::{
    Syncing, absolute_folder, remove_if_exists, sweep, sync_file_system, with_last_step,
    write_bytes, write_through,
};
pub(crate) use distinct::real_path;
pub(crate) use listing::{files_below, is_apple_double};
pub(crate) use natural_order::natural_key;
pub(crate) use open::{open_regular, read_regular, read_to_end, reason};
pub(crate) use own_file::{open_own, refuse_foreign};
pub(crate) use sanitize_path::{length_inside, or_working_folder, refuse_links};
pub(crate) use text_name::stem_text;
