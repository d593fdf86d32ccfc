//! Runs the denoiser in a separate thread, so that the first pixels and a moving camera do not wait
//! for the denoiser.

use super::{Engine, samples_of};
use crate::film::{Image, metered};
use crate::io::half_picture;
use crate::session::{RenderState, Renderer, Unfinished, denoise};
use crate::view::frame::{DENOISED, Frame};
use serde_json::{Value, json};
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::thread;
use std::time::{Duration, Instant};

/// Maximum fraction of the time that is spent on denoising for pages.
const SHARE: f64 = 0.25;

/// The running denoiser, and the last denoised picture.
pub(super) struct PageDenoiser {
    /// Number of the current picture.
    picture: u64,
    work: Option<RunningDenoiser>,
    /// Last denoised frame of the current picture. The `bool` is true if the frame includes the
    /// last sample.
    shown: Option<(Frame, bool)>,
    /// True if the denoiser has failed with the current picture.
    has_failed: bool,
    /// End and duration of the last run of the denoiser.
    ended: Instant,
    took: Duration,
}

/// A running denoiser with its input.
struct RunningDenoiser {
    picture: u64,
    size: [u32; 2],
    facts: Value,
    is_last: bool,
    start: Instant,
    result: Receiver<Result<Image, String>>,
}

impl PageDenoiser {
    /// State without a running denoiser and without a result.
    pub fn new() -> Self {
        Self {
            picture: 0,
            work: None,
            shown: None,
            has_failed: false,
            ended: Instant::now(),
            took: Duration::ZERO,
        }
    }

    /// Starts a new picture. Results that belong to earlier pictures are dropped.
    pub fn next_picture(&mut self) {
        self.picture += 1;
        self.shown = None;
        self.has_failed = false;
    }

    /// The last denoised picture, if it belongs to the current picture.
    pub fn shown(&self) -> Option<&Frame> {
        self.shown.as_ref().map(|(frame, _)| frame)
    }

    /// Returns true if a denoiser is running.
    pub fn is_busy(&self) -> bool {
        self.work.is_some()
    }

    /// Returns true if a denoiser is running for the current picture. The render then waits for the
    /// denoiser, because both at the same time take far longer than one after the other.
    pub fn is_awaited(&self) -> bool {
        self.work.as_ref().is_some_and(|work| work.picture == self.picture)
    }

    /// Returns true if the picture may be denoised now. The first picture of a camera is denoised
    /// at once. Later pictures are denoised if denoising takes at most the fraction [`SHARE`] of
    /// the time.
    fn is_due(&self, is_last: bool) -> bool {
        let share = self.took.as_secs_f64() / self.ended.elapsed().as_secs_f64().max(1e-9);
        let is_done = self.shown.as_ref().is_some_and(|(_, is_last)| *is_last);
        let is_free = self.work.is_none() && !self.has_failed && !is_done;
        is_free && (self.shown.is_none() || is_last || share <= SHARE)
    }

    fn start(&mut self, renderer: &Renderer, state: &RenderState, facts: Value, is_last: bool) {
        let image = renderer.develop(state);
        let settings = renderer.session().settings().clone();
        let (sender, result) = channel();
        let work = move || {
            let result = denoise(&settings, image, &|| false).map(|(image, _)| image);
            let words = |error| match error {
                Unfinished::Failed(error) => error.to_string(),
                _ => "the denoiser was cancelled".into(),
            };
            let _ = sender.send(result.map_err(words));
        };
        // If no thread can be started, the picture keeps its noise.
        if thread::Builder::new().name("denoiser".into()).spawn(work).is_ok() {
            self.work = Some(RunningDenoiser {
                picture: self.picture,
                size: state.film.crop().size().to_array(),
                facts,
                is_last,
                start: Instant::now(),
                result,
            });
        }
    }

    /// The finished run of the denoiser with its result, if any.
    fn take(&mut self) -> Option<(RunningDenoiser, Result<Image, String>)> {
        let result = match self.work.as_ref()?.result.try_recv() {
            Ok(result) => result,
            Err(TryRecvError::Empty) => return None,
            Err(TryRecvError::Disconnected) => Err("the denoiser has ended without a result".into()),
        };
        let work = self.work.take()?;
        (self.ended, self.took) = (Instant::now(), work.start.elapsed());
        Some((work, result))
    }
}

impl Engine<'_> {
    /// Shows the result of the denoiser, and starts the denoiser for newer samples if pages show
    /// the denoised picture.
    pub(super) fn denoise(&mut self, renderer: &Renderer, state: &RenderState, is_last: bool) {
        if let Some((work, result)) = self.denoising.take() {
            match result {
                Err(words) => {
                    self.denoising.has_failed = true;
                    self.send_error(None, &words);
                }
                Ok(image) if work.picture == self.denoising.picture => self.show_denoised(renderer, work, &image),
                Ok(_) => {}
            }
        }
        let is_wanted = self.hub.channels().contains(DENOISED) && can_denoise(renderer, state);
        if is_wanted && self.denoising.is_due(is_last) {
            let facts = self.facts(state);
            self.denoising.start(renderer, state, facts, is_last);
        }
    }

    fn show_denoised(&mut self, renderer: &Renderer, work: RunningDenoiser, image: &Image) {
        let RunningDenoiser {
            size,
            mut facts,
            is_last,
            ..
        } = work;
        let tone = renderer.session().settings().tone;
        if tone.exposure.stops().is_none() {
            // Meter the denoised picture, as the PNG file of `render` does.
            self.shown.exposure = metered(tone, image).exposure.stops();
            facts["exposure"] = json!(self.shown.exposure);
        }
        facts["denoised"] = json!(true);
        if let Some(values) = half_picture::layer(image, half_picture::PICTURE) {
            let mut frame = Frame::new(self.hub.next_frame(), DENOISED, size, &values, &facts, is_last);
            if let Some((backing, coverage)) = image.coverage() {
                frame = frame.over(backing, coverage.as_flattened());
            }
            self.hub.show(DENOISED, &frame);
            self.denoising.shown = Some((frame, is_last));
        }
        self.shown.status = None;
    }

    /// Data about `state` for the headers of its pictures.
    pub(super) fn facts(&self, state: &RenderState) -> Value {
        let whole = self.settings.resolution;
        json!({
            "size": [whole.x, whole.y],
            "samples": samples_of(state),
            "moves": self.moves,
            // True also for a preview at full size, which is possible if one sample per pixel is
            // fast enough.
            "preview": self.moved.is_some(),
            "exposure": self.shown.exposure,
        })
    }
}

/// Returns true if there is a denoiser, and each pixel has a sample.
pub(super) fn can_denoise(renderer: &Renderer, state: &RenderState) -> bool {
    renderer.session().settings().denoiser.is_some() && is_whole(state)
}

/// Returns true if each pixel has a sample.
pub(super) fn is_whole(state: &RenderState) -> bool {
    state.film.tiles().iter().all(|tile| tile.samples() > 0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    /// The first picture is due at once, and later pictures at intervals. No picture is due after a
    /// failure or after the last picture.
    #[test]
    fn denoised_pictures_are_due_at_intervals() {
        let mut denoising = PageDenoiser::new();
        denoising.took = Duration::from_secs(3600);
        assert!(denoising.is_due(false));
        let frame = Frame::new(1, DENOISED, [1, 1], &[0.5; 3], &json!({}), false);
        denoising.shown = Some((frame.clone(), false));
        assert!(!denoising.is_due(false) && denoising.is_due(true));
        denoising.took = Duration::ZERO;
        assert!(denoising.is_due(false));
        denoising.shown = Some((frame, true));
        assert!(!denoising.is_due(true));
        denoising.next_picture();
        assert!(denoising.is_due(false) && denoising.shown().is_none());
        denoising.has_failed = true;
        assert!(!denoising.is_due(true));
        denoising.next_picture();
        assert!(denoising.is_due(false));
    }
}
