use super::words::{escaped, in_colour};
use crate::film::Film;
use crate::io::LoadObserver;
use crate::render::Observer;
use indicatif::{HumanCount, ProgressBar, ProgressState, ProgressStyle};
use std::fmt::Write;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Set by the first Ctrl-C or termination signal.
static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Signals that come closer together than this are one: schedulers signal a job's script and its program, and the script passes it on.
const ONE_SIGNAL: Duration = Duration::from_secs(1);

/// From now on an interrupt asks the render to end and be written; a second one ends the process at once.
pub(super) fn catch_interrupts() {
    static INSTALLED: OnceLock<()> = OnceLock::new();
    INSTALLED.get_or_init(|| {
        let first: OnceLock<Instant> = OnceLock::new();
        // Without a handler an interrupt just ends the process, which is no reason not to render.
        let _ = ctrlc::set_handler(move || {
            INTERRUPTED.store(true, Ordering::SeqCst);
            if first.get_or_init(Instant::now).elapsed() > ONE_SIGNAL {
                std::process::exit(130);
            }
        });
    });
}

/// A bar with `facts` beside it, in colour where that is wanted.
fn style(facts: &str) -> ProgressStyle {
    let bar = if in_colour() {
        "{wide_bar:.cyan/blue}"
    } else {
        "{wide_bar}"
    };
    ProgressStyle::with_template(&format!("{bar} {facts}")).unwrap_or_else(|_| ProgressStyle::default_bar())
}

/// A bar with rate and remaining time on a terminal; nothing elsewhere.
pub(super) struct Progress {
    bar: ProgressBar,
}

impl Progress {
    /// For `samples` samples over all pixels.
    pub fn new(samples: u64, quiet: bool) -> Self {
        if quiet {
            return Self {
                bar: ProgressBar::hidden(),
            };
        }
        let style = style("{whole_percent:>3} %  {msg}{rate} samples/s  {elapsed} elapsed, {eta} to go")
            // Rounded down: what is not done is not 100 %.
            .with_key("whole_percent", |state: &ProgressState, w: &mut dyn Write| {
                let _ = write!(w, "{:>3}", floored_percent(state.pos(), state.len()));
            })
            .with_key("rate", |state: &ProgressState, w: &mut dyn Write| {
                let _ = write!(w, "{}", HumanCount(state.per_sec() as u64));
            });
        Self {
            bar: ProgressBar::new(samples).with_style(style),
        }
    }

    /// Starts with `samples` that were taken before.
    pub fn skip(&self, samples: u64) {
        self.bar.set_position(samples);
        self.bar.reset_eta();
    }

    /// Runs `f` while the bar is away, so that words on the terminal do not mix with it.
    pub fn suspend(&self, f: impl FnOnce()) {
        self.bar.suspend(f);
    }

    /// Removes the bar.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

/// A [`Progress`] that also stops the render at its end, and has it pause when something is due.
pub(super) struct Until<'a> {
    pub progress: &'a Progress,
    pub end: Option<Instant>,
    pub pause: Option<Instant>,
}

impl Observer for Until<'_> {
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

/// A bar for each part of reading a scene on a terminal; nothing elsewhere.
pub(super) struct Loading {
    bar: ProgressBar,
}

impl Loading {
    /// Shows nothing yet.
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

    /// Removes the bar.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

impl LoadObserver for Loading {
    fn begin(&self, what: &str, units: u64) {
        self.bar.reset();
        self.bar.set_length(units);
        self.bar.set_message(escaped(what));
    }

    fn advance(&self, units: u64) {
        self.bar.inc(units);
    }
}

/// How much is done, in whole per cent that are done.
fn floored_percent(done: u64, of: Option<u64>) -> u64 {
    let of = of.unwrap_or(0).max(1);
    (done.min(of) as u128 * 100 / of as u128) as u64
}

impl Observer for Progress {
    fn progress(&self, samples: u64) {
        self.bar.inc(samples);
    }

    fn expect(&self, samples: u64, error: f64) {
        self.bar.set_length(self.bar.position() + samples);
        self.bar.set_message(format!("error {error:.2e}  "));
    }

    fn prepared(&self, records: u64) {
        self.bar.set_message(format!("{records} records  "));
    }

    fn passed(&self, film: &Film) {
        let error = (!self.bar.is_hidden()).then(|| film.relative_error());
        if let Some(error) = error.flatten() {
            self.bar.set_message(format!("error {error:.2e}  "));
        }
    }

    fn should_stop(&self) -> bool {
        INTERRUPTED.load(Ordering::Relaxed)
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
}
