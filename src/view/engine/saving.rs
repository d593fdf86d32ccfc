//! Saves the camera, and changes of materials and lights, in the scene file.
//!
//! Only a loaded state is saved. A save after an edit waits until the scene with the edit is
//! loaded. If loading fails, the save is refused. The new contents of the file must be valid for
//! `render`. They replace the file under a lock, if the file still has the loaded contents. If
//! another program has changed the file, the file is loaded first.

use super::{Change, Engine};
use crate::files::read_text;
use crate::io::FileError;
use crate::view::SavedPart;
use crate::view::hub::{Mail, PageId};
use crate::view::protocol::{Command, PageCamera};
use crate::view::scene_file::{self, SaveResult};
use serde_json::json;

/// Maximum number of times that the file is loaded for one save.
const MAX_LOADS: u32 = 3;

impl SavedPart {
    /// Name of the part, as the start of a sentence.
    fn subject(self) -> &'static str {
        match self {
            Self::Camera => "The camera is",
            Self::Changes => "The changes are",
        }
    }
}

/// Part that `mail` requests to save, and the page that requests it.
fn saved_by(mail: &Mail) -> Option<(PageId, SavedPart)> {
    match mail {
        Mail::Command(page, Command::SaveCamera {}) => Some((*page, SavedPart::Camera)),
        Mail::Command(page, Command::SaveChanges {}) => Some((*page, SavedPart::Changes)),
        _ => None,
    }
}

/// Returns true if `mail` requests a save.
pub(super) fn is_save(mail: &Mail) -> bool {
    saved_by(mail).is_some()
}

impl Engine<'_> {
    /// Saves `part`. If another program has changed the file, the file is loaded first, and then
    /// `command` is executed again.
    pub(super) fn save(&mut self, page: PageId, part: SavedPart, command: Command) -> Change {
        if self.refuses_bare_obj(page, part) {
            return Change::Nothing;
        }
        let edits = &self.edits;
        if part == SavedPart::Changes && edits.materials.is_empty() && edits.lights.is_empty() {
            self.refuse(page, part, "there is no change to save");
            return Change::Nothing;
        }
        match self.write(part) {
            Ok(Some(saved)) => self.note_saved(page, part, &saved),
            Ok(None) if self.loads_of_save < MAX_LOADS => {
                self.loads_of_save += 1;
                self.held.push_front(Mail::Command(page, command));
                return Change::Scene;
            }
            Ok(None) => self.refuse(page, part, &self.unsteady().to_string()),
            Err(words) => self.refuse(page, part, &words),
        }
        self.loads_of_save = 0;
        Change::Nothing
    }

    /// Refuses the saves that wait for a scene, because the scene could not be loaded. `words` is
    /// the reason.
    pub(super) fn refuse_saves(&mut self, words: &str) {
        while let Some((page, part)) = self.held.front().and_then(saved_by) {
            self.held.pop_front();
            self.refuse(page, part, words);
        }
        self.loads_of_save = 0;
    }

    /// Replaces `part` in the scene file. Returns `None` if the file differs from the loaded
    /// contents.
    fn write(&mut self, part: SavedPart) -> Result<Option<SaveResult>, String> {
        let words = |error: FileError| error.to_string();
        let text = match part {
            SavedPart::Camera => scene_file::with_camera(&self.text, &PageCamera::of(&self.camera)),
            SavedPart::Changes => scene_file::with_changes(&self.text, &self.edits.materials, &self.edits.lights),
        };
        let text = text.map_err(|message| words(FileError::new(&self.path, message)))?;
        // The check may take long, and is useless if the file has changed.
        if read_text(&self.path, "the scene file").map_err(words)? != self.text {
            return Ok(None);
        }
        self.host.check(&text, &self.text, part)?;
        let saved = scene_file::save(&self.path, &self.text, &text).map_err(words)?;
        if let Some(saved) = &saved {
            self.text = text;
            self.watch.wrote(&self.path, &saved.metadata);
        }
        Ok(saved)
    }

    /// Error: other programs changed the file again and again during the save.
    fn unsteady(&self) -> FileError {
        let error = FileError::new(&self.path, "the file changes while it is saved");
        error.help("save again when no other program writes it")
    }

    /// Reports that a bare OBJ cannot store `part`. Returns true if the scene is a bare OBJ.
    fn refuses_bare_obj(&self, page: PageId, part: SavedPart) -> bool {
        if self.file.is_file() {
            return false;
        }
        let name = self.path.display();
        let what = match part {
            SavedPart::Camera => "a camera",
            SavedPart::Changes => "materials and lights",
        };
        let words = format!(
            "{name} is a bare OBJ, which cannot store {what}\n  help: make a scene file with `embrasure init {name}`, or copy what the page shows"
        );
        self.send_error(Some(page), &words);
        true
    }

    /// Reports to the page that `part` was not saved, with the reason `words`.
    fn refuse(&self, page: PageId, part: SavedPart, words: &str) {
        self.send_error(Some(page), &format!("{} not saved: {words}", part.subject()));
    }

    /// Reports to the page that `part` was saved. It is now part of the scene file.
    fn note_saved(&mut self, page: PageId, part: SavedPart, saved: &SaveResult) {
        match part {
            SavedPart::Camera => self.home = self.camera,
            SavedPart::Changes => {
                self.edits.materials.clear();
                self.edits.lights.clear();
                // If a later edit fails, the saved edits must not be restored.
                if let Some(restore_point) = &mut self.restore_point {
                    restore_point.edits = self.edits.clone();
                }
            }
        }
        let mut text = format!("{} saved in {}.", part.subject(), self.path.display());
        if saved.other_names > 0 {
            text += " Other names of this file (hard links) keep the old contents.";
        }
        let note = json!({ "type": "note", "text": text }).to_string();
        self.hub.send_text(Some(page), &note);
        self.send_state();
    }
}
