//! Work beside the interpreter: on threads of its own, with its lock released, stopped by Ctrl-C.
//!
//! A job gets a pool that nobody else uses while it runs: one that waits in the middle of a picture
//! must not begin another. Pools are kept for the next job of the same process; a fork has none of
//! its parent's threads, and begins anew. For the same reason nothing that works on rows side by
//! side is called outside of a job: rayon's own pool would not be there.

use crate::errors::{internal, to_python};
use crate::lock::locked;
use crate::messages;
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError, Weak};
use std::time::{Duration, Instant};

/// How often signals, messages and progress are looked for.
const POLL_INTERVAL: Duration = Duration::from_millis(50);
/// How long an interrupted job is waited for; what takes longer ends by itself, unseen.
const GRACE_PERIOD: Duration = Duration::from_millis(700);
/// Most threads that may be asked for, as on the command line.
const MAX_THREADS: usize = 1024;

/// Threads of a job; 0 is one per core.
static THREADS: AtomicUsize = AtomicUsize::new(0);

/// Pools that nobody uses, with the processes that they belong to.
static IDLE_POOLS: Mutex<Vec<IdlePool>> = Mutex::new(Vec::new());

struct IdlePool {
    process: u32,
    threads: usize,
    pool: ThreadPool,
}

/// Sets the number of threads of a job; 0 is one per core.
#[pyfunction]
pub(crate) fn set_threads(count: usize) -> PyResult<()> {
    if count > MAX_THREADS {
        let what = format!("{count}, expected 0 to {MAX_THREADS}");
        return Err(to_python(petcomp::Error::value("threads", what)));
    }
    THREADS.store(count, Ordering::Relaxed);
    Ok(())
}

/// Limits this process to its share of the memory for cut-outs and photos among `processes`.
#[pyfunction]
pub(crate) fn share_memory(processes: usize) {
    petcomp::share_memory(processes);
}

/// Flags that no job reads any more.
static IDLE_FLAGS: Mutex<Vec<&'static AtomicBool>> = Mutex::new(Vec::new());

/// Jobs that call Python, by what ends them.
static CALLERS: Mutex<Vec<Weak<Stop>>> = Mutex::new(Vec::new());

/// What ends one job: a flag that it reads.
///
/// A flag lives as long as the process, which the library's pipelines want; the next job gets it.
pub(crate) struct Stop {
    flag: &'static AtomicBool,
    process: u32,
}

impl Stop {
    pub(crate) fn new() -> Arc<Self> {
        let idle = locked(&IDLE_FLAGS).pop();
        Arc::new(Self {
            flag: idle.unwrap_or_else(|| Box::leak(Box::default())),
            process: std::process::id(),
        })
    }

    /// That of a job that calls Python, which the end of the interpreter waits for.
    pub(crate) fn of_caller() -> Arc<Self> {
        let stop = Self::new();
        let mut callers = locked(&CALLERS);
        callers.retain(|other| other.strong_count() > 0);
        callers.push(Arc::downgrade(&stop));
        stop
    }

    fn raise(&self) {
        self.flag.store(true, Ordering::Relaxed);
    }
}

impl Drop for Stop {
    fn drop(&mut self) {
        self.flag.store(false, Ordering::Relaxed);
        locked(&IDLE_FLAGS).push(self.flag);
    }
}

/// Stops all jobs that call Python and waits for them: a thread still in Python when the
/// interpreter exits is killed midway, and the process with it.
#[pyfunction]
pub(crate) fn end_callers(py: Python<'_>) -> PyResult<()> {
    while stop_callers() {
        py.detach(|| std::thread::sleep(POLL_INTERVAL));
        py.check_signals()?;
    }
    Ok(())
}

/// Whether there are any. A fork has none of its parent's.
fn stop_callers() -> bool {
    let process = std::process::id();
    let mut running: Vec<_> = locked(&CALLERS).iter().filter_map(Weak::upgrade).collect();
    running.retain(|stop| stop.process == process);
    running.iter().for_each(|stop| stop.raise());
    !running.is_empty()
}

/// What a job leaves for the thread that waits for it.
type Outcome<T> = Arc<(Mutex<Option<Result<T, String>>>, Condvar)>;

/// What to do beside waiting for a job, with the interpreter's lock held.
type Beside<'a> = &'a mut dyn FnMut(Python<'_>) -> PyResult<()>;

/// Runs a job that cannot be stopped in the middle; Ctrl-C leaves it behind.
pub(crate) fn run<T: Send + 'static>(
    py: Python<'_>,
    job: impl FnOnce() -> petcomp::Result<T> + Send + 'static,
) -> PyResult<T> {
    run_beside(py, Stop::new(), &mut |_| Ok(()), |_| job())
}

/// Runs a job, which gets the flag of `stop`: it turns true after Ctrl-C, or an error of what is
/// done beside the job. One that does not end then is left behind.
pub(crate) fn run_beside<T: Send + 'static>(
    py: Python<'_>,
    stop: Arc<Stop>,
    beside: Beside<'_>,
    job: impl FnOnce(&'static AtomicBool) -> petcomp::Result<T> + Send + 'static,
) -> PyResult<T> {
    messages::start();
    let outcome: Outcome<petcomp::Result<T>> = Arc::default();
    let own = stop.clone();
    start(move || job(own.flag), &outcome)?;
    let waited = wait(py, &outcome, beside);
    if waited.is_err() {
        stop.raise();
        let end = Instant::now() + GRACE_PERIOD;
        py.detach(|| while Instant::now() < end && !is_there(&outcome, POLL_INTERVAL) {});
    }
    messages::deliver(py)?;
    waited?;
    taken(&outcome)
}

fn taken<T>(outcome: &Outcome<petcomp::Result<T>>) -> PyResult<T> {
    match locked(&outcome.0).take() {
        Some(Ok(result)) => result.map_err(to_python),
        Some(Err(panic)) => Err(internal(&panic)),
        None => Err(internal("a job without a result")),
    }
}

/// Until the job has ended; an error when it is not to be waited for any more.
fn wait<T>(py: Python<'_>, outcome: &Outcome<T>, beside: Beside<'_>) -> PyResult<()>
where
    T: Send,
{
    loop {
        let ended = py.detach(|| is_there(outcome, POLL_INTERVAL));
        beside(py)?;
        if ended {
            return Ok(());
        }
        py.check_signals()?;
        messages::deliver(py)?;
    }
}

/// Whether there is an outcome, now or before long.
fn is_there<T>((result, there): &(Mutex<Option<T>>, Condvar), patience: Duration) -> bool {
    let result = locked(result);
    let waited = there.wait_timeout_while(result, patience, |result| result.is_none());
    waited.unwrap_or_else(PoisonError::into_inner).0.is_some()
}

/// Starts a job in a pool of its own.
fn start<T: Send + 'static>(
    job: impl FnOnce() -> T + Send + 'static,
    outcome: &Outcome<T>,
) -> PyResult<()> {
    let pool = Arc::new(idle_pool()?);
    let (outcome, own) = (outcome.clone(), pool.clone());
    pool.pool.spawn(move || {
        let result = catch_unwind(AssertUnwindSafe(job)).map_err(|panic| panic_message(&*panic));
        give_back(own);
        *locked(&outcome.0) = Some(result);
        outcome.1.notify_all();
    });
    give_back(pool);
    Ok(())
}

/// Of the job and the thread that started it, whichever is done with the pool last gives it back.
fn give_back(pool: Arc<IdlePool>) {
    if let Some(pool) = Arc::into_inner(pool) {
        locked(&IDLE_POOLS).push(pool);
    }
}

/// One with as many threads as are set; for what a job of several samples calls, which has one of
/// them, with as many as that has.
fn idle_pool() -> PyResult<IdlePool> {
    let threads = match rayon::current_thread_index() {
        Some(_) => rayon::current_num_threads(),
        None => THREADS.load(Ordering::Relaxed),
    };
    match take_idle_pool(std::process::id(), threads) {
        Some(pool) => Ok(pool),
        None => new_pool(threads),
    }
}

/// A pool of this process with so many threads that nobody uses.
fn take_idle_pool(process: u32, threads: usize) -> Option<IdlePool> {
    let mut idle = locked(&IDLE_POOLS);
    if idle.iter().any(|pool| pool.process != process) {
        // Those of the process that this one was forked from: nobody is there to end them.
        idle.drain(..).for_each(std::mem::forget);
    }
    let place = idle.iter().position(|pool| pool.threads == threads)?;
    Some(idle.swap_remove(place))
}

fn new_pool(threads: usize) -> PyResult<IdlePool> {
    let pool = ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.map_err(|e| to_python(petcomp::Error::value("threads", e)))?;
    Ok(IdlePool {
        process: std::process::id(),
        threads,
        pool,
    })
}

fn panic_message(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().copied();
    let text = text.or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    text.unwrap_or("no message").to_owned()
}
