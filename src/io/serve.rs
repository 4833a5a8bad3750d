//! The worker program: answers questions about files until nobody asks any more.

use super::confine::{Memory, confine};
use super::format::{Format, Source};
use super::limits::{Limits, at_most, machine_bytes};
use super::oiio;
use super::protocol::{Answer, Ask, Question, Ready, receive, send, send_raster};
use super::raster::Refusal;
use std::ffi::OsString;
use std::io::{BufRead, BufReader, Read, Result, Write};
use std::path::PathBuf;
use std::process::ExitCode;

/// The whole of the worker program; its argument is the [`Limits`] as JSON.
pub fn serve(mut arguments: impl Iterator<Item = OsString>) -> ExitCode {
    let argument = arguments.next().unwrap_or_default();
    let Ok(limits) = serde_json::from_str(&argument.to_string_lossy()) else {
        let _ = writeln!(
            std::io::stderr(),
            "petcomp starts this program to read pictures; people do not"
        );
        return ExitCode::FAILURE;
    };
    let (mut from, mut to) = (
        BufReader::new(std::io::stdin().lock()),
        std::io::stdout().lock(),
    );
    match answer_all(&limits, &mut from, &mut to) {
        Ok(()) => ExitCode::SUCCESS,
        Err(_) => ExitCode::FAILURE,
    }
}

fn answer_all(limits: &Limits, from: &mut impl BufRead, to: &mut impl Write) -> Result<()> {
    if let Err(e) = oiio::start() {
        return Err(std::io::Error::other(e.to_string()));
    }
    // Asked while files can be opened.
    machine_bytes();
    let (memory, missing) = confine(limits);
    send(
        to,
        &Ready {
            petcomp: env!("CARGO_PKG_VERSION").into(),
            openimageio: oiio::version(),
            missing,
        },
    )?;
    to.flush()?;
    while !from.fill_buf()?.is_empty() {
        let question: Question = receive(from)?;
        memory.allow(question.bytes, 0);
        let source = received_file(&question, limits, from)?;
        answer(&question, source, limits, memory, to)?;
        to.flush()?;
    }
    Ok(())
}

/// The file of a question; a format of an unknown name is for the answer to tell.
fn received_file(
    question: &Question,
    limits: &Limits,
    from: &mut impl Read,
) -> Result<std::result::Result<Source, String>> {
    at_most(question.bytes, limits.file_bytes, "bytes", "file_bytes")
        .map_err(std::io::Error::other)?;
    let mut bytes = vec![0; question.bytes as usize];
    from.read_exact(&mut bytes)?;
    let format = Format::of_name(&question.format).ok_or("a format of an unknown name");
    Ok(format
        .map(|format| Source {
            path: PathBuf::new(),
            bytes,
            format,
        })
        .map_err(String::from))
}

fn answer(
    question: &Question,
    source: std::result::Result<Source, String>,
    limits: &Limits,
    memory: Memory,
    to: &mut impl Write,
) -> Result<()> {
    let room = |decoded| memory.allow(question.bytes, decoded);
    let refused = |to: &mut _, e: &Refusal| send(to, &Answer::Refused(e.to_string()));
    let source = match source {
        Ok(source) => source,
        Err(e) => return refused(to, &e.into()),
    };
    match question.ask {
        Ask::Header => match oiio::shape(&source, limits) {
            Ok(shape) => send(to, &Answer::Picture(shape)),
            Err(e) => refused(to, &e),
        },
        Ask::Pixels { wanted, window } => match oiio::decode(&source, limits, wanted, window, room)
        {
            Ok(raster) => send_raster(to, &raster),
            Err(e) => refused(to, &e),
        },
    }
}
