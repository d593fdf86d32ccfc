//! Radiance by classes of light paths, for `--aov direct`, `bounces`, `lpe:…` and the like.
//!
//! Light that arrives at a vertex has the class of its path from the light to there. A scattering event moves it to the classes behind that event. Smooth
//! lobes share an event by their values, so that a mixture of diffuse and glossy lobes scatters each share into its own class. This holds for sampled
//! lights and for sampled directions alike, needs no random number, and gives each part the mean of its own paths.
//!
//! Classes do not overlap, and their sum is that of all light but for rounding. The sum itself is kept beside them, as it is for light groups.

use super::gathered::{ByGroup, Gathered};
use crate::bsdf::ScatteringEvent;
use crate::color::Spectrum;
use crate::film::{LightPaths, MAX_CLASSES, PathLight};
use crate::light::{Light, LightId};
use crate::scene::Scene;
use std::ops::{AddAssign, Mul};

/// Radiance with the share of each class of paths, and that of each group of lights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ByPath {
    /// The sum, and light by groups.
    all: ByGroup,
    classes: [Spectrum; MAX_CLASSES],
}

impl Default for ByPath {
    fn default() -> Self {
        Self {
            all: ByGroup::default(),
            classes: [Spectrum::ZERO; MAX_CLASSES],
        }
    }
}

impl ByPath {
    /// `all`, as it comes straight from a light.
    fn unscattered(all: ByGroup, light: PathLight) -> Self {
        let mut gathered = Self { all, ..Self::default() };
        gathered.classes[LightPaths::class_of(light)] = all.sum();
        gathered
    }

    /// Adds the classes of `light`, scattered by `event`, times `factor`.
    fn scatter_classes(
        &mut self,
        light: &Self,
        factor: Spectrum,
        event: impl FnOnce() -> ScatteringEvent,
        paths: Option<&LightPaths>,
    ) {
        let Some(paths) = paths else { return };
        if factor.is_black() || light.classes.iter().all(|light| light.is_black()) {
            return;
        }
        let shares = event().shares().map(|(kind, share)| (kind, share * factor));
        for (class, light) in light.classes.iter().enumerate().filter(|(_, light)| !light.is_black()) {
            for (kind, share) in shares {
                self.classes[paths.scattered(class, kind)] += *light * share;
            }
        }
    }
}

/// What expressions call the light `id`.
fn kind_of(id: LightId, scene: &Scene) -> PathLight {
    match scene.lights().get(id.0 as usize) {
        Some(
            Light::Triangle(_)
            | Light::MovingTriangle(_)
            | Light::Textured(_)
            | Light::Sphere(_)
            | Light::Disk(_)
            | Light::Rectangle(_),
        ) => PathLight::Surface,
        Some(Light::Point(_) | Light::Spot(_)) => PathLight::Point,
        Some(Light::Constant(_) | Light::Directional(_) | Light::Sun(_) | Light::Environment(_)) | None => {
            PathLight::Background
        }
    }
}

impl Gathered for ByPath {
    const TELLS_PATHS: bool = true;

    fn of_light(radiance: Spectrum, id: LightId, scene: &Scene) -> Self {
        Self::unscattered(ByGroup::of_light(radiance, id, scene), kind_of(id, scene))
    }

    fn sum(&self) -> Spectrum {
        self.all.sum()
    }

    fn by_group(&self) -> &[Spectrum] {
        self.all.by_group()
    }

    fn by_class(&self) -> &[Spectrum] {
        &self.classes
    }

    fn scattered(self, event: impl FnOnce() -> ScatteringEvent, paths: Option<&LightPaths>) -> Self {
        let mut scattered = Self::default();
        scattered.scatter_classes(&self, Spectrum::ONE, event, paths);
        scattered.all = self.all;
        scattered
    }

    fn add_scattered(
        &mut self,
        light: &Self,
        factor: Spectrum,
        event: impl FnOnce() -> ScatteringEvent,
        paths: Option<&LightPaths>,
    ) {
        self.all += light.all * factor;
        self.scatter_classes(light, factor, event, paths);
    }

    fn with_classes_of(self, other: Self) -> Self {
        Self {
            all: self.all,
            classes: other.classes,
        }
    }
}

impl From<Spectrum> for ByPath {
    /// What comes from no light, and is seen as a background is.
    fn from(sum: Spectrum) -> Self {
        Self::unscattered(sum.into(), PathLight::Background)
    }
}

impl AddAssign for ByPath {
    fn add_assign(&mut self, other: Self) {
        self.all += other.all;
        for (class, other) in self.classes.iter_mut().zip(other.classes) {
            *class += other;
        }
    }
}

impl Mul<Spectrum> for ByPath {
    type Output = Self;
    fn mul(self, factor: Spectrum) -> Self {
        Self {
            all: self.all * factor,
            classes: self.classes.map(|class| class * factor),
        }
    }
}

impl Mul<f32> for ByPath {
    type Output = Self;
    fn mul(self, factor: f32) -> Self {
        self * Spectrum::splat(factor)
    }
}
