//! Files of the operating system: their identity, locks, temporary files and errors, and limits of
//! memory while they are read.

mod error;
pub mod find_file;
mod guard;
mod identity;
pub mod input;
pub mod memory;
mod memory_limit;
mod output;
mod temporary;

pub use error::{FileError, FileErrorKind, Position};
pub use guard::{guarded, is_guarded};
pub use identity::FileId;
pub use input::read_text;
pub use memory::LoadObserver;
pub use memory_limit::{LimitSource, MemoryLimit, in_words};
pub use output::{Output, create_folder};
pub use temporary::OutputLock;
