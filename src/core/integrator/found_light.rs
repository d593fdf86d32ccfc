//! Light that an integrator passes to its sink.
//!
//! Each `FoundLight` has its source and the scattering events between the source and the camera.
//! The sink of a plain image adds the radiance. A sink that separates groups of lights or classes
//! of paths also adds it to the parts (`render/light_parts.rs`). `LightSum` keeps light that is
//! multiplied by a common factor later.

use super::Sink;
use crate::bsdf::ScatteringEvent;
use crate::color::Spectrum;
use crate::film::{LightPaths, MAX_CLASSES, PathLight};
use crate::light::{Light, LightId};
use crate::scene::Scene;

/// Light of one path.
#[derive(Clone, Copy, Debug)]
pub struct FoundLight<'e> {
    /// Radiance times the throughput of the path.
    pub radiance: Spectrum,
    /// Source of the light. `None` for a sum over several sources: [`Sink::part`] gets its parts.
    pub source: Option<LightSource>,
    /// Number of scattering events between the source and the camera.
    pub scatterings: u32,
    /// Last events of the path, in order from the camera. The sink has received the earlier events
    /// by [`Sink::scattered`]. Empty if the sink does not separate paths.
    pub events: &'e [ScatteringEvent],
}

/// Source of light: the group and the kind that light groups and light path expressions
/// distinguish.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightSource {
    /// Index of the group of the light. `None` if the source is not a light.
    pub group: Option<usize>,
    /// Kind of the light.
    pub kind: PathLight,
}

impl LightSource {
    /// Source of background light that does not come from a light.
    pub const BACKGROUND: Self = Self {
        group: None,
        kind: PathLight::Background,
    };

    /// Source of the light `id` of `scene`.
    #[inline(always)]
    pub fn of(id: LightId, scene: &Scene) -> Self {
        let kind = match scene.lights().get(id.0 as usize) {
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
        };
        Self {
            group: Some(scene.light_groups().of(id)),
            kind,
        }
    }
}

impl FoundLight<'_> {
    /// `radiance` of the light `id` of `scene`, after `scatterings` scattering events.
    #[inline(always)]
    pub fn of(radiance: Spectrum, id: LightId, scene: &Scene, scatterings: u32) -> Self {
        Self {
            radiance,
            source: Some(LightSource::of(id, scene)),
            scatterings,
            events: &[],
        }
    }

    /// `radiance` of several sources, after `scatterings` scattering events.
    #[inline(always)]
    pub fn sum(radiance: Spectrum, scatterings: u32) -> Self {
        Self {
            radiance,
            source: None,
            scatterings,
            events: &[],
        }
    }
}

/// Splits light of `kind` into the classes of `paths`. `events` lie between the light and the
/// camera, the event next to the light first.
///
/// Diffuse and glossy lobes share a smooth scattering event in proportion to their values, and each
/// share goes to its own class. This needs no random number.
pub fn path_classes(
    radiance: Spectrum,
    kind: PathLight,
    events: impl Iterator<Item = ScatteringEvent>,
    paths: &LightPaths,
) -> [Spectrum; MAX_CLASSES] {
    let mut classes = [Spectrum::ZERO; MAX_CLASSES];
    classes[LightPaths::class_of(kind)] = radiance;
    events.fold(classes, |light, event| {
        let mut scattered = [Spectrum::ZERO; MAX_CLASSES];
        for (class, light) in light.iter().enumerate().filter(|(_, light)| !light.is_black()) {
            for (kind, share) in event.shares() {
                scattered[paths.scattered(class, kind)] += *light * share;
            }
        }
        scattered
    })
}

/// Sum of light that is passed to a sink later, times a common factor. If the sink separates parts
/// of the light, the sum contains its parts.
#[derive(Clone, Debug, Default)]
pub(crate) struct LightSum {
    pub radiance: Spectrum,
    parts: Vec<LightPart>,
}

/// Part of a sum: light of one source by one sequence of scattering events.
#[derive(Clone, Debug)]
pub(crate) struct LightPart {
    pub radiance: Spectrum,
    pub source: LightSource,
    pub scatterings: u32,
    pub events: Vec<ScatteringEvent>,
}

impl LightSum {
    /// Adds a part of the light that `radiance` contains.
    #[inline(never)]
    pub fn add_part(&mut self, light: FoundLight) {
        let Some(source) = light.source else { return };
        let is_same = |part: &&mut LightPart| {
            part.source == source && part.scatterings == light.scatterings && part.events == light.events
        };
        match self.parts.iter_mut().find(is_same) {
            Some(part) => part.radiance += light.radiance,
            None => self.parts.push(LightPart {
                radiance: light.radiance,
                source,
                scatterings: light.scatterings,
                events: light.events.to_vec(),
            }),
        }
    }

    /// Parts of the sum.
    pub fn parts(&self) -> &[LightPart] {
        &self.parts
    }

    /// Passes the sum times `factor` to `out`.
    #[inline(always)]
    pub fn pass_on(&self, factor: Spectrum, scatterings: u32, out: &mut impl Sink) {
        out.light(FoundLight::sum(self.radiance * factor, scatterings));
        for part in &self.parts {
            out.part(FoundLight {
                radiance: part.radiance * factor,
                ..part.light()
            });
        }
    }
}

impl LightPart {
    /// The part as light for a sink.
    pub fn light(&self) -> FoundLight<'_> {
        FoundLight {
            radiance: self.radiance,
            source: Some(self.source),
            scatterings: self.scatterings,
            events: &self.events,
        }
    }
}
