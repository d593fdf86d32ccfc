use super::direct::Vertex;
use super::{RayKind, Sink};
use crate::accel::Accel;
use crate::camera::Camera;
use crate::film::{Filter, FirstSurface};
use crate::geometry::Hit;
use crate::math::{Frame, Ray, Vec2};
use crate::sampler::{Dimension, SampleKey, Sampler};
use crate::scene::Scene;

/// What every integrator works in.
#[derive(Debug)]
pub struct World<'a, A> {
    /// What light meets.
    pub scene: &'a Scene,
    /// Answers ray queries over `scene`.
    pub accel: &'a A,
    /// Where paths start.
    pub camera: &'a Camera,
    /// How pixels see the image.
    pub filter: &'a Filter,
}

// Derived, these would ask the same of `A`, of which there is only a reference.
impl<A> Clone for World<'_, A> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<A> Copy for World<'_, A> {}

impl<'a, A: Accel> World<'a, A> {
    /// The same with other answers to ray queries.
    pub fn with_accel<B>(self, accel: &'a B) -> World<'a, B> {
        let Self {
            scene, camera, filter, ..
        } = self;
        World {
            scene,
            accel,
            camera,
            filter,
        }
    }

    /// Starts the sample `key`: the ray through a point near the pixel that the filter draws, from a random point of the lens.
    pub(super) fn camera_ray(&self, key: SampleKey, sampler: &mut impl Sampler, out: &mut impl Sink) -> Ray {
        sampler.start(key);
        let (place, weight) = self.filter.sample(sampler.get_2d(Dimension::PIXEL));
        out.weight(weight);
        let film = key.pixel().as_vec2() + place;
        let lens = match self.camera.has_lens() {
            true => sampler.get_2d(Dimension::LENS),
            false => Vec2::ZERO,
        };
        self.camera.ray(film, lens)
    }

    /// What the camera sees in the sample `key`, noted for the auxiliary channels; `None` where that is nothing.
    pub(super) fn look(
        &self,
        key: SampleKey,
        sampler: &mut impl Sampler,
        out: &mut impl Sink,
    ) -> Option<(Hit, Vertex<'a>)> {
        let ray = self.camera_ray(key, sampler, out);
        let hit = self.intersect(&ray, RayKind::Camera, out)?;
        let vertex = self.vertex(&hit, &ray);
        out.first_surface(self.first_surface(&vertex));
        Some((hit, vertex))
    }

    /// The closest hit, counted.
    #[inline(always)]
    pub(super) fn intersect(&self, ray: &Ray, kind: RayKind, out: &mut impl Sink) -> Option<Hit> {
        out.ray(kind);
        self.accel.intersect(ray)
    }

    /// The surface at `hit`, seen along `ray`.
    #[inline(always)]
    pub(super) fn vertex(&self, hit: &Hit, ray: &Ray) -> Vertex<'a> {
        let point = self.scene.surface_point(hit);
        let frame = Frame::from_z(point.ns);
        Vertex {
            wo: frame.to_local(-ray.direction),
            bsdf: self.scene.bsdf(hit),
            frame,
            point,
        }
    }

    /// What the auxiliary channels show of `vertex`.
    pub(super) fn first_surface(&self, vertex: &Vertex) -> FirstSurface {
        FirstSurface {
            albedo: vertex.bsdf.albedo(),
            normal: vertex.point.ns * 1f32.copysign(vertex.wo.z),
            depth: self.camera.depth(vertex.point.p),
        }
    }
}
