//! Commands of pages, and their execution.

use super::saving::is_save;
use super::thumbnails::texture_png;
use super::{Change, Engine, PageRequest, samples_of};
use crate::camera::CameraDescription;
use crate::color::Spectrum;
use crate::files::Output;
use crate::io::Format;
use crate::session::{RenderState, Renderer};
use crate::view::hub::{Mail, PageId, SaveFormat};
use crate::view::protocol::{Command, PageCamera};
use crate::view::{FileLight, LightEdit, MaterialEdit, SavedPart, parameters, scene_keys};
use serde_json::{Value, json};
use std::fs;
use std::time::{Duration, Instant};

/// Maximum time of the search for the brightest samples of a pixel. The second constant is the
/// maximum number of samples to report.
const SEARCH: Duration = Duration::from_secs(2);
const BRIGHTEST: usize = 8;

impl Engine<'_> {
    /// Reads mail (requests of pages), and waits up to `patience` for it. Returns the change that
    /// the mail needs. If the scene must be loaded first, a save and all later mail wait in `held`.
    pub(super) fn read_mail(&mut self, patience: Duration) -> Change {
        let mut change = std::mem::replace(&mut self.pending, Change::Nothing);
        if self.held.is_empty() {
            let is_idle = change == Change::Nothing;
            let patience = if is_idle { patience } else { Duration::ZERO };
            self.held.extend(self.hub.take_mail(patience));
        }
        while let Some(mail) = self.held.pop_front() {
            if change == Change::Scene && is_save(&mail) {
                self.held.push_front(mail);
                break;
            }
            let next = match mail {
                Mail::Save(format, reply) => {
                    self.jobs.push(PageRequest::Save(format, reply));
                    Change::Nothing
                }
                Mail::Command(page, command) => self.obey(page, command),
            };
            change = change.max(next);
        }
        change
    }

    /// Executes the command of a page.
    fn obey(&mut self, page: PageId, command: Command) -> Change {
        match command {
            Command::Camera(view) => {
                let camera = CameraDescription {
                    parameters: view.parameters(),
                    ..self.camera
                };
                if let Err(error) = camera.camera(self.settings.resolution) {
                    self.send_error(Some(page), &error.to_string());
                    return Change::Nothing;
                }
                self.camera = camera;
                self.moves += 1;
                self.moved = Some(Instant::now());
                self.send(&json!({ "type": "camera", "camera": view, "from": page }));
                return Change::Picture;
            }
            Command::Set { key, value } => {
                let (mut options, mut settings) = (self.options, self.settings.clone());
                let set = parameters::set((&mut options, &mut settings), &key, value.as_deref());
                let checked = set.and_then(|()| settings.check().map_err(|error| error.to_string()));
                if let Err(words) = checked {
                    self.send_error(Some(page), &words);
                    self.send_state();
                    return Change::Nothing;
                }
                (self.options, self.settings) = (options, settings);
                self.changes.insert(key, value);
                return Change::Settings;
            }
            Command::Pause {} => {
                self.is_paused = true;
                // Send the paused picture again, now without loss.
                self.has_new_channel = true;
            }
            Command::Resume {} => self.is_paused = false,
            Command::Restart {} => return Change::Picture,
            Command::Inspect { x, y, sample } => self.jobs.push(PageRequest::Inspect(page, [x, y], sample)),
            Command::Brightest { x, y } => self.jobs.push(PageRequest::Brightest(page, [x, y])),
            Command::Pick { x, y } => self.jobs.push(PageRequest::Pick(page, [x, y])),
            Command::Views {} => self.jobs.push(PageRequest::Views(page)),
            Command::SaveCamera {} => return self.save(page, SavedPart::Camera, command),
            Command::Material { name, key, value } => {
                if let Err(words) = scene_keys::check_material(&key) {
                    self.send_error(Some(page), &words);
                    return Change::Nothing;
                }
                let edits = &mut self.edits.materials;
                // Single keys override a preset, so a new preset removes the keys that were set.
                let is_preset = key == scene_keys::PRESET;
                edits.retain(|edit| edit.name != name || (edit.key != key && !is_preset));
                edits.push(MaterialEdit { name, key, value });
                return Change::Scene;
            }
            Command::Light { index, key, value } => {
                let light = self.lights.iter().find(|light| light.index == index);
                let checked = match light {
                    Some(FileLight { section, .. }) => scene_keys::check_light(section.kind.get_ref(), &key),
                    None => Err(format!(
                        "the scene file has no light number {}, or a flag has replaced the light",
                        index.saturating_add(1)
                    )),
                };
                if let Err(words) = checked {
                    self.send_error(Some(page), &words);
                    return Change::Nothing;
                }
                let edits = &mut self.edits.lights;
                edits.retain(|edit| (edit.index, &edit.key) != (index, &key));
                edits.push(LightEdit { index, key, value });
                return Change::Scene;
            }
            Command::ResetChanges {} => {
                self.edits.materials.clear();
                self.edits.lights.clear();
                return Change::Scene;
            }
            Command::SaveChanges {} => return self.save(page, SavedPart::Changes, command),
            Command::Compare { with } => match self.change_compare(with) {
                Ok(change) => return change,
                Err(words) => self.send_error(Some(page), &words),
            },
            Command::Channel { .. } => {
                self.has_new_channel = true;
                return self.follow_pages();
            }
            // The thread of the page has already handled this command.
            Command::Shown { .. } => {}
        }
        Change::Nothing
    }

    /// Executes the waiting jobs, which need the picture of `state`.
    pub(super) fn do_jobs(&mut self, renderer: &Renderer, state: &RenderState) {
        for job in std::mem::take(&mut self.jobs) {
            match job {
                PageRequest::Save(format, reply) => {
                    let _ = reply.send(self.file_of(renderer, state, format));
                }
                PageRequest::Inspect(page, pixel, sample) => match self.host.inspect(renderer, pixel, sample) {
                    Ok(facts) => {
                        let camera = PageCamera::of(&self.camera);
                        let text = json!({ "type": "inspect", "facts": facts, "camera": camera });
                        self.hub.send_text(Some(page), &text.to_string());
                    }
                    Err(words) => self.send_error(Some(page), &words),
                },
                PageRequest::Brightest(page, pixel) => match self.brightest(renderer, state, pixel) {
                    Ok(found) => self.hub.send_text(Some(page), &found.to_string()),
                    Err(words) => self.send_error(Some(page), &words),
                },
                PageRequest::Pick(page, pixel) => match self.pick(renderer, pixel) {
                    Ok(found) => self.hub.send_text(Some(page), &found.to_string()),
                    Err(words) => self.send_error(Some(page), &words),
                },
                PageRequest::Views(page) => {
                    if let Err(error) = self.list_views(page, renderer.session()) {
                        self.send_error(Some(page), &error.to_string());
                    }
                }
            }
        }
    }

    /// Contents of a file in `format`: the picture, as `embrasure render` writes it, or a texture.
    fn file_of(&self, renderer: &Renderer, state: &RenderState, format: SaveFormat) -> Result<Vec<u8>, String> {
        if let SaveFormat::Texture(id) = format {
            return texture_png(renderer.session().scene(), id);
        }
        if state.is_empty() {
            return Err("there is no picture yet".into());
        }
        let words = |error: &dyn std::fmt::Display| error.to_string();
        let is_complete = samples_of(state) >= f64::from(renderer.session().settings().samples().end);
        let mut image = renderer.develop(state);
        let mut metadata = renderer.metadata(state, is_complete);
        renderer
            .denoise(&mut image, &mut metadata)
            .map_err(|error| words(&error))?;
        let tone = renderer.session().settings().tone;
        metadata.note_exposure(tone, &image);
        let (name, format) = match format {
            SaveFormat::Exr => ("picture.exr", Format::Exr(self.exr.clone())),
            SaveFormat::Png(of_page) => ("picture.png", Format::Png(of_page.unwrap_or(tone))),
            SaveFormat::Texture(_) => return Err("a texture cannot be saved as a picture of the scene".into()),
        };
        // Writers of pictures need a file that they can replace, so use a temporary folder.
        let folder = tempfile::tempdir().map_err(|error| words(&error))?;
        let output = Output::prepare(folder.path().join(name)).map_err(|error| words(&error))?;
        let path = output.path().to_path_buf();
        match renderer.write(state, &image, &[(format, output)], &metadata).first() {
            Some(error) => Err(words(error)),
            None => fs::read(path).map_err(|error| words(&error)),
        }
    }

    /// The samples of a pixel that contribute most light, among the samples taken so far.
    fn brightest(&self, renderer: &Renderer, state: &RenderState, pixel: [u32; 2]) -> Result<Value, String> {
        let first = renderer.session().settings().samples().start;
        let Some(tile) = state.film.tile_at(pixel.into()) else {
            return Err(format!("pixel {},{} is outside the image", pixel[0], pixel[1]));
        };
        let end = tile.next_sample();
        let lights = self.host.samples_of(renderer, pixel, first..end, SEARCH)?;
        let luminance = |light: &[f32; 3]| f64::from(Spectrum::from(*light).luminance());
        let total: f64 = lights.iter().map(luminance).sum();
        let mut order: Vec<usize> = (0..lights.len()).collect();
        order.sort_by(|a, b| luminance(&lights[*b]).total_cmp(&luminance(&lights[*a])));
        let entry = |&i: &usize| {
            let share = if total > 0.0 {
                luminance(&lights[i]) / total
            } else {
                0.0
            };
            json!({ "sample": first + i as u32, "radiance": lights[i], "share": share })
        };
        Ok(json!({
            "type": "brightest",
            "pixel": pixel,
            "searched": lights.len(),
            "of": end - first,
            "samples": order.iter().take(BRIGHTEST).map(entry).collect::<Vec<_>>(),
        }))
    }
}
