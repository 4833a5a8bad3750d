//! `make fuzz`.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    petcomp::fuzzing::coco(bytes);
});
