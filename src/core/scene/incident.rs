//! Light that a ray finds: emitted by the surface that it hits, or by infinitely distant lights.

use super::{LightNumbering, Scene, Shape};
use crate::color::Spectrum;
use crate::geometry::{Hit, PrimId};
use crate::light::{Light, LightId};
use crate::light_sampling::{LightSampleContext, LightSelection};
use crate::math::Vec3;

/// Light that a traced ray finds.
#[derive(Clone, Copy, Debug)]
pub struct Incident {
    /// Id of the light.
    pub id: LightId,
    /// Radiance that arrives, W·sr⁻¹·m⁻².
    pub radiance: Spectrum,
    /// Density per solid angle with which light sampling would sample this direction.
    pub pdf: f32,
}

impl Scene {
    /// Index, among the lights of `shape`, of the light to which the triangle `prim` belongs. The
    /// shape must emit.
    #[inline(always)]
    pub(super) fn number_of_light(&self, shape: &Shape, prim: PrimId) -> u32 {
        match shape.numbering {
            LightNumbering::Triangles => prim.0,
            LightNumbering::One => 0,
            LightNumbering::Listed(list) => self.light_numbers[list as usize][prim.0 as usize],
        }
    }

    /// Light that arrives at the point `context` from the point `q` of the surface at `hit`. `None`
    /// if the surface is not a light. The unit direction `wi` points from `context` to `q`. All
    /// positions are at `time`. The density includes the probability that `selection` chooses the
    /// light.
    pub fn emitted(
        &self,
        selection: &LightSelection,
        hit: &Hit,
        context: &LightSampleContext,
        (q, wi): (Vec3, Vec3),
        time: f32,
    ) -> Option<Incident> {
        let shape = self.shape(hit.geom);
        let first = shape.first_light?;
        let before = self.instance(hit.inst).map_or(0, |i| i.first_light.0);
        let of_shape = self.number_of_light(shape, hit.prim);
        let id = LightId(before + first.0 + of_shape);
        let Light::Area(light) = &self.lights[id.0 as usize] else {
            return None;
        };
        let (radiance, pdf) = light.incident(context.p, q, wi, [hit.b1, hit.b2], time, &self.textures);
        Some(Incident {
            id,
            radiance,
            pdf: selection.pmf(&self.lights, context, id) * pdf,
        })
    }

    /// Returns true if a ray that leaves the scene can find a light.
    pub fn has_infinite_lights(&self) -> bool {
        !self.infinite_lights.is_empty()
    }

    /// Light that arrives at `context` along −`wi` from each infinitely distant light. `wi` is the
    /// unit direction of a ray that leaves the scene.
    pub fn escaped(
        &self,
        selection: &LightSelection,
        context: LightSampleContext,
        wi: Vec3,
    ) -> impl Iterator<Item = Incident> {
        self.infinite_lights.iter().filter_map(move |&id| {
            let (radiance, pdf) = match &self.lights[id.0 as usize] {
                Light::Constant(light) => (light.radiance, light.pdf()),
                Light::Environment(light) => (light.radiance(wi), light.pdf(wi)),
                // Return the sun even if the ray misses the sun's disc. The radiance is then 0
                Light::Sun(light) => (light.radiance(wi), light.pdf(wi)),
                // Rays cannot hit these lights, or the lights are not at infinity.
                Light::Directional(_) | Light::Area(_) | Light::Point(_) | Light::Spot(_) => return None,
            };
            let factor = selection.pdf_factor(&self.lights, id, &context, wi);
            let pdf = selection.pmf(&self.lights, &context, id) * pdf * factor;
            Some(Incident { id, radiance, pdf })
        })
    }
}
