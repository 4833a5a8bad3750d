//! A studio over a folder of its own, running for as long as a test does.

use petcomp_studio::{Server, Stop};
use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// A studio that listens.
pub(crate) struct Studio {
    /// `http://127.0.0.1:PORT/TOKEN/`
    pub(crate) address: String,
    stop: Stop,
}

impl Studio {
    pub(crate) fn over(folder: &Path) -> Self {
        let server = Server::open(folder, 0).unwrap();
        let studio = Self {
            address: server.address(),
            stop: server.stop(),
        };
        std::thread::spawn(|| server.run());
        studio
    }

    /// The address of a page: `corners`.
    pub(crate) fn page(&self, name: &str) -> String {
        format!("{}{name}", self.address)
    }

    /// `127.0.0.1:PORT`
    pub(crate) fn host(&self) -> &str {
        self.address.split('/').nth(2).unwrap()
    }

    /// `/TOKEN/`
    pub(crate) fn root(&self) -> &str {
        &self.address[7 + self.host().len()..]
    }

    /// Sends bytes and returns all that comes back, until the server closes or says nothing more for
    /// a while.
    pub(crate) fn send(&self, request: &[u8]) -> String {
        let mut stream = TcpStream::connect(self.host()).unwrap();
        let patience = Some(Duration::from_secs(15));
        stream.set_read_timeout(patience).unwrap();
        // A body that is refused need not be read to its end.
        let _ = stream.write_all(request);
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        String::from_utf8_lossy(&answer).into_owned()
    }

    /// What a GET of a path below the token gives: status line, headers and body.
    pub(crate) fn get(&self, path: &str) -> String {
        let (root, host) = (self.root(), self.host());
        self.send(
            format!("GET {root}{path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n")
                .as_bytes(),
        )
    }

    /// What a POST of JSON to a path below the token gives.
    pub(crate) fn post(&self, path: &str, body: &str) -> String {
        let (root, host, length) = (self.root(), self.host(), body.len());
        self.send(
            format!(
                "POST {root}{path} HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\nConnection: close\r\n\
                 Content-Type: application/json\r\nContent-Length: {length}\r\n\r\n{body}"
            )
            .as_bytes(),
        )
    }
}

impl Drop for Studio {
    fn drop(&mut self) {
        self.stop.stop();
    }
}

/// A folder of the repository's samples: `backgrounds`, `bottles`.
pub(crate) fn samples(name: &str) -> PathBuf {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/samples");
    Path::new(root).join(name)
}

/// Copies the files of a folder whose names `wanted` takes.
pub(crate) fn copy_files(from: &Path, to: &Path, wanted: impl Fn(&str) -> bool) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap().flatten() {
        let name = entry.file_name();
        if entry.path().is_file() && wanted(&name.to_string_lossy()) {
            std::fs::copy(entry.path(), to.join(name)).unwrap();
        }
    }
}
