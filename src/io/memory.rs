//! Memory limits while files are read, and progress of reading.
//!
//! Meshes are moved from the reader into the scene. The memory that a file will take is known before it is allocated: from its length, then from the
//! counts of its statements (`Pieces::bytes`), the headers of its pictures, and the forecast of the render (`session`); the pixels are forecast
//! before all of these. Each is compared with `--max-memory`, or with what the system leaves (`machine`), and is asked of the allocator and given
//! back (`MemoryLimit::refusal`). obvhs and the exr and image crates allocate without asking, and would end the program where there is no memory
//! left.

use super::{FileError, machine};
use std::fmt;
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

/// How much memory this process may have in all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemoryLimit {
    /// Bytes.
    pub bytes: u64,
    /// Who says so.
    pub source: LimitSource,
}

/// Who limits memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LimitSource {
    /// `--max-memory`.
    Flag,
    /// The machine: what is available.
    Machine,
    /// A control group, such as that of a container or a job.
    ControlGroup,
}

impl MemoryLimit {
    /// `max_memory` where that is given, else what the system leaves; `None` where nothing is known.
    pub fn of(max_memory: Option<u64>) -> Option<Self> {
        let source = LimitSource::Flag;
        max_memory.map(|bytes| Self { bytes, source }).or_else(machine::limit)
    }

    /// Says why there is no memory for `more` bytes, which make `total` with what the process has then; `None` where there is. What the system
    /// refuses beyond any limit that it tells, such as that of `ulimit -v`, is found by asking for it.
    pub fn refusal(limit: Option<Self>, total: u64, more: u64) -> Option<String> {
        match limit {
            Some(limit) if total > limit.bytes => Some(format!("more than {limit}")),
            _ if !can_be_had(more) => Some("more than the system gives this process (ulimit -v)".into()),
            _ => None,
        }
    }
}

impl fmt::Display for MemoryLimit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let bytes = in_words(self.bytes);
        match self.source {
            LimitSource::Flag => write!(f, "the {bytes} of --max-memory"),
            LimitSource::Machine => write!(f, "the {bytes} that are available (--max-memory sets another limit)"),
            LimitSource::ControlGroup => {
                write!(
                    f,
                    "the {bytes} that the control group allows (--max-memory sets another limit)"
                )
            }
        }
    }
}

/// Whether the allocator gives so many bytes at once. They are given back untouched, which costs nothing.
fn can_be_had(bytes: u64) -> bool {
    let mut probe: Vec<u8> = Vec::new();
    let had = usize::try_from(bytes).is_ok_and(|bytes| probe.try_reserve_exact(bytes).is_ok());
    // An allocation that nobody sees might be left out.
    std::hint::black_box(&probe);
    had
}

/// The memory that reading may take.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Allowance {
    /// At most; `None` where all there is may be taken.
    pub limit: Option<MemoryLimit>,
    /// Bytes that what was read before keeps.
    pub kept: u64,
}

impl Allowance {
    /// For a file that is read by itself: what the system leaves.
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
