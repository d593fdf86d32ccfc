//! The picture of a moving camera: smaller, with a few samples.

use super::{Change, Engine, NextStep, REST};
use crate::film::Aov;
use crate::math::UVec2;
use crate::options::{IntegratorKind, IntegratorOptions};
use crate::render::Outcome;
use crate::session::{Error, Session, Settings};
use std::time::Duration;

/// Maximum time in seconds for the first sample of every pixel.
const FIRST_SAMPLE: f64 = 0.035;
/// Duration of a slice after the first sample of every pixel.
const SLICE: Duration = Duration::from_millis(40);
/// Width of the picture divided by the width of the first preview. Before the first preview, the
/// sample rate is not known.
const FIRST_FACTOR: u32 = 6;
/// Maximum number of samples per pixel of a preview.
const SAMPLES: u32 = 32;

impl Engine<'_> {
    /// Renders and shows the preview of the moving camera.
    pub(super) fn preview(&mut self, session: &mut Session) -> Result<NextStep, Error> {
        let (mut settings, camera) = (self.preview_settings(SAMPLES), self.camera);
        settings.resolution = self.preview_size();
        session.change(settings, camera, true)?;
        let renderer = session.renderer()?;
        let mut state = renderer.start();
        loop {
            let rests = self.moved.is_none_or(|moved| moved.elapsed() >= REST);
            if rests && !state.is_empty() {
                self.moved = None;
                return Ok(NextStep::Picture);
            }
            let has_samples = !state.is_empty();
            let slice = if has_samples { SLICE } else { Duration::ZERO };
            let outcome = self.take_samples(&renderer, &mut state, slice, has_samples);
            if !state.is_empty() {
                self.show(&renderer, &state, true);
            }
            let patience = match outcome {
                Outcome::Complete => REST,
                Outcome::Stopped => Duration::ZERO,
            };
            if self.is_over() {
                return Ok(NextStep::End);
            }
            match self.read_mail(patience) {
                Change::Scene => return Ok(NextStep::Scene(None)),
                Change::Picture => return Ok(NextStep::Picture),
                Change::Settings | Change::Nothing => {}
            }
        }
    }

    /// Size of a picture that renders fast enough for a moving camera.
    fn preview_size(&self) -> UVec2 {
        let size = self.settings.resolution;
        let pixels = f64::from(size.x) * f64::from(size.y);
        let factor = if self.rate > 0.0 {
            (pixels / (self.rate * FIRST_SAMPLE)).sqrt().ceil().clamp(1.0, 8.0) as u32
        } else {
            FIRST_FACTOR
        };
        // Each face of a cube map becomes smaller, so that the picture still has six squares
        let view = self.camera.view_size(size);
        (size / view) * UVec2::max(view / factor, UVec2::ONE)
    }

    /// Settings of a picture with few samples, by an integrator without preparation.
    pub(super) fn preview_settings(&self, samples: u32) -> Settings {
        let mut settings = Settings {
            spp: samples,
            noise: None,
            aovs: if self.shows_ids { vec![Aov::Ids] } else { Vec::new() },
            light_paths: Vec::new(),
            ..self.settings.clone()
        };
        // Replace integrators with a slow preparation by path tracing.
        use IntegratorKind::{AmbientOcclusion, Area, Debug, Direct, Light, Naive, OneSample, Path, Whitted};
        let kind = settings.chosen_integrator().kind();
        if !matches!(
            kind,
            AmbientOcclusion | Area | Debug | Direct | Light | Naive | OneSample | Path | Whitted
        ) {
            settings.integrator = IntegratorOptions {
                integrator: Some(Path),
                light_selection: settings.integrator.light_selection,
                triangle_sampling: settings.integrator.triangle_sampling,
                ..IntegratorOptions::default()
            };
        }
        settings
    }
}
