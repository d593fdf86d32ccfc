//! A second render ("rival") of the same view with other settings. The render that has used less
//! time continues, so pages see both renders after equal time.

use super::denoising::is_whole;
use super::{Change, Engine, samples_of};
use crate::compare::Errors;
use crate::film::RgbImage;
use crate::io::half_picture;
use crate::options::{IntegratorKind, Named};
use crate::render::Outcome;
use crate::session::{Error, RenderState, Renderer, Session, Settings};
use crate::view::frame::{Frame, RIVAL};
use crate::view::parameters;
use serde_json::json;
use std::time::{Duration, Instant};

/// Minimum time between two measurements of errors, which read all pixels.
const MEASURING: Duration = Duration::from_millis(500);

/// The scene of the second render.
pub(super) struct Rival {
    session: Session,
    /// Settings that override the settings of the picture.
    text: String,
}

/// The running second render, for the time in which the picture is rendered.
pub(super) struct RivalRender<'a> {
    renderer: Renderer<'a>,
    state: RenderState,
    pub is_complete: bool,
    text: &'a str,
}

impl<'a> RivalRender<'a> {
    pub fn new(rival: &'a Rival) -> Result<Self, Error> {
        let renderer = rival.session.renderer()?;
        Ok(Self {
            state: renderer.start(),
            renderer,
            is_complete: false,
            text: &rival.text,
        })
    }

    /// Returns true if the second render must take the next samples: it is not complete, and the
    /// main picture with `state` is complete or has taken more time.
    pub fn is_next(&self, state: &RenderState, is_complete: bool) -> bool {
        !self.is_complete && (is_complete || self.state.seconds < state.seconds)
    }
}

/// Splits `KEY=VALUE` or names of integrators, joined by `+`, into keys and values.
///
/// # Errors
///
/// A part of another form.
fn parts(text: &str) -> Result<Vec<(&str, &str)>, String> {
    let is_integrator = |part: &str| IntegratorKind::NAMES.iter().any(|(name, _)| *name == part);
    text.split('+')
        .map(|written| match written.split_once('=') {
            Some((key, value)) => Ok((key.trim(), value.trim())),
            None if is_integrator(written.trim()) => Ok(("integrator", written.trim())),
            None => Err(format!(
                "--compare {text}: `{}` is neither an integrator nor KEY=VALUE\n  help: write two, such as path,bdpt or path,path+reuse=none",
                written.trim()
            )),
        })
        .collect()
}

impl Engine<'_> {
    /// Applies the settings `first` to the picture, and starts a second render with the settings
    /// `second`.
    ///
    /// # Errors
    ///
    /// Unknown settings or invalid values.
    pub(super) fn compare(&mut self, first: &str, second: &str) -> Result<(), String> {
        let (mut options, mut settings) = (self.options, self.settings.clone());
        for (key, value) in parts(first)? {
            let key = key.replace('-', "_");
            parameters::set((&mut options, &mut settings), &key, Some(value))?;
            self.changes.insert(key, Some(value.into()));
        }
        settings.check().map_err(|error| error.to_string())?;
        (self.options, self.settings) = (options, settings);
        self.settings_beside(second)?;
        self.compare = Some(second.into());
        Ok(())
    }

    /// Settings of the second render: the settings of the picture, overridden by `text`.
    ///
    /// # Errors
    ///
    /// Unknown settings or invalid values.
    pub(super) fn settings_beside(&self, text: &str) -> Result<Settings, String> {
        let (mut options, mut settings) = (self.options, self.settings.clone());
        // Remove the additional channels, because the integrator of the second render possibly does
        // not support them
        settings.aovs.clear();
        settings.light_paths.clear();
        for (key, value) in parts(text)? {
            parameters::set((&mut options, &mut settings), &key.replace('-', "_"), Some(value))?;
        }
        if settings.resolution != self.settings.resolution {
            return Err("pictures of different sizes cannot be compared".into());
        }
        settings.check().map_err(|error| error.to_string())?;
        Ok(settings)
    }

    /// The second render of the scene of `session`, with the same camera; `None` without a
    /// comparison.
    ///
    /// # Errors
    ///
    /// Invalid settings. The comparison is then removed.
    pub(super) fn next_rival(&mut self, session: &Session) -> Result<Option<Rival>, Error> {
        let known = self.rival.take();
        let Some(text) = self.compare.clone() else {
            return Ok(None);
        };
        let made = self.rival_of(session, known, text);
        if made.is_err() {
            self.compare = None;
        }
        made.map(Some)
    }

    fn rival_of(&self, session: &Session, known: Option<Rival>, text: String) -> Result<Rival, Error> {
        let settings = self.settings_beside(&text).map_err(Error::Failed)?;
        let known = known.filter(|rival| rival.session.serves(&settings));
        let mut rival = match known {
            Some(rival) => Rival { text, ..rival },
            None => {
                let file = session.lit_file().unwrap_or(&self.file);
                let mut new = Session::load(file, settings.clone(), &())?;
                new.keep_accel_of(session)?;
                Rival { session: new, text }
            }
        };
        rival.session.change(settings, self.camera, false)?;
        Ok(rival)
    }

    /// Renders the rival for one `slice` of time.
    pub(super) fn take_turn(&mut self, rival_render: &mut RivalRender, slice: Duration) {
        let rate = self.rate;
        let before = rival_render.state.film.samples();
        let outcome = self.take_samples(&rival_render.renderer, &mut rival_render.state, slice, true);
        // Restore the rate: it is the sample rate of the main picture.
        self.rate = rate;
        rival_render.is_complete = outcome == Outcome::Complete;
        if rival_render.state.film.samples() > before || rival_render.is_complete {
            self.show_rival(rival_render, rival_render.is_complete);
        }
    }

    /// Shows the rival on the pages that show its channel.
    pub(super) fn show_rival(&self, rival_render: &RivalRender, is_final: bool) {
        if rival_render.state.is_empty() || !self.hub.channels().contains(RIVAL) {
            return;
        }
        let film = &rival_render.state.film;
        let size = film.crop().size().to_array();
        let facts =
            json!({ "size": size, "samples": samples_of(&rival_render.state), "moves": self.moves, "preview": false });
        let frame = Frame::of_film(self.hub.next_frame(), RIVAL, film, &facts, is_final);
        self.hub.show(RIVAL, &frame);
    }

    /// Sends pages the difference of the pictures and their errors against the reference, at
    /// intervals, and once more after the last sample (`is_over`).
    pub(super) fn send_errors(&mut self, state: &RenderState, rival_render: Option<&RivalRender>, is_over: bool) {
        let is_wanted = rival_render.is_some() || self.reference.is_some();
        let is_due = self.shown.errors.elapsed() >= MEASURING;
        if !is_wanted || !is_due || self.is_paused || is_over && self.shown.has_sent_last || !is_whole(state) {
            return;
        }
        self.shown.errors = Instant::now();
        self.shown.has_sent_last = is_over;
        let image = picture(state);
        let rival = rival_render.filter(|rival_render| is_whole(&rival_render.state));
        let rival = rival.map(|rival_render| (rival_render, picture(&rival_render.state)));
        let error = |image: &RgbImage, reference: &RgbImage| Errors::new(image, reference).ok().map(|e| e.rel_mse);
        let against = |image: &RgbImage| self.reference.as_ref().and_then(|reference| error(image, reference));
        let side = |text: &str, state: &RenderState, image: &RgbImage| json!({ "settings": text, "samples": samples_of(state), "seconds": state.seconds, "error": against(image) });
        self.send(&json!({
            "type": "errors",
            "first": side(self.settings.chosen_integrator().name(), state, &image),
            "second": rival.as_ref().map(|(rival_render, image)| side(rival_render.text, &rival_render.state, image)),
            "between": rival.as_ref().and_then(|(_, other)| error(&image, other)),
        }));
    }

    /// Starts a comparison with the settings `text`, or ends the comparison if `None`.
    pub(super) fn change_compare(&mut self, text: Option<String>) -> Result<Change, String> {
        if let Some(text) = &text {
            self.settings_beside(text)?;
        }
        self.compare = text;
        Ok(Change::Picture)
    }
}

/// Picture of the light of `state`.
fn picture(state: &RenderState) -> RgbImage {
    let size = state.film.crop().size();
    let values = half_picture::light(&state.film);
    RgbImage {
        width: size.x as usize,
        height: size.y as usize,
        pixels: values.chunks_exact(3).map(|rgb| [rgb[0], rgb[1], rgb[2]]).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_are_named() {
        assert_eq!(parts("sppm"), Ok(vec![("integrator", "sppm")]));
        let both = parts("path + reuse=none+max-depth = 3").unwrap();
        assert_eq!(both, [("integrator", "path"), ("reuse", "none"), ("max-depth", "3")]);
        let said = parts("path+nonsense").unwrap_err();
        assert!(said.contains("`nonsense` is neither"), "{said}");
        assert!(parts("").is_err());
    }
}
