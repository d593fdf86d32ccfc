//! Work on a thread of its own, for which a Python thread waits: it holds no lock meanwhile, and looks for signals.

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

/// Between two looks for signals.
const LOOK: Duration = Duration::from_millis(50);

/// Maximum wait for work that was told to stop.
const PATIENCE: Duration = Duration::from_millis(500);

/// What work and the thread that waits for it tell each other.
#[derive(Default)]
pub struct Status {
    /// Whether to stop.
    pub stop: AtomicBool,
    /// Samples taken, over all pixels.
    pub done: AtomicU64,
    /// Samples that will be taken, over all pixels, as far as it is known; 0 while the scene is read.
    pub total: AtomicU64,
}

impl Status {
    /// Whether the work was told to stop.
    pub fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Samples taken and to be taken.
    fn progress(&self) -> (u64, u64) {
        let [done, total] = [&self.done, &self.total].map(|count| count.load(Ordering::Relaxed));
        (done.min(total), total)
    }
}

/// Waits for what `results` gives. `progress` is called with the samples taken and to be taken, when these have changed.
///
/// # Errors
///
/// What a signal, such as Ctrl-C, or `progress` raises: the work is told to stop then.
pub fn wait<T: Send>(
    py: Python,
    results: &Mutex<Receiver<T>>,
    status: &Status,
    progress: Option<&Py<PyAny>>,
) -> PyResult<T> {
    let mut told = None;
    let mut tell = |py: Python| {
        let now = status.progress();
        match progress {
            Some(callback) if now.1 > 0 && told != Some(now) => {
                told = Some(now);
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
        match py.detach(|| receive(LOOK)) {
            Ok(result) => {
                tell(py)?;
                return Ok(result);
            }
            Err(RecvTimeoutError::Disconnected) => return Err(Error::new_err("the render has ended")),
            Err(RecvTimeoutError::Timeout) => {}
        }
        if let Err(raised) = py.check_signals().and_then(|()| tell(py)) {
            status.stop.store(true, Ordering::Relaxed);
            // Its memory is free when the exception is seen, as a rule.
            let _ = py.detach(|| receive(PATIENCE));
            return Err(raised);
        }
    }
}

/// Does `work`, which cannot be told to stop, on a thread of its own, so that signals are seen meanwhile.
///
/// # Errors
///
/// Those of `work`, and what a signal raises: the thread is left to itself then.
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

/// Does `work` in the threads of this process; a panic in it is an error.
pub fn pooled<T: Send>(work: impl FnOnce() -> Result<T, embrasure::Error> + Send) -> Result<T, embrasure::Error> {
    let pool = pool()?;
    guarded(|| pool.install(work))
}

/// Threads for work outside of sessions, and the process that they belong to.
static POOL: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

/// Threads of this process. A process that was forked has none of its parent, and would wait for those
/// of rayon's global pool forever.
fn pool() -> Result<Arc<ThreadPool>, embrasure::Error> {
    let mut known = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    let process = std::process::id();
    if let Some((_, pool)) = known.as_ref().filter(|(of, _)| *of == process) {
        return Ok(pool.clone());
    }
    let pool = ThreadPoolBuilder::new().build();
    let pool = pool.map_err(|error| embrasure::Error::Failed(format!("cannot start threads: {error}")))?;
    let pool = Arc::new(pool);
    // The parent's pool has no threads here that could end.
    std::mem::forget(known.replace((process, pool.clone())));
    Ok(pool)
}

/// Does `work`; a panic in it is an error.
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
