//! OpenImageIO in a process of its own: a file that crashes it ends that process and is named, and programs that never
//! meet such a file never load it.
//!
//! The worker gets format, path, wanted channels and limits as arguments and answers on its standard output: a line of
//! JSON, then the samples in little-endian order. The parent believes nothing: it checks the sizes itself, and kills a
//! worker that takes too long.

use super::format::{Format, Source};
use super::limits::{Demand, Limits};
use super::raster::{Raster, Refusal, Samples, Wanted};
use crate::Error;
use serde::{Deserialize, Serialize};
use std::ffi::OsString;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitCode, Stdio};
use std::sync::mpsc;
use std::time::Duration;

/// Name of the worker program, looked for beside the running one.
const PROGRAM: &str = "petcomp-oiio-worker";
/// Names the worker program where it lies elsewhere.
const PROGRAM_VARIABLE: &str = "PETCOMP_OIIO_WORKER";
/// Asks the worker for its version instead.
const VERSION: &str = "--version";
/// Wall-clock time for any file, and for each further 10 million pixels that the limits allow to be asked for.
const PATIENCE: Duration = Duration::from_secs(10);
const PATIENCE_PER_10_MPX: Duration = Duration::from_secs(1);
/// No answer has a longer first line.
const LONGEST_LINE: u64 = 64 << 10;

/// What a worker is asked.
#[derive(Serialize, Deserialize)]
struct Question {
    format: String,
    wanted: Wanted,
    limits: Limits,
}

/// The first line of its answer.
#[derive(Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Answer {
    Picture { width: usize, height: usize, names: Vec<String>, sample: Sample, display_encoded: bool },
    Refused(String),
}

#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Sample {
    U8,
    U16,
    F32,
}

impl Sample {
    fn bytes(self) -> u64 {
        match self {
            Self::U8 => 1,
            Self::U16 => 2,
            Self::F32 => 4,
        }
    }
}

/// The picture as a worker sees it.
pub(super) fn decode(path: &Path, source: &Source, limits: &Limits, wanted: Wanted) -> Result<Raster, Refusal> {
    let program = program().ok_or_else(|| {
        format!("needs OpenImageIO, and {PROGRAM} is not beside this program ({PROGRAM_VARIABLE} may name it)")
    })?;
    let question = Question { format: source.format.name().into(), wanted, limits: limits.clone() };
    let question = serde_json::to_string(&question).map_err(|e| e.to_string())?;
    let child = Command::new(&program)
        .arg(question)
        .arg(path)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .map_err(|e| format!("needs OpenImageIO, and {} does not start: {e}", program.display()))?;
    let megapixels = u32::try_from(limits.pixels / 10_000_000).unwrap_or(u32::MAX);
    let patience = PATIENCE.saturating_add(PATIENCE_PER_10_MPX.saturating_mul(megapixels));
    answer(child, limits, source.bytes.len() as u64, patience)
}

/// The OpenImageIO that the worker program links, as that tells it.
///
/// # Errors
/// [`Error::File`] where there is no worker program or it does not start.
pub fn worker_version() -> crate::Result<String> {
    let program = program().ok_or_else(|| Error::file(PROGRAM, "not found beside this program"))?;
    let output = Command::new(&program).arg(VERSION).output().map_err(|e| Error::file(&program, e))?;
    match output.status.success() {
        true => Ok(String::from_utf8_lossy(&output.stdout).trim().to_owned()),
        false => Err(Error::file(&program, format!("does not run: {}", output.status))),
    }
}

/// Beside the running program; one folder up serves test programs, which cargo puts below the others.
fn program() -> Option<PathBuf> {
    if let Some(named) = std::env::var_os(PROGRAM_VARIABLE) {
        return Some(named.into());
    }
    let own = std::env::current_exe().ok()?;
    let name = format!("{PROGRAM}{}", std::env::consts::EXE_SUFFIX);
    own.ancestors().skip(1).take(2).map(|folder| folder.join(&name)).find(|p| p.is_file())
}

/// Waits for the answer, and not longer than `patience`.
fn answer(mut child: Child, limits: &Limits, file_bytes: u64, patience: Duration) -> Result<Raster, Refusal> {
    let pipe = child.stdout.take().ok_or("no pipe to the OpenImageIO worker")?;
    let (send, receive) = mpsc::channel();
    let limits = limits.clone();
    let reader = std::thread::spawn(move || {
        // Nobody listens any more when the parent has lost patience.
        let _ = send.send(receive_raster(pipe, &limits, file_bytes));
    });
    let received = receive.recv_timeout(patience);
    if received.is_err() {
        // It may have ended by itself in between.
        let _ = child.kill();
    }
    let status = child.wait().map_err(|e| e.to_string())?;
    let _ = reader.join();
    match received {
        Err(_) => Err(format!("OpenImageIO took longer than {} s", patience.as_secs()).into()),
        Ok(Ok(raster)) => Ok(raster),
        Ok(Err(what)) => Err(death(status).unwrap_or(what).into()),
    }
}

/// How the worker died, if it did not end by itself.
fn death(status: std::process::ExitStatus) -> Option<String> {
    #[cfg(unix)]
    if let Some(signal) = std::os::unix::process::ExitStatusExt::signal(&status) {
        return Some(format!("unreadable: OpenImageIO died on it (signal {signal})"));
    }
    let _ = status;
    None
}

fn receive_raster(pipe: impl Read, limits: &Limits, file_bytes: u64) -> Result<Raster, String> {
    let mut pipe = BufReader::new(pipe);
    let mut line = String::new();
    pipe.by_ref().take(LONGEST_LINE).read_line(&mut line).map_err(|_| "OpenImageIO worker: garbled answer")?;
    match serde_json::from_str(&line).map_err(|_| "OpenImageIO worker: garbled answer")? {
        Answer::Refused(what) => Err(what.lines().next().unwrap_or_default().into()),
        Answer::Picture { width, height, names, sample, display_encoded } => {
            let channels = names.len() as u64;
            let bytes_per_pixel = channels * sample.bytes();
            limits.check(Demand {
                width: width as u64,
                height: height as u64,
                channels,
                bytes_per_pixel,
                file_bytes,
            })?;
            let samples = receive_samples(pipe, sample, width * height * names.len())?;
            Ok(Raster { width, height, names, samples, display_encoded, premultiplied: false })
        }
    }
}

fn receive_samples(mut pipe: impl Read, sample: Sample, count: usize) -> Result<Samples, String> {
    let mut bytes = vec![0; count * sample.bytes() as usize];
    pipe.read_exact(&mut bytes).map_err(|_| "OpenImageIO worker: answer ends too early")?;
    Ok(match sample {
        Sample::U8 => Samples::U8(bytes),
        Sample::U16 => Samples::U16(bytes.chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect()),
        Sample::F32 => {
            Samples::F32(bytes.chunks_exact(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect())
        }
    })
}

/// The whole of the worker program: answers the question in its arguments.
pub fn serve(mut arguments: impl Iterator<Item = OsString>) -> ExitCode {
    let first = arguments.next();
    if first.as_deref().is_some_and(|argument| argument == VERSION) {
        let told = writeln!(std::io::stdout(), "OpenImageIO {}", super::oiio::version());
        return if told.is_ok() { ExitCode::SUCCESS } else { ExitCode::FAILURE };
    }
    let outcome = match (first, arguments.next()) {
        (Some(question), Some(path)) => decode_as_asked(&question.to_string_lossy(), Path::new(&path)),
        _ => Err(format!("{PROGRAM} is started by petcomp, with a question and a path").into()),
    };
    let sent = match outcome {
        Ok(raster) => send_raster(&raster),
        Err(what) => send_line(&Answer::Refused(what.to_string())),
    };
    if sent.is_ok() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

fn decode_as_asked(question: &str, path: &Path) -> Result<Raster, Refusal> {
    let Question { format, wanted, limits } = serde_json::from_str(question).map_err(|e| e.to_string())?;
    let format = Format::of_name(&format).ok_or("a format of an unknown name")?;
    let file_bytes = std::fs::metadata(path).map_err(|e| e.to_string())?.len();
    super::oiio::decode(path, format, file_bytes, &limits, wanted)
}

fn send_line(answer: &Answer) -> std::io::Result<()> {
    let mut line = serde_json::to_vec(answer)?;
    line.push(b'\n');
    std::io::stdout().write_all(&line)
}

fn send_raster(raster: &Raster) -> std::io::Result<()> {
    let (sample, bytes) = match &raster.samples {
        Samples::U8(v) => (Sample::U8, v.clone()),
        Samples::U16(v) => (Sample::U16, v.iter().flat_map(|x| x.to_le_bytes()).collect()),
        Samples::F32(v) => (Sample::F32, v.iter().flat_map(|x| x.to_le_bytes()).collect()),
    };
    let &Raster { width, height, ref names, display_encoded, .. } = raster;
    send_line(&Answer::Picture { width, height, names: names.clone(), sample, display_encoded })?;
    let mut out = std::io::stdout();
    out.write_all(&bytes)?;
    out.flush()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn received(bytes: &[u8]) -> Result<Raster, String> {
        receive_raster(bytes, &Limits::default(), 100)
    }

    const HEAD: &str = r#"{"picture":{"width":1,"height":1,"names":["Y"],"sample":"u16","display_encoded":true}}"#;

    #[test]
    fn an_answer_is_a_line_and_samples() {
        let raster = received(format!("{HEAD}\n\x01\x02").as_bytes()).unwrap();
        assert_eq!(raster.samples, Samples::U16(vec![0x0201]));
    }

    #[test]
    fn a_worker_is_not_believed() {
        assert!(received(b"").is_err());
        assert!(received(b"nonsense\n").is_err());
        assert!(received(format!("{HEAD}\n\x01").as_bytes()).unwrap_err().contains("too early"));
        let huge = HEAD.replace("\"width\":1", "\"width\":999999999");
        assert!(received(format!("{huge}\n").as_bytes()).unwrap_err().contains("Limits::side"));
        assert_eq!(received(b"{\"refused\":\"why\"}\n").unwrap_err(), "why");
    }

    #[cfg(unix)]
    #[test]
    fn a_worker_that_hangs_is_killed_and_one_that_dies_is_named() {
        let run = |script: &str| Command::new("sh").args(["-c", script]).stdout(Stdio::piped()).spawn().unwrap();
        let wait = |script: &str| {
            answer(run(script), &Limits::default(), 100, Duration::from_millis(200)).unwrap_err().to_string()
        };
        assert!(wait("exec sleep 30").contains("took longer"));
        let long = answer(run("kill -SEGV $$"), &Limits::default(), 100, PATIENCE).unwrap_err().to_string();
        assert_eq!(long, "unreadable: OpenImageIO died on it (signal 11)");
    }
}
