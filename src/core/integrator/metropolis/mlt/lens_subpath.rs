use super::Proposal;
use super::numbers::Numbers;
use super::path::{CameraSample, Path, Vertex};
use super::space::{PathSpace, is_same_point};
use crate::accel::Accel;
use crate::bsdf::TransportMode;
use crate::integrator::{RayKind, RaySink};

/// Lens subpath mutation: replaces the subpath from the camera to the first vertex that does not
/// scatter by a delta lobe, (L|D)DS*E, by another subpath through any film point (Veach 1997,
/// §11.4). The film points of all chains of an iteration are stratified jointly.
#[derive(Debug)]
pub(super) struct LensSubpath<'s, 'w, 'a, A> {
    pub space: &'s PathSpace<'w, 'a, A>,
}

/// Index of the last vertex of the lens subpath of `x`. `None` if the rest of the path cannot be
/// connected to another lens subpath.
pub(super) fn end_of(x: &Path) -> Option<usize> {
    (1..x.len())
        .find(|&i| !x.vertices[i].is_delta)
        .filter(|&i| x.can_be_joined(i))
}

impl<'a, A: Accel> LensSubpath<'_, '_, 'a, A> {
    /// Replaces the lens subpath of `x`, which ends at the vertex `end`. `chosen` returns the
    /// probability of choosing this kind of mutation for a path.
    pub fn mutate(
        &self,
        x: &Path<'a>,
        end: usize,
        chosen: impl Fn(&Path<'a>) -> f64,
        numbers: &mut Numbers,
        out: &mut impl RaySink,
    ) -> Option<Proposal<'a>> {
        // Trace the new subpath through a film point and a lens point, then by delta lobes
        let film = self.space.film.at(numbers.spread());
        let sample = CameraSample {
            lens: numbers.next_2d(),
            ..x.camera
        };
        let mut ray = self.space.world.camera.ray(film, sample.lens, sample.time);
        let lens = Vertex::lens(self.space.world.camera.lens_of(&ray));
        let (mut kind, mut camera) = (RayKind::Camera, vec![lens]);
        let rest = &x.vertices[end + 1..];
        loop {
            let hit = self.space.intersect(&ray, kind, out);
            if is_same_point(&camera, &hit) {
                return None;
            }
            let vertex = hit?;
            self.space.note_through(&mut camera, &vertex, sample.time, out);
            camera.push(vertex);
            if numbers.next() < self.space.smooth_probability(&camera, TransportMode::Radiance)? {
                break;
            }
            if camera.len() + rest.len() >= self.space.max_vertices {
                return None;
            }
            (ray, kind) = (
                self.space
                    .scatter_by_delta(&mut camera, TransportMode::Radiance, numbers)?,
                RayKind::Bounce,
            );
        }
        let last = camera.len() - 1;
        let y = self
            .space
            .join(camera, rest.iter().rev().cloned(), 0..last + 1, sample, out)?;
        let back = chosen(&y) * self.inverse_contribution(x, end)?;
        let forth = chosen(x) * self.inverse_contribution(&y, last)?;
        // `forth` and `back` are densities, each divided by the contribution of the resulting path
        Some(Proposal::of(y, back / forth))
    }

    /// Density of making the lens subpath of `path` that ends at the vertex `end`, divided by the
    /// contribution of the path: Q(x → y) = T(x → y) / f(y).
    fn inverse_contribution(&self, path: &Path<'a>, end: usize) -> Option<f64> {
        let stops = self
            .space
            .smooth_probability(&path.vertices[..=end], TransportMode::Radiance)?;
        let factors = |i: usize| &path.vertices[i].factors;
        let continuing: f64 = (1..end).map(|i| factors(i).camera).product();
        Some(continuing * f64::from(stops) / (path.target * factors(end).geometry_term))
    }
}
