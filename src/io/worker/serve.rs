//! The worker program: responds to requests about files until there are none left.

use super::openimageio;
use super::protocol::{
    Greeting, Request, RequestHead, ResponseHead, receive_line, send_line, send_raster, send_shape,
};
use super::sandbox::{MemoryLimit, enter_sandbox};
use crate::io::codec::Wanted;
use crate::io::codec::raster::Raster;
use crate::io::codec::refusal::Refusal;
use crate::io::format::Format;
use crate::io::header::Window;
use crate::io::limits::{Limits, at_most, machine_bytes};
use crate::io::source::SourceFile;
use std::ffi::OsString;
use std::io::{BufRead, BufReader, Error, Read, Result, Write};
use std::path::PathBuf;
use std::process::ExitCode;

/// The entire worker program; its argument is the [`Limits`] as JSON.
pub fn serve(mut arguments: impl Iterator<Item = OsString>) -> ExitCode {
    let argument = arguments.next().unwrap_or_default();
    let Ok(limits) = serde_json::from_str(&argument.to_string_lossy()) else {
        let _ = writeln!(
            std::io::stderr(),
            "petcomp starts this program to read pictures; do not run it yourself"
        );
        return ExitCode::FAILURE;
    };
    let mut from = BufReader::new(std::io::stdin().lock());
    match respond_to_all(limits, &mut from, &mut std::io::stdout().lock()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(_) => ExitCode::FAILURE,
    }
}

fn respond_to_all(limits: Limits, from: &mut impl BufRead, to: &mut impl Write) -> Result<()> {
    openimageio::start().map_err(|e| Error::other(e.to_string()))?;
    // Queried while files can still be opened.
    machine_bytes();
    let (memory, missing) = enter_sandbox(&limits);
    greet(missing, to)?;
    let responder = Responder { limits, memory };
    while !from.fill_buf()?.is_empty() {
        responder.respond(from, to)?;
        to.flush()?;
    }
    Ok(())
}

fn greet(missing: Vec<String>, to: &mut impl Write) -> Result<()> {
    let greeting = Greeting {
        petcomp: env!("CARGO_PKG_VERSION").into(),
        libraries: openimageio::libraries(),
        missing,
    };
    send_line(to, &greeting)?;
    to.flush()
}

/// The state shared by all requests.
struct Responder {
    limits: Limits,
    memory: MemoryLimit,
}

impl Responder {
    fn respond(&self, from: &mut impl BufRead, to: &mut impl Write) -> Result<()> {
        let request: RequestHead = receive_line(from)?;
        self.memory.allow(request.bytes, 0);
        let bytes = self.receive_file(request.bytes, from)?;
        let Some(format) = Format::from_name(&request.format) else {
            return send_refusal(to, &"a format with an unknown name".into());
        };
        let source = SourceFile {
            path: PathBuf::new(),
            bytes,
            format,
        };
        self.respond_about(&source, request.ask, to)
    }

    fn receive_file(&self, bytes: u64, from: &mut impl Read) -> Result<Vec<u8>> {
        at_most(bytes, self.limits.file_bytes, "bytes", "file_bytes").map_err(Error::other)?;
        let mut file = vec![0; bytes as usize];
        from.read_exact(&mut file)?;
        Ok(file)
    }

    fn respond_about(
        &self,
        source: &SourceFile,
        request: Request,
        to: &mut impl Write,
    ) -> Result<()> {
        match request {
            Request::Header => match openimageio::shape(source, &self.limits) {
                Ok(shape) => send_shape(to, shape),
                Err(e) => send_refusal(to, &e),
            },
            Request::Pixels { wanted, window } => match self.decode(source, wanted, window, to) {
                Ok(raster) => send_raster(to, &raster),
                Err(e) => send_refusal(to, &e),
            },
        }
    }

    /// Decodes the pixels, with as much memory as they need; their shape is sent first.
    fn decode(
        &self,
        source: &SourceFile,
        wanted: Wanted,
        window: Window,
        to: &mut impl Write,
    ) -> std::result::Result<Raster, Refusal> {
        let prepare = |shape, decoded_bytes| {
            self.memory.allow(source.bytes.len() as u64, decoded_bytes);
            send_shape(to, shape).map_err(|e| Refusal::Broken(e.to_string()))
        };
        openimageio::decode(source, &self.limits, wanted, window, prepare)
    }
}

fn send_refusal(to: &mut impl Write, why: &Refusal) -> Result<()> {
    send_line(to, &ResponseHead::Refused(why.to_string()))
}
