//! Ctrl-C. A command that can stop with a valid partial output asks for [`stop_flag`] and polls it; before that, and
//! at the second Ctrl-C, the process ends at once. The exit code is 130 either way.

use std::sync::atomic::{AtomicBool, Ordering};

static STOP: AtomicBool = AtomicBool::new(false);
static POLLED: AtomicBool = AtomicBool::new(false);

/// Exit code after Ctrl-C.
const INTERRUPTED: i32 = 130;

/// Installs the handler; later calls do nothing. Without one (a system that refuses) Ctrl-C kills as usual.
pub fn install() {
    let _refused = ctrlc::set_handler(|| {
        let asked_before = STOP.swap(true, Ordering::SeqCst);
        if asked_before || !POLLED.load(Ordering::SeqCst) {
            std::process::exit(INTERRUPTED);
        }
    });
}

/// The flag that Ctrl-C sets. From the first call on, the caller has promised to poll it.
pub fn stop_flag() -> &'static AtomicBool {
    POLLED.store(true, Ordering::SeqCst);
    &STOP
}

/// Whether Ctrl-C was pressed; for the `stop` arguments of `measure`.
pub fn stopped() -> bool {
    stop_flag().load(Ordering::Relaxed)
}
