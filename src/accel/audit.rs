use super::{Accel, Answer, BackendInfo, Cause, Disagreement, Query, QueryKind, judge};
use crate::geometry::Hit;
use crate::math::Ray;
use crate::math::hash::{GOLDEN_GAMMA, mix};
use crate::scene::Scene;
use std::sync::{Mutex, PoisonError};

/// A backend whose answers are checked, for a share of the rays, against those of another one.
///
/// Which rays are checked depends on their bits alone, so that any number of threads checks the same ones.
pub struct Auditor<'a> {
    scene: &'a Scene,
    accels: [&'a dyn Accel; 2],
    /// A ray is checked where its hash is less.
    threshold: u64,
    findings: Mutex<Findings>,
}

/// What an audit has found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Findings {
    /// Rays whose closest hit was checked.
    pub closest: u64,
    /// Rays whose occlusion was checked.
    pub occlusion: u64,
    /// Disagreements by cause, in the order of [`Cause::ALL`].
    pub causes: [u64; 4],
    /// Some of them, the same ones in whichever order they were found.
    pub disagreements: Vec<Disagreement>,
}

impl Findings {
    /// How many disagreements are kept.
    const KEPT: usize = 100;

    /// Rays that were checked.
    pub fn rays(&self) -> u64 {
        self.closest + self.occlusion
    }

    /// Disagreements in all.
    pub fn count(&self) -> u64 {
        self.causes.iter().sum()
    }

    /// Disagreements of this cause.
    pub fn caused_by(&self, cause: Cause) -> u64 {
        self.causes[cause as usize]
    }

    fn add(&mut self, found: Disagreement) {
        self.causes[found.cause as usize] += 1;
        let at = self.disagreements.partition_point(|d| order(d) <= order(&found));
        self.disagreements.insert(at, found);
        self.disagreements.truncate(Self::KEPT);
    }
}

/// Unexplained ones first.
fn order(d: &Disagreement) -> (std::cmp::Reverse<Cause>, u64) {
    (std::cmp::Reverse(d.cause), hash(&d.query))
}

impl<'a> Auditor<'a> {
    /// Lets the first backend answer, and the second one be asked too for a `share` in [0, 1] of the rays.
    pub fn new(scene: &'a Scene, accels: [&'a dyn Accel; 2], share: f64) -> Self {
        Self {
            scene,
            accels,
            // The cast saturates: all rays for a share of 1.
            threshold: (share * 2f64.powi(64)) as u64,
            findings: Mutex::default(),
        }
    }

    /// What was found so far.
    pub fn findings(&self) -> Findings {
        self.findings.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    fn ask(&self, ray: &Ray, kind: QueryKind) -> Answer {
        let query = Query { ray: *ray, kind };
        if hash(&query) < self.threshold {
            let answers = self.accels.map(|accel| query.ask(accel));
            let found = judge(self.scene, self.accels, &query, answers);
            let mut findings = self.findings.lock().unwrap_or_else(PoisonError::into_inner);
            match kind {
                QueryKind::Closest => findings.closest += 1,
                QueryKind::Occlusion => findings.occlusion += 1,
            }
            if let Some(found) = found {
                findings.add(found);
            }
            return answers[0];
        }
        query.ask(self.accels[0])
    }
}

impl Accel for Auditor<'_> {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.ask(ray, QueryKind::Closest).hit()
    }

    fn occluded(&self, ray: &Ray) -> bool {
        self.ask(ray, QueryKind::Occlusion).is_hit()
    }

    fn info(&self) -> BackendInfo {
        self.accels[0].info()
    }

    fn bytes(&self) -> u64 {
        self.accels[0].bytes()
    }
}

/// A number that looks random, from the bits of the query.
fn hash(query: &Query) -> u64 {
    let words = query.ray.bits().into_iter().chain([query.kind as u32]);
    words.fold(0, |h, word| mix(h ^ word as u64).wrapping_add(GOLDEN_GAMMA))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::brute::BruteForce;
    use crate::geometry::Mesh;
    use crate::material::Material;
    use crate::math::Vec3;
    use crate::scene::SceneBuilder;

    /// Wrong in one way.
    struct Broken<'a> {
        right: &'a BruteForce,
        change: fn(Hit) -> Option<Hit>,
    }

    impl Accel for Broken<'_> {
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

    /// Checks `rays` against a backend that is wrong by `change`.
    fn audit(rays: &[Ray], share: f64, change: fn(Hit) -> Option<Hit>) -> Findings {
        let scene = triangle();
        let right = BruteForce::new(&scene);
        let broken = Broken { right: &right, change };
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
        // Hits that are not there, for the closest one and occlusion
        let blind = audit(&inside, 1.0, |_| None);
        assert_eq!(
            (blind.rays(), blind.count(), blind.caused_by(Cause::Unexplained)),
            (4, 2, 2)
        );
        assert_eq!(blind.disagreements.len(), 2);
        // Distances off by more than roundings, and by less
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
    fn what_roundings_decide_is_told_apart() {
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

    #[test]
    fn a_share_of_the_rays_is_checked() {
        let rays: Vec<Ray> = (0..20_000).map(|i| down(i as f32 * 1e-5, 0.3)).collect();
        let checked = |share| audit(&rays, share, Some).rays() as f64;
        assert_eq!((checked(0.0), checked(1.0)), (0.0, 40_000.0));
        // Binomial: 400 with a standard deviation of 20
        assert!((checked(0.01) - 400.0).abs() < 100.0, "{}", checked(0.01));
    }
}
