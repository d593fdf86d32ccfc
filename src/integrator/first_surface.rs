//! Auxiliary channels of the first surface along a camera path: albedo, normal and depth of every picture, and what `--aov` adds (`film/aov.rs`).

use super::vertex::Vertex;
use super::world::World;
use crate::accel::Accel;
use crate::film::{Features, FirstSurface};
use crate::geometry::Hit;
use crate::math::Vec2;

impl<A: Accel> World<'_, A> {
    /// First surface of a camera path: `vertex`, which is at `hit`.
    pub(super) fn first_surface(&self, hit: &Hit, vertex: &Vertex) -> FirstSurface {
        FirstSurface {
            features: self.features.then(|| self.features_of(hit, vertex)),
            albedo: vertex.bsdf.albedo(),
            normal: vertex.point.ns * 1f32.copysign(vertex.wo.z),
            depth: self.camera.depth(vertex.point.p, vertex.point.time),
        }
    }
}

impl<A: Accel> World<'_, A> {
    /// Channels of `vertex`, which is at `hit`, that `--aov` adds.
    #[inline(never)]
    fn features_of(&self, hit: &Hit, vertex: &Vertex) -> Features {
        // Where the point is on the film when the shutter opens and when it closes
        let moves = self.scene.is_moving() || self.camera.is_moving();
        let film = |time: f32| {
            let p = self.scene.placed(hit, time).point(hit.b1, hit.b2).p;
            self.camera.film_of(p, time)
        };
        let ends = self.camera.shutter().map(|time| moves.then(|| film(time)).flatten());
        let motion = match ends {
            [Some(open), Some(close)] => (close - open) * Vec2::new(1.0, -1.0),
            _ => Vec2::ZERO,
        };
        Features {
            p: vertex.point.p,
            uv: self.scene.uv(hit).unwrap_or_default(),
            motion,
            object: self.scene.object(hit),
            material: self.scene.shape(hit.geom).material.0,
        }
    }
}
