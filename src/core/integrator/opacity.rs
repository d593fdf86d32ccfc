//! Alpha and thin glass: the walk of a ray through surfaces that do not stop the ray. These
//! surfaces have an opacity below 1 (`d` and `map_d` of MTL, 0 to 1), or light passes them without
//! a change of direction (`material/thin_surface.rs`).
//!
//! Backends do not handle such surfaces. A walk keeps the origin and direction of its ray, and
//! moves the near end of the ray's open interval to the parameter of the last hit. So each hit is
//! strictly farther than the hit before, and no surface counts twice. A new ray from an offset
//! origin behind each surface was tried, but between two surfaces with large offsets the walk never
//! ended.
//!
//! - `World::intersect` stops at a surface with the probability of its opacity, decided by a hash
//!   of ray and hit.
//! - `World::intersect` passes thin glass with the probability of its Fresnel transmittance, and
//!   multiplies the throughput by the tint of the glass. All thin surfaces of a ray share one
//!   random number. After a decision, the number is rescaled to be uniform again. For camera rays,
//!   the sampler provides this number, so that windows in the image are stratified. For all other
//!   rays, the number is a hash.
//! - `World::transmittance` multiplies the factors 1 − opacity and the transmittances of glass
//!   along a shadow ray, which is less noisy than random decisions.
//! - Crossing a surface is not a scattering event: the depth and the previous vertex stay the same.
//! - Camera rays pass surfaces that are hidden from the camera. All other rays pass surfaces that
//!   only the camera sees (`Material::camera_visible`, `Material::light_visible`).
//! - Rays that arrive from behind pass surfaces without a back (`Mesh::is_front_only`).
//! - Surfaces that coincide to the last bit count as one.
//! - A walk has at most 10,000 queries. All surfaces behind the last query count as opaque, and
//!   `cut_walks` of `--stats` counts such walks.
//! - A surface of opacity α with emitted radiance Le emits α Le on average. A ray that stops at the
//!   surface finds Le. A light sample on the surface has α Le (`light/textured.rs`). Rays that hit
//!   the hull mesh of a sphere or disk lamp, but miss the lamp, pass through the hull
//!   (`scene/lamp_hulls.rs`).
//!
//! Each ray query checks once if the scene has alpha or thin glass. docs/notebook/2026-11.md,
//! "Alpha", has the cost of alpha, and "Window panes" the cost of glass.

use super::{RayKind, RaySink};
use crate::accel::Accel;
use crate::color::Spectrum;
use crate::geometry::Hit;
use crate::math::Ray;
use crate::math::float::ALMOST_ONE;
use crate::math::hash::{GOLDEN_GAMMA, mix, unit_f32};
use crate::scene::Scene;

/// Maximum number of ray queries of one walk. Surfaces behind the last query count as opaque: a cut
/// walk loses light, but every walk ends. Statistics count cut walks.
pub(super) const MAX_LAYERS: u32 = 10_000;

/// Transmittance of the surfaces between two points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transmittance {
    /// Probability that a ray passes all surfaces.
    pub pass: f32,
    /// Mean tint of the light of rays that pass, as a factor per channel.
    pub tint: Spectrum,
}

impl Transmittance {
    /// Transmittance of free space.
    pub const CLEAR: Self = Self {
        pass: 1.0,
        tint: Spectrum::ONE,
    };
    /// Transmittance of an opaque surface.
    pub const BLOCKED: Self = Self {
        pass: 0.0,
        tint: Spectrum::ONE,
    };

    /// Fraction of the light that passes, per channel.
    #[inline(always)]
    pub fn color(&self) -> Spectrum {
        self.tint * self.pass
    }

    /// Returns `true` if no ray passes.
    #[inline(always)]
    pub fn is_blocked(&self) -> bool {
        self.pass <= 0.0
    }

    /// Multiplies by the transmittance of the surface at `hit` for `ray`. Does nothing if the
    /// surface is hidden from camera rays (`is_from_camera`) or from all other rays.
    pub fn cross(&mut self, hit: &Hit, ray: &Ray, scene: &Scene, is_from_camera: bool) {
        if scene.misses_lamp(hit, ray) || !scene.is_visible(hit, ray, is_from_camera) {
            return;
        }
        let opacity = scene.opacity(hit);
        match scene.thin_surface_along(hit, ray).filter(|_| opacity > 0.0) {
            None => self.pass *= 1.0 - opacity,
            Some((pass, tint)) => {
                // Fraction of rays that pass through openings of the surface, and fraction of rays
                // that pass through its glass
                let (hole, glass) = (1.0 - opacity, opacity * pass);
                self.pass *= hole + glass;
                if hole + glass > 0.0 {
                    self.tint *= (Spectrum::splat(hole) + tint * glass) / (hole + glass);
                }
            }
        }
    }
}

/// Random decisions of a ray at thin surfaces.
pub(super) struct ThinSurfaceChoices {
    /// Random number, uniform in [0, 1). `None` before the first thin surface, if the caller gave
    /// no number.
    u: Option<f32>,
    /// Product of the tints of the surfaces passed so far.
    pub tint: Spectrum,
}

impl ThinSurfaceChoices {
    /// Decisions of a ray before its first surface. `u` is the uniform random number of the ray. If
    /// `u` is `None`, a hash is used.
    pub fn new(u: Option<f32>) -> Self {
        Self { u, tint: Spectrum::ONE }
    }

    /// Returns `true` if the surface at `hit` is thin glass and `ray` passes it.
    pub fn passes(&mut self, hit: &Hit, ray: &Ray, scene: &Scene) -> bool {
        let Some((pass, tint)) = scene.thin_surface_along(hit, ray) else {
            return false;
        };
        let u = self
            .u
            .unwrap_or_else(|| unit_f32(mix(hash(hit, ray).wrapping_add(GOLDEN_GAMMA))));
        let stop = 1.0 - pass;
        let passes = u >= stop;
        if passes {
            self.u = Some(((u - stop) / pass).min(ALMOST_ONE));
            self.tint *= tint;
        }
        passes
    }
}

/// Walks along a ray from surface to surface, nearest first.
///
/// The ray keeps its origin and direction. Only the near end of its interval moves, to the
/// parameter of the last hit. The interval is open, so the parameter grows with each query: every
/// walk ends, and no surface counts twice. Surfaces that coincide to the last bit count as one.
pub(super) struct OpacityWalk<'a, A> {
    accel: &'a A,
    ray: Ray,
    /// Last surface that the walk found.
    last: Option<Hit>,
    /// Remaining number of ray queries.
    left: u32,
    is_cut: bool,
}

impl<'a, A: Accel> OpacityWalk<'a, A> {
    /// A walk over all surfaces along `ray`.
    pub fn along(accel: &'a A, ray: Ray) -> Self {
        Self {
            accel,
            ray,
            last: None,
            left: MAX_LAYERS,
            is_cut: false,
        }
    }

    /// A walk over the surfaces behind `hit`, the closest hit of `ray`.
    pub fn behind(accel: &'a A, ray: Ray, hit: &Hit) -> Self {
        let mut layers = Self::along(accel, ray);
        layers.pass(hit);
        layers
    }

    /// Next surface. `None` behind the last surface, or if the walk is cut. Counts each ray query
    /// as a ray of kind `kind`.
    pub fn next(&mut self, kind: RayKind, out: &mut impl RaySink) -> Option<Hit> {
        loop {
            if self.left == 0 {
                self.is_cut = true;
                out.cut_walk();
                return None;
            }
            self.left -= 1;
            out.ray(kind);
            let hit = self.accel.intersect(&self.ray)?;
            let is_same = self.last.is_some_and(|last| last.is_same_surface(&hit));
            self.pass(&hit);
            // Skip a surface that is found twice. A ray packet and a single ray may find the same
            // surface at parameters that differ by a rounding error.
            if !is_same {
                return Some(hit);
            }
        }
    }

    /// Ends the walk at the ray parameter `t`.
    pub fn end_at(&mut self, t: f32) {
        self.ray.t_max = self.ray.t_max.min(t);
    }

    /// Returns `true` if the walk ended after [`MAX_LAYERS`] ray queries and surfaces may remain.
    pub fn is_cut(&self) -> bool {
        self.is_cut
    }

    fn pass(&mut self, hit: &Hit) {
        // Move strictly farther, even if a backend returns a parameter outside the interval
        self.ray.t_min = hit.t.max(f32::from_bits(self.ray.t_min.to_bits() + 1));
        self.last = Some(*hit);
    }
}

/// Returns `true` if the surface at `hit` stops `ray`, with the probability `opacity`. The random
/// number is a hash of ray and hit, because the dimensions of a sample do not depend on the number
/// of surfaces. No two rays of a render are equal.
pub(super) fn stops(hit: &Hit, ray: &Ray, opacity: f32) -> bool {
    opacity >= 1.0 || (opacity > 0.0 && uniform(hit, ray) < opacity)
}

/// Uniform number in [0, 1): a hash of the bits of `hit` and `ray`.
fn uniform(hit: &Hit, ray: &Ray) -> f32 {
    unit_f32(hash(hit, ray))
}

fn hash(hit: &Hit, ray: &Ray) -> u64 {
    let [x, y, z] = ray.direction.to_array().map(f32::to_bits);
    let [t, b1, b2] = [hit.t, hit.b1, hit.b2].map(f32::to_bits);
    let pairs = [
        [x, y],
        [z, t],
        [b1, b2],
        [hit.geom.0, hit.prim.0],
        [hit.inst.0, ray.time.to_bits()],
    ];
    pairs
        .iter()
        .fold(0, |hash, &[a, b]| mix(hash ^ (((a as u64) << 32) | b as u64)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::brute::BruteForce;
    use crate::camera::{Camera, CameraParameters};
    use crate::film::Filter;
    use crate::geometry::Mesh;
    use crate::integrator::World;
    use crate::material::Material;
    use crate::math::{DVec3, UVec2, Vec3};
    use crate::scene::{Scene, SceneBuilder};

    #[derive(Default)]
    struct Counts {
        rays: u64,
        cut: u64,
    }

    impl RaySink for Counts {
        fn ray(&mut self, _: RayKind) {
            self.rays += 1;
        }

        fn cut_walk(&mut self) {
            self.cut += 1;
        }
    }

    /// Random numbers in [0, 1), by SplitMix64.
    struct Random(u64);

    impl Random {
        fn next(&mut self) -> f32 {
            self.0 = self.0.wrapping_add(crate::math::hash::GOLDEN_GAMMA);
            unit_f32(mix(self.0))
        }

        /// A random point of the cube [-1, 1]³.
        fn point(&mut self) -> Vec3 {
            Vec3::new(self.next(), self.next(), self.next()) * 2.0 - 1.0
        }
    }

    /// Random triangles within `scale` of the origin, with random opacities. Their shading normals
    /// are random, as in foliage: most triangles then approximate curved surfaces, and the origins
    /// of rays are raised far from the triangles.
    fn cards(random: &mut Random, scale: f32) -> Scene {
        let mut builder = SceneBuilder::new();
        for _ in 0..10 + (random.next() * 40.0) as usize {
            let opacity = [0.0, 1.0, random.next(), random.next()][(random.next() * 4.0) as usize];
            let material = Material {
                opacity,
                ..Material::default()
            };
            let center = 0.5 * random.point();
            let mesh = Mesh {
                positions: (0..3).map(|_| scale * (center + 0.7 * random.point())).collect(),
                triangles: vec![[0, 1, 2]],
                normals: (0..3).map(|_| random.point().normalize_or(Vec3::Y)).collect(),
                ..Mesh::default()
            };
            let id = builder.add_material(material).unwrap();
            builder.add_mesh(mesh, id).unwrap();
        }
        builder.build().unwrap().0
    }

    /// Opacities of the triangles that `ray` crosses, nearest first, computed in f64 by the
    /// Möller-Trumbore test. `None` if rounding might change the result: at an edge, at an end of
    /// the ray, or if two triangles are close together.
    fn sorted_opacities(scene: &Scene, ray: &Ray) -> Option<Vec<f32>> {
        let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
        let mut crossings = Vec::new();
        for geom in scene.geom_ids() {
            let [a, b, c] = scene.mesh(geom).corners(crate::geometry::PrimId(0)).map(Vec3::as_dvec3);
            let (e1, e2, s): (DVec3, DVec3, DVec3) = (b - a, c - a, o - a);
            let (h, q) = (d.cross(e2), s.cross(e1));
            let determinant = e1.dot(h);
            if determinant.abs() < 1e-3 * e1.length() * e2.length() * d.length() {
                return None;
            }
            let (t, b1, b2) = (e2.dot(q) / determinant, s.dot(h) / determinant, d.dot(q) / determinant);
            let margin = b1.min(b2).min(1.0 - b1 - b2);
            if margin < -1e-3 {
                continue;
            }
            let ends = [ray.t_min, ray.t_max.min(1e30)].map(|end| (t - end as f64).abs() * d.length());
            let size = scene.bounds().radius() as f64;
            if margin < 1e-3 || ends[0].min(ends[1]) < 1e-3 * size {
                return None;
            }
            if t > ray.t_min as f64 && t < ray.t_max as f64 {
                crossings.push((t, scene.materials()[scene.shape(geom).material.0 as usize].opacity));
            }
        }
        crossings.sort_by(|a, b| a.0.total_cmp(&b.0));
        let size = scene.bounds().radius() as f64 / d.length();
        let is_close = crossings.windows(2).any(|pair| pair[1].0 - pair[0].0 < 1e-4 * size);
        (!is_close).then(|| crossings.into_iter().map(|(_, opacity)| opacity).collect())
    }

    /// Calls `look` with a world of `scene` for each available backend.
    fn with_worlds(scene: &Scene, mut look: impl FnMut(World<&dyn Accel>)) {
        let camera = CameraParameters {
            position: Vec3::Z,
            look_at: Vec3::ZERO,
            up: Vec3::Y,
            vertical_fov: 40.0,
            lens_radius: 0.0,
            focus_distance: 1.0,
        };
        let camera = Camera::new(camera, UVec2::ONE).unwrap();
        let selection = scene.light_selection(crate::light_sampling::LightChoice::default());
        let mut show = |accel: &dyn Accel| {
            look(World::new(scene, &accel, &selection, &camera, &Filter::BOX));
        };
        show(&BruteForce::new(scene));
        #[cfg(feature = "embree")]
        show(&crate::accel::embree::EmbreeAccel::new(scene, 1).unwrap());
        #[cfg(feature = "obvhs")]
        show(&crate::accel::bvh::BvhAccel::new(scene));
    }

    #[test]
    fn transmittance_is_the_product_over_sorted_hits() {
        let mut random = Random(7);
        let mut checked = 0;
        for k in 0..26 {
            let scale = 10f32.powi(k / 2 - 6);
            let scene = cards(&mut random, scale);
            let rays: Vec<Ray> = (0..60)
                .map(|i| {
                    let (a, b) = (scale * random.point(), scale * random.point());
                    match i % 2 {
                        0 => Ray::new(a, (b - a).normalize_or(Vec3::X)),
                        _ => crate::geometry::segment(a, b),
                    }
                })
                .collect();
            with_worlds(&scene, |world| {
                for ray in &rays {
                    let Some(opacities) = sorted_opacities(&scene, ray) else {
                        continue;
                    };
                    let expected: f32 = opacities.iter().map(|opacity| 1.0 - opacity).product();
                    let mut counts = Counts::default();
                    let found = world.transmittance(ray, &mut counts).pass;
                    let name = world.accel.info().name;
                    assert!(
                        (found - expected).abs() <= 1e-6,
                        "{name}, scale {scale}: {found} instead of {expected} of {opacities:?} along {ray:?}"
                    );
                    // Expect one query per surface up to the first opaque surface. Without an
                    // opaque surface, expect the number of surfaces plus one
                    let met = opacities.iter().position(|&opacity| opacity >= 1.0);
                    let queries = met.map_or(opacities.len() + 1, |opaque| opaque + 1);
                    assert_eq!((counts.rays, counts.cut), (queries as u64, 0), "{name}, {opacities:?}");
                    checked += 1;
                }
            });
        }
        assert!(checked > 500, "{checked}");
    }

    /// The fraction of rays that pass equals the transmittance. The closest hit comes from a single
    /// ray or from a packet.
    #[test]
    fn fraction_of_passing_rays_equals_transmittance() {
        let mut random = Random(8);
        for _ in 0..4 {
            let scene = cards(&mut random, 1.0);
            let rays: Vec<[Ray; 16]> = (0..300)
                .map(|_| {
                    let (a, b) = (random.point() * 2.0, random.point());
                    std::array::from_fn(|_| Ray::new(a, b + 0.02 * random.point() - a))
                })
                .collect();
            with_worlds(&scene, |world| {
                for in_packets in [false, true] {
                    let mut counts = Counts::default();
                    let (mut difference, mut variance) = (0.0, 0.0);
                    for rays in &rays {
                        let mut firsts = [None; 16];
                        if in_packets {
                            world.accel.intersect_coherent(rays, &mut firsts)
                        } else {
                            firsts = rays.each_ref().map(|ray| world.accel.intersect(ray));
                        }
                        for (ray, first) in rays.iter().zip(firsts) {
                            let (hit, _) = world.first_opaque(*ray, first, RayKind::Bounce, None, &mut counts);
                            let transmittance = f64::from(world.transmittance(ray, &mut counts).pass);
                            difference += f64::from(u8::from(hit.is_none())) - transmittance;
                            variance += transmittance * (1.0 - transmittance);
                        }
                    }
                    let z = difference / variance.sqrt();
                    assert!(z.abs() < 4.5, "{}: {z} standard deviations", world.accel.info().name);
                    assert_eq!(counts.cut, 0);
                }
            });
        }
    }

    #[test]
    fn walks_are_cut_at_maximum_and_counted() {
        let mut builder = SceneBuilder::new();
        let material = Material {
            opacity: 0.0,
            ..Material::default()
        };
        let id = builder.add_material(material).unwrap();
        let layers = MAX_LAYERS + 5;
        let z = |i: u32| -1.0 - i as f32 * 1e-3;
        let mesh = Mesh {
            positions: (0..layers)
                .flat_map(|i| [(-1.0, -1.0), (3.0, -1.0), (-1.0, 3.0)].map(|(x, y)| Vec3::new(x, y, z(i))))
                .collect(),
            triangles: (0..layers).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
            ..Mesh::default()
        };
        builder.add_mesh(mesh, id).unwrap();
        let scene = builder.build().unwrap().0;
        with_worlds(&scene, |world| {
            // Skip brute force, which would take a minute.
            if world.accel.info().name == crate::accel::brute::NAME {
                return;
            }
            let (through, mut counts) = (Ray::new(Vec3::ZERO, Vec3::NEG_Z), Counts::default());
            assert!(world.transmittance(&through, &mut counts).is_blocked());
            assert_eq!((counts.rays, counts.cut), (u64::from(MAX_LAYERS), 1));
            let (hit, _) = world.intersect(&through, RayKind::Bounce, &mut counts);
            assert!(hit.is_some(), "a surface behind the last query counts as opaque");
            assert_eq!(counts.cut, 2);
            // This walk starts behind six surfaces, so it is not cut
            let within = Ray::new(Vec3::Z * (z(5) - 1e-4), Vec3::NEG_Z);
            assert_eq!(world.transmittance(&within, &mut counts), Transmittance::CLEAR);
            let found = world.intersect(&within, RayKind::Bounce, &mut counts);
            assert_eq!(found, (None, Spectrum::ONE));
            assert_eq!(counts.cut, 2);
        });
    }
}
