//! Detects changed files by their times, lengths and inodes.
//!
//! A file that changes while it is read may have been read before or after the change. Therefore
//! the stamp (time, length, inode) from before the reading is stored. A file that is read for the
//! first time has no stamp. It counts as changed if its time is later than the start of the
//! reading. After the viewer has written a file, the stamp of the written contents is stored, not
//! the current stamp.

use std::fs::Metadata;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

/// Time between two checks of the files.
const POLL_INTERVAL: Duration = Duration::from_millis(500);

/// Time, length and inode of a file. Files with equal stamps are treated as equal; `None` if there
/// is no file.
type Stamp = Option<(SystemTime, u64, u64)>;

fn stamp_of(data: &Metadata) -> Stamp {
    #[cfg(unix)]
    let inode = std::os::unix::fs::MetadataExt::ino(data);
    #[cfg(not(unix))]
    let inode = 0;
    Some((data.modified().ok()?, data.len(), inode))
}

fn stamp(path: &Path) -> Stamp {
    stamp_of(&path.metadata().ok()?)
}

/// Watched files.
pub(super) struct Watch {
    files: Vec<WatchedFile>,
    checked: Instant,
    /// Stamps of the last check, if a file had changed. An editor may write a file in several
    /// steps, so a change is reported only if the next check finds the same stamps.
    changing: Option<Vec<Stamp>>,
}

struct WatchedFile {
    path: PathBuf,
    /// Stamp of the loaded contents; `None` if this stamp is unknown.
    known: Option<Stamp>,
}

/// State of the files before they are read.
pub(super) struct FileStamps {
    since: SystemTime,
    before: Vec<(PathBuf, Stamp)>,
}

impl FileStamps {
    /// First reading of all files. It started after the time `since`.
    pub fn first(since: SystemTime) -> Self {
        let before = Vec::new();
        Self { since, before }
    }

    /// Stamp of `path` at the time of reading; `None` if the file may have changed since.
    fn stamp_of(&self, path: &Path) -> Option<Stamp> {
        if let Some((_, stamp)) = self.before.iter().find(|(known, _)| known == path) {
            return Some(*stamp);
        }
        let now = stamp(path);
        let is_new = now.is_some_and(|(modified, ..)| modified > self.since);
        (!is_new).then_some(now)
    }
}

impl Watch {
    /// A watch that has no files yet.
    pub fn new() -> Self {
        Self {
            files: Vec::new(),
            checked: Instant::now(),
            changing: None,
        }
    }

    /// Starts another reading of the files. If the reading fails, the old stamps stay valid.
    pub fn begin(&self) -> FileStamps {
        FileStamps {
            since: SystemTime::now(),
            before: self
                .files
                .iter()
                .map(|file| (file.path.clone(), stamp(&file.path)))
                .collect(),
        }
    }

    /// Watches `files`, which were read in `reading`.
    pub fn finish(&mut self, reading: &FileStamps, files: impl IntoIterator<Item = PathBuf>) {
        let watched = |path: PathBuf| WatchedFile {
            known: reading.stamp_of(&path),
            path,
        };
        self.files = files.into_iter().map(watched).collect();
        self.changing = None;
    }

    /// Stores that the viewer has written the file `path`. `data` is the metadata of the new file,
    /// read before the file got this name.
    pub fn wrote(&mut self, path: &Path, data: &Metadata) {
        for file in self.files.iter_mut().filter(|file| file.path == path) {
            file.known = Some(stamp_of(data));
        }
    }

    /// Returns true if a file has changed since it was read, and has not changed since the last
    /// check.
    pub fn has_changed(&mut self) -> bool {
        if self.checked.elapsed() < POLL_INTERVAL {
            return false;
        }
        self.checked = Instant::now();
        self.check_files()
    }

    fn check_files(&mut self) -> bool {
        let now: Vec<Stamp> = self.files.iter().map(|file| stamp(&file.path)).collect();
        let is_known = |(file, now): (&WatchedFile, &Stamp)| file.known == Some(*now);
        if self.files.iter().zip(&now).all(is_known) {
            self.changing = None;
            return false;
        }
        if self.changing.as_ref() != Some(&now) {
            self.changing = Some(now);
            return false;
        }
        // Also store the stamps of unreadable files, so that each error is reported once.
        for (file, now) in self.files.iter_mut().zip(now) {
            file.known = Some(now);
        }
        self.changing = None;
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;
    use std::fs::File;
    use tempfile::TempDir;

    /// A folder with the file `a.mtl`, and its watch.
    fn watched() -> (TempDir, PathBuf, Watch) {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.mtl");
        fs::write(&file, "a").unwrap();
        let mut watch = Watch::new();
        watch.finish(
            &FileStamps::first(SystemTime::now() + Duration::from_secs(60)),
            [file.clone()],
        );
        (folder, file, watch)
    }

    #[test]
    fn changes_are_noticed_once_files_rest() {
        let (_folder, file, mut watch) = watched();
        assert!(!watch.check_files());
        fs::write(&file, "ab").unwrap();
        assert!(!watch.check_files(), "the file may still be written");
        assert!(watch.check_files());
        assert!(!watch.check_files());
        fs::remove_file(&file).unwrap();
        assert!(!watch.check_files());
        assert!(watch.check_files(), "a file that is gone has changed");
    }

    #[test]
    fn file_changed_while_it_is_read_has_changed() {
        let (folder, file, mut watch) = watched();
        let reading = watch.begin();
        fs::write(&file, "abc").unwrap();
        let new = folder.path().join("new.png");
        fs::write(&new, "").unwrap();
        let after = SystemTime::now() + Duration::from_secs(60);
        File::open(&new).unwrap().set_modified(after).unwrap();
        watch.finish(&reading, [file, new]);
        assert!(watch.files.iter().all(|file| file.known != Some(stamp(&file.path))));
        assert!(!watch.check_files());
        assert!(watch.check_files());
        let reading = watch.begin();
        let files = watch.files.iter().map(|file| file.path.clone()).collect::<Vec<_>>();
        watch.finish(&reading, files);
        assert!(!watch.check_files(), "nothing has changed since");
    }

    /// An editor saves the scene file just after the viewer, and another file just before the
    /// viewer.
    #[test]
    fn files_of_editors_count_as_changed_after_a_save() {
        let (folder, mtl, mut watch) = watched();
        let scene = folder.path().join("s.toml");
        fs::write(&scene, "version = 1").unwrap();
        watch.finish(&watch.begin(), [mtl.clone(), scene.clone()]);
        let data = |path: &Path| fs::metadata(path).unwrap();
        watch.wrote(&scene, &data(&scene));
        assert!(!watch.check_files());

        fs::write(&mtl, "by an editor").unwrap();
        watch.wrote(&scene, &data(&scene));
        assert!(
            !watch.check_files() && watch.check_files(),
            "the other file has changed"
        );

        let written = data(&scene);
        fs::write(&scene, "version = 1 # by an editor").unwrap();
        watch.wrote(&scene, &written);
        assert!(
            !watch.check_files() && watch.check_files(),
            "the editor's file is another one"
        );
    }
}
