//! What two benches of the keyer share.

use petcomp::matte::key::{KeyOptions, Profile};

/// Every stage of the keyer, as matte.py and the README have it.
pub(crate) fn all_stages(profile: Profile) -> KeyOptions {
    KeyOptions {
        blur_pre: 6,
        clip_black: 0.1,
        clip_white: 0.9,
        edge_kernel_radius: 3,
        blur_post: 4,
        dilate_distance: 3,
        feather_distance: 8,
        ..KeyOptions::for_profile(profile)
    }
}
