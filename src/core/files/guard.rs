//! Conversion of panics to errors of a single file, so that a panic does not end the program.

use std::any::Any;
use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};

thread_local! {
    static IS_GUARDED: Cell<bool> = const { Cell::new(false) };
}

/// Returns true if this thread runs [`guarded`] work, whose panics become errors. A panic hook need
/// not print such panics.
pub fn is_guarded() -> bool {
    IS_GUARDED.get()
}

/// Runs `work` and converts a panic to an error with the panic's message. After a panic, values
/// that `work` has changed may be inconsistent and must not be used.
pub fn guarded<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    // Nested calls are possible: a thread that waits within `work` may begin other work.
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
