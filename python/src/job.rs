//! Runs work in a separate thread. Meanwhile the Python thread waits without the interpreter's
//! lock, and checks for signals.

use crate::errors::{self, Error};
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

/// Time between two checks for signals.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// Maximum time to wait for the work after it was requested to stop.
const PATIENCE: Duration = Duration::from_millis(500);

/// State that the working thread and the waiting thread share.
#[derive(Default)]
pub struct Status {
    /// True if the work must stop.
    pub stop: AtomicBool,
    /// Number of samples taken so far, over all pixels.
    pub done: AtomicU64,
    /// Number of samples to take, over all pixels. It is 0 until the number is known, for example
    /// while the scene is read.
    pub total: AtomicU64,
}

impl Status {
    /// Returns true if the work must stop.
    pub fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Number of samples taken, and number of samples to take.
    fn progress(&self) -> (u64, u64) {
        let [done, total] = [&self.done, &self.total].map(|count| count.load(Ordering::Relaxed));
        (done.min(total), total)
    }
}

/// Waits for a value from `results`. If the progress has changed, calls `progress` with the number
/// of samples taken and the number of samples to take.
///
/// # Errors
///
/// Exceptions of a signal, such as Ctrl-C, or of `progress`. The work is then requested to stop.
pub fn wait<T: Send>(
    py: Python,
    results: &Mutex<Receiver<T>>,
    status: &Status,
    progress: Option<&Py<PyAny>>,
) -> PyResult<T> {
    let mut reported = None;
    let mut report = |py: Python| {
        let now = status.progress();
        match progress {
            Some(callback) if now.1 > 0 && reported != Some(now) => {
                reported = Some(now);
                callback.call1(py, now).map(drop)
            }
            _ => Ok(()),
        }
    };
    let receive = |time| {
        results
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .recv_timeout(time)
    };
    loop {
        match py.detach(|| receive(POLL_INTERVAL)) {
            Ok(result) => {
                report(py)?;
                return Ok(result);
            }
            Err(RecvTimeoutError::Disconnected) => return Err(Error::new_err("the render has ended")),
            Err(RecvTimeoutError::Timeout) => {}
        }
        if let Err(raised) = py.check_signals().and_then(|()| report(py)) {
            status.stop.store(true, Ordering::Relaxed);
            // Wait for the end of the work, so that its memory is usually freed before the
            // exception arrives
            let _ = py.detach(|| receive(PATIENCE));
            return Err(raised);
        }
    }
}

/// Runs `work`, which cannot be stopped, in a separate thread, so that signals are handled
/// meanwhile.
///
/// # Errors
///
/// Errors of `work`, and exceptions of a signal. After a signal the thread continues, but its
/// result is not used.
pub fn on_thread<T: Send + 'static>(
    py: Python,
    work: impl FnOnce() -> Result<T, embrasure::Error> + Send + 'static,
) -> PyResult<T> {
    let (sender, receiver) = channel();
    thread::spawn(move || {
        let _ = sender.send(pooled(work));
    });
    let done = wait(py, &Mutex::new(receiver), &Status::default(), None)?;
    done.map_err(|error| errors::of_session(py, error))
}

/// Runs `work` in the thread pool of this process. A panic becomes an error.
pub fn pooled<T: Send>(work: impl FnOnce() -> Result<T, embrasure::Error> + Send) -> Result<T, embrasure::Error> {
    let pool = pool()?;
    guarded(|| pool.install(work))
}

/// Thread pool for work outside of sessions, and the id of the process that owns its threads.
static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

/// Thread pool of this process. After a fork, the child process needs a new pool: it does not have
/// the threads of its parent, and would wait forever for rayon's global pool.
fn pool() -> Result<Arc<ThreadPool>, embrasure::Error> {
    let mut known = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    let process = std::process::id();
    if let Some((_, pool)) = known.as_ref().filter(|(of, _)| *of == process) {
        return Ok(pool.clone());
    }
    let pool = ThreadPoolBuilder::new().build();
    let pool = pool.map_err(|error| embrasure::Error::Failed(format!("cannot start threads: {error}")))?;
    let pool = Arc::new(pool);
    // Do not drop the pool of the parent: its threads do not exist in this process, so they cannot
    // end
    std::mem::forget(known.replace((process, pool.clone())));
    Ok(pool)
}

/// Runs `work`. A panic becomes an error.
pub fn guarded<T>(work: impl FnOnce() -> Result<T, embrasure::Error>) -> Result<T, embrasure::Error> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|panic| {
        let words = format!("the library has failed: {}", message(&*panic));
        Err(embrasure::Error::Failed(format!("{words}\n  help: please report this")))
    })
}

fn message(panic: &(dyn Any + Send)) -> &str {
    let literal = panic.downcast_ref::<&str>().copied();
    let text = panic.downcast_ref::<String>().map(String::as_str);
    literal.or(text).unwrap_or("a panic without a message")
}
