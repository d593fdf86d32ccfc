//! Light that is set over that of a scene file: it is kept as changes until the camera is known.

use super::SceneFile;
use crate::description::LightSection;
use crate::description::light_changes::{ChangedLight, LightChanges, Viewpoint};

impl SceneFile {
    /// Sets `changes` over the light of the file, seen from `viewpoint`.
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

    /// Lights for a camera at `viewpoint`; `None` if they are those of the file.
    pub(crate) fn lights_seen_from(&self, viewpoint: &Viewpoint) -> Option<Vec<LightSection>> {
        let lights = self.changed_light.as_ref()?.seen_from(viewpoint);
        (lights != self.light).then_some(lights)
    }

    /// Makes the changes of light final: `lights` in place of the sections, if they are given.
    pub(crate) fn settle_light(&mut self, lights: Option<Vec<LightSection>>) {
        self.changed_light = None;
        if let Some(lights) = lights {
            self.light = lights;
        }
    }

    /// Whether the file's environment was changed.
    pub(crate) fn has_changed_environment(&self) -> bool {
        let changed = self.changed_light.as_ref();
        changed.is_some_and(|changed| changed.changes.env.is_some())
    }
}
