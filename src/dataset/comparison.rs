//! Compares what would be written with what a file holds.

use std::io::{BufRead, Error, Result, Write};

/// Takes bytes and fails at the first that is not the next one of a file.
pub(super) struct Comparison<R> {
    file: R,
}

impl<R: BufRead> Comparison<R> {
    pub(super) fn new(file: R) -> Self {
        Self { file }
    }

    /// Whether the file ends here.
    pub(super) fn is_at_end(&mut self) -> bool {
        self.file.fill_buf().is_ok_and(<[u8]>::is_empty)
    }
}

impl<R: BufRead> Write for Comparison<R> {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        let next = self.file.fill_buf()?;
        let count = next.len().min(bytes.len());
        let is_beyond_end = count == 0 && !bytes.is_empty();
        if is_beyond_end || next[..count] != bytes[..count] {
            return Err(Error::other("the file holds something else"));
        }
        self.file.consume(count);
        Ok(count)
    }

    fn flush(&mut self) -> Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::BufReader;

    /// Whether a file holds these bytes, read in small pieces.
    fn is_same(file: &[u8], bytes: &[u8]) -> bool {
        let mut comparison = Comparison::new(BufReader::with_capacity(3, file));
        comparison.write_all(bytes).is_ok() && comparison.is_at_end()
    }

    #[test]
    fn other_shorter_and_longer_files_differ() {
        assert!(is_same(b"", b""));
        assert!(is_same(b"labels\n", b"labels\n"));
        for other in [b"label\n".as_slice(), b"labels\n\n", b"Labels\n", b"labels"] {
            assert!(!is_same(other, b"labels\n"));
        }
    }
}
