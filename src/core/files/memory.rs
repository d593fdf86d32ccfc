//! Memory limits while files are read, and reports of the progress of reading.
//!
//! Meshes are moved from the reader into the scene. Memory is estimated before it is allocated.
//! Estimates are made one after the other: for the pixels of the render, the length of the file,
//! the counts of its statements (`Chunks::bytes`), the headers of its pictures, and the whole
//! render (`session`). Each estimate is compared with the memory limit: `--max-memory`, or else the
//! limit of the system. As a test, the estimated memory is also allocated and freed
//! (`memory_limit`). The crates obvhs, exr and image allocate without a check, and would abort the
//! program if memory ran out.

use super::FileError;
use super::memory_limit::{MemoryLimit, in_words};
use std::path::Path;

/// Observer of the progress of reading the files of a scene.
pub trait LoadObserver: Sync {
    /// Called when a part of the work begins, such as reading a file. `units` is the size of this
    /// part.
    fn begin(&self, what: &str, units: u64);

    /// Called when `units` more units are done. Any thread may call it.
    fn advance(&self, units: u64);
}

/// Discards all reports.
impl LoadObserver for () {
    fn begin(&self, _: &str, _: u64) {}

    fn advance(&self, _: u64) {}
}

/// Memory that readers of files may use.
#[derive(Clone, Copy, Debug, Default)]
pub struct Allowance {
    /// Maximum memory of the process. `None` if no limit is known.
    pub limit: Option<MemoryLimit>,
    /// Bytes in use for files that were read before.
    pub kept: u64,
}

impl Allowance {
    /// Allowance for a single file, with the memory limit of the system.
    pub fn of_system() -> Self {
        Self {
            limit: MemoryLimit::of(None),
            kept: 0,
        }
    }

    /// Returns an error if `bytes` more would exceed the limit. Call it before the allocation.
    pub fn check(&self, path: &Path, bytes: u64) -> Result<(), FileError> {
        self.check_reading(path, "this file", bytes)
    }

    /// [`Allowance::check`] with `what` as the name of the files in the error message.
    pub fn check_reading(&self, path: &Path, what: &str, bytes: u64) -> Result<(), FileError> {
        let total = self.kept.saturating_add(bytes);
        let Some(refusal) = MemoryLimit::refusal(self.limit, total, bytes) else {
            return Ok(());
        };
        let all = match self.kept {
            0 => String::new(),
            _ => format!(", together with the files before {}", in_words(total)),
        };
        let message = format!("reading {what} takes about {}{all}: {refusal}", in_words(bytes));
        let help = "allow more memory, scale pictures down, or leave parts of the scene out; objects with the same OBJ file share its memory";
        Err(FileError::new(path, message).help(help))
    }
}
