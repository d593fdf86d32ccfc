use super::stats::NoiseOfRender;
use crate::film::Film;

/// Reason for the end of a render.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Stop {
    /// All samples were taken.
    Samples,
    /// The noise level was reached.
    Noise,
    TimeLimit,
    Interrupt,
}

impl Stop {
    /// Reason for the end of a render that neither an interrupt nor the time limit ended.
    pub fn of_complete(film: &Film, noise: Option<f64>) -> Self {
        match noise {
            Some(level) if NoiseOfRender::new(film, level).is_reached() => Self::Noise,
            _ => Self::Samples,
        }
    }

    pub fn is_complete(self) -> bool {
        matches!(self, Self::Samples | Self::Noise)
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::Samples => "samples",
            Self::Noise => "noise",
            Self::TimeLimit => "time-limit",
            Self::Interrupt => "interrupt",
        }
    }

    /// Text for the end of a sentence; empty if all samples were taken.
    pub fn words(self) -> &'static str {
        match self {
            Self::Samples => "",
            Self::Noise => ", stopped by --noise",
            Self::TimeLimit => ", stopped by --time-limit",
            Self::Interrupt => ", stopped by an interrupt",
        }
    }
}
