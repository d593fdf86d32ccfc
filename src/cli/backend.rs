use super::error::CliError;
use super::job::find_backend;
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

/// The backend to check `backend` against: the one that is named, else another one that is built in.
pub(super) fn other_backend(backend: Backend, name: Option<&str>) -> Result<Backend, CliError> {
    let other = match name {
        Some(name) => Some(find_backend(name, "--against")?),
        None => Backend::ALL.iter().copied().find(|b| *b != backend),
    };
    other.filter(|other| *other != backend).ok_or_else(|| {
        let message = format!("there is nothing to check the backend {} against", backend.name());
        CliError::Usage(format!(
            "{message}\n  help: name another one (see --version), or build with one more"
        ))
    })
}

/// What is done with two backends.
pub(super) trait PairTask {
    type Output;

    /// `build_s` is how long building the first one took.
    fn run(self, accels: [&dyn Accel; 2], build_s: f64) -> Self::Output;
}

/// Builds both backends, and gives them to `task`.
pub(super) fn both<T: PairTask>(
    first: Backend,
    second: Backend,
    scene: &Scene,
    pool: &rayon::ThreadPool,
    task: T,
) -> Result<T::Output, CliError> {
    struct First<'a, T> {
        second: Backend,
        scene: &'a Scene,
        pool: &'a rayon::ThreadPool,
        task: T,
    }
    struct Second<'a, T> {
        first: &'a dyn Accel,
        build_s: f64,
        task: T,
    }
    impl<T: PairTask> BackendTask for First<'_, T> {
        type Output = Result<T::Output, CliError>;
        fn run<A: Accel>(self, accel: &A, build_s: f64) -> Self::Output {
            let (first, task) = (accel as &dyn Accel, self.task);
            self.second.with(self.scene, self.pool, Second { first, build_s, task })
        }
    }
    impl<T: PairTask> BackendTask for Second<'_, T> {
        type Output = T::Output;
        fn run<A: Accel>(self, accel: &A, _build_s: f64) -> T::Output {
            self.task.run([self.first, accel], self.build_s)
        }
    }
    let task = First {
        second,
        scene,
        pool,
        task,
    };
    first.with(scene, pool, task)?
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
