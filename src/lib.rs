//! Embrasure: a production-style path tracer over Intel Embree 4.
//!
//! A program loads a scene, builds an acceleration structure, takes samples until an observer stops
//! it, and writes pictures:
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
//! let format = Format::Exr(ExrFormat::default());
//! Output::prepare(path)?.write_image(&format, &image, None, &metadata)?;
//! # image.save_png(path.with_extension("png"), &session.settings().tone)?;
//! # Ok(())
//! # }
//! ```
//!
//! Examples: `examples/until_clean.rs` observes a render and stops it, `examples/made_in_code.rs`
//! makes a scene in code, and `examples/own_integrator.rs` renders with a custom integrator.
//!
//! # Stability
//!
//! The types of [`prelude`], and the other types that this page re-exports by name, follow semantic
//! versioning. Before version 1.0, they change only with the minor version, and each change has a
//! line in the CHANGELOG. The same rule applies to file formats, to flags, and to the bits of a
//! picture for given settings. [`Settings`], [`Error`] and the enums that will grow, such as
//! integrators, backends, samplers and channels, are `#[non_exhaustive]`: a program starts with
//! [`Settings::of`] a file, or with the default, and assigns fields. docs/public-api.txt lists this
//! stable interface, and `make lint` compares the list with the sources. Other public items of the
//! modules may change with any version. They are for custom integrators, for tests and for readers
//! of the code.
//!
//! # Modules
//!
//! Modules are listed from the lowest layer to the highest. A module imports only modules that are
//! above it in this list. docs/architecture.md describes each module.
//!
//! - [`math`], [`color`], [`sampling`], [`sampler`]: numbers, colours, warps and random numbers
//! - [`parameter`]: reading, writing, checks and descriptions of values that a user can set
//! - [`geometry`], [`texture`], [`bsdf`], [`material`], [`light`], [`camera`], [`film`]: components
//!   of a picture
//! - [`scene`], [`denoise`], [`compare`]: the immutable scene, denoisers, and errors of a picture
//! - [`accel`]: ray queries over the scene
//! - [`integrator`], [`guess`]: light transport of one pixel sample, or of one iteration; guesses
//!   for missing settings of a scene
//! - [`options`]: all settable options
//! - [`render`], [`io`]: passes and tiles, and file formats
//! - [`pipeline`], [`lint`]: an integrator with a backend; checks of a scene
//! - [`scene_file`]: scene files, and scenes built from them
//! - [`session`]: a render from scene file to picture
//! - `view`: a render in a browser, with the feature of that name
//! - `cli`: the command line, with the feature of that name

// Items that only the commands use.
#![cfg_attr(not(feature = "cli"), allow(dead_code, unused_imports))]

#[cfg(feature = "cli")]
pub mod cli;
pub mod scene_file;
pub mod session;
#[cfg(feature = "view")]
mod view;

/// Items that most programs need: `use embrasure::prelude::*;`.
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
    light_sampling, lint, material, math, options, parameter, pipeline, render, sampler, sampling, scene, texture,
};

pub use files::{FileError, FileId, LoadObserver, Output, OutputLock};
pub use film::{Aov, Image, Rect};
pub use io::{Checkpoint, Compression, ExrFormat, Format, LoadOptions, Metadata, read_checkpoint};
pub use light_paths::PathPart;
pub use options::{Backend, IntegratorKind, IntegratorOptions, MaxDepth, PathReuse};
pub use render::{Observer, Outcome, Statistics};
pub use scene_file::SceneFile;
pub use session::{
    BUILD, CameraSettings, Error, InvalidSetting, JoinedPicture, MAX_SAMPLES_FOR_NOISE, PictureParts, RenderState,
    Renderer, Session, Settings, version_text,
};
