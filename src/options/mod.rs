//! Everything that a user can set, each defined once: key, type, default, range and help of a parameter are an entry of the macro `parameters!`
//! (`parameter`), from which the scene file, the command line, the documentation and the checks are made.
//!
//! To add a parameter of an integrator: an entry in [`integrator`], its name in the list of each method that reads it in [`method`], and the line
//! that uses it. To add another one: an entry in [`picture`], or beside the code that it belongs to.

pub mod integrator;
pub mod method;
pub mod names;
mod parameter;
pub mod picture;
mod range;
#[cfg(test)]
mod tests;
mod value;

pub use integrator::{IntegratorOptions, MaxDepth, PathReuse};
pub use method::*;
pub use names::Named;
pub use parameter::{Input, InvalidOption, OptionGroup, Parameter};
pub use picture::{Backend, Denoising, FilterOptions, SamplingOptions, SizeOptions, ToneOptions};
pub use range::Range;
pub use value::Value;

pub(crate) use names::{name_of, nearest};
pub(crate) use parameter::{check, parameters, read};
