//! The protocol between petcomp and its worker program.
//!
//! The worker is started with [`Limits`] as its argument and sends a greeting. A request is a line
//! of JSON and the bytes of a file; a response is a line of JSON with the shape. If pixels were
//! requested, it is sent before they are decoded, and their own shape and the samples in native
//! byte order follow. The requesting side trusts nothing: it checks every size itself.

use crate::io::codec::Wanted;
use crate::io::codec::raster::{Raster, SampleKind, Samples};
use crate::io::codec::refusal::Refusal;
use crate::io::format::Format;
use crate::io::header::Window;
use crate::io::limits::{Demand, Limits};
use crate::io::source::SourceFile;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::io::{BufRead, Error, ErrorKind, Read, Result, Write};

/// Maximum length of a line.
const LONGEST_LINE_BYTES: u64 = 64 << 10;

/// What is requested about a file.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Request {
    /// Only its shape.
    Header,
    /// These pixels.
    Pixels { wanted: Wanted, window: Window },
}

/// OpenImageIO's response about a file, from this process or a worker.
pub(crate) enum Response {
    Shape(Shape),
    Raster(Raster),
}

/// OpenImageIO linked into this program, created by [`in_process`](crate::io::oiio::in_process).
#[derive(Clone, Copy)]
pub struct Linked(pub(in crate::io) LinkedAnswer);

type LinkedAnswer = fn(&SourceFile, &Limits, Request) -> std::result::Result<Response, Refusal>;

impl std::fmt::Debug for Linked {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Linked")
    }
}

/// The first line that a worker sends.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct Greeting {
    /// Version of the program that it belongs to.
    pub(super) petcomp: String,
    /// The libraries that it links, with their versions.
    pub(super) libraries: String,
    /// Parts of the sandbox that the system could not provide.
    pub(super) missing: Vec<String>,
}

/// The first line of a request; `bytes` bytes follow.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct RequestHead {
    pub(super) format: String,
    pub(super) ask: Request,
    pub(super) bytes: u64,
}

/// The first line of a response.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum ResponseHead {
    /// A picture that can be decoded, or one whose samples follow.
    Picture(Shape),
    /// Why there is no picture.
    Refused(String),
}

/// A picture without its samples.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Shape {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) names: Vec<String>,
    pub(crate) sample: SampleKind,
    pub(crate) display_encoded: bool,
}

impl Shape {
    /// The demand of a picture with this shape.
    fn demand(&self, file_bytes: u64) -> Demand {
        let size = [self.width as u64, self.height as u64];
        let channels = self.names.len() as u64;
        Demand::new(size, channels, self.sample.bytes(), file_bytes)
    }
}

impl From<&Raster> for Shape {
    fn from(raster: &Raster) -> Self {
        Self {
            width: raster.width,
            height: raster.height,
            names: raster.names.clone(),
            sample: raster.samples.kind(),
            display_encoded: raster.display_encoded,
        }
    }
}

/// Sends a value as a line of JSON.
pub(super) fn send_line(to: &mut impl Write, what: &impl Serialize) -> Result<()> {
    let mut line = serde_json::to_vec(what)?;
    line.push(b'\n');
    to.write_all(&line)
}

/// Receives a line.
pub(super) fn receive_line<T: DeserializeOwned>(from: &mut impl BufRead) -> Result<T> {
    let mut line = Vec::new();
    from.take(LONGEST_LINE_BYTES).read_until(b'\n', &mut line)?;
    match line.last() {
        None => Err(ErrorKind::UnexpectedEof.into()),
        Some(_) => serde_json::from_slice(&line).map_err(|e| Error::new(ErrorKind::InvalidData, e)),
    }
}

/// Sends a request about a file.
pub(super) fn send_request(
    to: &mut impl Write,
    format: Format,
    request: Request,
    file: &[u8],
) -> Result<()> {
    let head = RequestHead {
        format: format.name().into(),
        ask: request,
        bytes: file.len() as u64,
    };
    send_line(to, &head)?;
    to.write_all(file)?;
    to.flush()
}

/// Announces the shape of a picture that is about to be decoded.
pub(super) fn send_shape(to: &mut impl Write, shape: Shape) -> Result<()> {
    send_line(to, &ResponseHead::Picture(shape))?;
    to.flush()
}

/// Responds with a picture and its samples.
pub(super) fn send_raster(to: &mut impl Write, raster: &Raster) -> Result<()> {
    send_line(to, &ResponseHead::Picture(raster.into()))?;
    to.write_all(raster.samples.bytes())?;
    to.flush()
}

/// Receives a line of a response. A shape beyond the limits, which the worker also knows, is
/// invalid.
pub(crate) fn receive_shape(
    from: &mut impl BufRead,
    limits: &Limits,
    file_bytes: u64,
) -> Result<std::result::Result<Shape, Refusal>> {
    let shape = match receive_line(from)? {
        ResponseHead::Refused(what) => return Ok(Err(Refusal::Broken(what))),
        ResponseHead::Picture(shape) => shape,
    };
    limits
        .check(shape.demand(file_bytes))
        .map_err(|e| Error::new(ErrorKind::InvalidData, e))?;
    Ok(Ok(shape))
}

/// Receives the samples of a checked shape.
pub(crate) fn receive_samples(from: &mut impl Read, shape: Shape) -> Result<Raster> {
    let count = shape.width * shape.height * shape.names.len();
    let mut samples = Samples::zeroed(shape.sample, count);
    from.read_exact(samples.bytes_mut())?;
    Ok(Raster {
        width: shape.width,
        height: shape.height,
        names: shape.names,
        samples,
        display_encoded: shape.display_encoded,
        premultiplied: false,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn received(bytes: &[u8]) -> std::result::Result<Raster, String> {
        let mut from = bytes;
        let shape = receive_shape(&mut from, &Limits::default(), 100).map_err(|e| e.to_string())?;
        receive_samples(&mut from, shape.map_err(|e| e.to_string())?).map_err(|e| e.to_string())
    }

    const HEAD: &str =
        r#"{"picture":{"width":1,"height":1,"names":["Y"],"sample":"u16","display_encoded":true}}"#;

    #[test]
    fn what_is_sent_is_received() {
        let names = ["R", "G", "B"].map(String::from).to_vec();
        for samples in [
            Samples::U8(vec![1, 2, 3]),
            Samples::U16(vec![1, 2, 60_000]),
            Samples::F16([0.5, 1.0, 2.0].map(half::f16::from_f32).to_vec()),
            Samples::F32(vec![0.1, -1.0, f32::INFINITY]),
        ] {
            let sent = Raster {
                width: 1,
                height: 1,
                names: names.clone(),
                samples,
                display_encoded: false,
                premultiplied: false,
            };
            let mut pipe = Vec::new();
            send_raster(&mut pipe, &sent).unwrap();
            assert_eq!(received(&pipe).unwrap(), sent);
        }
    }

    #[test]
    fn a_worker_is_not_trusted() {
        assert!(received(b"").is_err());
        assert!(received(b"nonsense\n").is_err());
        assert!(received(&[b'x'; 1 << 17]).is_err());
        assert!(received(format!("{HEAD}\n\x01").as_bytes()).is_err());
        let huge = HEAD.replace("\"width\":1", "\"width\":999999999");
        assert!(
            received(format!("{huge}\n").as_bytes())
                .unwrap_err()
                .contains("Limits::side")
        );
        assert_eq!(received(b"{\"refused\":\"why\"}\n").unwrap_err(), "why");
    }
}
