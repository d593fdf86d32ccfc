//! Memory limits while files are read, and progress of reading.
//!
//! Meshes are moved from the reader into the scene. The memory that a file will take is known before it is allocated: from its length, then from the
//! counts of its statements (`Chunks::bytes`), the headers of its pictures, and the estimate of the render (`session`); the pixels are checked
//! before all of these. Each is compared with `--max-memory`, or with what the system leaves, and is asked of the allocator and given back
//! (`memory_limit`). obvhs and the exr and image crates allocate without asking, and would end the program where there is no memory left.

use super::FileError;
use super::memory_limit::{MemoryLimit, in_words};
use std::path::Path;

/// Is told how far reading the files of a scene is.
pub trait LoadObserver: Sync {
    /// A part of the work begins, such as reading a file; it has so many units.
    fn begin(&self, what: &str, units: u64);

    /// So many more of its units are done; any thread may say so.
    fn advance(&self, units: u64);
}

/// Discards all reports.
impl LoadObserver for () {
    fn begin(&self, _: &str, _: u64) {}

    fn advance(&self, _: u64) {}
}

/// The memory that reading may take.
#[derive(Clone, Copy, Debug, Default)]
pub struct Allowance {
    /// Maximum of memory; `None`: all memory of the machine.
    pub limit: Option<MemoryLimit>,
    /// Bytes that what was read before keeps.
    pub kept: u64,
}

impl Allowance {
    /// Allowance for a file that is read by itself: what the system leaves.
    pub fn of_system() -> Self {
        Self {
            limit: MemoryLimit::of(None),
            kept: 0,
        }
    }

    /// Refuses `bytes` more where that is too much, before they are taken.
    pub fn check(&self, path: &Path, bytes: u64) -> Result<(), FileError> {
        let total = self.kept.saturating_add(bytes);
        let Some(refusal) = MemoryLimit::refusal(self.limit, total, bytes) else {
            return Ok(());
        };
        let all = match self.kept {
            0 => String::new(),
            _ => format!(", which makes {} with what was read before", in_words(total)),
        };
        let message = format!("reading this takes about {}{all}: {refusal}", in_words(bytes));
        let help =
            "allow more, scale pictures down, or leave parts out; objects that name the same OBJ share its memory";
        Err(FileError::new(path, message).help(help))
    }
}
