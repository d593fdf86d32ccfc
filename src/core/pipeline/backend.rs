//! Choice of the backend. No other code makes this choice.

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
    /// Error for a backend that is not built in.
    pub fn absence(self) -> InvalidSetting {
        let names: Vec<&str> = Self::ALL.iter().map(|b| b.name()).collect();
        let help = format!(
            "use one of {}; for another backend, build the program with its feature",
            names.join(", ")
        );
        InvalidSetting::new("backend", format!("{} is not built in", self.name()), help)
    }

    /// Builds the acceleration structure of `scene` like [`Backend::build`], but without a borrow
    /// of the scene. The structure stays valid until the meshes of the scene change. Lights,
    /// materials and the camera may change. Returns `None` for a backend without a structure.
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
                // If neither backend is built in, both variables are unused.
                let _ = (scene, pool);
                Ok(None)
            }
        }
    }

    /// Builds the acceleration structure of `scene` with the threads of `pool`. No other code
    /// chooses the backend.
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
                // obvhs ends the program if memory runs out, so check first.
                let bytes = OBVHS_BUILDING_BYTES * scene.triangle_count();
                if let Some(refusal) = MemoryLimit::refusal(None, 0, bytes) {
                    return Err(Error::Failed(format!(
                        "obvhs: building the acceleration structure takes about {}: {refusal}\n  help: allow more memory, or use --backend embree",
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

/// Address space per triangle, in bytes, that obvhs needs during the build: boxes, codes and their
/// sorted copies, and nodes as they are made and optimised.
#[cfg(feature = "obvhs")]
const OBVHS_BUILDING_BYTES: u64 = 400;

/// Acceleration structure of any backend. Clones share the structure.
#[derive(Clone)]
pub enum AnyAccel<'a> {
    /// Structure of Embree.
    #[cfg(feature = "embree")]
    Embree(Arc<embree::EmbreeAccel<'a>>),
    /// Structure of obvhs.
    #[cfg(feature = "obvhs")]
    Obvhs(Arc<bvh::BvhAccel>),
    /// No structure: every triangle is tested.
    Brute(brute::BruteForce<'a>),
    /// Structure of one backend. A fraction of its rays is checked against another backend.
    Audited(&'a Auditor<'a>),
}

impl AnyAccel<'_> {
    /// The acceleration structure behind dynamic dispatch.
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
