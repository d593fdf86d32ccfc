//! Panics that become errors of one file and end nothing else.

use std::any::Any;
use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};

thread_local! {
    static IS_GUARDED: Cell<bool> = const { Cell::new(false) };
}

/// Whether panics of this thread are caught and told as errors: a panic hook need not speak of them.
pub fn is_guarded() -> bool {
    IS_GUARDED.get()
}

/// Does `work`; a panic in it is an error with the panic's message. What `work` leaves half-done must not be looked at then.
pub fn guarded<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    // A thread that waits within `work` may begin other work meanwhile.
    let before = IS_GUARDED.replace(true);
    let done = catch_unwind(AssertUnwindSafe(work));
    IS_GUARDED.set(before);
    done.map_err(|panic| message(&*panic))
}

fn message(panic: &(dyn Any + Send)) -> String {
    let literal = panic.downcast_ref::<&str>().map(|text| text.to_string());
    let text = literal.or_else(|| panic.downcast_ref::<String>().cloned());
    text.unwrap_or_else(|| "a panic without a message".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn panics_become_their_messages() {
        assert_eq!(guarded(|| 7), Ok(7));
        let said = guarded(|| {
            assert!(is_guarded());
            panic!("row {} is missing", 3)
        });
        assert_eq!(said, Err::<(), _>("row 3 is missing".into()));
        assert_eq!(
            guarded(|| std::panic::panic_any(1)),
            Err::<(), _>("a panic without a message".into())
        );
        assert!(!is_guarded());
    }
}
