//! OpenImageIO and libheif in separate processes: a file that crashes them only ends such a process
//! and is reported, and programs that never read such a file never load them.
//!
//! A worker lives as long as this program and serves one request at a time; there are as many as
//! were ever needed at once. One that dies is replaced and the file tried once more, one that takes
//! too long is killed.

use super::protocol::{
    Greeting, Request, Response, Shape, receive_line, receive_samples, receive_shape, send_request,
};
use super::timeout::TimedStream;
use crate::error::{Error, Result};
use crate::io::codec::refusal::Refusal;
use crate::io::limits::Limits;
use crate::io::source::SourceFile;
use std::io::{BufReader, ErrorKind};
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::{Mutex, MutexGuard, Once, PoisonError};
use std::time::{Duration, Instant};

/// Name of the worker program, which is searched next to the running one.
const PROGRAM: &str = "petcomp-oiio-worker";
/// Environment variable with the path of the worker program if it is elsewhere.
const PROGRAM_VARIABLE: &str = "PETCOMP_OIIO_WORKER";
/// The environment variables that a worker sees: OpenImageIO and OpenColorIO read settings from others.
const ENVIRONMENT: [&str; 1] = ["LD_LIBRARY_PATH"];
/// Time for loading 260 libraries on a busy machine.
const START_TIMEOUT: Duration = Duration::from_secs(60);
/// Number of pixels that give a worker one more second.
const PIXELS_PER_SECOND: u64 = 10_000_000;
/// How many times a file is tried.
const MAX_ATTEMPTS: usize = 2;
/// How many times a worker is started if it ends before its greeting: it has not seen a file yet,
/// so no file is to blame.
const MAX_STARTS: usize = 3;
/// How long to wait for a worker that closed its streams before it is killed.
const EXIT_TIMEOUT: Duration = Duration::from_secs(2);
/// A large pipe saves switches between the two processes; an even larger one requires a privilege
/// (`pipe(7)`).
#[cfg(target_os = "linux")]
const PIPE_BYTES: usize = 1 << 20;

/// The idle workers of this program.
static IDLE: WorkerPool = WorkerPool {
    idle: Mutex::new(Vec::new()),
};

/// A worker's response about a file. A strict request is never sent to a worker that the system
/// does not sandbox.
pub(crate) fn ask(
    source: &SourceFile,
    limits: &Limits,
    strict: bool,
    request: Request,
) -> std::result::Result<Response, Refusal> {
    let program = find_program().ok_or_else(|| {
        format!("needs OpenImageIO, but {PROGRAM} is not next to this program (set {PROGRAM_VARIABLE} to its path)")
    })?;
    IDLE.ask(&program, source, limits, strict, request)
}

/// The libraries that the worker program links, as it reports them.
///
/// # Errors
/// [`Error::File`] if there is no worker program or it does not start.
pub fn worker_version() -> Result<String> {
    let program =
        find_program().ok_or_else(|| Error::file(PROGRAM, "not found next to this program"))?;
    let worker =
        Worker::start(&program, &Limits::default()).map_err(|e| Error::file(&program, e))?;
    Ok(worker.greeting.libraries.clone())
}

/// Next to the running program; one folder up is for test programs, which cargo puts below the
/// others.
fn find_program() -> Option<PathBuf> {
    if let Some(named) = std::env::var_os(PROGRAM_VARIABLE).filter(|named| !named.is_empty()) {
        return Some(named.into());
    }
    let own = std::env::current_exe().ok()?;
    let name = format!("{PROGRAM}{}", std::env::consts::EXE_SUFFIX);
    let folders = own.ancestors().skip(1).take(2);
    let mut programs = folders.map(|folder| folder.join(&name));
    programs.find(|program| program.is_file())
}

/// Workers that are waiting for a request.
struct WorkerPool {
    idle: Mutex<Vec<Worker>>,
}

/// Why a worker gave no response.
#[derive(Debug)]
enum WorkerFailure {
    /// It ended, or its response was invalid: the next one may succeed.
    Died(String),
    /// It exceeded the time limit, because of the file.
    TimedOut(Duration),
}

impl WorkerPool {
    fn ask(
        &self,
        program: &Path,
        source: &SourceFile,
        limits: &Limits,
        strict: bool,
        request: Request,
    ) -> std::result::Result<Response, Refusal> {
        let (mut cause, library) = (String::new(), source.format.library());
        for attempt in 0..MAX_ATTEMPTS {
            let mut worker = self.worker(attempt, program, limits)?;
            worker.check_sandbox(strict)?;
            match worker.answer(source, request) {
                Ok(response) => {
                    self.idle().push(worker);
                    return response;
                }
                Err(WorkerFailure::TimedOut(timeout)) => return Err(timed_out(library, timeout)),
                Err(WorkerFailure::Died(how)) => {
                    log::debug!("{}: {library} died on it ({how})", source.path.display());
                    cause = how;
                }
            }
        }
        Err(format!("unreadable: {library} died on it {MAX_ATTEMPTS} times ({cause})").into())
    }

    /// An idle worker or a new one; the second attempt gets a new one, which has seen no file
    /// before.
    fn worker(
        &self,
        attempt: usize,
        program: &Path,
        limits: &Limits,
    ) -> std::result::Result<Worker, Refusal> {
        let idle = (attempt == 0).then(|| self.take(limits)).flatten();
        idle.map_or_else(|| Worker::start(program, limits), Ok)
    }

    /// A worker that was started with these limits.
    fn take(&self, limits: &Limits) -> Option<Worker> {
        let mut idle = self.idle();
        let at = idle.iter().rposition(|worker| worker.limits == *limits)?;
        Some(idle.swap_remove(at))
    }

    fn idle(&self) -> MutexGuard<'_, Vec<Worker>> {
        let mut idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        let process = std::process::id();
        if idle.iter().any(|worker| worker.process != process) {
            // They serve the process that this one was forked from; dropping them would kill them.
            idle.drain(..).for_each(std::mem::forget);
        }
        idle
    }
}

fn timed_out(library: &str, timeout: Duration) -> Refusal {
    let seconds = timeout.as_secs_f64();
    format!("unreadable: {library} took longer than {seconds} s (Limits::seconds)").into()
}

/// A running worker program, killed when dropped.
struct Worker {
    child: Child,
    /// The process that it serves.
    process: u32,
    to: TimedStream,
    from: BufReader<TimedStream>,
    limits: Limits,
    greeting: Greeting,
}

impl Drop for Worker {
    fn drop(&mut self) {
        // It may have already ended.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Worker {
    fn start(program: &Path, limits: &Limits) -> std::result::Result<Self, Refusal> {
        let mut cause = String::new();
        for _ in 0..MAX_STARTS {
            let mut worker =
                Self::launch(program, limits).map_err(|e| not_started(program, &e.to_string()))?;
            let Err(e) = worker.receive_greeting() else {
                return Ok(worker);
            };
            cause = worker.cause_of_death(&e);
            if !is_closed(&e) {
                break;
            }
        }
        Err(not_started(program, &cause))
    }

    /// Starts a process that has sent nothing yet.
    fn launch(program: &Path, limits: &Limits) -> std::io::Result<Self> {
        let (to, stdin) = UnixStream::pair()?;
        #[cfg(target_vendor = "apple")]
        rustix::net::sockopt::set_socket_nosigpipe(&to, true)?;
        let mut child = spawn_program(program, limits, stdin.into())?;
        let stdout = child.stdout.take();
        let stdout = stdout.ok_or_else(|| std::io::Error::other("no pipe from it"))?;
        // With a smaller pipe it is only slower.
        #[cfg(target_os = "linux")]
        let _ = rustix::pipe::fcntl_setpipe_size(&stdout, PIPE_BYTES);
        Ok(Self {
            child,
            process: std::process::id(),
            to: TimedStream::new(to.into())?,
            from: BufReader::new(TimedStream::new(stdout.into())?),
            limits: limits.clone(),
            greeting: Greeting::default(),
        })
    }

    fn receive_greeting(&mut self) -> std::io::Result<()> {
        self.from.get_mut().deadline = Instant::now() + START_TIMEOUT;
        self.greeting = receive_line(&mut self.from)?;
        let version = &self.greeting.petcomp;
        if version == env!("CARGO_PKG_VERSION") {
            return Ok(());
        }
        let what = format!("belongs to petcomp {version}");
        Err(std::io::Error::other(what))
    }

    /// An incomplete sandbox is an error for strict requests and a warning otherwise.
    fn check_sandbox(&self, strict: bool) -> std::result::Result<(), Refusal> {
        let missing = self.greeting.missing.join("; ");
        if missing.is_empty() {
            return Ok(());
        }
        if strict {
            return Err(format!(
                "needs OpenImageIO, but its worker has no full sandbox here ({missing})"
            )
            .into());
        }
        warn_once(&missing);
        Ok(())
    }

    fn answer(
        &mut self,
        source: &SourceFile,
        request: Request,
    ) -> std::result::Result<std::result::Result<Response, Refusal>, WorkerFailure> {
        let started = Instant::now();
        self.set_deadline(started + Duration::from_secs(self.limits.seconds));
        let received = self.receive_response(source, request);
        received.map_err(|e| self.failure(e, self.to.deadline - started))
    }

    fn receive_response(
        &mut self,
        source: &SourceFile,
        request: Request,
    ) -> std::io::Result<std::result::Result<Response, Refusal>> {
        send_request(&mut self.to, source.format, request, &source.bytes)?;
        let announced = match self.receive_shape(source)? {
            Ok(shape) if request != Request::Header => shape,
            other => return Ok(other.map(Response::Shape)),
        };
        self.set_deadline(self.to.deadline + timeout_for_pixels(&announced));
        let shape = match self.receive_shape(source)? {
            Ok(shape) => shape,
            Err(refusal) => return Ok(Err(refusal)),
        };
        let raster = receive_samples(&mut self.from, shape)?;
        Ok(Ok(Response::Raster(raster)))
    }

    fn receive_shape(
        &mut self,
        source: &SourceFile,
    ) -> std::io::Result<std::result::Result<Shape, Refusal>> {
        receive_shape(&mut self.from, &self.limits, source.bytes.len() as u64)
    }

    fn set_deadline(&mut self, deadline: Instant) {
        self.to.deadline = deadline;
        self.from.get_mut().deadline = deadline;
    }

    fn failure(&mut self, e: std::io::Error, timeout: Duration) -> WorkerFailure {
        match e.kind() {
            ErrorKind::TimedOut => WorkerFailure::TimedOut(timeout),
            _ => WorkerFailure::Died(self.cause_of_death(&e)),
        }
    }

    /// The signal that ended it, or what else went wrong. It is no longer running.
    fn cause_of_death(&mut self, e: &std::io::Error) -> String {
        let status = is_closed(e)
            .then(|| self.wait_for_exit(EXIT_TIMEOUT))
            .flatten();
        // It may have already ended.
        let _ = self.child.kill();
        match status {
            Some(status) => ending_of(status),
            None if is_closed(e) => "closed its streams and did not exit".into(),
            None => format!("garbled response: {e}"),
        }
    }

    /// Its exit status, if it ends in time.
    fn wait_for_exit(&mut self, timeout: Duration) -> Option<ExitStatus> {
        let deadline = Instant::now() + timeout;
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

fn ending_of(status: ExitStatus) -> String {
    match status.signal() {
        Some(signal) => format!("signal {signal}"),
        None => status.to_string(),
    }
}

fn spawn_program(program: &Path, limits: &Limits, stdin: OwnedFd) -> std::io::Result<Child> {
    let environment = ENVIRONMENT
        .iter()
        .filter_map(|name| Some((name, std::env::var_os(name)?)));
    Command::new(program)
        .arg(serde_json::to_string(limits)?)
        .env_clear()
        .envs(environment)
        .stdin(stdin)
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
}

fn not_started(program: &Path, how: &str) -> Refusal {
    let program = program.display();
    format!("needs OpenImageIO, but {program} does not start: {how}").into()
}

/// Whether the other end of a stream is gone.
fn is_closed(e: &std::io::Error) -> bool {
    use ErrorKind::{BrokenPipe, ConnectionReset, UnexpectedEof};
    matches!(e.kind(), UnexpectedEof | BrokenPipe | ConnectionReset)
}

fn timeout_for_pixels(shape: &Shape) -> Duration {
    Duration::from_secs(
        (shape.width as u64).saturating_mul(shape.height as u64) / PIXELS_PER_SECOND,
    )
}

/// Warns once about the missing parts of a worker's sandbox.
fn warn_once(missing: &str) {
    static WARNED: Once = Once::new();
    WARNED.call_once(|| log::warn!("the OpenImageIO worker has no full sandbox: {missing}"));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::codec::Wanted;
    use crate::io::codec::raster::{Raster, Samples};
    use crate::io::format::Format;
    use crate::io::header::Window;
    use std::io::Write;

    /// Written by a separate process: a program that this process had open for writing cannot be
    /// started while the child of another test, forked at that moment, still has it open (ETXTBSY).
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
        r#"","libraries":"none","missing":[]}'"#
    );

    /// The result of a worker that sends a greeting and then runs a shell script.
    fn asked(script: &str, limits: &Limits) -> std::result::Result<Raster, String> {
        asked_of(&format!("{GREETING}\n{script}"), limits, false)
    }

    /// The same for a worker that is a shell script; `$n` counts how many were started in its folder.
    fn asked_of(
        script: &str,
        limits: &Limits,
        strict: bool,
    ) -> std::result::Result<Raster, String> {
        let folder = tempfile::tempdir().unwrap();
        let program = folder.path().join("worker");
        let count = folder.path().join("count");
        let text = format!(
            "#!/bin/sh\necho x >>{count}\nn=$(wc -l <{count})\n{script}\n",
            count = count.display()
        );
        write_program(&program, &text);
        let request = Request::Pixels {
            wanted: Wanted::Coverage,
            window: Window::Display,
        };
        match answer_of(&program, limits, strict, request) {
            Ok(Response::Raster(raster)) => Ok(raster),
            Ok(Response::Shape(shape)) => panic!("{shape:?}"),
            Err(e) => Err(e.to_string()),
        }
    }

    /// The response of a program about a file of three bytes.
    fn answer_of(
        program: &Path,
        limits: &Limits,
        strict: bool,
        request: Request,
    ) -> std::result::Result<Response, Refusal> {
        let source = SourceFile {
            path: "a.tif".into(),
            bytes: vec![0; 3],
            format: Format::Tiff,
        };
        let pool = WorkerPool {
            idle: Mutex::new(Vec::new()),
        };
        pool.ask(program, &source, limits, strict, request)
    }

    const SHAPE: &str =
        r#"{"picture":{"width":2,"height":1,"names":["Y"],"sample":"u8","display_encoded":true}}"#;

    /// A line of a script that announces a picture and sends it.
    fn grey() -> String {
        format!("echo '{SHAPE}'; echo '{SHAPE}'; printf ab")
    }

    #[test]
    fn an_answer_is_two_lines_and_samples() {
        let raster = asked(&format!("{}; sleep 5", grey()), &Limits::default()).unwrap();
        assert_eq!(raster.samples, Samples::U8(b"ab".to_vec()));
    }

    #[test]
    fn a_death_is_tried_again_and_the_second_one_named() {
        let once = format!("[ $n = 1 ] && kill -SEGV $$; {}; sleep 5", grey());
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

    /// The first line arrives together with the greeting, so that no time passes before it.
    #[test]
    fn many_pixels_get_more_time_from_their_announcement_on() {
        let limits = Limits {
            seconds: 0,
            ..Default::default()
        };
        let many = SHAPE.replace(r#""width":2,"height":1"#, r#""width":8192,"height":8192"#);
        let script = format!(
            "hello=$({GREETING}); printf '%s\\n' \"$hello\" '{many}'\n\
             sleep 0.1; echo '{SHAPE}'; printf ab; sleep 5"
        );
        let raster = asked_of(&script, &limits, false).unwrap();
        assert_eq!(raster.samples, Samples::U8(b"ab".to_vec()));
    }

    #[test]
    fn a_refusal_may_follow_the_announcement() {
        let script = format!("echo '{SHAPE}'; echo '{{\"refused\":\"why\"}}'; sleep 5");
        assert_eq!(asked(&script, &Limits::default()).unwrap_err(), "why");
    }

    #[test]
    fn a_death_before_the_greeting_is_no_fault_of_the_file() {
        let script = |deaths: usize| {
            let grey = grey();
            format!("[ $n -le {deaths} ] && kill -ABRT $$\n{GREETING}\n{grey}; sleep 5")
        };
        assert!(asked_of(&script(MAX_STARTS - 1), &Limits::default(), false).is_ok());
        let e = asked_of(&script(MAX_STARTS), &Limits::default(), false).unwrap_err();
        assert!(e.ends_with("does not start: signal 6"), "{e}");
    }

    #[test]
    fn a_worker_that_closes_its_streams_and_stays_is_killed() {
        let start = Instant::now();
        let e = asked("exec <&- >&- sleep 600", &Limits::default()).unwrap_err();
        assert!(e.contains("closed its streams"), "{e}");
        let took = start.elapsed();
        assert!(took < Duration::from_secs(120), "{took:?}");
    }

    #[test]
    fn a_strict_one_asks_no_worker_without_a_full_sandbox() {
        let loose = GREETING.replace("[]", "[\"Landlock: not in this kernel\"]");
        let script = format!("{loose}\n{}; sleep 5", grey());
        assert!(asked_of(&script, &Limits::default(), false).is_ok());
        let e = asked_of(&script, &Limits::default(), true).unwrap_err();
        assert!(
            e.ends_with("its worker has no full sandbox here (Landlock: not in this kernel)"),
            "{e}"
        );
        let script = format!("{GREETING}\n{}; sleep 5", grey());
        assert!(asked_of(&script, &Limits::default(), true).is_ok());
    }

    #[test]
    fn nonsense_and_half_an_answer_are_deaths() {
        let e = asked("echo nonsense; exec sleep 30", &Limits::default()).unwrap_err();
        assert!(e.contains("garbled response"), "{e}");
        let half = grey().replace("printf ab", "printf a");
        assert!(
            asked(&half, &Limits::default())
                .unwrap_err()
                .contains("exit status: 0")
        );
    }

    #[test]
    fn a_program_that_is_no_worker_is_named() {
        for program in ["/bin/true", "/bin/echo", "/no/such/program"] {
            let limits = Limits::default();
            let answer = answer_of(Path::new(program), &limits, false, Request::Header);
            let e = answer.err().unwrap().to_string();
            assert!(e.contains(program) && e.contains("does not start"), "{e}");
        }
    }
}
