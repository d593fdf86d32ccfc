use crate::film::Film;

/// Watches a render from outside; called from many threads at once.
pub trait Observer: Sync {
    /// `samples` more have been taken.
    fn progress(&self, samples: u64);

    /// As things look now, `samples` more will be taken; the picture's relative error is estimated to be `error`. Told by renders whose
    /// number of samples is not known ahead.
    fn expect(&self, _samples: u64, _error: f64) {}

    /// What has to be there before the first sample is being made: the irradiance cache has so many `records`.
    fn prepared(&self, _records: u64) {}

    /// A pass over all tiles of `film` is done.
    fn passed(&self, _film: &Film) {}

    /// Whether to end the render at once. Work that is not whole, of a tile or of an iteration, is thrown away, and may be done again later.
    fn should_stop(&self) -> bool;

    /// Whether to leave the render for a while, where no work is thrown away for that: when the tiles in work are done, or the iteration.
    fn should_pause(&self) -> bool {
        false
    }
}

/// No-op observer: never pauses, never stops.
impl Observer for () {
    fn progress(&self, _: u64) {}

    fn should_stop(&self) -> bool {
        false
    }
}

/// Dynamic dispatch, for code that is compiled once for all observers.
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

/// Whether `observer` wants no new work to be begun.
pub(super) fn should_leave(observer: &impl Observer) -> bool {
    observer.should_stop() || observer.should_pause()
}

/// How a render ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// All samples were taken.
    Complete,
    /// The observer asked to stop, or to pause; some pixels may have fewer samples than others, and all none.
    Stopped,
}
