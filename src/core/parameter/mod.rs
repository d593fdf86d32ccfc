//! Machinery of parameters: reading, writing, checking and describing a value that a user can set.
//!
//! The macro `parameters!` (`table`) defines the parameters of a group once, for flags, scene
//! files, documentation and checks. [`Value`] is a type of parameters, [`Range`] the valid numbers
//! of a parameter, and [`Named`] a choice by name. The lists of parameters are beside their code,
//! most of them in `options`.

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
