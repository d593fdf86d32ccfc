//! Temporary files and locks beside outputs.
//!
//! A temporary file carries a hash of its output's name and is locked (`flock`) while it is open. The next run that writes the same output removes
//! those that no process has locked: killed runs left them.
//!
//! A checkpoint has a lock file beside it for as long as a run may write it. Its owner removes it; a lock file that a kill leaves is not locked, and
//! the next run takes it over. The checkpoint itself cannot hold the lock, because each write replaces it.

use super::FileError;
use super::identity::folder_of;
use sha2::{Digest, Sha256};
use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// Attempts to make a file that another run removes before it is locked.
const MAX_TRIES: usize = 100;
/// Ends the names of temporary files.
const SUFFIX: &str = ".tmp";

/// Begins the names of all files that belong to the output `target`: short, whatever its own name.
fn prefix(target: &Path) -> String {
    let name = target.file_name().unwrap_or_default();
    let digest = Sha256::digest(name.as_encoded_bytes());
    let digits: String = digest.iter().take(8).map(|byte| format!("{byte:02x}")).collect();
    format!(".embrasure-{digits}-")
}

/// A new file in the folder of `target`, which vanishes unless it is persisted. It is locked while it is open: other runs see that it is in use.
pub(super) fn temporary(target: &Path) -> io::Result<NamedTempFile> {
    let prefix = prefix(target);
    let mut builder = tempfile::Builder::new();
    builder.prefix(&prefix).suffix(SUFFIX);
    // Temporary files are private by default; this one becomes the user's picture, under the user's umask.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    for _ in 0..MAX_TRIES {
        let file = builder.tempfile_in(folder_of(target))?;
        // Another run may have come before the lock, and removed the file.
        match try_lock(file.as_file())? {
            Lock::Taken if is_at(file.as_file(), file.path()) => return Ok(file),
            Lock::Unknown => return Ok(file),
            Lock::Taken | Lock::Refused => {}
        }
    }
    Err(io::Error::other("another program removes temporary files"))
}

/// Removes temporary files of `target` that killed runs have left: those which no process has locked. What cannot be removed stays.
pub(super) fn sweep(target: &Path) {
    let prefix = prefix(target);
    let entries = fs::read_dir(folder_of(target)).into_iter().flatten().flatten();
    for entry in entries {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        let is_own = name.starts_with(&prefix) && name.ends_with(SUFFIX);
        if is_own && File::open(entry.path()).is_ok_and(|file| matches!(try_lock(&file), Ok(Lock::Taken))) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// Keeps other runs from writing an output, for as long as this lives. The system ends it with the process, however that ends.
#[derive(Debug)]
pub struct OutputLock {
    /// `None` where the file system has no locks.
    held: Option<(File, PathBuf)>,
}

impl OutputLock {
    /// Locks the output `target`, which the user calls `path`.
    pub(super) fn take(path: &Path, target: &Path) -> Result<Self, FileError> {
        let lock = folder_of(target).join(prefix(target) + "lock");
        let failed = |error: io::Error| FileError::system(path, "cannot lock this file", &error);
        for _ in 0..MAX_TRIES {
            let mut options = File::options();
            let mut file = options
                .read(true)
                .write(true)
                .create(true)
                .truncate(false)
                .open(&lock)
                .map_err(failed)?;
            match try_lock(&file).map_err(failed)? {
                Lock::Unknown => return Ok(Self { held: None }),
                Lock::Refused => {
                    let mut owner = String::new();
                    let _ = file.read_to_string(&mut owner);
                    let message = format!("process {} is writing this file", owner.trim());
                    return Err(FileError::new(path, message).help("wait until it ends, or give another name"));
                }
                // The run before may have removed the file before it let it go.
                Lock::Taken if !is_at(&file, &lock) => {}
                Lock::Taken => {
                    // For the words of others; the lock holds without them.
                    let _ = file.set_len(0).and_then(|()| writeln!(file, "{}", std::process::id()));
                    return Ok(Self {
                        held: Some((file, lock)),
                    });
                }
            }
        }
        Err(failed(io::Error::other("another program removes its lock")))
    }
}

impl Drop for OutputLock {
    fn drop(&mut self) {
        if let Some((file, path)) = &self.held {
            // While it is locked, so that no other process's file is removed.
            if is_at(file, path) {
                let _ = fs::remove_file(path);
            }
        }
    }
}

/// What became of a lock that was asked for.
enum Lock {
    Taken,
    /// Another process has it.
    Refused,
    /// The system has no locks there.
    Unknown,
}

#[cfg(unix)]
fn try_lock(file: &File) -> io::Result<Lock> {
    use rustix::fs::{FlockOperation, flock};
    use rustix::io::Errno;
    loop {
        return match flock(file, FlockOperation::NonBlockingLockExclusive) {
            Ok(()) => Ok(Lock::Taken),
            Err(Errno::WOULDBLOCK) => Ok(Lock::Refused),
            Err(Errno::INTR) => continue,
            Err(Errno::NOTSUP | Errno::NOSYS | Errno::NOLCK | Errno::INVAL) => Ok(Lock::Unknown),
            Err(error) => Err(error.into()),
        };
    }
}

#[cfg(not(unix))]
fn try_lock(_: &File) -> io::Result<Lock> {
    Ok(Lock::Unknown)
}

/// Whether `file` is still called `path`.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let inode = |data: fs::Metadata| (data.dev(), data.ino());
    match (file.metadata(), fs::symlink_metadata(path)) {
        (Ok(open), Ok(named)) => inode(open) == inode(named),
        _ => false,
    }
}

#[cfg(not(unix))]
fn is_at(_: &File, path: &Path) -> bool {
    path.exists()
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    fn names(folder: &Path) -> usize {
        fs::read_dir(folder).unwrap().count()
    }

    #[test]
    fn only_files_of_ended_runs_are_swept() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("x.exr");
        let alive = temporary(&target).unwrap();
        // Kept without its lock, as a kill leaves it.
        let (file, left) = temporary(&target).unwrap().keep().unwrap();
        drop(file);
        let other = temporary(&folder.path().join("y.exr")).unwrap();
        fs::write(folder.path().join(".embrasure-notes.tmp"), "").unwrap();
        sweep(&target);
        assert!(alive.path().exists() && other.path().exists() && !left.exists());
        assert_eq!(names(folder.path()), 3);
    }

    #[test]
    fn an_output_has_one_writer() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("c.exr");
        let take = || OutputLock::take(&target, &target);
        let first = take().unwrap();
        let error = take().unwrap_err();
        assert!(error.message.contains(&std::process::id().to_string()), "{error}");
        assert!(error.help.is_some());
        drop(first);
        assert_eq!(names(folder.path()), 0);
        // What a killed run leaves is no lock.
        fs::write(folder.path().join(prefix(&target) + "lock"), "1\n").unwrap();
        drop(take().unwrap());
        assert_eq!(names(folder.path()), 0);
    }
}
