//! The one place that chooses a backend, and the name of the build.
//!
//! `build.rs` makes the build's name: a SHA-256 of the sources, `Cargo.lock`, the compiler's version and the processor that it compiles for. It needs
//! no git and is the same for one source tree wherever it lies. Bits are promised within one build, so `--resume` and `merge` refuse files of another
//! build and name the remedy.

use super::{Error, InvalidSetting};
#[cfg(feature = "obvhs")]
use crate::accel::bvh;
#[cfg(feature = "embree")]
use crate::accel::embree;
use crate::accel::{Accel, Auditor, Dispatch, brute};
#[cfg(feature = "obvhs")]
use crate::io::{MemoryLimit, in_words};
use crate::options::Backend;
use crate::scene::Scene;
use std::collections::BTreeSet;
use std::fs;
#[cfg(any(feature = "embree", feature = "obvhs"))]
use std::sync::Arc;

impl Backend {
    /// That it is not built in.
    pub(super) fn absence(self) -> InvalidSetting {
        let names: Vec<&str> = Self::ALL.iter().map(|b| b.name()).collect();
        let help = format!(
            "built in: {}; others need a build with their features",
            names.join(", ")
        );
        InvalidSetting::new("backend", format!("{}: not built in", self.name()), help)
    }

    /// Builds the acceleration structure of `scene` as [`Backend::build`] does, to serve for as long as the scene's meshes stay: light, materials and the
    /// camera may change meanwhile. `None` for a backend that has no structure to keep.
    pub(super) fn build_kept(
        self,
        scene: &Scene,
        pool: &rayon::ThreadPool,
    ) -> Result<Option<AnyAccel<'static>>, Error> {
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
    pub(crate) fn build<'a>(self, scene: &'a Scene, pool: &rayon::ThreadPool) -> Result<AnyAccel<'a>, Error> {
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
pub(crate) enum AnyAccel<'a> {
    #[cfg(feature = "embree")]
    Embree(Arc<embree::EmbreeAccel<'a>>),
    #[cfg(feature = "obvhs")]
    Obvhs(Arc<bvh::BvhAccel>),
    Brute(brute::BruteForce<'a>),
    /// That of one, for a share of the rays checked against another.
    Audited(&'a Auditor<'a>),
}

/// What is done with an acceleration structure, whichever it is.
pub(crate) trait AccelTask {
    type Output;

    fn run<A: Dispatch>(self, accel: &A) -> Self::Output;
}

impl AnyAccel<'_> {
    /// Gives it to `task`. Ray-tracing code is monomorphised for Embree; all other backends answer by dynamic dispatch, which costs about 1 % per
    /// query and keeps the build short.
    pub fn with<T: AccelTask>(&self, task: T) -> T::Output {
        match self {
            #[cfg(feature = "embree")]
            Self::Embree(accel) => task.run(&**accel),
            _ => task.run(&self.as_dyn()),
        }
    }

    /// The same, to be asked without knowing which.
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

/// Name of this build: a hash of its sources and of what the compiler was told (`build.rs`). Bits are only promised within one build.
pub const BUILD: &str = env!("EMBRASURE_BUILD");

/// Name, version and build of this program, the backends built in, and where libraries were found, a line each.
pub fn version_text() -> String {
    let mut text = format!("embrasure {} (build {BUILD})", env!("CARGO_PKG_VERSION"));
    #[cfg(feature = "embree")]
    match embree::Device::new(1) {
        Ok(device) => text += &format!("\nbackend embree {} ({})", device.version(), device.isa()),
        Err(error) => text += &format!("\nbackend embree: {error}"),
    }
    #[cfg(feature = "obvhs")]
    {
        text += &format!("\nbackend obvhs {} (pure Rust)", bvh::VERSION);
    }
    text += "\nbackend brute (every triangle against every ray, for checks)";
    for library in libraries() {
        text += &format!("\nlibrary {library}");
    }
    text
}

/// Files of Embree and Open Image Denoise that the process has loaded, as far as the system says.
fn libraries() -> BTreeSet<String> {
    const NAMES: [&str; 2] = ["libembree4", "libOpenImageDenoise.so"];
    let maps = fs::read_to_string("/proc/self/maps").unwrap_or_default();
    let paths = maps
        .lines()
        .filter_map(|line| line.find('/').map(|start| &line[start..]));
    let is_named = |path: &&str| {
        let name = path.rsplit('/').next().unwrap_or_default();
        NAMES.iter().any(|known| name.starts_with(known))
    };
    paths.filter(is_named).map(String::from).collect()
}
