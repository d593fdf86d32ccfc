//! Messages and pictures for pages.

use super::denoising::can_denoise;
use super::groups::of_users;
use super::{Engine, MEASURING, STATUS, samples_of};
use crate::color::{Curve, Tone};
use crate::film::{Image, metered};
use crate::io::half_picture;
use crate::material::Material;
use crate::math::Vec2;
use crate::scene::Scene;
use crate::scene_file::MaterialSection;
use crate::session::{RenderState, Renderer, Session};
use crate::view::frame::{self, Frame};
use crate::view::hub::PageId;
use crate::view::protocol::PageCamera;
use crate::view::{FileLight, LightEdit, parameters, scene_file, scene_keys};
use serde::Serialize;
use serde_json::{Value, json};
use std::time::Instant;

/// Pixel values of a frame.
enum Values {
    /// Light, and the coverage of the background if the film has one.
    Light,
    /// Values of a channel: three numbers per pixel.
    Channel(Vec<f32>),
}

impl Engine<'_> {
    /// Sends the channels of `state` to the pages that show them. Pages that show the denoised
    /// channel get the noisy picture until the denoiser has finished.
    pub(super) fn show(&mut self, renderer: &Renderer, state: &RenderState, is_last: bool) {
        let mut channels = self.hub.channels();
        let size = state.film.crop().size().to_array();
        let is_preview = self.moved.is_some();
        if is_preview {
            // Always send the picture, so that a new page gets pixels at once.
            channels.insert(half_picture::PICTURE.into());
        }
        let tone = renderer.session().settings().tone;
        let mut developed: Option<Image> = None;
        let is_final = is_last && !is_preview;
        // A page may decode the last picture after it has read the last status. Both must have the
        // same exposure.
        if self.shown.exposure.is_none() || (is_final && self.denoising.shown().is_none()) {
            let stops = tone.exposure.stops();
            let metered = |image: &Image| metered(tone, image).exposure.stops();
            self.shown.exposure = stops.or_else(|| metered(developed.get_or_insert_with(|| renderer.develop(state))));
        }
        let facts = self.facts(state);
        let groups = if self.shows_groups && !is_preview {
            renderer.session().scene().light_groups().names()
        } else {
            &[]
        };
        for channel in &channels {
            let mut facts = facts.clone();
            let mut is_final = is_final;
            match channel.as_str() {
                frame::LIGHTS => facts["groups"] = json!(groups),
                frame::DENOISED => {
                    facts["denoised"] = json!(false);
                    is_final &= !can_denoise(renderer, state);
                }
                _ => {}
            }
            let denoised = self.denoising.shown().filter(|_| !is_preview);
            let values = match channel.as_str() {
                frame::RIVAL if !is_preview => None,
                frame::DENOISED if denoised.is_some() => {
                    // Send the denoised picture again, for pages that were opened after it was sent
                    if let Some(frame) = denoised.filter(|_| is_last) {
                        self.hub.show(channel, frame);
                    }
                    None
                }
                frame::LIGHTS if !groups.is_empty() => {
                    let layers: Vec<String> = groups.iter().map(|name| format!("light_{name}")).collect();
                    Some(Values::Channel(half_picture::stacked(
                        developed.get_or_insert_with(|| renderer.develop(state)),
                        &layers,
                    )))
                }
                // A moving camera shows only one of the two compared renders.
                half_picture::PICTURE | frame::DENOISED | frame::LIGHTS | frame::RIVAL => Some(Values::Light),
                half_picture::IDS => {
                    half_picture::ids(developed.get_or_insert_with(|| renderer.develop(state))).map(Values::Channel)
                }
                name => half_picture::layer(developed.get_or_insert_with(|| renderer.develop(state)), name)
                    .map(Values::Channel),
            };
            if let Some(values) = values {
                let id = self.hub.next_frame();
                let frame = match values {
                    Values::Light => Frame::of_film(id, channel, &state.film, &facts, is_final),
                    Values::Channel(values) => Frame::new(id, channel, size, &values, &facts, is_final),
                };
                if channel == half_picture::PICTURE {
                    self.hub.greet_with(Some(&frame));
                }
                self.hub.show(channel, &frame);
            }
        }
    }

    /// Sends the first messages for each page.
    pub(super) fn greet(&self, session: &Session) {
        let scene = session.scene();
        let bounds = scene.bounds();
        let mut channels = half_picture::layers(Image::channel_names());
        channels.insert(1, frame::DENOISED.into());
        channels.insert(2, frame::LIGHTS.into());
        channels.push(half_picture::IDS.into());
        let tone = self.settings.tone;
        let hello = json!({
            "type": "hello",
            "version": env!("CARGO_PKG_VERSION"),
            "scene": self.path.display().to_string(),
            "triangles": scene.placed_triangle_count(),
            "lights": scene.lights().len(),
            "bounds": [bounds.min.to_array(), bounds.max.to_array()],
            "tables": parameters::tables(),
            "channels": channels,
            "materials": of_users(scene).into_iter().map(|material| of_material(material, scene)).collect::<Vec<_>>(),
            "presets": scene_keys::presets(),
            "scene_lights": self.lights.iter().map(light).collect::<Vec<_>>(),
            "keys": scene_keys::tables(),
            "reference": self.reference.is_some(),
            "exposure": tone.exposure.stops(),
            "tone": tone_name(tone),
            "warnings": session.warnings().iter().map(|w| w.text.as_str()).collect::<Vec<_>>(),
        });
        self.hub.greet("1 hello", &hello.to_string());
        self.send_state();
    }

    /// Sends camera and settings to the pages.
    pub(super) fn send_state(&self) {
        let state = json!({
            "type": "state",
            "camera": PageCamera::of(&self.camera),
            "home": PageCamera::of(&self.home),
            "values": parameters::values(&self.options, &self.settings),
            "patches": scene_file::patches(&self.edits.materials),
            "light_edits": self.edits.lights.iter().map(LightEdit::flag).collect::<Vec<_>>(),
            "light_sections": scene_file::light_sections(&self.lights, &self.edits.lights),
            "compare": self.compare,
            "can_save": self.file.is_file(),
        });
        self.hub.greet("2 state", &state.to_string());
    }

    /// Sends the progress of the render to the pages, at intervals or `at_once`.
    pub(super) fn send_status(&mut self, renderer: &Renderer, state: &RenderState, is_complete: bool, at_once: bool) {
        let is_early = self.shown.status.is_some_and(|sent| sent.elapsed() < STATUS);
        if is_early && !at_once {
            return;
        }
        self.shown.status = Some(Instant::now());
        let settings = renderer.session().settings();
        let samples = state.film.samples();
        let is_known = |(of, at): (u64, Instant)| of == samples || !is_complete && at.elapsed() < MEASURING;
        if samples > 0 && !self.shown.measured.is_some_and(is_known) {
            self.shown.measured = Some((samples, Instant::now()));
            self.shown.noise = state.film.relative_error();
            // If there is a denoised picture, keep its exposure.
            if self.denoising.shown().is_none() {
                let tone = settings.tone;
                let exposure = tone.exposure.stops();
                self.shown.exposure = exposure.or_else(|| metered(tone, &renderer.develop(state)).exposure.stops());
            }
        }
        let phase = match (is_complete, self.is_paused) {
            (true, _) => "complete",
            (false, true) => "paused",
            (false, false) => "rendering",
        };
        self.send(&json!({
            "type": "status",
            "phase": phase,
            "samples": samples_of(state),
            "target": settings.samples().end,
            "rate": self.rate,
            "seconds": state.seconds,
            "noise": self.shown.noise,
            "exposure": self.shown.exposure,
            "pages": self.hub.pages().0,
        }));
    }

    pub(super) fn send(&self, message: &Value) {
        self.hub.send_text(None, &message.to_string());
    }

    pub(super) fn send_error(&self, page: Option<PageId>, words: &str) {
        self.hub
            .send_text(page, &json!({ "type": "error", "text": words }).to_string());
    }
}

/// The applicable keys of a material with their values. Also number, size and mean colour of each
/// of its textures.
fn of_material(material: &Material, scene: &Scene) -> Value {
    let textures = material.maps.by_key().into_iter().filter_map(|(key, map)| {
        let id = map?.texture.0;
        let texture = scene.textures().get(id as usize)?;
        let (width, height) = texture.size();
        let mean = texture.color(Vec2::splat(0.5), 1.0).to_array();
        Some(json!({ "key": key, "id": id, "size": [width, height], "mean": mean }))
    });
    json!({
        "name": material.name,
        "keys": keys_of(&MaterialSection::of_material(material)),
        "textures": textures.collect::<Vec<_>>(),
    })
}

/// Keys of a light in the scene file, with their values.
fn light(light: &FileLight) -> Value {
    json!({ "index": light.index, "keys": keys_of(&light.section) })
}

/// The keys of a section that have values.
fn keys_of(section: &impl Serialize) -> Value {
    // Convert through text, because the text has the shortest decimal form of each number.
    let text = serde_json::to_string(section).unwrap_or_default();
    let mut keys = serde_json::from_str(&text).unwrap_or(Value::Null);
    if let Value::Object(keys) = &mut keys {
        keys.retain(|_, value| !value.is_null());
    }
    keys
}

/// The name of a tone curve.
fn tone_name(tone: Tone) -> &'static str {
    let mut names = Curve::NAMES.iter();
    names
        .find(|(_, curve)| *curve == tone.curve)
        .map_or("srgb", |(name, _)| name)
}
