//! Debug views (`render --integrator debug`): properties of the first surface as colours, and the
//! cost of a sample.

use super::direct::LIGHTS_BETWEEN_CHECKS;
use super::integrator::PathIntegrator;
use super::roulette::Roulette;
use super::strategy::Strategy;
use crate::accel::Accel;
use crate::color::{Spectrum, false_color, srgb};
use crate::film::FirstSurface;
use crate::geometry::Hit;
use crate::integrator::vertex::Vertex;
use crate::integrator::{FoundLight, Integrator, RayKind, RaySink, Sink, World};
use crate::light::LightId;
use crate::material::BsdfSlot;
use crate::math::Vec3;
use crate::sampler::{Bounce, Dimension, SampleKey, Sampler};

/// Shows a property of the first surface, or the number of rays of a sample, as a colour.
#[derive(Debug)]
pub struct DebugIntegrator<'a, A> {
    /// World with the scene and the camera.
    pub world: World<'a, A>,
    /// Property to show.
    pub view: DebugView,
}

/// Property that [`DebugIntegrator`] shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DebugView {
    /// Shading normal in world space: (−1, −1, −1) is black and (1, 1, 1) is white. Both sides of a
    /// surface have the same colour.
    #[default]
    Normals,
    /// Fractional parts of the texture coordinates as red and green. Surfaces without texture
    /// coordinates are blue.
    Uv,
    /// Barycentric coordinates of the triangle's second and third corner as red and green.
    Barycentrics,
    /// A different colour for each triangle of a mesh.
    Ids,
    /// A different colour for each material.
    Material,
    /// Albedo: fraction of uniform incident light that is scattered.
    Albedo,
    /// Depth along the view axis: white at the near end of the scene's bounding box, black at the
    /// far end.
    Depth,
    /// Edges of triangles, one pixel wide, on grey surfaces.
    Wireframe,
    /// Front sides are blue and back sides red, by the winding of the corners.
    Facing,
    /// Number of lights of which a random point is not occluded, from black (0) to pale yellow
    /// (all), on a logarithmic scale.
    LightCount,
    /// Number of rays of a sample of the path tracer, from black (1) to pale yellow (32), on a
    /// logarithmic scale.
    RayCost,
}

/// Number of rays that is shown in the brightest colour: a shadow ray and a scattered ray at each
/// of sixteen vertices.
const MAX_RAYS: f32 = 32.0;
/// Maximum number of scattering events of a path whose rays are counted. It is the default of
/// `max_depth`.
const MAX_DEPTH: u32 = 16;

impl<A: Accel> Integrator for DebugIntegrator<'_, A> {
    fn sample<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
        if self.view == DebugView::RayCost {
            let rays = self.rays(key, sampler, out);
            out.radiance(scale(rays as f32, MAX_RAYS));
            return;
        }
        let slot = BsdfSlot::new();
        let Some(vertex) = self.world.first_vertex(key, sampler, &slot, out) else {
            return;
        };
        let (scene, hit) = (self.world.scene, vertex.hit);
        let color = match self.view {
            DebugView::Normals => Spectrum::from((0.5 * vertex.point.ns + 0.5).to_array()),
            DebugView::Uv => match scene.uv(&hit) {
                Some(uv) => Spectrum::rgb(uv.x - uv.x.floor(), uv.y - uv.y.floor(), 0.0),
                None => Spectrum::rgb(0.0, 0.0, 1.0),
            },
            DebugView::Barycentrics => Spectrum::rgb(hit.b1, hit.b2, 0.0),
            DebugView::Ids => id_color(hit.geom.0, hit.prim.0),
            DebugView::Material => id_color(scene.shape(hit.geom).material.0, 0),
            DebugView::Albedo => vertex.albedo(),
            DebugView::Depth => Spectrum::splat(self.nearness(vertex.point.p, vertex.point.time)),
            DebugView::Wireframe if self.is_on_edge(&hit, &vertex) => Spectrum::ZERO,
            DebugView::Wireframe => Spectrum::splat(lit(&vertex)),
            DebugView::Facing => {
                if vertex.point.ng.dot(vertex.frame.to_world(vertex.wo)) >= 0.0 {
                    Spectrum::rgb(0.1, 0.3, 1.0) * lit(&vertex)
                } else {
                    Spectrum::rgb(1.0, 0.15, 0.1) * lit(&vertex)
                }
            }
            DebugView::LightCount => {
                let max = 1.0 + scene.lights().len() as f32;
                scale(1.0 + self.arriving_lights(&vertex, sampler, out) as f32, max)
            }
            DebugView::RayCost => Spectrum::ZERO,
        };
        out.radiance(color);
    }
}

impl<A: Accel> DebugIntegrator<'_, A> {
    /// Nearness of the point `p` along the view axis: 1 at the near end of the scene's bounding
    /// box, 0 at the far end.
    fn nearness(&self, p: Vec3, time: f32) -> f32 {
        let (bounds, camera) = (self.world.scene.bounds(), self.world.camera);
        let depths = bounds
            .corners()
            .into_iter()
            .map(|corner| camera.depth(corner, time).max(0.0));
        let (near, far) = (depths.clone().fold(f32::INFINITY, f32::min), depths.fold(0.0, f32::max));
        ((far - camera.depth(p, time)) / (far - near).max(f32::MIN_POSITIVE)).clamp(0.0, 1.0)
    }

    /// Returns `true` if an edge of the triangle at `hit` is at most half a pixel from `vertex` on
    /// the film.
    fn is_on_edge(&self, hit: &Hit, vertex: &Vertex) -> bool {
        let (camera, p, time) = (self.world.camera, vertex.point.p, vertex.point.time);
        let corners = self.world.scene.corners(hit, time);
        let film = corners.map(|corner| camera.film_of(corner, time));
        let distance = match (camera.film_of(p, time), film) {
            (Some(p), [Some(a), Some(b), Some(c)]) => {
                let edges = [[a, b], [b, c], [c, a]];
                edges.map(|[a, b]| distance(p.extend(0.0).into(), [a, b].map(|v| v.extend(0.0).into())))
            }
            // A corner behind the camera has no film position: use the distance in space instead.
            _ => {
                let [a, b, c] = corners;
                [[a, b], [b, c], [c, a]].map(|edge| distance(p, edge) / camera.pixel_width(p, time))
            }
        };
        distance.into_iter().any(|distance| distance < 0.5)
    }

    /// Number of lights whose light reaches `vertex` from a random point of the light.
    fn arriving_lights(&self, vertex: &Vertex, sampler: &impl Sampler, out: &mut impl Sink) -> u32 {
        let scene = self.world.scene;
        let context = vertex.light_context();
        let mut count = 0;
        for id in 0..scene.lights().len() as u32 {
            if id % LIGHTS_BETWEEN_CHECKS == LIGHTS_BETWEEN_CHECKS - 1 && out.is_cancelled() {
                break;
            }
            let u = sampler.get_2d(Dimension::bounce(0, Bounce::LightPoint).nth(id));
            let selection = self.world.light_selection;
            let time = vertex.point.time;
            let light = selection.sample_light(scene.lights(), LightId(id), &context, time, u, scene.textures());
            let Some(light) = light.filter(|light| !light.radiance.is_black()) else {
                continue;
            };
            // Skip light that arrives on the side that the camera does not see.
            let wi = vertex.frame.to_local(light.wi);
            if wi.z * vertex.wo.z <= 0.0 {
                continue;
            }
            let ray = light
                .shadow_ray(self.world.origin(vertex, wi, light.wi))
                .when(vertex.point.time);
            count += u32::from(!self.world.transmittance(&ray, out).is_blocked());
        }
        count
    }

    /// Number of rays that the path tracer traces for the sample `key`.
    fn rays<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink) -> u32 {
        let path = PathIntegrator {
            world: self.world,
            strategy: Strategy::default(),
            max_depth: Some(MAX_DEPTH),
            roulette: Roulette::default(),
            light_samples: 1,
            clamp_indirect: None,
        };
        let mut counter = Counter { out, rays: 0 };
        // Use dynamic dispatch, so that the path tracer is not compiled again
        let mut sink: &mut dyn Sink = &mut counter;
        path.sample(key, sampler, &mut sink);
        counter.rays
    }
}

/// Sink that counts the rays of a sample and ignores its light.
struct Counter<'a, T> {
    out: &'a mut T,
    rays: u32,
}

impl<T: Sink> Sink for Counter<'_, T> {
    fn weight(&mut self, weight: f32) {
        self.out.weight(weight);
    }

    fn light(&mut self, _: FoundLight) {}

    fn first_surface(&mut self, surface: FirstSurface) {
        self.out.first_surface(surface);
    }

    fn line(&mut self) {
        self.out.line();
    }
}

impl<T: RaySink> RaySink for Counter<'_, T> {
    fn ray(&mut self, kind: RayKind) {
        self.rays += 1;
        self.out.ray(kind);
    }

    fn cut_walk(&mut self) {
        self.out.cut_walk();
    }

    fn is_cancelled(&self) -> bool {
        self.out.is_cancelled()
    }
}

/// Brightness of the surface at `vertex` under a lamp at the camera, which shows the shape of the
/// surface.
fn lit(vertex: &Vertex) -> f32 {
    0.25 + 0.6 * vertex.wo.z.abs()
}

/// Distance of `p` from the segment between `a` and `b`.
fn distance(p: Vec3, [a, b]: [Vec3; 2]) -> f32 {
    let along = b - a;
    let t = ((p - a).dot(along) / along.length_squared().max(f32::MIN_POSITIVE)).clamp(0.0, 1.0);
    p.distance(a + t * along)
}

/// Colour of `count` on a logarithmic scale from 1 to `max`.
fn scale(count: f32, max: f32) -> Spectrum {
    let share = (count.max(1.0).ln() / max.max(2.0).ln()).clamp(0.0, 1.0);
    Spectrum::from(false_color::magma(share).map(|code| srgb::decode(f32::from(code) / 255.0)))
}

/// A bright colour that differs between neighbouring ids: three bytes of a multiplicative hash.
fn id_color(major: u32, minor: u32) -> Spectrum {
    let id = major.wrapping_mul(0x9e37_79b9) ^ minor.wrapping_add(1).wrapping_mul(0x85eb_ca6b);
    let mixed = (id ^ (id >> 15)).wrapping_mul(0x2c1b_3c6d);
    let byte = |shift: u32| 0.2 + 0.8 * ((mixed >> shift) & 255) as f32 / 255.0;
    Spectrum::rgb(byte(24), byte(16), byte(8))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_from_segments() {
        let edge = [Vec3::ZERO, Vec3::X * 2.0];
        assert_eq!(distance(Vec3::new(1.0, 3.0, 0.0), edge), 3.0);
        assert_eq!(distance(Vec3::new(-3.0, 4.0, 0.0), edge), 5.0);
        assert_eq!(distance(Vec3::Y, [Vec3::ZERO; 2]), 1.0);
    }

    #[test]
    fn counts_have_rising_colours() {
        let luminance = |count| scale(count, 128.0).luminance();
        assert!(luminance(1.0) < luminance(4.0) && luminance(4.0) < luminance(128.0));
        assert_eq!(luminance(1e6), luminance(128.0));
    }
}
