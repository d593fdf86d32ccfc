//! Notices that files change, by their times and lengths, which every file system has.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

/// Between two looks at the files.
const LOOK: Duration = Duration::from_millis(500);

/// What tells a file from itself before a change.
type Stamp = Option<(SystemTime, u64)>;

/// Files that are watched.
pub(super) struct Watch {
    files: Vec<(PathBuf, Stamp)>,
    looked: Instant,
    /// What was seen last, where files are changing: editors write in several steps.
    changing: Option<Vec<Stamp>>,
}

fn stamp(path: &Path) -> Stamp {
    let data = path.metadata().ok()?;
    Some((data.modified().ok()?, data.len()))
}

impl Watch {
    /// Watches `files` from now on.
    pub fn new(files: impl IntoIterator<Item = PathBuf>) -> Self {
        Self {
            files: files.into_iter().map(|file| (file.clone(), stamp(&file))).collect(),
            looked: Instant::now(),
            changing: None,
        }
    }

    /// Whether a file has changed since the last time, and rests since the last look.
    pub fn has_changed(&mut self) -> bool {
        if self.looked.elapsed() < LOOK {
            return false;
        }
        self.looked = Instant::now();
        self.look()
    }

    fn look(&mut self) -> bool {
        let now: Vec<Stamp> = self.files.iter().map(|(file, _)| stamp(file)).collect();
        if self.files.iter().zip(&now).all(|((_, before), now)| before == now) {
            self.changing = None;
            return false;
        }
        if self.changing.as_ref() != Some(&now) {
            self.changing = Some(now);
            return false;
        }
        self.accept();
        true
    }

    /// Takes the files as they are now.
    pub fn accept(&mut self) {
        for (file, known) in &mut self.files {
            *known = stamp(file);
        }
        self.changing = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn changes_are_noticed_once_files_rest() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.mtl");
        fs::write(&file, "a").unwrap();
        let mut watch = Watch::new([file.clone()]);
        assert!(!watch.look());
        fs::write(&file, "ab").unwrap();
        assert!(!watch.look(), "the file may still be written");
        assert!(watch.look());
        assert!(!watch.look());
        fs::remove_file(&file).unwrap();
        assert!(!watch.look());
        assert!(watch.look(), "a file that is gone has changed");
    }
}
