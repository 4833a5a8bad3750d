//! Disks that are full or may not be written, and what must not find its way into a file.

use crate::build::{inserted, segment};
use crate::make::{Folder, codes, opaque_codes};
use petcomp::LinearRgb;
use petcomp::io;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A small file system of its own, if this user may make one.
struct Mount(PathBuf);

impl Mount {
    fn new(place: PathBuf, options: &str) -> Option<Self> {
        std::fs::create_dir_all(&place).unwrap();
        let done = Command::new("mount")
            .args(["-t", "tmpfs", "-o", options, "petcomp-test"])
            .arg(&place)
            .output();
        let mounted = done.is_ok_and(|output| output.status.success());
        if !mounted {
            let _ = writeln!(
                std::io::stderr(),
                "skipped: no right to mount a small file system here"
            );
        }
        mounted.then_some(Self(place))
    }
}

impl Drop for Mount {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(&self.0).status();
    }
}

fn files(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .flatten()
        .map(|e| e.file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

#[test]
fn a_full_disk_is_named_and_the_old_file_stays() {
    let folder = Folder::new();
    let Some(mount) = Mount::new(folder.file("disk"), "size=64k") else {
        return;
    };
    let path = mount.0.join("a.png");
    io::write(&path, &codes(8, 8)).unwrap();
    let old = std::fs::read(&path).unwrap();
    let noise = petcomp::Image::from_fn(400, 400, |x, y| {
        LinearRgb::grey(((x * 7919 + y * 104_729) % 97) as f32 / 97.0)
    });
    let e = io::write(&path, &noise).unwrap_err().to_string();
    assert!(
        e.ends_with("a.png: cannot be written: no space left on the disk"),
        "{e}"
    );
    assert_eq!(std::fs::read(&path).unwrap(), old);
    let text = "x".repeat(1 << 20);
    assert!(
        io::write_text(mount.0.join("a.txt"), &text)
            .unwrap_err()
            .to_string()
            .contains("no space left")
    );
    assert_eq!(files(&mount.0), ["a.png"]);
}

#[test]
fn a_folder_that_may_not_be_written_is_named() {
    let folder = Folder::new();
    let Some(mount) = Mount::new(folder.file("disk"), "ro,size=64k") else {
        return;
    };
    let e = io::write(mount.0.join("a.png"), &codes(8, 8))
        .unwrap_err()
        .to_string();
    assert!(e.contains("a.png: cannot be written: read-only"), "{e}");
    assert!(
        io::create_folder(mount.0.join("sub"))
            .unwrap_err()
            .to_string()
            .contains("read-only")
    );
}

#[cfg(unix)]
#[test]
fn a_link_in_the_way_is_replaced_and_not_followed() {
    let folder = Folder::new();
    let elsewhere = folder.with("elsewhere.txt", b"mine");
    std::os::unix::fs::symlink(&elsewhere, folder.file("a.txt")).unwrap();
    io::write_text(folder.file("a.txt"), "theirs").unwrap();
    assert_eq!(std::fs::read(&elsewhere).unwrap(), b"mine");
    assert!(
        !std::fs::symlink_metadata(folder.file("a.txt"))
            .unwrap()
            .is_symlink()
    );
}

/// EXIF data with a place (GPS latitude) and a serial number (BodySerialNumber, 0xA431).
fn private_notes() -> Vec<u8> {
    let mut out = b"MM\0*\0\0\0\x08".to_vec();
    let entry = |tag: u16, kind: u16, count: u32, value: u32| -> Vec<u8> {
        [
            tag.to_be_bytes().to_vec(),
            kind.to_be_bytes().to_vec(),
            count.to_be_bytes().to_vec(),
            value.to_be_bytes().to_vec(),
        ]
        .concat()
    };
    // The first directory: where the EXIF (38) and GPS (56) directories are.
    out.extend([0, 2]);
    out.extend(entry(0x8769, 4, 1, 38));
    out.extend(entry(0x8825, 4, 1, 56));
    out.extend([0; 4]);
    out.extend([0, 1]);
    out.extend(entry(0xa431, 2, 12, 74));
    out.extend([0; 4]);
    out.extend([0, 1]);
    out.extend(entry(0x0001, 2, 2, u32::from_be_bytes(*b"N\0\0\0")));
    out.extend([0; 4]);
    out.extend(b"SN0123456789");
    out
}

#[test]
fn places_and_serial_numbers_stay_behind() {
    let folder = Folder::new();
    io::write(folder.file("a.jpg"), &opaque_codes(8, 8)).unwrap();
    let jpeg = std::fs::read(folder.file("a.jpg")).unwrap();
    let notes = segment(0xe1, &[b"Exif\0\0".as_slice(), &private_notes()].concat());
    let photo = folder.with("photo.jpg", &inserted(&jpeg, 2, &notes));
    let read = io::read::<LinearRgb>(&photo).unwrap();
    for name in ["out.png", "out.jpg", "out.tif", "out.exr"] {
        io::write(folder.file(name), &read).unwrap();
        let bytes = std::fs::read(folder.file(name)).unwrap();
        let holds = |text: &[u8]| bytes.windows(text.len()).any(|w| w == text);
        assert!(
            !holds(b"SN0123456789") && !holds(b"Exif") && !holds(b"GPS"),
            "{name}"
        );
    }
    let told = format!("{:?}", io::read_header(&photo).unwrap());
    assert!(!told.contains("SN0123456789"), "{told}");
}
