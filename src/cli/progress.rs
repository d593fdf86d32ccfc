//! Interrupts, and the progress of long work.
//!
//! An interrupt ends a command at once with exit code 130. If the command holds an
//! [`InterruptGuard`], the first interrupt only sets a flag, which the observers of renders check
//! (`render/cancellation.rs`). Signals within a second of the first signal count as one. The
//! reason: a scheduler that ends a job signals its script and its programs, and the script forwards
//! the signal. The forwarded signal must not count as a second Ctrl-C of the user.
//!
//! Work without an observer runs in a separate thread, which the command can abandon. Denoising is
//! abandoned half a second after an interrupt. A tev viewer is abandoned if it reads no band of
//! rows of the last picture for a second. A command with abandoned work ends without exit handlers.

use super::printing::{escaped, in_colour, percent};
use crate::film::{BLOCK, Film};
use crate::io::LoadObserver;
use crate::render::Observer;
use indicatif::{HumanCount, HumanDuration, ProgressBar, ProgressState, ProgressStyle};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::iterator::Signals;
use std::io::Write as _;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
use std::thread;
use std::time::{Duration, Instant};

/// Exit code of a command ended by an interrupt.
const INTERRUPTED_CODE: i32 = super::error::INTERRUPTED as i32;

/// True while an [`InterruptGuard`] exists.
static IS_HEEDED: AtomicBool = AtomicBool::new(false);

/// Set by the first signal that counts.
static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Signals within this time count as one. Schedulers signal a job's script and its program, and the
/// script forwards the signal.
const ONE_SIGNAL: Duration = Duration::from_secs(1);

/// Handles Ctrl-C (SIGINT), SIGTERM and SIGHUP: they end the process at once with exit code 130,
/// unless an [`InterruptGuard`] exists. Signals that are ignored at the start of the process, as by
/// `nohup` and `trap '' INT`, stay ignored.
pub(super) fn catch_interrupts() {
    let ignored = ignored_signals();
    let caught = [SIGINT, SIGTERM, SIGHUP]
        .into_iter()
        .filter(|signal| ignored >> (signal - 1) & 1 == 0);
    // Without a handler, a signal has the default action of the system. This is not an error.
    let Ok(mut signals) = Signals::new(caught) else { return };
    let wait = move || {
        let mut first: Option<Instant> = None;
        for _ in signals.forever() {
            let is_at_once = match first {
                None => !IS_HEEDED.load(Ordering::SeqCst),
                Some(first) => first.elapsed() > ONE_SIGNAL,
            };
            if is_at_once {
                signal_hook::low_level::exit(INTERRUPTED_CODE);
            }
            INTERRUPTED.store(true, Ordering::SeqCst);
            first.get_or_insert_with(Instant::now);
        }
    };
    let _ = thread::Builder::new().name("signals".into()).spawn(wait);
}

/// Guard of a command with results to write. While the guard exists, the first interrupt requests
/// the command to end and to write its results. Another interrupt at least a second later ends the
/// process at once.
pub(super) struct InterruptGuard(());

impl InterruptGuard {
    pub fn begin() -> Self {
        IS_HEEDED.store(true, Ordering::SeqCst);
        Self(())
    }
}

impl Drop for InterruptGuard {
    fn drop(&mut self) {
        IS_HEEDED.store(false, Ordering::SeqCst);
    }
}

/// Ends an interrupted command at once, after it has written all results. Exit handlers of
/// libraries do not run, because abandoned work in other threads may still use the libraries.
pub(super) fn leave_interrupted() -> ! {
    leave(INTERRUPTED_CODE)
}

/// Ends a command at once with the exit code `code`, after it has written all results. An abandoned
/// thread may still run.
pub(super) fn leave(code: i32) -> ! {
    let _ = std::io::stdout().flush();
    signal_hook::low_level::exit(code)
}

/// Returns true if an interrupt has requested the command to end.
pub(super) fn is_interrupted() -> bool {
    INTERRUPTED.load(Ordering::Relaxed)
}

/// Returns a function that limits the waiting after an interrupt. This function returns true if
/// more than `time` has passed since its first call after the interrupt.
pub(super) fn interrupted_for(time: Duration) -> impl Fn() -> bool {
    let since = OnceLock::new();
    move || is_interrupted() && since.get_or_init(Instant::now).elapsed() > time
}

/// Signals that the process ignores, signal `n` as bit `n - 1`; 0 on systems without `/proc`.
fn ignored_signals() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok())
        .unwrap_or(0)
}

/// Style of a bar with `facts` beside it, in colour if the terminal shows colours.
fn style(facts: &str) -> ProgressStyle {
    let bar = if in_colour() {
        "{wide_bar:.cyan/blue}"
    } else {
        "{wide_bar}"
    };
    ProgressStyle::with_template(&format!("{bar} {facts}")).unwrap_or_else(|_| ProgressStyle::default_bar())
}

/// Update interval of the time in a bar.
const TICK: Duration = Duration::from_secs(1);

/// A bar with rate and remaining time on a terminal; hidden elsewhere.
pub(super) struct Progress {
    bar: ProgressBar,
    /// True until the first sample is taken.
    is_preparing: AtomicBool,
    /// Noise level that ends the render, if any.
    noise: Option<f64>,
    /// False if the number of remaining samples cannot be estimated yet.
    is_end_known: Arc<AtomicBool>,
}

impl Progress {
    /// Progress bar for `samples` samples over all pixels.
    pub fn new(samples: u64, quiet: bool) -> Self {
        Self::to_noise(samples, None, quiet)
    }

    /// Progress bar for at most `samples` samples over all pixels, of which fewer are taken if the
    /// image reaches the noise level `noise` earlier.
    pub fn to_noise(samples: u64, noise: Option<f64>, quiet: bool) -> Self {
        let is_end_known = Arc::new(AtomicBool::new(noise.is_none()));
        if quiet {
            return Self {
                bar: ProgressBar::hidden(),
                is_preparing: AtomicBool::new(false),
                noise,
                is_end_known,
            };
        }
        let is_known = Arc::clone(&is_end_known);
        let style = style("{whole_percent:>3} %  {msg}{rate} samples/s  {elapsed} elapsed, {left}")
            .with_key("left", move |state: &ProgressState, w: &mut dyn std::fmt::Write| {
                let _ = w.write_str(&left_text(is_known.load(Ordering::Relaxed), state.eta()));
            })
            // Rounded down, so that an unfinished render never shows 100 %.
            .with_key("whole_percent", |state: &ProgressState, w: &mut dyn std::fmt::Write| {
                let _ = write!(w, "{:>3}", floored_percent(state.pos(), state.len()));
            })
            .with_key("rate", |state: &ProgressState, w: &mut dyn std::fmt::Write| {
                let _ = write!(w, "{}", HumanCount(state.per_sec() as u64));
            });
        let bar = ProgressBar::new(samples).with_style(style);
        bar.set_message("preparing  ");
        bar.enable_steady_tick(TICK);
        Self {
            bar,
            is_preparing: AtomicBool::new(true),
            noise,
            is_end_known,
        }
    }

    /// Shows that `left` samples remain.
    fn set_left(&self, left: u64) {
        self.bar.set_length(self.bar.position() + left);
        self.is_end_known.store(true, Ordering::Relaxed);
    }

    /// Removes the preparation message.
    fn end_preparing(&self) {
        if self.is_preparing.load(Ordering::Relaxed) && self.is_preparing.swap(false, Ordering::Relaxed) {
            self.bar.set_message("");
        }
    }

    /// Starts the bar at `samples`, the number of samples of earlier runs.
    pub fn skip(&self, samples: u64) {
        self.bar.set_position(samples);
        self.bar.reset_eta();
    }

    /// Runs `f` while the bar is hidden, so that the output of `f` does not mix with the bar.
    pub fn suspend(&self, f: impl FnOnce()) {
        self.bar.suspend(f);
    }

    /// Removes the progress bar.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

/// A [`Progress`] that also stops the render at `end`, and pauses it at `pause`.
pub(super) struct TimedProgress<'a> {
    pub progress: &'a Progress,
    pub end: Option<Instant>,
    pub pause: Option<Instant>,
}

impl Observer for TimedProgress<'_> {
    fn progress(&self, samples: u64) {
        self.progress.progress(samples);
    }

    fn expect(&self, samples: u64, error: f64) {
        self.progress.expect(samples, error);
    }

    fn prepared(&self, records: u64) {
        self.progress.prepared(records);
    }

    fn passed(&self, film: &Film) {
        self.progress.passed(film);
    }

    fn should_stop(&self) -> bool {
        self.progress.should_stop() || is_past(self.end)
    }

    fn should_pause(&self) -> bool {
        is_past(self.pause)
    }
}

fn is_past(time: Option<Instant>) -> bool {
    time.is_some_and(|time| Instant::now() >= time)
}

/// A bar for each stage of reading a scene on a terminal; hidden elsewhere.
pub(super) struct LoadingBar {
    bar: ProgressBar,
}

impl LoadingBar {
    /// A loading bar before the first stage.
    pub fn new(quiet: bool) -> Self {
        let bar = if quiet {
            ProgressBar::hidden()
        } else {
            ProgressBar::no_length()
        };
        Self {
            bar: bar.with_style(style("{percent:>3} %  {msg}  {elapsed}")),
        }
    }

    /// Removes the loading bar.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

impl LoadObserver for LoadingBar {
    fn begin(&self, what: &str, units: u64) {
        self.bar.reset();
        self.bar.set_length(units);
        self.bar.set_message(escaped(what));
        self.bar.enable_steady_tick(TICK);
    }

    fn advance(&self, units: u64) {
        self.bar.inc(units);
    }
}

/// Minimum number of samples per pixel after which the error is estimated from blocks of samples.
pub(super) const MIN_SAMPLES: u32 = 2 * BLOCK;

/// Estimated work until the noise level `level` is reached from the error `error`, as a multiple of
/// the work so far: errors fall as 1/√n. `None` if `error` is not known yet.
pub(super) fn work_left(error: f64, level: f64) -> Option<f64> {
    let factor = (error / level).powi(2);
    factor.is_finite().then(|| (factor - 1.0).max(0.0))
}

/// Estimated number of further samples after `samples` samples, as [`work_left`] estimates it.
pub(super) fn samples_left(samples: u64, error: f64, level: f64) -> Option<u64> {
    work_left(error, level).map(|multiple| (samples as f64 * multiple).ceil() as u64)
}

/// Text for the remaining time `left`, which may be unknown.
fn left_text(is_known: bool, left: Duration) -> String {
    if is_known {
        format!("about {:#} to go", HumanDuration(left))
    } else {
        "time to go not known yet".into()
    }
}

/// Fraction `done` / `of` in whole percent, rounded down.
fn floored_percent(done: u64, of: Option<u64>) -> u64 {
    let of = of.unwrap_or(0).max(1);
    (done.min(of) as u128 * 100 / of as u128) as u64
}

impl Observer for Progress {
    fn progress(&self, samples: u64) {
        self.end_preparing();
        self.bar.inc(samples);
    }

    fn expect(&self, samples: u64, error: f64) {
        self.end_preparing();
        self.set_left(samples);
        self.bar.set_message(format!("error {}  ", percent(error)));
    }

    fn prepared(&self, records: u64) {
        self.bar.set_message(format!("{records} records  "));
    }

    fn passed(&self, film: &Film) {
        let error = (!self.bar.is_hidden()).then(|| film.relative_error()).flatten();
        if let Some(error) = error {
            self.bar.set_message(format!("error {}  ", percent(error)));
        }
        // Methods that render whole iterations do not call `expect`. With fewer samples, the error
        // is estimated too large
        let is_estimated = || film.tiles().iter().all(|tile| tile.samples() >= MIN_SAMPLES);
        if let (Some(level), Some(error)) = (self.noise, error.filter(|_| is_estimated())) {
            let left = samples_left(film.samples(), error, level);
            left.into_iter().for_each(|left| self.set_left(left));
        }
    }

    fn should_stop(&self) -> bool {
        is_interrupted()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_is_said_of_all_alone() {
        assert_eq!(floored_percent(999_999, Some(1_000_000)), 99);
        assert_eq!(floored_percent(1_000_000, Some(1_000_000)), 100);
        assert_eq!(floored_percent(u64::MAX - 1, Some(u64::MAX)), 99);
        assert_eq!((floored_percent(0, Some(0)), floored_percent(5, None)), (0, 100));
    }

    #[test]
    fn unknown_time_is_not_a_number() {
        assert_eq!(left_text(true, Duration::from_secs(40)), "about 40s to go");
        assert_eq!(left_text(false, Duration::from_secs(40)), "time to go not known yet");
    }
}
