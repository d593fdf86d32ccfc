//! Small pictures for pages, of views and of textures.

use super::denoising::is_whole;
use super::{Engine, MOMENT};
use crate::camera::CameraDescription;
use crate::color::srgb;
use crate::film::metered;
use crate::io::{display_bytes, png_bytes};
use crate::math::{UVec2, Vec2};
use crate::scene::Scene;
use crate::session::{Error, Session};
use crate::view::hub::PageId;
use crate::view::protocol::PageCamera;
use base64::prelude::{BASE64_STANDARD, Engine as _};
use serde_json::{Value, json};

/// Longer side of the picture of a view in pixels. The second constant is the number of samples per
/// pixel.
const VIEW_SIDE: u32 = 224;
const VIEW_SAMPLES: u32 = 8;
/// Longer side in pixels of the picture of a texture.
const TEXTURE_SIDE: f32 = 96.0;

/// A view that needs a thumbnail.
pub(super) struct ThumbnailView {
    page: PageId,
    index: usize,
    camera: CameraDescription,
}

impl Engine<'_> {
    /// Sends the candidate cameras to `page`. The pictures follow later.
    pub(super) fn list_views(&mut self, page: PageId, session: &Session) -> Result<(), Error> {
        let cameras = session.guessed_views()?;
        let views = cameras.iter().enumerate().map(|(index, (_, guess))| ThumbnailView {
            page,
            index,
            camera: CameraDescription::still(guess.parameters()),
        });
        let views: Vec<ThumbnailView> = views.collect();
        let entry = |((flags, guess), view): (&(String, _), &ThumbnailView)| {
            let guess: &crate::guess::CameraGuess = guess;
            json!({ "flags": flags, "words": guess.words, "camera": PageCamera::of(&view.camera) })
        };
        let list: Vec<Value> = cameras.iter().zip(&views).map(entry).collect();
        let text = json!({ "type": "views", "views": list }).to_string();
        self.hub.send_text(Some(page), &text);
        self.views.retain(|view| view.page != page);
        self.views.extend(views);
        Ok(())
    }

    /// Renders thumbnails of views until urgent mail arrives.
    pub(super) fn picture_views(&mut self, session: &mut Session) -> Result<(), Error> {
        let mut settings = self.preview_settings(VIEW_SAMPLES);
        let size = self.settings.resolution;
        settings.resolution = (size * VIEW_SIDE / size.max_element()).max(UVec2::ONE);
        while !self.hub.is_urgent() && !self.is_over() {
            let Some(view) = self.views.pop_front() else {
                return Ok(());
            };
            session.change(settings.clone(), view.camera, true)?;
            let renderer = session.renderer()?;
            let mut state = renderer.start();
            let rate = self.rate;
            // Continue until each pixel has a sample, because a picture with gaps is not shown.
            while !is_whole(&state) && !self.hub.is_urgent() && !self.is_over() {
                self.take_samples(&renderer, &mut state, MOMENT, false);
            }
            // Restore the sample rate, because `rate` is the rate of larger pictures.
            self.rate = rate;
            if !is_whole(&state) {
                self.views.push_front(view);
                return Ok(());
            }
            let mut image = renderer.develop(&state);
            let mut metadata = renderer.metadata(&state, false);
            // If denoising fails, the thumbnail keeps its noise.
            let _ = renderer.denoise(&mut image, &mut metadata);
            let (channels, bytes) = display_bytes(&image, &metered(settings.tone, &image));
            if let Ok(png) = png_bytes(channels, settings.resolution.to_array(), &bytes) {
                let image = BASE64_STANDARD.encode(png);
                let text = json!({ "type": "view-picture", "index": view.index, "image": image });
                self.hub.send_text(Some(view.page), &text.to_string());
            }
        }
        Ok(())
    }
}

/// A small PNG of the texture with the number `id`.
pub(super) fn texture_png(scene: &Scene, id: u32) -> Result<Vec<u8>, String> {
    let texture = scene.textures().get(id as usize);
    let texture = texture.ok_or_else(|| format!("the scene has no texture number {id}"))?;
    let (width, height) = texture.size();
    let scale = (TEXTURE_SIDE / width.max(height) as f32).min(1.0);
    let [columns, rows] = [width, height].map(|side| ((side as f32 * scale) as u32).max(1));
    let texel = |row: u32, column: u32| {
        let uv = Vec2::new(
            (column as f32 + 0.5) / columns as f32,
            1.0 - (row as f32 + 0.5) / rows as f32,
        );
        texture.color(uv, 1.0 / columns.max(rows) as f32).to_array()
    };
    let codes = (0..rows).flat_map(|row| (0..columns).flat_map(move |column| texel(row, column)));
    let code = |value: f32| (255.0 * srgb::encode(value.clamp(0.0, 1.0))).round() as u8;
    let bytes: Vec<u8> = codes.map(code).collect();
    png_bytes(3, [columns, rows], &bytes).map_err(|error| error.to_string())
}
