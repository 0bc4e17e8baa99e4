//! Ctrl-C: what a command does then, and the end of the programs that it has started.

use linkwright::responses::program::end_programs;
use std::sync::{Mutex, PoisonError};

/// Exit code after Ctrl-C: 128 and the number of the signal, as shells have it.
pub const INTERRUPTED: u8 = 130;

/// The action of a command at Ctrl-C; the process ends if it returns true.
pub type InterruptAction = Box<dyn Fn() -> bool + Send + Sync>;

/// Action of the running command at Ctrl-C.
static ACTION: Mutex<Option<InterruptAction>> = Mutex::new(None);

/// Ends this process at Ctrl-C, with the programs that it has started: they have process groups of their own, which the terminal does not
/// interrupt.
pub fn handle() {
    // Without a handler the system ends the process all the same.
    drop(ctrlc::set_handler(|| {
        let action = ACTION.lock().unwrap_or_else(PoisonError::into_inner);
        if action.as_ref().is_none_or(|action| action()) {
            end_programs();
            std::process::exit(i32::from(INTERRUPTED));
        }
    }));
}

/// Calls `action` at Ctrl-C; the process ends if it returns true.
pub fn at_interruption(action: impl Fn() -> bool + Send + Sync + 'static) {
    drop(replaced(Some(Box::new(action))));
}

/// Sets or removes the action at Ctrl-C, and returns the former one.
pub fn replaced(action: Option<InterruptAction>) -> Option<InterruptAction> {
    std::mem::replace(&mut *ACTION.lock().unwrap_or_else(PoisonError::into_inner), action)
}
