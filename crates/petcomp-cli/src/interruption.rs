//! Ctrl-C and SIGTERM: a long job stops between two pictures.

use crate::exit::INTERRUPTED_STATUS;
use crate::print;
use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// From the first Ctrl-C (or SIGTERM) to the end of the program at the latest: schedulers kill
/// after 10 s and more.
const GRACE_PERIOD: Duration = Duration::from_secs(8);

static STOP: AtomicBool = AtomicBool::new(false);

/// Turns true at the first Ctrl-C (or SIGTERM), so that a long job can stop between two pictures.
/// What has not ended by itself after [`GRACE_PERIOD`] is ended in the middle, as the second signal
/// ends it at once: every file is complete or absent, so the same command continues from there.
pub(crate) fn interruption() -> &'static AtomicBool {
    static ONCE: Once = Once::new();
    ONCE.call_once(catch_interrupts);
    &STOP
}

fn catch_interrupts() {
    if let Err(error) = ctrlc::set_handler(stop_soon) {
        log::warn!("interrupts cannot be caught: {error}");
    }
}

fn stop_soon() {
    if STOP.swap(true, Ordering::Relaxed) {
        stop_now();
    }
    std::thread::spawn(stop_after_grace_period);
    print::aside(format_args!(
        "stopping after the pictures in hand, in {} s at the latest; the same command goes on; interrupt again to stop at \
         once",
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
