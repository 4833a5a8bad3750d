//! Ctrl-C, SIGTERM and SIGHUP: a long job stops between two pictures.

use crate::exit::INTERRUPTED_STATUS;
use crate::print;
use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Maximum time from the first Ctrl-C (or SIGTERM) to the end of the program: schedulers kill after
/// 10 s or more.
const GRACE_PERIOD: Duration = Duration::from_secs(8);

static STOP: AtomicBool = AtomicBool::new(false);

/// Becomes true at the first Ctrl-C (or SIGTERM), so that a long job can stop between two pictures.
/// A job that has not ended after [`GRACE_PERIOD`] is terminated, as it is at once by a second
/// signal: every file is complete or absent, so no finished work is lost.
pub(crate) fn interruption() -> &'static AtomicBool {
    static ONCE: Once = Once::new();
    ONCE.call_once(catch_interrupts);
    &STOP
}

fn catch_interrupts() {
    if let Err(error) = on_interrupt(stop_soon) {
        log::warn!("interrupts cannot be caught: {error}");
    }
}

/// Calls `handler` at every Ctrl-C, SIGTERM and SIGHUP, except for those that the program was
/// started to ignore.
pub(crate) fn on_interrupt(handler: impl FnMut() + Send + 'static) -> Result<(), ctrlc::Error> {
    let ignored = ignored_signals();
    let caught = ctrlc::set_handler(handler);
    ignored.into_iter().for_each(ignore);
    caught
}

/// The signals that the program was started to ignore: `nohup` ignores hang-ups, and a script's
/// shell ignores interrupts of background commands.
#[cfg(unix)]
fn ignored_signals() -> Vec<i32> {
    let signals = [libc::SIGHUP, libc::SIGINT].into_iter();
    signals.filter(|&signal| is_ignored(signal)).collect()
}

#[cfg(unix)]
#[expect(unsafe_code, reason = "a function of C, which fills a struct")]
fn is_ignored(signal: i32) -> bool {
    // SAFETY: all zeros are a valid `sigaction`, and none is set.
    let action = unsafe {
        let mut action: libc::sigaction = std::mem::zeroed();
        libc::sigaction(signal, std::ptr::null(), &mut action);
        action
    };
    action.sa_sigaction == libc::SIG_IGN
}

#[cfg(unix)]
#[expect(unsafe_code, reason = "a function of C, which takes numbers")]
fn ignore(signal: i32) {
    // SAFETY: no handler is given that could do harm.
    unsafe { libc::signal(signal, libc::SIG_IGN) };
}

/// Other systems do not have this.
#[cfg(not(unix))]
fn ignored_signals() -> Vec<i32> {
    Vec::new()
}

#[cfg(not(unix))]
fn ignore(_: i32) {}

fn stop_soon() {
    if STOP.swap(true, Ordering::Relaxed) {
        stop_now();
    }
    std::thread::spawn(stop_after_grace_period);
    print::aside(format_args!(
        "stopping after the pictures in progress, in {} s at the latest; interrupt again to stop at once",
        GRACE_PERIOD.as_secs()
    ));
}

fn stop_after_grace_period() {
    std::thread::sleep(GRACE_PERIOD);
    stop_now();
}

fn stop_now() -> ! {
    std::process::exit(INTERRUPTED_STATUS.into())
}
