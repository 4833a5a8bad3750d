//! AprilTags of the family `tag36h11`, as they are drawn.

/// Cells along a side of a tag's black square.
pub(super) const TAG_CELLS: usize = 8;
/// The bits of the first tags of the family, from the highest (tag36h11.c of the AprilTag library).
#[rustfmt::skip]
const CODES: [u64; 72] = [
    0xd_7e00_984b, 0xd_da66_4ca7, 0xd_c4a1_c821, 0xe_17b4_70e9, 0xe_f91d_01b1, 0xf_429c_dd73,
    0x5da2_9225, 0x1_106c_ba43, 0x2_23be_d79d, 0x2_1f51_213c, 0x3_3eb1_9ca6, 0x3_f76e_b0f8,
    0x4_69a9_7414, 0x4_5dcf_e0b0, 0x4_a646_5f72, 0x5_1801_db96, 0x5_eb94_6b4e, 0x6_8a7c_c2ec,
    0x6_f0ba_2652, 0x7_8765_559d, 0x8_7b83_d129, 0x8_6cc4_a5c5, 0x8_b64d_f90f, 0x9_c577_b611,
    0xa_3810_f2f5, 0xa_f4d7_5b83, 0xb_59a0_3fef, 0xb_b109_6f85, 0xd_1b92_fc76, 0xd_0dd5_09d2,
    0xe_2cfd_a160, 0x2_ff49_7c63, 0x4_7240_671b, 0x5_047a_2e55, 0x6_35ca_87c7, 0x6_9125_4166,
    0x6_8f43_d94a, 0x6_ef24_bdb6, 0x8_cdd8_f886, 0x9_de96_b718, 0xa_ff6e_5a8a, 0xb_ae46_f029,
    0xd_225b_6d59, 0xd_f8ba_8c01, 0xe_3744_a22f, 0xf_bb59_375d, 0x1_8a91_6828, 0x2_2f29_c1ba,
    0x2_8688_7d58, 0x4_1392_322e, 0x7_5d18_ecd1, 0x8_7c30_2743, 0x8_c631_7ba9, 0x9_e40f_36d7,
    0xc_0e5a_806a, 0xc_c78c_b87c, 0x1_2d2f_2d01, 0x3_79f3_6a21, 0x6_973f_59ac, 0x7_789e_a9f4,
    0x8_f1c7_3e84, 0x8_dd28_7a20, 0x9_4a4e_ee4c, 0xa_4553_79b5, 0xa_9e92_987d, 0xb_d25c_b40b,
    0xb_e98d_3582, 0xd_3d59_72b2, 0x1_4c53_d7c7, 0x4_f179_6936, 0x4_e71f_ed1a, 0x6_6d46_fae0,
];
/// Where each bit lies: row and column, two digits, in the square of eight by eight cells.
const ROW_AND_COLUMN: [u8; 36] = [
    11, 12, 13, 14, 15, 22, 23, 24, 33, 16, 26, 36, 46, 56, 25, 35, 45, 34, 66, 65, 64, 63, 62, 55,
    54, 53, 44, 61, 51, 41, 31, 21, 52, 42, 32, 43,
];

/// Whether a cell of a tag is white, from its top left.
///
/// # Panics
/// For a number beyond the tags that frames use.
pub(crate) fn is_white(id: u32, row: usize, column: usize) -> bool {
    let cell = 10 * row + column;
    let mut bits = ROW_AND_COLUMN.iter();
    let bit = bits.position(|&at| usize::from(at) == cell);
    bit.is_some_and(|bit| CODES[id as usize] >> (35 - bit) & 1 == 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tags_differ_in_as_many_bits_as_the_family_promises() {
        let pairs = (0..CODES.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
        for (i, j) in pairs {
            assert!((CODES[i] ^ CODES[j]).count_ones() >= 11, "{i} and {j}");
        }
    }

    #[test]
    fn the_border_is_black() {
        for i in 0..TAG_CELLS {
            assert!(!is_white(5, 0, i) && !is_white(5, i, 7));
        }
    }
}
