//! Changes that flags make to the light of a scene file. They are stored as changes until the
//! camera is known.

use super::SceneFile;
use crate::scene_file::LightSection;
use crate::scene_file::light_changes::{ChangedLight, LightChanges, Viewpoint};

impl SceneFile {
    /// Applies `changes` to the lights of the file. Lights that depend on the camera are placed for
    /// a camera at `viewpoint`.
    pub(crate) fn change_light(&mut self, changes: LightChanges, viewpoint: &Viewpoint) {
        let words = changes.words();
        if words == [None; 3] {
            return;
        }
        let spans = words.map(|words| words.map_or(0..0, |words| self.flag_span(words)));
        let changed = ChangedLight {
            changes,
            spans,
            light: self.light.clone(),
        };
        self.light = changed.seen_from(viewpoint);
        self.changed_light = Some(Box::new(changed));
    }

    /// Lights for a camera at `viewpoint`; `None` if they equal the current lights.
    pub(crate) fn lights_seen_from(&self, viewpoint: &Viewpoint) -> Option<Vec<LightSection>> {
        let lights = self.changed_light.as_ref()?.seen_from(viewpoint);
        (lights != self.light).then_some(lights)
    }

    /// Drops the stored changes of the light. If `lights` are given, they replace the light
    /// sections.
    pub(crate) fn settle_light(&mut self, lights: Option<Vec<LightSection>>) {
        self.changed_light = None;
        if let Some(lights) = lights {
            self.light = lights;
        }
    }

    /// Returns true if the environment of the file was changed.
    pub(crate) fn has_changed_environment(&self) -> bool {
        let changed = self.changed_light.as_ref();
        changed.is_some_and(|changed| changed.changes.env.is_some())
    }
}
