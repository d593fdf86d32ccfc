//! Light that an integrator passes to its sink.
//!
//! A `FoundLight` has a radiance, the source of the light, and the scattering events between the
//! source and the camera. The sink of a plain image adds the radiance. A sink that separates groups
//! of lights or classes of paths also adds the radiance to the parts (`render/light_parts.rs`).
//! `LightSum` stores light that is multiplied by a common factor later.

use super::Sink;
use crate::bsdf::ScatteringEvent;
use crate::color::Spectrum;
use crate::film::{LightPaths, MAX_CLASSES, PathLight};
use crate::light::{Light, LightId};
use crate::scene::Scene;

/// Light that reaches the camera along one path.
#[derive(Clone, Copy, Debug)]
pub struct FoundLight<'e> {
    /// Radiance times the throughput of the path.
    pub radiance: Spectrum,
    /// Source of the light. `None` for a sum over several sources; [`Sink::part`] then receives the
    /// light of each source.
    pub source: Option<LightSource>,
    /// Number of scattering events between the source and the camera.
    pub scatterings: u32,
    /// Last scattering events of the path, in order from the camera. The sink has received the
    /// earlier events by [`Sink::scattered`]. Empty if the sink does not separate classes of paths.
    pub events: &'e [ScatteringEvent],
}

/// Source of light, with the two properties by which a sink separates light: its group, for light
/// groups, and its kind, for light path expressions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightSource {
    /// Index of the light's group. `None` if the source is not a light of the scene.
    pub group: Option<usize>,
    /// Kind of the source in light path expressions.
    pub kind: PathLight,
}

impl LightSource {
    /// Source of background radiance that does not come from a light of the scene.
    pub const BACKGROUND: Self = Self {
        group: None,
        kind: PathLight::Background,
    };

    /// Source of the light `id` of `scene`.
    #[inline(always)]
    pub fn of(id: LightId, scene: &Scene) -> Self {
        let kind = match scene.lights().get(id.0 as usize) {
            Some(Light::Area(_)) => PathLight::Surface,
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
    /// Radiance `radiance` from the light `id` of `scene`, after `scatterings` scattering events.
    #[inline(always)]
    pub fn of(radiance: Spectrum, id: LightId, scene: &Scene, scatterings: u32) -> Self {
        Self {
            radiance,
            source: Some(LightSource::of(id, scene)),
            scatterings,
            events: &[],
        }
    }

    /// Radiance `radiance` summed over several sources, after `scatterings` scattering events.
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

/// Splits the radiance `radiance` into the classes of `paths`. `kind` is the kind of the light
/// source. `events` are the scattering events between source and camera, in order from the source.
///
/// A smooth scattering event may belong to a diffuse and a glossy lobe at the same time. The light
/// is split in proportion to the values of these lobes, and each part goes to its class. The split
/// needs no random number.
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

/// Sum of light that is multiplied by a common factor later, and then passed to a sink. If the sink
/// separates parts of the light, the sum also stores its parts.
#[derive(Clone, Debug, Default)]
pub(crate) struct LightSum {
    pub radiance: Spectrum,
    parts: Vec<LightPart>,
}

/// Part of a [`LightSum`]: the light of one source with one sequence of scattering events.
#[derive(Clone, Debug)]
pub(crate) struct LightPart {
    pub radiance: Spectrum,
    pub source: LightSource,
    pub scatterings: u32,
    pub events: Vec<ScatteringEvent>,
}

impl LightSum {
    /// Stores a part of the light. The field `radiance` must already include this light.
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

    /// Parts of the sum, if the sink separates parts of the light.
    pub fn parts(&self) -> &[LightPart] {
        &self.parts
    }

    /// Multiplies the sum by `factor` and passes it to `out`.
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
