//! Machinery of parameters: how a value that a user can set is read, written, checked and
//! described.
//!
//! The macro `parameters!` (`table`) defines the parameters of a group once, for flags, scene
//! files, documentation and checks. [`Value`] is a type of parameters, [`Range`] the numbers that
//! one may have, and [`Named`] a choice by name. The lists of parameters stand beside the code that
//! they belong to, most of them in `options`.

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
