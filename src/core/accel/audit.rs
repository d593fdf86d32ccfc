//! Audits: a second backend checks a random fraction of the rays of a render (`embrasure audit`,
//! `render --audit-rays`).
//!
//! Rays are chosen by a hash of their bits, so the report does not depend on threads. The audited
//! backend traces single rays and packets as in a normal render, so an audited picture is
//! bit-identical to a normal picture. Brute force also traces each ray with a disagreement, to
//! identify the wrong backend. In addition, brute force traces a fraction of the checked rays,
//! inversely proportional to the number of triangles.

use super::brute::BruteForce;
use super::{Accel, Answer, BackendInfo, Cause, Disagreement, Query, QueryKind, judge};
use crate::geometry::Hit;
use crate::math::Ray;
use crate::math::hash::{GOLDEN_GAMMA, mix};
use crate::scene::Scene;
use std::sync::{Mutex, PoisonError};

/// Average number of triangles that brute force tests per checked ray. This is about as much work
/// as the rest of a check.
const BRUTE_TESTS: f64 = 256.0;

/// A backend that checks a fraction of its answers against a second backend, and against crossings
/// computed in f64.
///
/// The first backend is called as in a render: it traces each packet in one call. Each ray of a
/// packet is checked separately. The choice of rays depends on the bits of the rays only, and not
/// on the number of threads.
pub struct Auditor<'a> {
    scene: &'a Scene,
    accels: [&'a dyn Accel; 2],
    brute: BruteForce<'a>,
    /// A ray is checked if its hash is below this threshold.
    threshold: u64,
    /// Brute force also traces a checked ray if its hash is below this threshold.
    brute_threshold: u64,
    findings: Mutex<AuditFindings>,
}

/// Results of an audit.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct AuditFindings {
    /// Number of rays whose closest hit was checked.
    pub closest: u64,
    /// Number of rays whose occlusion was checked.
    pub occlusion: u64,
    /// Number of disagreements by cause, in the order of [`Cause::ALL`].
    pub causes: [u64; Cause::COUNT],
    /// Some of the disagreements, at most 100. The selection does not depend on the order in which
    /// they were found.
    pub disagreements: Vec<Disagreement>,
}

impl AuditFindings {
    /// Maximum length of `disagreements`.
    const KEPT: usize = 100;

    /// Number of checked rays.
    pub fn rays(&self) -> u64 {
        self.closest + self.occlusion
    }

    /// Total number of disagreements.
    pub fn count(&self) -> u64 {
        self.causes.iter().sum()
    }

    /// Number of disagreements with the cause `cause`.
    pub fn caused_by(&self, cause: Cause) -> u64 {
        self.causes[cause as usize]
    }

    /// Number of disagreements in which a backend is wrong.
    pub fn faults(&self) -> u64 {
        let faults = Cause::ALL.into_iter().filter(|cause| cause.is_fault());
        faults.map(|cause| self.caused_by(cause)).sum()
    }

    fn add(&mut self, found: Disagreement) {
        self.causes[found.cause as usize] += 1;
        let at = self.disagreements.partition_point(|d| order(d) <= order(&found));
        self.disagreements.insert(at, found);
        self.disagreements.truncate(Self::KEPT);
    }
}

/// Sort key that puts unexplained disagreements first.
fn order(d: &Disagreement) -> (std::cmp::Reverse<Cause>, u64) {
    (std::cmp::Reverse(d.cause), hash(&d.query))
}

impl<'a> Auditor<'a> {
    /// Auditor that returns the hits of the first backend. The second backend checks a fraction
    /// `share` of the rays, in [0, 1].
    pub fn new(scene: &'a Scene, accels: [&'a dyn Accel; 2], share: f64) -> Self {
        // The cast saturates, so a `share` of 1 selects all rays.
        let threshold = |share: f64| (share * 2f64.powi(64)) as u64;
        let triangles = scene.placed_triangle_count().max(1) as f64;
        Self {
            scene,
            accels,
            brute: BruteForce::new(scene),
            threshold: threshold(share),
            brute_threshold: threshold(share * (BRUTE_TESTS / triangles).min(1.0)),
            findings: Mutex::default(),
        }
    }

    /// Copy of the current findings.
    pub fn findings(&self) -> AuditFindings {
        self.findings.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Checks the answer of the first backend, if the ray is selected.
    fn check(&self, query: Query, answer: Answer, is_packet: bool) {
        let hash = hash(&query);
        if hash >= self.threshold {
            return;
        }
        let answers = [answer, query.trace(self.accels[1])];
        let found = judge(self.scene, self.accels, &query, answers);
        let found = found.or_else(|| {
            if hash < self.brute_threshold {
                self.common_fault(&query, answers)
            } else {
                None
            }
        });
        let mut findings = self.findings.lock().unwrap_or_else(PoisonError::into_inner);
        match query.kind {
            QueryKind::Closest => findings.closest += 1,
            QueryKind::Occlusion => findings.occlusion += 1,
        }
        if let Some(found) = found {
            findings.add(Disagreement { is_packet, ..found });
        }
    }

    /// Returns the disagreement of the first backend with brute force, if both backends missed a
    /// surface that brute force hits. Returns `None` if rounding explains the difference.
    fn common_fault(&self, query: &Query, answers: [Answer; 2]) -> Option<Disagreement> {
        let exact = query.trace(&self.brute);
        let distance = |answer: &Answer| answer.hit().map_or(f32::INFINITY, |hit| hit.t);
        let is_missed = exact.is_hit() && (!answers[0].is_hit() || distance(&exact) < distance(&answers[0]));
        if !is_missed {
            return None;
        }
        let found = judge(self.scene, [self.accels[0], &self.brute], query, [answers[0], exact])?;
        found.cause.is_fault().then_some(Disagreement { answers, ..found })
    }
}

impl Accel for Auditor<'_> {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        let hit = self.accels[0].intersect(ray);
        self.check(Query::closest(ray), Answer::Closest(hit), false);
        hit
    }

    fn intersect_coherent(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        self.accels[0].intersect_coherent(rays, hits);
        for (ray, hit) in rays.iter().zip(hits) {
            self.check(Query::closest(ray), Answer::Closest(*hit), true);
        }
    }

    fn occluded(&self, ray: &Ray) -> bool {
        let occluded = self.accels[0].occluded(ray);
        self.check(Query::occlusion(ray), Answer::Occlusion(occluded), false);
        occluded
    }

    fn occluded_coherent(&self, rays: &[Ray], occluded: &mut [bool]) {
        self.accels[0].occluded_coherent(rays, occluded);
        for (ray, occluded) in rays.iter().zip(occluded) {
            self.check(Query::occlusion(ray), Answer::Occlusion(*occluded), true);
        }
    }

    fn info(&self) -> BackendInfo {
        self.accels[0].info()
    }

    fn bytes(&self) -> u64 {
        self.accels[0].bytes()
    }
}

/// Hash of the bits of the ray and of the kind of the query.
fn hash(query: &Query) -> u64 {
    let words = query.ray.bits().into_iter().chain([query.kind as u32]);
    words.fold(0, |h, word| mix(h ^ word as u64).wrapping_add(GOLDEN_GAMMA))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::brute::BruteForce;
    use crate::geometry::{Mesh, PrimId};
    use crate::material::Material;
    use crate::math::Vec3;
    use crate::scene::SceneBuilder;

    /// Brute force whose hits are changed by the function `change`.
    struct BrokenAccel<'a> {
        right: &'a BruteForce<'a>,
        change: fn(Hit) -> Option<Hit>,
    }

    impl Accel for BrokenAccel<'_> {
        fn intersect(&self, ray: &Ray) -> Option<Hit> {
            self.right.intersect(ray).and_then(self.change)
        }
        fn occluded(&self, ray: &Ray) -> bool {
            self.intersect(ray).is_some()
        }
        fn info(&self) -> BackendInfo {
            self.right.info()
        }
        fn bytes(&self) -> u64 {
            0
        }
    }

    fn triangle() -> Scene {
        let mut builder = SceneBuilder::new();
        let material = builder.add_material(Material::default()).unwrap();
        let mesh = Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        };
        builder.add_mesh(mesh, material).unwrap();
        builder.build().unwrap().0
    }

    /// Audits `rays` with a correct first backend, and a second backend whose hits are changed by
    /// `change`.
    fn audit(rays: &[Ray], share: f64, change: fn(Hit) -> Option<Hit>) -> AuditFindings {
        let scene = triangle();
        let right = BruteForce::new(&scene);
        let broken = BrokenAccel { right: &right, change };
        let auditor = Auditor::new(&scene, [&right, &broken], share);
        for ray in rays {
            auditor.intersect(ray);
            auditor.occluded(ray);
        }
        auditor.findings()
    }

    fn down(x: f32, y: f32) -> Ray {
        Ray::new(Vec3::new(x, y, 1.0), Vec3::NEG_Z)
    }

    #[test]
    fn wrong_backends_are_found() {
        let inside = [down(0.2, 0.3), down(5.0, 0.3)];
        assert_eq!(audit(&inside, 1.0, Some).count(), 0);
        // Test a backend that misses all hits: closest hits and occlusion
        let blind = audit(&inside, 1.0, |_| None);
        assert_eq!(
            (blind.rays(), blind.count(), blind.caused_by(Cause::Unexplained)),
            (4, 2, 2)
        );
        assert_eq!(blind.disagreements.len(), 2);
        // Test distance errors above and below the rounding bound
        let off = audit(&inside, 1.0, |hit| {
            Some(Hit {
                t: hit.t * 1.001,
                ..hit
            })
        });
        assert_eq!((off.count(), off.caused_by(Cause::Unexplained)), (1, 1));
        let close = audit(&inside, 1.0, |hit| {
            Some(Hit {
                t: hit.t * 1.000_000_2,
                ..hit
            })
        });
        assert_eq!(close.count(), 0);
    }

    #[test]
    fn differences_by_rounding_have_their_cause() {
        let cause = |ray: Ray| {
            let findings = audit(&[ray], 1.0, |_| None);
            assert_eq!(findings.count(), 2, "{ray:?}");
            findings.disagreements[0].cause
        };
        assert_eq!(cause(down(0.5, 1e-9)), Cause::Edge);
        assert_eq!(
            cause(Ray {
                t_max: 1.0 + 1e-6,
                ..down(0.2, 0.3)
            }),
            Cause::Interval
        );
        let grazing = Ray::new(Vec3::new(-1.0, 0.2, 1e-7), Vec3::new(1.0, 0.0, -1e-7));
        assert_eq!(cause(grazing), Cause::Grazing);
        assert_eq!(cause(down(0.2, 0.3)), Cause::Unexplained);
    }

    /// Scene with a square of two triangles, and a second square behind it.
    fn squares() -> Scene {
        let mut builder = SceneBuilder::new();
        let material = builder.add_material(Material::default()).unwrap();
        let corners = |z: f32| [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(|[x, y]| Vec3::new(x, y, z));
        let mesh = Mesh {
            positions: [corners(0.0), corners(-1.0)].concat(),
            triangles: vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]],
            ..Mesh::default()
        };
        builder.add_mesh(mesh, material).unwrap();
        builder.build().unwrap().0
    }

    /// Audits the closest hit of `ray` in a backend whose hits are changed by `change`. Returns the
    /// cause of the disagreement, and `true` for each backend that is wrong. `None` if the backends
    /// agree.
    fn judged(ray: Ray, change: fn(Hit) -> Option<Hit>) -> Option<(Cause, [bool; 2])> {
        let scene = squares();
        let right = BruteForce::new(&scene);
        let broken = BrokenAccel { right: &right, change };
        let auditor = Auditor::new(&scene, [&right, &broken], 1.0);
        auditor.intersect(&ray);
        let found = auditor.findings().disagreements.first().copied();
        found.map(|found| (found.cause, found.wrong(&scene, Some(&right))))
    }

    #[test]
    fn wrong_names_and_barycentrics_are_found() {
        let inside = down(0.7, 0.3);
        assert_eq!(judged(inside, Some), None);
        let wrong = Some((Cause::Unexplained, [false, true]));
        assert_eq!(judged(inside, |hit| Some(Hit { prim: PrimId(1), ..hit })), wrong);
        assert_eq!(
            judged(inside, |hit| Some(Hit {
                b1: hit.b1 + 1e-3,
                ..hit
            })),
            wrong
        );
        assert_eq!(
            judged(inside, |hit| Some(Hit {
                b1: -0.0,
                b2: -0.0,
                ..hit
            })),
            wrong
        );
        assert_eq!(
            judged(inside, |hit| Some(Hit {
                t: hit.t + 1.0,
                prim: PrimId(2),
                ..hit
            })),
            wrong
        );
    }

    #[test]
    fn leaks_are_distinguished_from_boundary_edges() {
        // Test rays through the diagonal, which both triangles share, and rays at the boundary of
        // the square
        let diagonal = down(0.25, 0.25 + 1e-9);
        let behind = |hit: Hit| {
            Some(Hit {
                t: hit.t + 1.0,
                prim: PrimId(hit.prim.0 + 2),
                ..hit
            })
        };
        for miss in [behind as fn(Hit) -> Option<Hit>, |_| None] {
            assert_eq!(judged(diagonal, miss), Some((Cause::Leak, [false, true])));
            assert_eq!(judged(down(0.5, 1e-9), miss), Some((Cause::Edge, [false; 2])));
            assert_eq!(judged(down(0.6, 0.3), miss), Some((Cause::Unexplained, [false, true])));
        }
        // On a shared edge, a hit on either of the two triangles is correct.
        let other = |hit: Hit| {
            let (b1, b2) = if hit.prim == PrimId(0) {
                (0.25, 0.0)
            } else {
                (0.0, 0.25)
            };
            Some(Hit {
                prim: PrimId(1 - hit.prim.0),
                b1,
                b2,
                ..hit
            })
        };
        assert_eq!(judged(down(0.25, 0.25), other), None);
    }

    /// If both backends are wrong in the same way, brute force finds the fault.
    #[test]
    fn surfaces_that_both_backends_miss_are_found() {
        let scene = squares();
        let right = BruteForce::new(&scene);
        let blind = BrokenAccel {
            right: &right,
            change: |_| None,
        };
        let auditor = Auditor::new(&scene, [&blind, &blind], 1.0);
        auditor.intersect(&down(0.6, 0.3));
        auditor.occluded(&down(0.6, 0.3));
        let findings = auditor.findings();
        assert_eq!((findings.faults(), findings.caused_by(Cause::Unexplained)), (2, 2));
        for found in &findings.disagreements {
            assert_eq!(found.wrong(&scene, Some(&right)), [true; 2]);
        }
    }

    #[test]
    fn coincident_surfaces_are_reported() {
        let mut builder = SceneBuilder::new();
        let material = builder.add_material(Material::default()).unwrap();
        let mesh = Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y],
            // The second triangle has the opposite winding, because two equal triangles would count
            // as a single triangle.
            triangles: vec![[0, 1, 2], [0, 2, 1]],
            ..Mesh::default()
        };
        builder.add_mesh(mesh, material).unwrap();
        let scene = builder.build().unwrap().0;
        let right = BruteForce::new(&scene);
        let other = |hit: Hit| {
            Some(Hit {
                prim: PrimId(1 - hit.prim.0),
                b1: hit.b2,
                b2: hit.b1,
                ..hit
            })
        };
        let broken = BrokenAccel {
            right: &right,
            change: other,
        };
        let auditor = Auditor::new(&scene, [&right, &broken], 1.0);
        auditor.intersect(&down(0.2, 0.3));
        let findings = auditor.findings();
        assert_eq!((findings.count(), findings.caused_by(Cause::Coincident)), (1, 1));
        assert_eq!(findings.faults(), 0);
    }

    /// A backend whose packets have no hits.
    struct BlindPackets<'a>(&'a BruteForce<'a>);

    impl Accel for BlindPackets<'_> {
        fn intersect(&self, ray: &Ray) -> Option<Hit> {
            self.0.intersect(ray)
        }
        fn intersect_coherent(&self, _: &[Ray], hits: &mut [Option<Hit>]) {
            hits.fill(None);
        }
        fn occluded(&self, ray: &Ray) -> bool {
            self.0.occluded(ray)
        }
        fn occluded_coherent(&self, _: &[Ray], occluded: &mut [bool]) {
            occluded.fill(false);
        }
        fn info(&self) -> BackendInfo {
            self.0.info()
        }
        fn bytes(&self) -> u64 {
            0
        }
    }

    #[test]
    fn packets_are_audited_as_packets() {
        let scene = squares();
        let right = BruteForce::new(&scene);
        let blind = BlindPackets(&right);
        let rays = [down(0.2, 0.7), down(0.3, 0.8), down(5.0, 0.0)];
        let auditor = Auditor::new(&scene, [&blind, &right], 1.0);
        let (mut hits, mut occluded) = ([right.intersect(&rays[0]); 3], [true; 3]);
        auditor.intersect_coherent(&rays, &mut hits);
        auditor.occluded_coherent(&rays, &mut occluded);
        // The answers of the backend are returned unchanged, and each ray is checked.
        assert_eq!((hits, occluded), ([None; 3], [false; 3]));
        let findings = auditor.findings();
        assert_eq!((findings.closest, findings.occlusion), (3, 3));
        assert_eq!(findings.caused_by(Cause::Unexplained), 4);
        assert!(findings.disagreements.iter().all(|found| found.is_packet));
        // Single rays of the same backend have correct hits.
        let auditor = Auditor::new(&scene, [&blind, &right], 1.0);
        for ray in &rays {
            auditor.intersect(ray);
        }
        assert_eq!(auditor.findings().count(), 0);

        // A recorder also forwards packets as packets.
        let recorder = super::super::Recorder::new(&blind);
        recorder.intersect_coherent(&rays, &mut hits);
        recorder.intersect(&rays[0]);
        recorder.occluded_coherent(&rays, &mut occluded);
        let notes = recorder.take();
        let is_hit: Vec<bool> = notes.iter().map(|(_, answer)| answer.is_hit()).collect();
        assert_eq!(is_hit, [false, false, false, true, false, false, false]);
        let asked: Vec<Ray> = notes.iter().map(|(query, _)| query.ray).collect();
        assert_eq!(asked, [&rays[..], &rays[..1], &rays[..]].concat());
    }

    #[test]
    fn a_share_of_the_rays_is_checked() {
        let rays: Vec<Ray> = (0..20_000).map(|i| down(i as f32 * 1e-5, 0.3)).collect();
        let checked = |share| audit(&rays, share, Some).rays() as f64;
        assert_eq!((checked(0.0), checked(1.0)), (0.0, 40_000.0));
        // The number is binomial: 400 with a standard deviation of 20
        assert!((checked(0.01) - 400.0).abs() < 100.0, "{}", checked(0.01));
    }
}
