use super::error::CliError;
#[cfg(feature = "obvhs")]
use crate::accel::bvh;
#[cfg(feature = "embree")]
use crate::accel::embree;
use crate::accel::{Accel, brute};
use crate::scene::Scene;
use std::time::Instant;

/// A ray-tracing backend that is built in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Backend {
    /// Intel Embree.
    #[cfg(feature = "embree")]
    Embree,
    /// A hierarchy by obvhs, in pure Rust.
    #[cfg(feature = "obvhs")]
    Obvhs,
    /// Every triangle against every ray.
    Brute,
}

impl Backend {
    /// All backends built in, the default first.
    pub const ALL: &[Self] = &[
        #[cfg(feature = "embree")]
        Self::Embree,
        #[cfg(feature = "obvhs")]
        Self::Obvhs,
        Self::Brute,
    ];

    /// The name users type.
    pub fn name(self) -> &'static str {
        match self {
            #[cfg(feature = "embree")]
            Self::Embree => embree::NAME,
            #[cfg(feature = "obvhs")]
            Self::Obvhs => bvh::NAME,
            Self::Brute => brute::NAME,
        }
    }
}

/// What is done with a backend, whichever it is.
pub(super) trait BackendTask {
    type Output;

    /// `build_s` is how long building `accel` took.
    fn run<A: Accel>(self, accel: &A, build_s: f64) -> Self::Output;
}

impl Backend {
    /// Builds the acceleration structure of `scene` with as many threads as `pool` has, and gives it to `task`: the one place
    /// that chooses the backend.
    pub fn with<T: BackendTask>(self, scene: &Scene, pool: &rayon::ThreadPool, task: T) -> Result<T::Output, CliError> {
        let start = Instant::now();
        match self {
            #[cfg(feature = "embree")]
            Self::Embree => {
                let accel = embree::EmbreeAccel::new(scene, pool.current_num_threads())
                    .map_err(|e| CliError::Failed(e.to_string()))?;
                Ok(task.run(&accel, start.elapsed().as_secs_f64()))
            }
            #[cfg(feature = "obvhs")]
            Self::Obvhs => {
                let accel = pool.install(|| bvh::BvhAccel::new(scene));
                Ok(task.run(&accel, start.elapsed().as_secs_f64()))
            }
            Self::Brute => {
                let accel = pool.install(|| brute::BruteForce::new(scene));
                Ok(task.run(&accel, start.elapsed().as_secs_f64()))
            }
        }
    }
}

/// What `--version` prints.
pub(super) fn version_text() -> String {
    let mut text = format!("embrasure {}", env!("CARGO_PKG_VERSION"));
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
    text
}
