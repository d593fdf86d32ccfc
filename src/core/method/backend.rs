//! The one place that chooses a backend.

use super::{Error, InvalidSetting};
#[cfg(feature = "obvhs")]
use crate::accel::bvh;
#[cfg(feature = "embree")]
use crate::accel::embree;
use crate::accel::{Accel, Auditor, brute};
#[cfg(feature = "obvhs")]
use crate::files::{MemoryLimit, in_words};
use crate::options::Backend;
use crate::scene::Scene;
#[cfg(any(feature = "embree", feature = "obvhs"))]
use std::sync::Arc;

impl Backend {
    /// Error of a backend that is not built in.
    pub fn absence(self) -> InvalidSetting {
        let names: Vec<&str> = Self::ALL.iter().map(|b| b.name()).collect();
        let help = format!(
            "built in: {}; others need a build with their features",
            names.join(", ")
        );
        InvalidSetting::new("backend", format!("{}: not built in", self.name()), help)
    }

    /// Builds the acceleration structure of `scene` as [`Backend::build`] does, to serve for as long as the scene's meshes stay: light, materials and the
    /// camera may change meanwhile. `None` for a backend that has no structure to keep.
    pub fn build_kept(self, scene: &Scene, pool: &rayon::ThreadPool) -> Result<Option<AnyAccel<'static>>, Error> {
        match self {
            #[cfg(feature = "embree")]
            Self::Embree => {
                let accel = embree::EmbreeAccel::kept(scene, pool.current_num_threads());
                accel
                    .map(|accel| Some(AnyAccel::Embree(Arc::new(accel))))
                    .map_err(|e| Error::Failed(e.to_string()))
            }
            #[cfg(feature = "obvhs")]
            Self::Obvhs => Ok(match self.build(scene, pool)? {
                AnyAccel::Obvhs(accel) => Some(AnyAccel::Obvhs(accel)),
                _ => None,
            }),
            _ => {
                // A program without these backends uses neither.
                let _ = (scene, pool);
                Ok(None)
            }
        }
    }

    /// Builds the acceleration structure of `scene` with as many threads as `pool` has: the one place that chooses the backend.
    pub fn build<'a>(self, scene: &'a Scene, pool: &rayon::ThreadPool) -> Result<AnyAccel<'a>, Error> {
        match self {
            #[cfg(feature = "embree")]
            Self::Embree => {
                let accel = embree::EmbreeAccel::new(scene, pool.current_num_threads());
                accel
                    .map(|accel| AnyAccel::Embree(Arc::new(accel)))
                    .map_err(|e| Error::Failed(e.to_string()))
            }
            #[cfg(feature = "obvhs")]
            Self::Obvhs => {
                // It ends the program where there is no memory left, and so is asked for beforehand.
                let bytes = OBVHS_BUILDING_BYTES * scene.triangle_count();
                if let Some(refusal) = MemoryLimit::refusal(None, 0, bytes) {
                    return Err(Error::Failed(format!(
                        "obvhs: building the acceleration structure takes about {}: {refusal}\n  help: allow more, or use --backend embree",
                        in_words(bytes)
                    )));
                }
                Ok(AnyAccel::Obvhs(Arc::new(pool.install(|| bvh::BvhAccel::new(scene)))))
            }
            Self::Brute => Ok(AnyAccel::Brute(pool.install(|| brute::BruteForce::new(scene)))),
            #[cfg(not(all(feature = "embree", feature = "obvhs")))]
            absent => Err(absent.absence().into()),
        }
    }
}

/// Address space that obvhs takes for a triangle while it builds: boxes, codes and their sorted copies, and nodes as they are made and optimised.
#[cfg(feature = "obvhs")]
const OBVHS_BUILDING_BYTES: u64 = 400;

/// The acceleration structure of whichever backend; copies share it.
#[derive(Clone)]
pub enum AnyAccel<'a> {
    /// That of Embree.
    #[cfg(feature = "embree")]
    Embree(Arc<embree::EmbreeAccel<'a>>),
    /// That of obvhs.
    #[cfg(feature = "obvhs")]
    Obvhs(Arc<bvh::BvhAccel>),
    /// None: every triangle is tried.
    Brute(brute::BruteForce<'a>),
    /// That of one, for a share of the rays checked against another.
    Audited(&'a Auditor<'a>),
}

impl AnyAccel<'_> {
    /// The acceleration structure, to be asked without knowing which it is.
    pub fn as_dyn(&self) -> &dyn Accel {
        match self {
            #[cfg(feature = "embree")]
            Self::Embree(accel) => &**accel,
            #[cfg(feature = "obvhs")]
            Self::Obvhs(accel) => &**accel,
            Self::Brute(accel) => accel,
            Self::Audited(accel) => *accel,
        }
    }
}
