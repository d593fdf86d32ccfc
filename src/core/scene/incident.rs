//! Light that a ray finds: emitted by the surface that it hits, or by infinitely distant lights.

use super::{LightNumbering, Scene, Shape};
use crate::color::Spectrum;
use crate::geometry::{Hit, PrimId};
use crate::light::{Light, LightId, LightSampleContext, LightSelection, TriangleLight};
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

    /// Light that the point `q` of the surface at `hit` sends to `context` along −`wi`; `None` if
    /// the surface is not a light. The unit direction `wi` points from the context to `q`. All
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
        let Light::Triangle(light) = &self.lights[id.0 as usize] else {
            return self.emitted_otherwise(selection, id, hit, context, (q, wi), time);
        };
        Some(Incident {
            id,
            radiance: light.emitted(-wi),
            pdf: selection.pmf(&self.lights, context, id) * light.pdf(context.p, q, wi),
        })
    }

    /// [`Scene::emitted`] for lights that move or have textures, and for spheres, disks and
    /// rectangles.
    #[inline(never)]
    fn emitted_otherwise(
        &self,
        selection: &LightSelection,
        id: LightId,
        hit: &Hit,
        context: &LightSampleContext,
        (q, wi): (Vec3, Vec3),
        time: f32,
    ) -> Option<Incident> {
        let of_triangle = |light: TriangleLight, factor| (light.emitted(-wi) * factor, light.pdf(context.p, q, wi));
        let (radiance, pdf) = match &self.lights[id.0 as usize] {
            Light::MovingTriangle(light) => of_triangle(light.at(time), Spectrum::ONE),
            Light::Textured(light) => of_triangle(light.at(time), light.color(hit.b1, hit.b2, &self.textures)),
            Light::Sphere(light) => (light.radiance_at(context.p), light.pdf(context.p)),
            Light::Disk(light) => (light.emitted(-wi), light.pdf(context.p, q, wi)),
            Light::Rectangle(light) => (light.emitted(-wi), light.pdf(context.p, q, wi)),
            // These lights have no surface that a ray can hit, or the caller handles them
            Light::Triangle(_)
            | Light::Point(_)
            | Light::Constant(_)
            | Light::Directional(_)
            | Light::Sun(_)
            | Light::Spot(_)
            | Light::Environment(_) => return None,
        };
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
                // Return the sun even if the ray misses its disc; the radiance is then 0
                Light::Sun(light) => (light.radiance(wi), light.pdf(wi)),
                // Rays cannot hit these lights, or the lights are not at infinity.
                Light::Directional(_)
                | Light::Triangle(_)
                | Light::MovingTriangle(_)
                | Light::Textured(_)
                | Light::Sphere(_)
                | Light::Disk(_)
                | Light::Rectangle(_)
                | Light::Point(_)
                | Light::Spot(_) => return None,
            };
            let factor = selection.pdf_factor(&self.lights, id, &context, wi);
            let pdf = selection.pmf(&self.lights, &context, id) * pdf * factor;
            Some(Incident { id, radiance, pdf })
        })
    }
}
