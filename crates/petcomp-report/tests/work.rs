//! Large allocations, counted by the allocator of the program.

#[path = "../src/allocator.rs"]
mod allocator;

use petcomp::work::{Kind, LARGE_BYTES, counted};
use petcomp_report::work::measure;

#[test]
fn an_allocation_of_a_mebibyte_is_one_and_a_smaller_one_is_none() {
    let large = |bytes: usize| {
        counted(|| drop(std::hint::black_box(vec![1_u8; bytes])))
            .unwrap()
            .1[Kind::LargeAllocations]
    };
    assert_eq!(
        [LARGE_BYTES - 1, LARGE_BYTES, 3 * LARGE_BYTES].map(large),
        [0, 1, 1]
    );
    let (_, work) = counted(|| {
        std::hint::black_box(Vec::<u8>::with_capacity(LARGE_BYTES)).reserve_exact(2 * LARGE_BYTES)
    })
    .unwrap();
    assert_eq!(work[Kind::LargeAllocations], 2, "growing is another one");
}

#[test]
fn every_scene_is_as_promised_with_allocations_counted_too() {
    let rows = measure(|_, _| {}).unwrap();
    let broken: Vec<_> = rows.iter().filter(|row| !row.is_as_expected()).collect();
    assert!(broken.is_empty(), "{broken:#?}");
    let large = |name: &str| {
        let row = rows.iter().find(|row| row.scene == name).unwrap();
        row.counts
            .iter()
            .find(|(kind, _)| *kind == Kind::LargeAllocations)
            .unwrap()
            .1
    };
    // Of pictures of 320 x 240 pixels only the frame, 16 bytes a pixel, has a mebibyte; what
    // finishes it makes new ones.
    assert_eq!(
        ["labels", "nothing", "plate alone", "usual"].map(large),
        [0, 1, 1, 1]
    );
    assert!(large("finished") > large("usual"));
    assert_eq!(large("dim map"), large("usual"));
}
