use crate::film::Film;

/// Observer of a render: receives its progress, and may stop or pause the render. It is called from
/// several threads at the same time.
pub trait Observer: Sync {
    /// Called after each piece of work, with the number of new samples.
    fn progress(&self, samples: u64);

    /// Receives the estimated number of remaining samples and the estimated relative error of the
    /// image. Called by renders without a known number of samples.
    fn expect(&self, _samples: u64, _error: f64) {}

    /// Called during preparation: the irradiance cache now has `records` records.
    fn prepared(&self, _records: u64) {}

    /// Called after a pass over all tiles of `film`.
    fn passed(&self, _film: &Film) {}

    /// Returns `true` to end the render at once. The incomplete tile or iteration is discarded and
    /// may be rendered again later.
    fn should_stop(&self) -> bool;

    /// Returns `true` to pause the render without losing work: after the current tiles, or after
    /// the current iteration.
    fn should_pause(&self) -> bool {
        false
    }
}

/// An observer that does nothing: it never pauses and never stops the render.
impl Observer for () {
    fn progress(&self, _: u64) {}

    fn should_stop(&self) -> bool {
        false
    }
}

/// Observers behind dynamic dispatch, for code that is compiled once for all observers.
impl Observer for &dyn Observer {
    fn progress(&self, samples: u64) {
        (**self).progress(samples);
    }

    fn prepared(&self, records: u64) {
        (**self).prepared(records);
    }

    fn expect(&self, samples: u64, error: f64) {
        (**self).expect(samples, error);
    }

    fn passed(&self, film: &Film) {
        (**self).passed(film);
    }

    fn should_stop(&self) -> bool {
        (**self).should_stop()
    }

    fn should_pause(&self) -> bool {
        (**self).should_pause()
    }
}

/// Returns `true` if the render must stop or pause, and must start no new work.
pub(super) fn should_leave(observer: &impl Observer) -> bool {
    observer.should_stop() || observer.should_pause()
}

/// Outcome of a render.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// All samples were taken.
    Complete,
    /// The observer stopped or paused the render. Some pixels may have fewer samples than others,
    /// and pixels may have no samples.
    Stopped,
}
