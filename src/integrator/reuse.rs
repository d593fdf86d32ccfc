use super::direct::Vertex;
use super::strategy::Directions;
use super::{RayKind, SAMPLES_AT_ONCE, Sink, World};
use crate::accel::Accel;
use crate::color::Spectrum;
use crate::geometry::{SurfacePoint, offset_origin, ray_between};
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
pub(super) struct End {
    /// The point, clear of its surface.
    p: Vec3,
    /// Unit normal on the side that light leaves.
    n: Vec3,
    /// Estimate of the radiance that is scattered to that side.
    radiance: Spectrum,
}

/// A first vertex that could have found the end.
#[derive(Clone, Copy)]
struct Candidate {
    index: usize,
    /// `f |cos θ| |cos θ_y| / d²`: the light it takes from the end, if it sees it.
    f: Spectrum,
    /// Density per area with which it finds the end, if it sees it.
    pdf: f32,
}

impl End {
    /// Whether `vertex` scatters to all directions alike.
    pub fn can_be(vertex: &Vertex) -> bool {
        vertex.bsdf.is_lambert()
    }

    /// At `point`, seen from the side of `wo` (local frame), whose scattered light is `radiance`.
    pub fn new(point: &SurfacePoint, wo: Vec3, radiance: Spectrum) -> Self {
        let n = point.ns * 1f32.copysign(wo.z);
        Self {
            p: offset_origin(point, n),
            n,
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
        out: &mut [impl Sink],
    ) {
        if self.radiance.is_black() {
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
                rays[count] = ray_between(&first.point, self.p);
                count += 1;
            }
        }

        // Who sees it
        let mut occluded = [false; SAMPLES_AT_ONCE];
        let (others, occluded) = (&others[..count], &mut occluded[..count]);
        world.accel.occluded_coherent(&rays[..count], occluded);
        let mut pdf = own.pdf;
        for (other, occluded) in others.iter().zip(&*occluded) {
            out[other.index].ray(RayKind::Shadow);
            if !occluded {
                pdf += other.pdf;
            }
        }

        // Its share
        let light = self.radiance * (1.0 / pdf);
        out[owner].radiance(own.f * light);
        for (other, _) in others.iter().zip(&*occluded).filter(|(_, occluded)| !**occluded) {
            out[other.index].radiance(other.f * light);
        }
    }

    /// The path `index`, whose first vertex is `vertex`, as one that could have found the end.
    #[inline(always)]
    fn candidate(&self, vertex: &Vertex, index: usize, directions: Directions) -> Option<Candidate> {
        let d = self.p - vertex.point.p;
        let squared = d.length_squared();
        let wi = d * (1.0 / squared.sqrt());
        let g = -self.n.dot(wi) / squared;
        let wi = vertex.frame.to_local(wi);
        let pdf = directions.pdf(vertex.bsdf, vertex.wo, wi) * g;
        // Also false where the two points are one
        (pdf > 0.0 && pdf.is_finite()).then(|| Candidate {
            index,
            f: vertex.bsdf.eval(vertex.wo, wi) * (wi.z.abs() * g),
            pdf,
        })
    }
}
