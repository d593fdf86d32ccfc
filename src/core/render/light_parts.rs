//! Light of one sample, separated by light groups and by classes of light paths.
//!
//! Light transport is linear in the lights. So the light that a path finds from one group is an
//! estimate of the image that only this group lights. Classes do not overlap. The sum of all light
//! is kept separately, because a sum of the parts would round differently: `R G B` keep their bits.

use crate::bsdf::ScatteringEvent;
use crate::color::Spectrum;
use crate::film::{LightPaths, MAX_CLASSES};
use crate::integrator::{BackgroundLight, CameraView, FoundLight, path_classes};
use crate::light::LightGroups;

/// Parts of the light of one sample.
#[derive(Clone, Debug)]
pub(super) struct LightParts<'a> {
    groups: [Spectrum; LightGroups::MAX_GROUPS],
    classes: [Spectrum; MAX_CLASSES],
    /// Classes of paths, if they are separated.
    pub paths: Option<&'a LightPaths>,
    /// Events of the path, from the camera on.
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

    /// Adds `light` to its group and its classes. Light without a source is a sum over several
    /// sources, and is not added.
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

    /// Records the scattering event by which the path leaves a vertex. `depth` is the number of
    /// earlier events.
    pub fn scattered(&mut self, depth: u32, event: ScatteringEvent) {
        self.events.truncate(depth as usize);
        self.events.push(event);
    }

    /// Finishes the sample: applies the ground that the camera ray sees, and adds the background.
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
