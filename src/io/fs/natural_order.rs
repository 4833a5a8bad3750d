//! Natural sort order: `frame2` before `frame10`.

use std::cmp::Ordering;
use std::ffi::OsStr;
use std::path::Path;

/// The sort key of a name: its letters, with each run of digits as one number of any length.
pub(crate) fn natural_key(name: &OsStr) -> impl Iterator<Item = (u8, usize, &[u8])> {
    let name = name.as_encoded_bytes();
    let runs = name.chunk_by(|a, b| a.is_ascii_digit() && b.is_ascii_digit());
    runs.map(|run| match run[0] {
        b'0'..=b'9' => number_key(run),
        letter => (letter, 1, run),
    })
}

/// Numbers sort where digits do among letters, and by their length without leading zeros.
fn number_key(digits: &[u8]) -> (u8, usize, &[u8]) {
    let zeros = digits.iter().take_while(|&&digit| digit == b'0').count();
    let number = &digits[zeros..];
    (b'0', number.len(), number)
}

/// Compares by the first step that differs in natural order, then by its letters.
pub(super) fn compare_paths(a: &Path, b: &Path) -> Ordering {
    let mut steps = a.components().zip(b.components());
    let natural = match steps.find(|(a, b)| a != b) {
        Some((a, b)) => natural_key(a.as_os_str()).cmp(natural_key(b.as_os_str())),
        None => Ordering::Equal,
    };
    natural.then_with(|| a.cmp(b))
}
