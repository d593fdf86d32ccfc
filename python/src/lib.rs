//! The extension module `embrasure._native`, which the Python package `embrasure` uses. The package
//! (`python/embrasure`) has the names, types and documentation for users. The classes of this
//! module hold data for which neither Python nor numpy has a type.
//!
//! Renders run in a separate thread, and scenes are read in a separate thread (`job`). The Python
//! thread waits without the interpreter's lock, checks for signals, and calls the progress
//! callback.

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

    /// Text with the version, the backends with their versions, and the paths of libraries. Each is
    /// on a separate line.
    #[pyfunction]
    fn version_text() -> String {
        embrasure::version_text()
    }

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
