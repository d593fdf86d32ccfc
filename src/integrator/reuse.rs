use super::direct::Vertex;
use super::strategy::Directions;
use super::{Gathered, RayKind, SAMPLES_AT_ONCE, Sink, World};
use crate::accel::Accel;
use crate::color::Spectrum;
use crate::geometry::{SurfacePoint, offset_origin, segment};
use crate::math::{Ray, Vec3};

/// Where a path has been led by its first scattering, if that is a matte surface: it sends the same light to the first vertices
/// of all paths of a group (Bekaert, Sbert and Halton 2002, "Accelerating Path Tracing by Re-Using Paths").
///
/// Any of the paths might have found the point. By the balance heuristic over all of them (Veach 1997, §9.2.2), the light
/// `L` of an end `y` counts in the pixel whose first vertex is `xᵢ` as
///
/// ```text
/// f(xᵢ→y) |cos θᵢ| G(xᵢ, y) L / Σₖ pdfₖ(xₖ→y) G(xₖ, y),    G(x, y) = V(x, y) |cos θ_y| / |x − y|²
/// ```
///
/// which is never more than `f |cos θ| / pdf · L` of the pixel's own path. What is emitted at `y`, and what is scattered there by
/// other than matte surfaces, stays with the path that found it.
pub(super) struct End<R> {
    /// The point, clear of its surface.
    p: Vec3,
    /// When the path is there; all paths of a group have the same time.
    time: f32,
    /// Unit geometric normal on the side that light leaves.
    n: Vec3,
    /// The point where the shading normal is another one: from where it would be bent, the end is another surface.
    curved: Option<SurfacePoint>,
    /// Estimate of the radiance that is scattered to that side.
    radiance: R,
}

/// A first vertex that could have found the end.
#[derive(Clone, Copy)]
struct Candidate {
    index: usize,
    /// `f |cos θ| |cos θ_y| / d²`: the light it takes from the end, if it sees it.
    f: Spectrum,
    /// Density per area with which it finds the end, if it sees it.
    pdf: f32,
    /// Where its ray to the end starts.
    origin: Vec3,
}

impl<R: Gathered> End<R> {
    /// Whether `vertex` scatters to all directions alike.
    pub fn can_be(vertex: &Vertex) -> bool {
        vertex.bsdf.is_lambert() && !vertex.is_bent
    }

    /// At `vertex`, whose scattered light is `radiance`.
    pub fn new(vertex: &Vertex, radiance: R) -> Self {
        let point = vertex.point;
        let n = point.ng * 1f32.copysign(vertex.wo.z);
        Self {
            p: offset_origin(&point, n),
            time: point.time,
            n,
            curved: point.is_curved().then_some(point),
            radiance,
        }
    }

    /// Gives each path whose first vertex sees the end its share; the path `owner` has found it.
    pub fn light_all<A: Accel>(
        &self,
        world: &World<A>,
        directions: Directions,
        firsts: &[Option<Vertex>; SAMPLES_AT_ONCE],
        owner: usize,
        out: &mut [impl Sink<Radiance = R>],
    ) {
        if self.radiance.sum().is_black() {
            return;
        }

        // Who could have found it. That the owner sees it is known.
        let Some(own) = firsts[owner]
            .as_ref()
            .and_then(|v| self.candidate(v, owner, directions))
        else {
            return;
        };
        let mut others = [own; SAMPLES_AT_ONCE];
        let mut rays = [Ray::new(Vec3::ZERO, Vec3::ZERO); SAMPLES_AT_ONCE];
        let mut count = 0;
        for (i, first) in firsts.iter().enumerate().filter(|(i, _)| *i != owner) {
            let Some(first) = first else { continue };
            if let Some(candidate) = self.candidate(first, i, directions) {
                others[count] = candidate;
                rays[count] = segment(candidate.origin, self.p).when(self.time);
                count += 1;
            }
        }

        // Who sees it, and how much of it where there are holes
        let (others, rays) = (&others[..count], &rays[..count]);
        let mut seen = [1.0; SAMPLES_AT_ONCE];
        let mut own_seen = 1.0;
        if world.scene.has_holes() {
            for ((seen, ray), other) in seen.iter_mut().zip(rays).zip(others) {
                *seen = world.transmittance(ray, &mut out[other.index]);
            }
            let ray = segment(own.origin, self.p).when(self.time);
            own_seen = world.transmittance(&ray, &mut out[owner]);
        } else {
            let mut occluded = [false; SAMPLES_AT_ONCE];
            world.accel.occluded_coherent(rays, &mut occluded[..count]);
            for ((seen, other), occluded) in seen.iter_mut().zip(others).zip(occluded) {
                out[other.index].ray(RayKind::Shadow);
                *seen = f32::from(u8::from(!occluded));
            }
        }

        // Their shares
        let others = || others.iter().zip(seen);
        let pdf = others().fold(own_seen * own.pdf, |pdf, (other, seen)| pdf + seen * other.pdf);
        if pdf <= 0.0 {
            return;
        }
        let light = self.radiance * (1.0 / pdf);
        out[owner].radiance(light * own.f * own_seen);
        for (other, seen) in others().filter(|(_, seen)| *seen > 0.0) {
            out[other.index].radiance(light * other.f * seen);
        }
    }

    /// The path `index`, whose first vertex is `vertex`, as one that could have found the end.
    #[inline(always)]
    fn candidate(&self, vertex: &Vertex, index: usize, directions: Directions) -> Option<Candidate> {
        let d = self.p - vertex.point.p;
        let squared = d.length_squared();
        let wi = d * (1.0 / squared.sqrt());
        let g = -self.n.dot(wi) / squared;
        if self.curved.is_some_and(|point| point.bends_for(-wi)) {
            return None;
        }
        let wi = vertex.frame.to_local(wi);
        let pdf = directions.pdf(vertex.bsdf, vertex.wo, wi) * g;
        // Also false where the two points are one
        (pdf > 0.0 && pdf.is_finite()).then(|| Candidate {
            index,
            f: vertex.bsdf.eval(vertex.wo, wi) * (wi.z.abs() * g),
            pdf,
            origin: vertex.origin(wi),
        })
    }
}
