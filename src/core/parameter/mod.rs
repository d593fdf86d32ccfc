//! Parameters are values that a user can set. This module reads, writes, checks and describes them.
//!
//! The macro `parameters!` (`table`) defines the parameters of a group once, for flags, scene
//! files, documentation and checks. [`Value`] is a trait for the types of parameters, [`Range`] has
//! the valid numbers of a parameter, and [`Named`] is a trait for types whose values have names.
//! The lists of parameters are beside the code that uses them, most of them in `options`.

mod entry;
mod names;
mod range;
mod table;
mod value;

pub use entry::{Entry, EntryKind, Input, InvalidOption};
pub use names::{Named, join_names, name_of, named, nearest};
pub use range::Range;
pub use table::{OptionGroup, Parameter};
pub(crate) use table::{bounded, check, parameters, read};
pub use value::{Value, numbers};
