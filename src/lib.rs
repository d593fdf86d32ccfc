//! Embrasure: a production-style path tracer over Intel Embree 4.
//!
//! A scene is loaded, an acceleration structure is built, samples are taken for as long as an observer likes, and pictures are written:
//!
//! ```
//! use embrasure::prelude::*;
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! # let folder = tempfile::tempdir()?;
//! # let path = &folder.path().join("box.exr");
//! let file = SceneFile::load("scenes/cornell-box.toml")?;
//! let mut settings = Settings::of(&file);
//! settings.spp = 16;
//! # settings.spp = 1;
//! # settings.resolution = UVec2::splat(16);
//!
//! let session = Session::load(&file, settings, &())?;
//! let renderer = session.renderer()?;
//! let mut state = renderer.start();
//! renderer.render(&mut state, &());
//!
//! let (image, metadata) = (renderer.develop(&state), renderer.metadata(&state, true));
//! Output::prepare(path)?.write_image(&Format::Exr(ExrFormat::default()), &image, None, &metadata)?;
//! # image.save_png(path.with_extension("png"), &session.settings().tone)?;
//! # Ok(())
//! # }
//! ```
//!
//! `examples/until_clean.rs` watches a render and stops it, `examples/made_in_code.rs` has a scene that is in no file, and `examples/own_integrator.rs` an
//! integrator of its own.
//!
//! # What may change
//!
//! The types of [`prelude`], and the others that this page re-exports by name, follow semantic versioning: before 1.0 they change with the minor version
//! alone, with a line in the CHANGELOG, and so do file formats, flags, and the bits of a picture of given settings. [`Settings`], [`Error`] and the enums
//! that will grow, such as those of integrators, backends, samplers and channels, are `#[non_exhaustive]`: a program takes [`Settings::of`] a file, or the
//! default, and assigns fields. docs/public-api.txt lists this interface, and `make lint` compares it with the sources. All else that is public in the
//! modules is there for integrators of one's own, for tests and for readers of the code, and may change with any version.
//!
//! # Modules
//!
//! From the ground up; a module imports only modules above it in this list. docs/architecture.md says more of each.
//!
//! - [`math`], [`color`], [`sampling`], [`sampler`]: numbers, colours, warps and random numbers
//! - [`parameter`]: how a value that a user can set is read, written, checked and described
//! - [`geometry`], [`texture`], [`bsdf`], [`material`], [`light`], [`camera`], [`film`]: what a picture is made of
//! - [`scene`], [`denoise`], [`compare`]: the frozen scene, denoisers, and errors of a picture
//! - [`accel`]: ray queries over the scene
//! - [`integrator`], [`guess`]: light transport of one pixel sample, or of one iteration; what is guessed of a scene that does not say it
//! - [`options`]: everything that a user can set
//! - [`render`], [`io`]: passes and tiles, and formats of files
//! - [`method`], [`lint`]: a method over a backend; checks of a scene
//! - [`description`]: scene files, and the scenes made of them
//! - [`session`]: a render from scene file to picture
//! - `view`: a render in a browser, with the feature of that name
//! - `cli`: the command line, with the feature of that name

// Parts that the commands alone use.
#![cfg_attr(not(feature = "cli"), allow(dead_code, unused_imports))]

#[cfg(feature = "cli")]
pub mod cli;
pub mod description;
pub mod session;
#[cfg(feature = "view")]
mod view;

/// What most programs need: `use embrasure::prelude::*;`.
pub mod prelude {
    pub use crate::camera::CameraParameters;
    pub use crate::color::{Spectrum, Tone};
    pub use crate::film::Film;
    pub use crate::geometry::Mesh;
    pub use crate::material::{Gloss, Material};
    pub use crate::math::{UVec2, Vec2, Vec3};
    pub use crate::scene::SceneBuilder;
    pub use crate::{
        ExrFormat, Format, Image, IntegratorKind, Observer, Outcome, Output, RenderState, Renderer, SceneFile, Session,
        Settings,
    };
}

pub use embrasure_core::{
    accel, bsdf, camera, color, compare, denoise, files, film, geometry, guess, integrator, io, light, light_paths,
    lint, material, math, method, options, parameter, render, sampler, sampling, scene, texture,
};

pub use description::SceneFile;
pub use files::{FileError, FileId, LoadObserver, Output, OutputLock};
pub use film::{Aov, Image, Rect};
pub use io::{Checkpoint, Compression, ExrFormat, Format, LoadOptions, Metadata, read_checkpoint};
pub use light_paths::PathPart;
pub use options::{Backend, IntegratorKind, IntegratorOptions, MaxDepth, PathReuse};
pub use render::{Observer, Outcome, Statistics};
pub use session::{
    BUILD, CameraSettings, Error, InvalidSetting, Joined, MAX_SAMPLES_FOR_NOISE, Parts, RenderState, Renderer, Session,
    Settings, version_text,
};
