//! What reading files may take of memory, and who is told how far it is.

use super::FileError;
use std::path::Path;

/// Is told how far reading the files of a scene is.
pub trait LoadObserver: Sync {
    /// A part of the work begins, such as reading a file; it has so many units.
    fn begin(&self, what: &str, units: u64);

    /// So many more of its units are done; any thread may say so.
    fn advance(&self, units: u64);
}

/// Nobody is told.
impl LoadObserver for () {
    fn begin(&self, _: &str, _: u64) {}

    fn advance(&self, _: u64) {}
}

/// The memory that reading may take.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Allowance {
    /// Bytes at most; `None` where all there is may be taken.
    pub limit: Option<u64>,
    /// Bytes that what was read before keeps.
    pub kept: u64,
}

impl Allowance {
    /// Refuses `bytes` more where that is too much, before they are taken.
    pub fn check(&self, path: &Path, bytes: u64) -> Result<(), FileError> {
        match self.limit {
            Some(limit) if self.kept.saturating_add(bytes) > limit => Err(FileError::new(
                path,
                format!(
                    "reading this takes about {}, which makes {} with what was read before: more than the {} of --max-memory",
                    in_words(bytes),
                    in_words(self.kept.saturating_add(bytes)),
                    in_words(limit)
                ),
            )
            .help("allow more, or leave parts out; objects that name the same OBJ share its memory")),
            _ => Ok(()),
        }
    }
}

/// Bytes for people, such as `1.3 GB`.
pub fn in_words(bytes: u64) -> String {
    let bytes = bytes as f64;
    let units = [(1e9, "GB"), (1e6, "MB"), (1e3, "kB")];
    let unit = units.into_iter().find(|(size, _)| bytes >= *size);
    unit.map_or_else(
        || format!("{bytes} bytes"),
        |(size, unit)| format!("{:.1} {unit}", bytes / size),
    )
}
