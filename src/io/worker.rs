//! OpenImageIO in processes of their own: a file that crashes it ends such a process and is named, and programs that
//! never meet such a file never load it.
//!
//! A worker lives as long as this program and answers one question at a time; there are as many as ever asked at once.
//! One that dies is replaced and the file tried once more, one that takes too long is killed.

use super::format::Source;
use super::limits::Limits;
use super::patience::Pipe;
use super::protocol::{self, Ask, Ready, Shape, Told};
use super::raster::Refusal;
use crate::Error;
use std::io::{BufReader, ErrorKind};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::{Mutex, Once, PoisonError};
use std::time::{Duration, Instant};

/// Name of the worker program, looked for beside the running one.
const PROGRAM: &str = "petcomp-oiio-worker";
/// Names the worker program where it lies elsewhere.
const PROGRAM_VARIABLE: &str = "PETCOMP_OIIO_WORKER";
/// What of the environment a worker sees: OpenImageIO and OpenColorIO take settings from the rest.
const ENVIRONMENT: [&str; 1] = ["LD_LIBRARY_PATH"];
/// Time for loading 260 libraries on a busy machine.
const START: Duration = Duration::from_secs(60);
/// Pixels that earn a worker a further second.
const PIXELS_PER_SECOND: u64 = 10_000_000;
/// How often a file is tried.
const TRIES: usize = 2;
/// How often a worker is started that ends before it greets: it has seen no file yet, so none is to blame.
const STARTS: usize = 3;
/// A worker that closed its pipes is ending, and is waited for so long before it is killed.
const LAST_BREATH: Duration = Duration::from_secs(2);

/// The workers of this program that have nothing to do.
static IDLE: Pool = Pool {
    idle: Mutex::new(Vec::new()),
};

/// What a worker says about a file. A strict one refuses to be read by a worker that the system does not confine.
pub(super) fn ask(
    source: &Source,
    limits: &Limits,
    strict: bool,
    ask: Ask,
) -> Result<Told, Refusal> {
    let program = program().ok_or_else(|| {
        format!("needs OpenImageIO, and {PROGRAM} is not beside this program ({PROGRAM_VARIABLE} may name it)")
    })?;
    IDLE.ask(&program, source, limits, strict, ask)
}

/// The OpenImageIO that the worker program links, as that tells it.
///
/// # Errors
/// [`Error::File`] where there is no worker program or it does not start.
pub fn worker_version() -> crate::Result<String> {
    let program = program().ok_or_else(|| Error::file(PROGRAM, "not found beside this program"))?;
    let worker =
        Worker::start(&program, &Limits::default()).map_err(|e| Error::file(&program, e))?;
    Ok(format!("OpenImageIO {}", worker.ready.openimageio))
}

/// Beside the running program; one folder up serves test programs, which cargo puts below the others.
fn program() -> Option<PathBuf> {
    if let Some(named) = std::env::var_os(PROGRAM_VARIABLE) {
        return Some(named.into());
    }
    let own = std::env::current_exe().ok()?;
    let name = format!("{PROGRAM}{}", std::env::consts::EXE_SUFFIX);
    own.ancestors()
        .skip(1)
        .take(2)
        .map(|folder| folder.join(&name))
        .find(|p| p.is_file())
}

/// Workers that wait for a question.
struct Pool {
    idle: Mutex<Vec<Worker>>,
}

/// Why a worker gave no answer.
#[derive(Debug)]
enum Failure {
    /// It ended, or spoke nonsense: the next one may do better.
    Died(String),
    /// It, and so the file, had its time.
    Slow(Duration),
}

impl Pool {
    fn ask(
        &self,
        program: &Path,
        source: &Source,
        limits: &Limits,
        strict: bool,
        ask: Ask,
    ) -> Result<Told, Refusal> {
        let mut cause = String::new();
        for attempt in 0..TRIES {
            // The second try is for a worker that nothing has happened to yet.
            let idle = if attempt == 0 {
                self.take(limits)
            } else {
                None
            };
            let mut worker = match idle {
                Some(worker) => worker,
                None => Worker::start(program, limits)?,
            };
            worker.confinement(strict)?;
            match worker.answer(source, ask) {
                Ok(answer) => {
                    self.idle
                        .lock()
                        .unwrap_or_else(PoisonError::into_inner)
                        .push(worker);
                    return answer;
                }
                Err(Failure::Slow(patience)) => {
                    let seconds = patience.as_secs_f64();
                    return Err(format!(
                        "unreadable: OpenImageIO took longer than {seconds} s (Limits::seconds)"
                    )
                    .into());
                }
                Err(Failure::Died(how)) => {
                    log::debug!("{}: OpenImageIO died on it ({how})", source.path.display());
                    cause = how;
                }
            }
        }
        Err(format!("unreadable: OpenImageIO died on it {TRIES} times ({cause})").into())
    }

    /// One that was started with these limits.
    fn take(&self, limits: &Limits) -> Option<Worker> {
        let mut idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        let at = idle.iter().rposition(|worker| worker.limits == *limits)?;
        Some(idle.swap_remove(at))
    }
}

/// A running worker program; killed when it is dropped.
struct Worker {
    child: Child,
    to: Pipe,
    from: BufReader<Pipe>,
    limits: Limits,
    ready: Ready,
}

impl Drop for Worker {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Worker {
    fn start(program: &Path, limits: &Limits) -> Result<Self, Refusal> {
        let not_started = |how: &dyn std::fmt::Display| {
            format!(
                "needs OpenImageIO, and {} does not start: {how}",
                program.display()
            )
        };
        let mut cause = String::new();
        for _ in 0..STARTS {
            let mut worker = Self::launch(program, limits).map_err(|e| not_started(&e))?;
            let Err(e) = worker.greeting() else {
                return Ok(worker);
            };
            cause = worker.how_it_died(&e);
            if !has_closed(&e) {
                break;
            }
        }
        Err(not_started(&cause).into())
    }

    /// A process that has said nothing yet.
    fn launch(program: &Path, limits: &Limits) -> std::io::Result<Self> {
        let mut child = Command::new(program)
            .arg(serde_json::to_string(limits)?)
            .env_clear()
            .envs(
                ENVIRONMENT
                    .iter()
                    .filter_map(|name| Some((name, std::env::var_os(name)?))),
            )
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()?;
        let pipes = child.stdin.take().zip(child.stdout.take());
        let (stdin, stdout) = pipes.ok_or_else(|| std::io::Error::other("no pipe to it"))?;
        let (to, from) = (
            Pipe::new(stdin.into())?,
            BufReader::new(Pipe::new(stdout.into())?),
        );
        Ok(Self {
            child,
            to,
            from,
            limits: limits.clone(),
            ready: Ready::default(),
        })
    }

    fn greeting(&mut self) -> std::io::Result<()> {
        self.from.get_mut().deadline = Instant::now() + START;
        self.ready = protocol::receive(&mut self.from)?;
        if self.ready.petcomp != env!("CARGO_PKG_VERSION") {
            return Err(std::io::Error::other(format!(
                "belongs to petcomp {}",
                self.ready.petcomp
            )));
        }
        Ok(())
    }

    /// What the system could not give it is an error where that is asked for, and a warning elsewhere.
    fn confinement(&self, strict: bool) -> Result<(), Refusal> {
        let missing = self.ready.missing.join("; ");
        match (strict, missing.is_empty()) {
            (_, true) => Ok(()),
            (true, _) => Err(format!(
                "needs OpenImageIO, and its worker cannot be confined here ({missing})"
            )
            .into()),
            (false, _) => {
                warn_of(&missing);
                Ok(())
            }
        }
    }

    fn answer(&mut self, source: &Source, ask: Ask) -> Result<Result<Told, Refusal>, Failure> {
        let started = Instant::now();
        let mut patience = Duration::from_secs(self.limits.seconds);
        self.wait_until(started + patience);
        let shape = match self
            .ask_shape(source, ask)
            .map_err(|e| self.failure(e, patience))?
        {
            Ok(shape) if ask != Ask::Header => shape,
            other => return Ok(other.map(Told::Shape)),
        };
        patience += patience_for(&shape);
        self.wait_until(started + patience);
        let raster = protocol::receive_samples(&mut self.from, shape)
            .map_err(|e| self.failure(e, patience))?;
        Ok(Ok(Told::Raster(raster)))
    }

    fn ask_shape(&mut self, source: &Source, ask: Ask) -> std::io::Result<Result<Shape, Refusal>> {
        protocol::ask(&mut self.to, source.format, ask, &source.bytes)?;
        protocol::receive_shape(&mut self.from, &self.limits, source.bytes.len() as u64)
    }

    fn wait_until(&mut self, deadline: Instant) {
        self.to.deadline = deadline;
        self.from.get_mut().deadline = deadline;
    }

    fn failure(&mut self, e: std::io::Error, patience: Duration) -> Failure {
        match e.kind() {
            ErrorKind::TimedOut => Failure::Slow(patience),
            _ => Failure::Died(self.how_it_died(&e)),
        }
    }

    /// The signal that ended it, or what else went wrong. It does not run any more.
    fn how_it_died(&mut self, e: &std::io::Error) -> String {
        let status = if has_closed(e) {
            self.status_within(LAST_BREATH)
        } else {
            None
        };
        // It may have ended by itself.
        let _ = self.child.kill();
        match status {
            Some(status) => match std::os::unix::process::ExitStatusExt::signal(&status) {
                Some(signal) => format!("signal {signal}"),
                None => status.to_string(),
            },
            None if has_closed(e) => "closed its pipes without an end".into(),
            None => format!("garbled answer: {e}"),
        }
    }

    /// How it ended, if it does so in time.
    fn status_within(&mut self, patience: Duration) -> Option<ExitStatus> {
        let deadline = Instant::now() + patience;
        loop {
            match self.child.try_wait() {
                Ok(None) if Instant::now() < deadline => {
                    std::thread::sleep(Duration::from_millis(1))
                }
                status => return status.ok().flatten(),
            }
        }
    }
}

/// The other end of a pipe is gone.
fn has_closed(e: &std::io::Error) -> bool {
    matches!(e.kind(), ErrorKind::UnexpectedEof | ErrorKind::BrokenPipe)
}

fn patience_for(shape: &Shape) -> Duration {
    Duration::from_secs(
        (shape.width as u64).saturating_mul(shape.height as u64) / PIXELS_PER_SECOND,
    )
}

/// Confinement that a worker could not have; said once.
fn warn_of(missing: &str) {
    static SAID: Once = Once::new();
    SAID.call_once(|| {
        log::warn!("the OpenImageIO worker is less confined than it could be: {missing}")
    });
}

#[cfg(test)]
mod tests {
    use super::super::raster::{Raster, Samples, Wanted};
    use super::super::{Format, Window};
    use super::*;
    use std::io::Write;

    /// Written by a process of its own: a program that this one had open for writing cannot be started while any other
    /// test's child, forked at that moment, still holds it open (ETXTBSY).
    fn write_program(program: &Path, text: &str) {
        let mut shell = Command::new("/bin/sh");
        shell
            .args(["-c", "cat >\"$0\" && chmod 755 \"$0\""])
            .arg(program)
            .stdin(Stdio::piped());
        let mut child = shell.spawn().unwrap();
        child
            .stdin
            .take()
            .unwrap()
            .write_all(text.as_bytes())
            .unwrap();
        assert!(child.wait().unwrap().success());
    }

    const GREETING: &str = concat!(
        r#"echo '{"petcomp":""#,
        env!("CARGO_PKG_VERSION"),
        r#"","openimageio":"0","missing":[]}'"#
    );

    /// A worker that greets and then does what a shell script says.
    fn asked(script: &str, limits: &Limits) -> Result<Raster, String> {
        asked_of(&format!("{GREETING}\n{script}"), limits, false)
    }

    /// A worker that is a shell script; `$n` counts how many were started in its folder.
    fn asked_of(script: &str, limits: &Limits, strict: bool) -> Result<Raster, String> {
        let folder = tempfile::tempdir().unwrap();
        let program = folder.path().join("worker");
        let count = folder.path().join("count");
        let text = format!(
            "#!/bin/sh\necho x >>{count}\nn=$(wc -l <{count})\n{script}\n",
            count = count.display()
        );
        write_program(&program, &text);
        let source = Source {
            path: "a.tif".into(),
            bytes: vec![0; 3],
            format: Format::Tiff,
        };
        let pool = Pool {
            idle: Mutex::new(Vec::new()),
        };
        let ask = Ask::Pixels {
            wanted: Wanted::Coverage,
            window: Window::Display,
        };
        match pool.ask(&program, &source, limits, strict, ask) {
            Ok(Told::Raster(raster)) => Ok(raster),
            Ok(Told::Shape(shape)) => panic!("{shape:?}"),
            Err(e) => Err(e.to_string()),
        }
    }

    const GREY: &str = r#"echo '{"picture":{"width":2,"height":1,"names":["Y"],"sample":"u8","display_encoded":true}}'; printf ab"#;

    #[test]
    fn an_answer_is_a_line_and_samples() {
        let raster = asked(&format!("{GREY}; sleep 5"), &Limits::default()).unwrap();
        assert_eq!(raster.samples, Samples::U8(b"ab".to_vec()));
    }

    #[test]
    fn a_death_is_tried_again_and_the_second_one_named() {
        let once = format!("[ $n = 1 ] && kill -SEGV $$; {GREY}; sleep 5");
        assert!(asked(&once, &Limits::default()).is_ok());
        let e = asked("kill -SEGV $$", &Limits::default()).unwrap_err();
        assert_eq!(e, "unreadable: OpenImageIO died on it 2 times (signal 11)");
    }

    #[test]
    fn a_worker_that_hangs_is_killed() {
        let limits = Limits {
            seconds: 0,
            ..Default::default()
        };
        let e = asked("exec sleep 30", &limits).unwrap_err();
        assert!(e.contains("took longer than 0 s (Limits::seconds)"), "{e}");
    }

    #[test]
    fn a_death_before_the_greeting_is_no_fault_of_the_file() {
        let script = |deaths: usize| {
            format!("[ $n -le {deaths} ] && kill -ABRT $$\n{GREETING}\n{GREY}; sleep 5")
        };
        assert!(asked_of(&script(STARTS - 1), &Limits::default(), false).is_ok());
        let e = asked_of(&script(STARTS), &Limits::default(), false).unwrap_err();
        assert!(e.ends_with("does not start: signal 6"), "{e}");
    }

    #[test]
    fn a_worker_that_closes_its_pipes_and_stays_is_killed() {
        let start = Instant::now();
        let e = asked("exec <&- >&- sleep 600", &Limits::default()).unwrap_err();
        assert!(e.contains("closed its pipes"), "{e}");
        assert!(
            start.elapsed() < Duration::from_secs(120),
            "{:?}",
            start.elapsed()
        );
    }

    #[test]
    fn a_strict_one_asks_no_worker_that_is_not_confined() {
        let loose = GREETING.replace("[]", "[\"Landlock: not in this kernel\"]");
        let script = format!("{loose}\n{GREY}; sleep 5");
        assert!(asked_of(&script, &Limits::default(), false).is_ok());
        let e = asked_of(&script, &Limits::default(), true).unwrap_err();
        assert!(
            e.ends_with("its worker cannot be confined here (Landlock: not in this kernel)"),
            "{e}"
        );
        assert!(
            asked_of(
                &format!("{GREETING}\n{GREY}; sleep 5"),
                &Limits::default(),
                true
            )
            .is_ok()
        );
    }

    #[test]
    fn nonsense_and_half_an_answer_are_deaths() {
        let e = asked("echo nonsense; exec sleep 30", &Limits::default()).unwrap_err();
        assert!(e.contains("garbled answer"), "{e}");
        let half = GREY.replace("printf ab", "printf a");
        assert!(
            asked(&half, &Limits::default())
                .unwrap_err()
                .contains("exit status: 0")
        );
    }

    #[test]
    fn a_program_that_is_no_worker_is_named() {
        let source = Source {
            path: "a.tif".into(),
            bytes: vec![0; 3],
            format: Format::Tiff,
        };
        let pool = Pool {
            idle: Mutex::new(Vec::new()),
        };
        for program in ["/bin/true", "/bin/echo", "/no/such/program"] {
            let e = pool
                .ask(
                    Path::new(program),
                    &source,
                    &Limits::default(),
                    false,
                    Ask::Header,
                )
                .err()
                .unwrap()
                .to_string();
            assert!(e.contains(program) && e.contains("does not start"), "{e}");
        }
    }
}
