//! Copies files only if they are unchanged since they were written.

use super::atomic::write_through;
use super::open::{open_regular, reason};
use crate::error::{Error, Result};
use std::io::{ErrorKind, Read, Write};
use std::path::Path;

/// Length and CRC-32 of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Checksum {
    /// Its length.
    pub bytes: u64,
    /// CRC-32 of its bytes.
    pub crc32: u32,
}

impl Checksum {
    /// The checksum of a regular file, which is read to its end.
    ///
    /// # Errors
    /// [`Error::File`] for one that cannot be read.
    pub fn from_file(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let (file, _) = open_regular(path, (u64::MAX, "file_bytes"), "file")?;
        copy_bytes(file, &mut std::io::sink()).map_err(|e| Error::file(path, reason(&e)))
    }
}

/// Copies a file atomically if it is unchanged: if its length or content differs, it is rejected
/// and nothing is written.
///
/// # Errors
/// [`Error::File`] for the file that cannot be read or written.
pub fn copy(from: impl AsRef<Path>, to: impl AsRef<Path>, expected: Checksum) -> Result<()> {
    let (from, to) = (from.as_ref(), to.as_ref());
    let (file, bytes) = open_regular(from, (u64::MAX, "file_bytes"), "file")?;
    if bytes != expected.bytes {
        return Err(changed(from));
    }
    let mut same = true;
    let written = write_through(to, |out| {
        same = copy_bytes(file.take(bytes), out)? == expected;
        if same {
            Ok(())
        } else {
            Err(std::io::Error::other("other bytes"))
        }
    });
    if same { written } else { Err(changed(from)) }
}

fn changed(path: &Path) -> Error {
    Error::file(path, "has changed since it was written")
}

/// Bytes copied at a time.
const PIECE_BYTES: usize = 1 << 16;

/// Copies everything from one to the other.
fn copy_bytes(mut from: impl Read, to: &mut dyn Write) -> std::io::Result<Checksum> {
    let (mut hasher, mut bytes) = (crc32fast::Hasher::new(), 0);
    let mut piece = vec![0; PIECE_BYTES];
    loop {
        let filled = read_some(&mut from, &mut piece)?;
        if filled == 0 {
            break;
        }
        hasher.update(&piece[..filled]);
        to.write_all(&piece[..filled])?;
        bytes += filled as u64;
    }
    let crc32 = hasher.finalize();
    Ok(Checksum { bytes, crc32 })
}

/// Reads some bytes, retrying when interrupted; none at the end.
fn read_some(from: &mut impl Read, piece: &mut [u8]) -> std::io::Result<usize> {
    loop {
        match from.read(piece) {
            Err(e) if e.kind() == ErrorKind::Interrupted => continue,
            done => return done,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::fs::write_bytes;

    #[test]
    fn a_copy_is_made_of_what_was_written_and_of_nothing_else() {
        let dir = tempfile::tempdir().unwrap();
        let [from, to] = ["a", "b"].map(|name| dir.path().join(name));
        write_bytes(&from, &vec![7; 2 * PIECE_BYTES + 3]).unwrap();
        let sum = Checksum::from_file(&from).unwrap();
        assert_eq!(
            sum,
            Checksum {
                bytes: 2 * PIECE_BYTES as u64 + 3,
                crc32: crc32fast::hash(&vec![7; 2 * PIECE_BYTES + 3])
            }
        );
        for wrong in [
            Checksum { bytes: 5, ..sum },
            Checksum {
                crc32: sum.crc32 ^ 1,
                ..sum
            },
        ] {
            let message = copy(&from, &to, wrong).unwrap_err().to_string();
            assert!(
                message.ends_with("a: has changed since it was written"),
                "{message}"
            );
            assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1);
        }
        copy(&from, &to, sum).unwrap();
        assert_eq!(std::fs::read(&to).unwrap(), std::fs::read(&from).unwrap());
    }
}
