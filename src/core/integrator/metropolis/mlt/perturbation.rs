use super::Proposal;
use super::numbers::Numbers;
use super::path::{CameraSample, LightEndKind, Path, Single, Vertex};
use super::space::{PathSpace, is_same_point};
use crate::accel::Accel;
use crate::bsdf::TransportMode;
use crate::integrator::{RayKind, RaySink};
use crate::math::{Frame, Ray, Vec2, Vec3};
use std::f32::consts::{PI, TAU};

/// Perturbations: mutations that move one end of the path slightly. The vertices of the chain of
/// delta lobes next to this end move too (Veach 1997, §11.4.2.2 to 11.4.2.4).
///
/// Moved vertices are sampled symmetrically. So the acceptance probability is the ratio of the
/// contributions per film area, and per solid angle of each perturbed direction. New paths have
/// delta lobes at the same vertices as the old path, of the same kinds.
#[derive(Debug)]
pub(super) struct PathPerturbation<'s, 'w, 'a, A> {
    pub space: &'s PathSpace<'w, 'a, A>,
}

/// Minimum perturbation of the film point, in pixels.
const MIN_STEP: f32 = 0.1;
/// Area of the disk of all film points that a perturbation can reach, as a fraction of the film
/// area.
const MAX_STEP_SHARE: f32 = 0.05;
/// Minimum and maximum angle, in radians, by which a perturbation changes a direction between two
/// specular chains.
const ANGLES: [f32; 2] = [0.0001, 0.1];
/// Maximum angle, in radians, by which a caustic perturbation changes the direction in which light
/// leaves a vertex.
const MAX_ANGLE: f32 = 0.5;

/// Part of a path that moves if its film point moves: the vertices from the camera to `last`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct CameraChain {
    /// Index of the last vertex that moves. It is connected to the next vertex, or is on the light.
    pub last: usize,
    /// True if there are several specular chains, with perturbed directions between them.
    pub is_multiple: bool,
}

impl CameraChain {
    /// The part of `x` that moves: (L|D)DS*E, or (L|D)DS⁺DS⁺E, or a chain that ends at a light that
    /// the path hits.
    pub fn of(x: &Path) -> Option<Self> {
        let mut is_multiple = false;
        for i in 1..x.len() {
            let vertex = &x.vertices[i];
            let ends = match vertex.source() {
                Some(source) => (!source.kind.is_delta()).then_some(true)?,
                None => x.can_be_joined(i),
            };
            if ends {
                return Some(Self { last: i, is_multiple });
            }
            is_multiple |= !vertex.is_delta;
        }
        None
    }
}

/// Index of the vertex at which a specular chain starts. The chain lights a vertex that the camera
/// sees: (L|D)S*DE. `None` if `x` has no such chain.
pub(super) fn caustic_start(x: &Path) -> Option<usize> {
    let is_seen = x.vertices[1].surface().is_some() && !x.vertices[1].is_delta;
    (2..x.len()).find(|&i| !x.vertices[i].is_delta).filter(|_| is_seen)
}

impl<'a, A: Accel> PathPerturbation<'_, '_, 'a, A> {
    /// Maximum perturbation of the film point, in pixels.
    fn max_step(&self) -> f32 {
        (MAX_STEP_SHARE * self.space.film.area() / PI)
            .sqrt()
            .max(2.0 * MIN_STEP)
    }

    /// Moves the film point of `x`, and the vertices of `chain`. `chosen` returns the probability
    /// of choosing this kind of mutation for a path.
    pub fn move_film_point(
        &self,
        x: &Path<'a>,
        chain: CameraChain,
        chosen: impl Fn(&Path<'a>) -> f64,
        numbers: &mut Numbers,
        out: &mut impl RaySink,
    ) -> Option<Proposal<'a>> {
        // Choose a nearby film point
        let film = x.film + on_ring(numbers, [MIN_STEP, self.max_step()]);
        if !self.space.film.contains(film) {
            return None;
        }
        let camera = self.follow(
            x,
            chain,
            (film, x.camera),
            |w, numbers| turned(w, numbers, ANGLES).0,
            numbers,
            out,
        )?;
        let light = x.vertices[chain.last + 1..].iter().rev().cloned();
        let y = self.space.join(camera, light, 0..chain.last + 1, x.camera, out)?;
        Some(self.proposal(x, y, chain, chosen))
    }

    /// Moves the path `x` to another time. The film point, the lens point and the directions that
    /// no delta lobe determines stay the same. The objects of vertices outside of `chain` must not
    /// move.
    pub fn move_in_time(
        &self,
        x: &Path<'a>,
        chain: CameraChain,
        chosen: impl Fn(&Path<'a>) -> f64,
        numbers: &mut Numbers,
        out: &mut impl RaySink,
    ) -> Option<Proposal<'a>> {
        let sample = CameraSample {
            time: self.space.world.time_at(|| numbers.next()),
            ..x.camera
        };
        let camera = self.follow(x, chain, (x.film, sample), |w, _| w, numbers, out)?;
        // Test the visibility of the other edges again, because occluders may move
        let mut light: Vec<Vertex> = x.vertices[chain.last + 1..].iter().rev().cloned().collect();
        for i in 1..light.len() {
            let before = light.get(i + 1).or(camera.last());
            light[i].transmittance = self
                .space
                .visibility(before, &light[i], &light[i - 1], sample.time, out);
            if light[i].transmittance.is_blocked() {
                return None;
            }
        }
        let y = self.space.join(camera, light.into_iter(), 0..x.len(), sample, out)?;
        Some(self.proposal(x, y, chain, chosen))
    }

    /// Returns `true` if [`PathPerturbation::move_in_time`] can move the path `x`.
    pub fn can_move_in_time(&self, x: &Path<'a>) -> bool {
        let chain = CameraChain::of(x);
        chain.is_some_and(|chain| {
            x.vertices[chain.last + 1..]
                .iter()
                .all(|vertex| self.space.is_still(vertex))
        })
    }

    /// Makes the vertices of `chain` anew, along a camera ray through the film point `film`. The
    /// vertices scatter by the same kinds of lobes as in `x`. `turn` changes the free directions,
    /// which are the directions that no delta lobe determines.
    fn follow(
        &self,
        x: &Path<'a>,
        chain: CameraChain,
        (film, sample): (Vec2, CameraSample),
        turn: impl Fn(Vec3, &mut Numbers) -> Vec3,
        numbers: &mut Numbers,
        out: &mut impl RaySink,
    ) -> Option<Vec<Vertex<'a>>> {
        let mut ray = self.space.world.camera.ray(film, sample.lens, sample.time);
        let mut kind = RayKind::Camera;
        let mut camera = Vec::with_capacity(x.len());
        camera.push(Vertex::lens(self.space.world.camera.lens_of(&ray)));
        for i in 1..=chain.last {
            let old = &x.vertices[i];
            let hit = self.space.intersect(&ray, kind, out);
            if is_same_point(&camera, &hit) {
                return None;
            }
            let mut vertex = match old.source() {
                Some(_) => self.space.light_at(hit, &ray, numbers.next())?,
                None => hit?,
            };
            vertex.is_delta = old.is_delta;
            self.space.note_through(&mut camera, &vertex, sample.time, out);
            camera.push(vertex);
            if i < chain.last {
                kind = RayKind::Bounce;
                let neighbours = [&x.vertices[i - 1], old, &x.vertices[i + 1]];
                let turn = |w| turn(w, numbers);
                let w = self.onwards(&camera, neighbours, TransportMode::Radiance, turn)?;
                let origin = camera[i].origin_towards_light(self.space.world, Some(&camera[i - 1]), w);
                ray = Ray::new(origin, w).when(sample.time);
            }
        }
        Some(camera)
    }

    /// Proposal to move from the path `x` to the path `y`. The step and the reverse step have equal
    /// densities.
    fn proposal(
        &self,
        x: &Path<'a>,
        y: Path<'a>,
        chain: CameraChain,
        chosen: impl Fn(&Path<'a>) -> f64,
    ) -> Proposal<'a> {
        let ratio = self.contribution(&y, chain) / self.contribution(x, chain) * (chosen(&y) / chosen(x));
        Proposal::of(y, ratio)
    }

    /// Contribution of `path` per film area, and per solid angle of each free direction of `chain`.
    /// If the path hits its light, the contribution is divided by [`PathSpace::hit_probability`].
    fn contribution(&self, path: &Path<'a>, chain: CameraChain) -> f64 {
        let geometry_term = match path.source() {
            Some(source) if chain.last + 1 == path.len() => 1.0 / self.space.hit_probability(source),
            _ => path.vertices[chain.last].factors.geometry_term,
        };
        path.target * geometry_term
    }

    /// Caustic perturbation: changes the direction in which light leaves the vertex `start` of `x`,
    /// or the position of light from infinity. From `start`, a specular chain leads to a vertex
    /// that the camera sees.
    pub fn move_light(
        &self,
        x: &Path<'a>,
        start: usize,
        chosen: impl Fn(&Path<'a>) -> f64,
        numbers: &mut Numbers,
        out: &mut impl RaySink,
    ) -> Option<Proposal<'a>> {
        // Choose a nearby direction, or a nearby position for light from infinity
        let from = &x.vertices[start];
        let old = from.direction_to(&x.vertices[start - 1]);
        let range = self.range_of_light(x, start);
        let (origin, w, moved) = match from.source().map(|source| source.kind) {
            Some(LightEndKind::Far | LightEndKind::Parallel) => {
                let offset = on_ring(numbers, range);
                let across = Frame::from_z(old).to_world(Vec3::new(offset.x, offset.y, 0.0));
                let ball = self.space.world.scene.ball();
                let next = x.vertices[start - 1].p + across;
                // Start the ray outside of the scene
                let back = (next - ball.center).dot(old) + ball.radius;
                (next - back * old, old, offset.length())
            }
            _ => {
                let (w, angle) = turned(old, numbers, range);
                (from.origin_towards_camera(w), w, angle)
            }
        };
        let mut ray = Ray::new(origin, w).when(x.camera.time);

        // Trace the chain, with the same kinds of lobes as in `x`
        let mut light: Vec<Vertex> = Vec::with_capacity(x.len());
        light.extend(x.vertices[start..].iter().rev().cloned());
        for i in (1..start).rev() {
            let mut vertex = self.space.intersect(&ray, RayKind::Bounce, out)?;
            vertex.is_delta = x.vertices[i].is_delta;
            if let Some(last) = light.last() {
                vertex.transmittance = self.space.transmittance(None, &vertex, last, x.camera.time, out);
            }
            light.push(vertex);
            if i > 1 {
                let neighbours = [&x.vertices[i + 1], &x.vertices[i], &x.vertices[i - 1]];
                let turn = |w| turned(w, numbers, ANGLES).0;
                let w = self.onwards(&light, neighbours, TransportMode::Importance, turn)?;
                ray = Ray::new(light.last()?.origin_towards_camera(w), w).when(x.camera.time);
            }
        }
        let mut camera = Vec::with_capacity(x.len());
        camera.push(x.vertices[0].clone());
        let y = self.space.join(camera, light.into_iter(), 1..start, x.camera, out)?;

        // Reject the step if the reverse step is outside of the range for the new path
        let [min, max] = self.range_of_light(&y, start);
        if !(min..=max).contains(&moved) {
            return None;
        }
        let contribution = |path: &Path| {
            let chain = path.vertices[2..=start].iter();
            let towards_camera: f64 = chain.map(|vertex| vertex.factors.towards_camera).product();
            path.target * towards_camera * path.vertices[0].factors.geometry_term
        };
        let ratio = contribution(&y) / contribution(x) * (chosen(&y) / chosen(x));
        Some(Proposal::of(y, ratio))
    }

    /// Range of perturbations of the light that leaves the vertex `start` of `x`, in radians, or in
    /// scene units for infinitely distant lights. The perturbations move the film point about as
    /// much as film perturbations do.
    fn range_of_light(&self, x: &Path, start: usize) -> [f32; 2] {
        let pixel = self.space.world.camera.pixel_width(x.vertices[1].p, x.camera.time);
        let steps = [MIN_STEP, self.max_step()];
        if x.vertices[start].is_infinite() {
            return steps.map(|step| step * pixel);
        }
        let edges = x.vertices[1..=start].windows(2);
        let distance: f32 = edges.map(|edge| edge[0].p.distance(edge[1].p)).sum();
        // The ratio of minimum to maximum is the same for all paths. So a distance has the same
        // density for all paths whose range contains this distance.
        let greatest = (steps[1] * pixel / distance).min(MAX_ANGLE);
        [greatest * (steps[0] / steps[1]), greatest]
    }

    /// Unit direction in which the last vertex of the new path `path` continues. The vertex
    /// scatters by the same kind of lobe as the vertex `old` of the old path, whose neighbours are
    /// `before` and `after`. If this lobe is not a delta lobe, the result is the old direction,
    /// changed by `turn`.
    fn onwards(
        &self,
        path: &[Vertex<'a>],
        [before, old, after]: [&Vertex<'a>; 3],
        mode: TransportMode,
        turn: impl FnOnce(Vec3) -> Vec3,
    ) -> Option<Vec3> {
        let [.., previous, last] = path else { return None };
        let surface = last.surface()?;
        let w = old.direction_to(after);
        if !old.is_delta {
            return (!surface.bsdf.is_delta()).then(|| turn(w));
        }
        let back = old.direction_to(before);
        let old = old.surface()?.frame_for(self.space.world.scene, back, mode);
        let is_reflected = old.to_local(back).z * old.to_local(w).z > 0.0;
        let back = last.direction_to(previous);
        let frame = surface.frame_for(self.space.world.scene, back, mode);
        let single = Single::of(&surface.bsdf, frame.to_local(back), is_reflected, mode)?;
        Some(frame.to_world(single.direction))
    }
}

/// A random distance between `min` and `max`. Its logarithm is uniform.
fn distance(numbers: &mut Numbers, [min, max]: [f32; 2]) -> f32 {
    max * (-(max / min).ln() * numbers.next()).exp()
}

/// A random offset in the plane, with a length in `range`.
fn on_ring(numbers: &mut Numbers, range: [f32; 2]) -> Vec2 {
    let length = distance(numbers, range);
    length * Vec2::from_angle(TAU * numbers.next())
}

/// The unit direction `w`, rotated by a random angle in `range` (radians), and this angle.
fn turned(w: Vec3, numbers: &mut Numbers, range: [f32; 2]) -> (Vec3, f32) {
    let angle = distance(numbers, range);
    let (sin, cos) = angle.sin_cos();
    let (y, x) = (TAU * numbers.next()).sin_cos();
    (Frame::from_z(w).to_world(Vec3::new(sin * x, sin * y, cos)), angle)
}
