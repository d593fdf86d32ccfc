//! The extension module `embrasure._native`: what the Python package `embrasure` stands on. The package has the names, types and documentation that users
//! see (`python/embrasure`); the classes here hold what numpy and Python have no types for.
//!
//! Renders, and reading of scenes, run on a thread of their own (`job`). The Python thread waits without the interpreter's lock, looks for signals, and
//! calls the progress callback.

mod bsdf;
mod compare;
mod errors;
mod film;
mod job;
mod rays;
mod render;
mod sampler;
mod scene;

use pyo3::prelude::*;

#[pymodule]
mod _native {
    #[pymodule_export]
    use crate::bsdf::Bsdf;
    #[pymodule_export]
    use crate::compare::compare;
    #[pymodule_export]
    use crate::errors::{Error, FileError, SettingError};
    #[pymodule_export]
    use crate::film::{Film, read};
    #[pymodule_export]
    use crate::rays::Rays;
    #[pymodule_export]
    use crate::render::Render;
    #[pymodule_export]
    use crate::sampler::points;
    #[pymodule_export]
    use crate::scene::{Description, Mesh};
    use pyo3::prelude::*;

    /// Version, backends with their versions, and where libraries were found, a line each.
    #[pyfunction]
    fn version_text() -> String {
        embrasure::version_text()
    }

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
