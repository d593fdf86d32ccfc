//! All options that a user can set. Each option is defined once, by an entry of the macro
//! `parameters!` (`parameter`) with its key, type, default, range and help. Keys of the scene file,
//! flags, documentation and checks are generated from this entry.
//!
//! A new parameter of an integrator needs three changes: an entry in [`integrator_parameters`], the
//! line that uses it, and its name in the lists of [`integrators`], for each integrator that reads
//! it. Other parameters need an entry in [`picture_parameters`], or in the module of the code that
//! uses them.

mod background;
mod calibration;
mod camera;
mod finish;
pub mod integrator_parameters;
pub mod integrators;
mod lines;
mod names;
pub mod picture_parameters;
mod print;
pub mod quality;
#[cfg(test)]
mod tests;
mod view_size;

pub use crate::parameter::{
    Entry, EntryKind, Input, InvalidOption, Named, OptionGroup, Parameter, Range, Value, join_names, name_of, named,
    nearest,
};
pub use background::{BACKGROUND, BackgroundOptions, backing_of};
pub use calibration::{DistortionCoefficients, PoseConvention, PoseMatrix};
pub use camera::{CameraOptions, Shutter};
pub use finish::Finish;
pub use integrator_parameters::{Clamp, IntegratorOptions, MaxDepth, PathReuse};
pub use integrators::*;
pub use lines::{DrawnLines, LineColor, LineOptions};
pub use picture_parameters::{Backend, Denoising, FilterOptions, SamplingOptions, SizeOptions, ToneOptions};
pub use print::{DrawingScale, Print, PrintOptions};
pub use quality::{Quality, QualityOptions};
pub use view_size::{view_size_of, view_size_text};
