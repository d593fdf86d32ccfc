use crate::io::LoadObserver;
use crate::render::Observer;
use indicatif::{HumanCount, ProgressBar, ProgressState, ProgressStyle};
use std::fmt::Write;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

/// Set by the first Ctrl-C or termination signal.
static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// From now on an interrupt asks the render to end and be written; a second one ends the process at once.
pub(super) fn catch_interrupts() {
    static INSTALLED: OnceLock<()> = OnceLock::new();
    INSTALLED.get_or_init(|| {
        // Without a handler an interrupt just ends the process, which is no reason not to render.
        let _ = ctrlc::set_handler(|| {
            if INTERRUPTED.swap(true, Ordering::SeqCst) {
                std::process::exit(130);
            }
        });
    });
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
        let style = ProgressStyle::with_template(
            "{wide_bar:.cyan/blue} {percent:>3} %  {msg}{rate} samples/s  {elapsed} elapsed, {eta} to go",
        )
        .unwrap_or_else(|_| ProgressStyle::default_bar())
        .with_key("rate", |state: &ProgressState, w: &mut dyn Write| {
            let _ = write!(w, "{}", HumanCount(state.per_sec() as u64));
        });
        Self {
            bar: ProgressBar::new(samples).with_style(style),
        }
    }

    /// Removes the bar.
    pub fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

/// A bar for each part of reading a scene on a terminal; nothing elsewhere.
pub(super) struct Loading {
    bar: ProgressBar,
}

impl Loading {
    /// Shows nothing yet.
    pub fn new(quiet: bool) -> Self {
        let style = ProgressStyle::with_template("{wide_bar:.cyan/blue} {percent:>3} %  {msg}  {elapsed}");
        let bar = if quiet {
            ProgressBar::hidden()
        } else {
            ProgressBar::no_length()
        };
        Self {
            bar: bar.with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar())),
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
        self.bar.set_message(what.to_string());
    }

    fn advance(&self, units: u64) {
        self.bar.inc(units);
    }
}

impl Observer for Progress {
    fn progress(&self, samples: u64) {
        self.bar.inc(samples);
    }

    fn expect(&self, samples: u64, error: f64) {
        self.bar.set_length(self.bar.position() + samples);
        self.bar.set_message(format!("noise {error:.2e}  "));
    }

    fn should_stop(&self) -> bool {
        INTERRUPTED.load(Ordering::Relaxed)
    }
}
