//! What petcomp and its worker program say to each other.
//!
//! The worker is started with [`Limits`] as its argument and says that it is ready. A question is a line of JSON and the
//! bytes of a file; an answer is a line of JSON and, where pixels were asked for, the samples in native byte order. The
//! side that asks believes nothing: it checks every size itself.

use super::limits::{Demand, Limits};
use super::raster::{Raster, Refusal, Samples, Wanted};
use super::{Format, Window};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::io::{BufRead, Error, ErrorKind, Read, Result, Write};

/// No line is longer.
const LONGEST_LINE: u64 = 64 << 10;

/// What is asked about a file.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Ask {
    /// Its shape alone.
    Header,
    /// These pixels.
    Pixels { wanted: Wanted, window: Window },
}

/// The first line of a question; so many bytes follow.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Question {
    pub(super) format: String,
    pub(super) ask: Ask,
    pub(super) bytes: u64,
}

/// What the worker says first.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct Ready {
    /// Version of the program it belongs to.
    pub(super) petcomp: String,
    /// Version of the OpenImageIO that it links.
    pub(super) openimageio: String,
    /// Confinement that the system could not give it.
    pub(super) missing: Vec<String>,
}

/// The first line of an answer.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Answer {
    /// A picture; its samples follow if pixels were asked for.
    Picture(Shape),
    /// Why there is none.
    Refused(String),
}

/// What OpenImageIO says about a file, here or in a worker.
pub(super) enum Told {
    Shape(Shape),
    Raster(Raster),
}

/// A picture without its samples.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Shape {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) names: Vec<String>,
    pub(super) sample: Sample,
    pub(super) display_encoded: bool,
}

/// How a sample is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Sample {
    U8,
    U16,
    F16,
    F32,
}

impl Sample {
    pub(super) fn bytes(self) -> u32 {
        match self {
            Self::U8 => 1,
            Self::U16 | Self::F16 => 2,
            Self::F32 => 4,
        }
    }

    pub(super) fn of(samples: &Samples) -> Self {
        match samples {
            Samples::U8(_) => Self::U8,
            Samples::U16(_) => Self::U16,
            Samples::F16(_) => Self::F16,
            Samples::F32(_) => Self::F32,
        }
    }
}

/// Sends something as a line.
pub(super) fn send(to: &mut impl Write, what: &impl Serialize) -> Result<()> {
    let mut line = serde_json::to_vec(what)?;
    line.push(b'\n');
    to.write_all(&line)
}

/// Receives a line.
pub(super) fn receive<T: DeserializeOwned>(from: &mut impl BufRead) -> Result<T> {
    let mut line = Vec::new();
    from.take(LONGEST_LINE).read_until(b'\n', &mut line)?;
    match line.last() {
        None => Err(ErrorKind::UnexpectedEof.into()),
        Some(_) => serde_json::from_slice(&line).map_err(|e| Error::new(ErrorKind::InvalidData, e)),
    }
}

/// Asks about a file.
pub(super) fn ask(to: &mut impl Write, format: Format, ask: Ask, file: &[u8]) -> Result<()> {
    send(
        to,
        &Question {
            format: format.name().into(),
            ask,
            bytes: file.len() as u64,
        },
    )?;
    to.write_all(file)?;
    to.flush()
}

/// Answers with a picture and its samples.
pub(super) fn send_raster(to: &mut impl Write, raster: &Raster) -> Result<()> {
    let &Raster {
        width,
        height,
        ref names,
        ref samples,
        display_encoded,
        ..
    } = raster;
    let shape = Shape {
        width,
        height,
        names: names.clone(),
        sample: Sample::of(samples),
        display_encoded,
    };
    send(to, &Answer::Picture(shape))?;
    to.write_all(match samples {
        Samples::U8(v) => v,
        Samples::U16(v) => bytemuck::cast_slice(v),
        Samples::F16(v) => bytemuck::cast_slice(v),
        Samples::F32(v) => bytemuck::cast_slice(v),
    })?;
    to.flush()
}

/// Receives the first line of an answer. A shape beyond the limits, which the worker knows too, is nonsense.
pub(super) fn receive_shape(
    from: &mut impl BufRead,
    limits: &Limits,
    file_bytes: u64,
) -> Result<std::result::Result<Shape, Refusal>> {
    let shape = match receive(from)? {
        Answer::Refused(what) => return Ok(Err(Refusal::Broken(what))),
        Answer::Picture(shape) => shape,
    };
    let channels = shape.names.len() as u64;
    let bytes_per_pixel = channels * u64::from(shape.sample.bytes());
    let (width, height) = (shape.width as u64, shape.height as u64);
    let demand = Demand {
        width,
        height,
        channels,
        bytes_per_pixel,
        file_bytes,
    };
    limits
        .check(demand)
        .map_err(|e| Error::new(ErrorKind::InvalidData, e))?;
    Ok(Ok(shape))
}

/// Receives the samples of a shape that was checked.
pub(super) fn receive_samples(from: &mut impl Read, shape: Shape) -> Result<Raster> {
    let Shape {
        width,
        height,
        names,
        sample,
        display_encoded,
    } = shape;
    let count = width * height * names.len();
    let samples = match sample {
        Sample::U8 => Samples::U8(filled(from, count)?),
        Sample::U16 => Samples::U16(filled(from, count)?),
        Sample::F16 => Samples::F16(filled(from, count)?),
        Sample::F32 => Samples::F32(filled(from, count)?),
    };
    Ok(Raster {
        width,
        height,
        names,
        samples,
        display_encoded,
        premultiplied: false,
    })
}

fn filled<T: bytemuck::Pod>(from: &mut impl Read, count: usize) -> Result<Vec<T>> {
    let mut samples = bytemuck::zeroed_vec(count);
    from.read_exact(bytemuck::cast_slice_mut(&mut samples))?;
    Ok(samples)
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
    fn a_worker_is_not_believed() {
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
