//! What pages ask for, and what is done about it.

use super::{Change, Engine, Job, samples_of};
use crate::camera::CameraDescription;
use crate::io::{Format, Output};
use crate::session::{RenderState, Renderer};
use crate::view::hub::{Mail, PageId, SaveFormat};
use crate::view::protocol::{CameraView, Command};
use crate::view::{parameters, scene_file};
use serde_json::{Value, json};
use std::fs;
use std::time::{Duration, Instant};

impl Engine<'_> {
    /// Reads all mail, which is waited for so long at most, and gives what has changed.
    pub(super) fn read_mail(&mut self, patience: Duration) -> Change {
        let mut change = std::mem::replace(&mut self.pending, Change::Nothing);
        let patience = if change == Change::Nothing {
            patience
        } else {
            Duration::ZERO
        };
        for mail in self.hub.take_mail(patience) {
            let next = match mail {
                Mail::Save(format, reply) => {
                    self.jobs.push(Job::Save(format, reply));
                    Change::Nothing
                }
                Mail::Command(page, command) => self.obey(page, command),
            };
            change = change.max(next);
        }
        change
    }

    /// Does what a page asks for.
    fn obey(&mut self, page: PageId, command: Command) -> Change {
        match command {
            Command::Camera(view) => {
                let camera = CameraDescription {
                    parameters: view.parameters(),
                    ..self.camera
                };
                if let Err(error) = camera.camera(self.settings.resolution) {
                    self.tell_error(Some(page), &error.to_string());
                    return Change::Nothing;
                }
                self.camera = camera;
                self.moves += 1;
                self.moved = Some(Instant::now());
                self.tell(&json!({ "type": "camera", "camera": view, "from": page }));
                return Change::Picture;
            }
            Command::Set { key, value } => {
                let (mut options, mut settings) = (self.options, self.settings.clone());
                let set = parameters::set((&mut options, &mut settings), &key, value.as_deref());
                let checked = set.and_then(|()| settings.check().map_err(|error| error.to_string()));
                if let Err(words) = checked {
                    self.tell_error(Some(page), &words);
                    self.tell_state();
                    return Change::Nothing;
                }
                (self.options, self.settings) = (options, settings);
                self.changes.insert(key, value);
                return Change::Settings;
            }
            Command::Pause {} => self.is_paused = true,
            Command::Resume {} => self.is_paused = false,
            Command::Restart {} => return Change::Picture,
            Command::Inspect { x, y, sample } => self.jobs.push(Job::Inspect(page, [x, y], sample)),
            Command::Views {} => self.jobs.push(Job::Views(page)),
            Command::SaveCamera {} => self.save_camera(page),
            Command::Material { name, key, value } => {
                let is_plain = !name.contains(['*', '?']) && !key.is_empty();
                if !is_plain {
                    self.tell_error(Some(page), "a change of a material needs its full name and a key");
                    return Change::Nothing;
                }
                let start = format!("{name}.{key}=");
                self.patches.retain(|patch| !patch.starts_with(&start));
                self.patches.push(format!("{start}{value}"));
                return Change::Scene;
            }
            Command::ResetMaterials {} => {
                self.patches.clear();
                return Change::Scene;
            }
            Command::Channel { .. } => self.has_new_channel = true,
            // The page's own thread has seen to it.
            Command::Shown { .. } => {}
        }
        Change::Nothing
    }

    /// Does what was asked of the picture.
    pub(super) fn do_jobs(&mut self, renderer: &Renderer, state: &RenderState) {
        for job in std::mem::take(&mut self.jobs) {
            match job {
                Job::Save(format, reply) => {
                    let _ = reply.send(self.file_of(renderer, state, format));
                }
                Job::Inspect(page, pixel, sample) => match self.host.inspect(renderer, pixel, sample) {
                    Ok(facts) => {
                        let camera = CameraView::of(&self.camera);
                        let text = json!({ "type": "inspect", "facts": facts, "camera": camera });
                        self.hub.tell(Some(page), &text.to_string());
                    }
                    Err(words) => self.tell_error(Some(page), &words),
                },
                Job::Views(page) => match renderer.session().views() {
                    Ok(cameras) => {
                        let list: Vec<Value> = cameras
                            .iter()
                            .map(|(flags, guess)| {
                                let camera = CameraDescription::still(guess.parameters());
                                json!({ "flags": flags, "words": guess.words, "camera": CameraView::of(&camera) })
                            })
                            .collect();
                        let text = json!({ "type": "views", "views": list }).to_string();
                        self.hub.tell(Some(page), &text);
                    }
                    Err(error) => self.tell_error(Some(page), &error.to_string()),
                },
            }
        }
    }

    /// The picture as a file, as `render` writes it.
    fn file_of(&self, renderer: &Renderer, state: &RenderState, format: SaveFormat) -> Result<Vec<u8>, String> {
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
        };
        // Writers ask for a file that can be replaced.
        let folder = tempfile::tempdir().map_err(|error| words(&error))?;
        let output = Output::prepare(&folder.path().join(name)).map_err(|error| words(&error))?;
        let path = output.path().to_path_buf();
        match renderer.write(state, &image, &[(format, output)], &metadata).first() {
            Some(error) => Err(words(error)),
            None => fs::read(path).map_err(|error| words(&error)),
        }
    }

    /// Writes the camera into the scene file.
    fn save_camera(&mut self, page: PageId) {
        if !self.file.is_file() {
            let name = self.path.display();
            let words = format!(
                "{name} is a bare OBJ, which cannot store a camera\n  help: make a scene file with `embrasure init {name}`, or copy the camera as flags"
            );
            self.tell_error(Some(page), &words);
            return;
        }
        let view = CameraView::of(&self.camera);
        match scene_file::save_camera(&self.path, &view) {
            Ok(()) => {
                self.home = self.camera;
                // The file is as it is known to be.
                self.watch.accept();
                let text = format!("The camera is saved in {}.", self.path.display());
                self.hub
                    .tell(Some(page), &json!({ "type": "note", "text": text }).to_string());
                self.tell_state();
            }
            Err(error) => self.tell_error(Some(page), &error.to_string()),
        }
    }
}
