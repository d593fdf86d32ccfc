//! Light of one sample, separated into light groups and classes of light paths.
//!
//! Light transport is linear in the lights. So the light that a path finds from one group is an
//! estimate of the image that only this group lights. Classes do not overlap. The sum of all light
//! is stored separately, because the sum of the parts would be rounded differently. So the channels
//! `R G B` are bit-identical with and without parts.

use crate::bsdf::ScatteringEvent;
use crate::color::Spectrum;
use crate::film::{LightPaths, MAX_CLASSES};
use crate::integrator::{BackgroundLight, CameraView, FoundLight, path_classes};
use crate::light::LightGroups;

/// Light of one sample, by light group and by class of light paths.
#[derive(Clone, Debug)]
pub(super) struct LightParts<'a> {
    groups: [Spectrum; LightGroups::MAX_GROUPS],
    classes: [Spectrum; MAX_CLASSES],
    /// Light path expressions whose classes are separated, if any.
    pub paths: Option<&'a LightPaths>,
    /// Scattering events of the path, in order from the camera.
    events: Vec<ScatteringEvent>,
}

impl<'a> LightParts<'a> {
    /// Parts without any light.
    pub fn new(paths: Option<&'a LightPaths>) -> Self {
        Self {
            groups: [Spectrum::ZERO; LightGroups::MAX_GROUPS],
            classes: [Spectrum::ZERO; MAX_CLASSES],
            paths,
            events: Vec::new(),
        }
    }

    /// Adds `light` to its group and its classes. Ignores light without a source, which is a sum
    /// over several sources.
    pub fn add(&mut self, light: &FoundLight) {
        let Some(source) = light.source.filter(|_| !light.radiance.is_black()) else {
            return;
        };
        if let Some(group) = source.group.and_then(|group| self.groups.get_mut(group)) {
            *group += light.radiance;
        }
        let Some(paths) = self.paths else { return };
        let before = (light.scatterings as usize).saturating_sub(light.events.len());
        let before = &self.events[..before.min(self.events.len())];
        let events = before.iter().chain(light.events).rev().copied();
        let classes = path_classes(light.radiance, source.kind, events, paths);
        for (class, light) in self.classes.iter_mut().zip(classes) {
            *class += light;
        }
    }

    /// Records the scattering event at a vertex. `depth` is the number of scattering events before
    /// this event.
    pub fn scattered(&mut self, depth: u32, event: ScatteringEvent) {
        self.events.truncate(depth as usize);
        self.events.push(event);
    }

    /// Finishes the sample for the camera view `view`. On the ground, this scales the light and
    /// adds the background.
    pub fn finish(&mut self, view: &CameraView) {
        let CameraView::Ground(shadow) = view else { return };
        self.scale(shadow.light_factor());
        let background = shadow.background.iter();
        for light in background.flat_map(|background: &BackgroundLight| background.lights(shadow.base)) {
            self.add(&light);
        }
    }

    /// Multiplies all parts by `factor`.
    pub fn scale(&mut self, factor: Spectrum) {
        let parts = self.groups.iter_mut().chain(&mut self.classes);
        parts.for_each(|part| *part *= factor);
    }

    /// Light of each group, in the order of [`LightGroups::names`].
    pub fn by_group(&self) -> &[Spectrum] {
        &self.groups
    }

    /// Light of each class of paths.
    pub fn by_class(&self) -> &[Spectrum] {
        &self.classes
    }
}
