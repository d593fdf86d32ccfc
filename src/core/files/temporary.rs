//! Temporary files and locks beside outputs.
//!
//! The name of a temporary file contains a hash of the output's name. The file is locked (`flock`)
//! while it is open. Temporary files without a lock are left over from killed runs. The next run
//! that writes the same output removes them.
//!
//! A checkpoint has a lock file beside it while a run may write the checkpoint. At its end, the run
//! removes the lock file. A lock file that a killed run left is not locked, and the next run uses
//! the same file. The checkpoint itself cannot be locked, because each write replaces it by another
//! file. While the lock file is locked, no other output replaces the checkpoint.
//!
//! The names of temporary files and lock files can be guessed, so another user may create a file
//! with such a name first. Pipes, links and devices are therefore not opened. A file with a second
//! name (a hard link) is never written.

use super::FileError;
use super::identity::folder_of;
use sha2::{Digest, Sha256};
use std::fs::{self, File, Metadata, OpenOptions};
use std::io::{self, Read, Write};
#[cfg(unix)]
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;
use tempfile::NamedTempFile;

/// Time between two attempts to take a lock, and maximum number of attempts. Several attempts are
/// made, because a process that saves a scene file locks the file for a moment.
const LOCK_PAUSE: Duration = Duration::from_millis(20);
const LOCK_ATTEMPTS: usize = 50;
/// Maximum number of digits of a process id.
const MAX_DIGITS: u64 = 10;
/// Error code of the system if a path is opened without following links, and the path is a link.
#[cfg(unix)]
const LINK_REFUSED: i32 = rustix::io::Errno::LOOP.raw_os_error();
#[cfg(not(unix))]
const LINK_REFUSED: i32 = i32::MIN;
/// Maximum number of attempts to create and lock a file, because another run may remove the file
/// before it is locked.
const MAX_TRIES: usize = 100;
/// Suffix of the names of temporary files.
const SUFFIX: &str = ".tmp";

/// Prefix of the names of all files that belong to the output `target`. The length of the prefix
/// does not depend on the name of the output.
fn prefix(target: &Path) -> String {
    let name = target.file_name().unwrap_or_default();
    let digest = Sha256::digest(name.as_encoded_bytes());
    let digits: String = digest.iter().take(8).map(|byte| format!("{byte:02x}")).collect();
    format!(".embrasure-{digits}-")
}

/// Creates a temporary file in the folder of `target`. The file is removed when the result is
/// dropped, unless it was kept. It is locked while it is open, so that other runs do not remove it.
/// It gets the owner, the group and the permissions of the file at `target`. If there is no such
/// file, it gets them as any new file does.
pub(super) fn temporary(target: &Path) -> io::Result<NamedTempFile> {
    let replaced = fs::symlink_metadata(target).ok().filter(Metadata::is_file);
    let prefix = prefix(target);
    let mut builder = tempfile::Builder::new();
    builder.prefix(&prefix).suffix(SUFFIX);
    // A new file gets the permissions of the user's umask. A file that will replace another file is
    // private until its permissions are set.
    #[cfg(unix)]
    builder.permissions(PermissionsExt::from_mode(if replaced.is_some() {
        0o600
    } else {
        0o666
    }));
    for _ in 0..MAX_TRIES {
        let file = builder.tempfile_in(folder_of(target))?;
        // Another run may have removed the file before it was locked.
        match try_lock(file.as_file())? {
            Lock::Taken if !is_at(file.as_file(), file.path()) => continue,
            Lock::Refused => continue,
            Lock::Taken | Lock::Unknown => {}
        }
        if let Some(replaced) = &replaced {
            take_permissions(file.as_file(), replaced);
        }
        return Ok(file);
    }
    Err(io::Error::other("another program removes temporary files"))
}

/// Gives `file` the owner, the group and the permissions of the file `replaced`, as far as the
/// system permits. If the group cannot be kept, the new group gets only the permissions that all
/// users have.
#[cfg(unix)]
fn take_permissions(file: &File, replaced: &Metadata) {
    use std::os::unix::fs::fchown;
    let Ok(own) = file.metadata() else { return };
    let mut mode = replaced.mode() & 0o777;
    if own.gid() != replaced.gid() && fchown(file, None, Some(replaced.gid())).is_err() {
        mode = (mode & !0o070) | ((mode & 0o007) << 3);
    }
    if own.uid() != replaced.uid() {
        let _ = fchown(file, Some(replaced.uid()), None);
    }
    // If permissions cannot be set, the file stays private.
    let _ = file.set_permissions(PermissionsExt::from_mode(mode));
}

#[cfg(not(unix))]
fn take_permissions(_: &File, _: &Metadata) {}

/// Opens a temporary file or a lock file of the program. Other users can guess its name and replace
/// the file, so the call never waits and follows no link.
fn open_own(options: &mut OpenOptions, path: &Path) -> io::Result<File> {
    #[cfg(unix)]
    {
        use rustix::fs::OFlags;
        let flags = OFlags::NOFOLLOW | OFlags::NONBLOCK | OFlags::NOCTTY;
        std::os::unix::fs::OpenOptionsExt::custom_flags(options, flags.bits() as i32);
    }
    let not_regular = || io::Error::other("not a regular file");
    let file = options.open(path).map_err(|error| match error.raw_os_error() {
        // The system's message for a refused link does not mention the link.
        Some(code) if code == LINK_REFUSED => not_regular(),
        _ => error,
    })?;
    if file.metadata()?.is_file() {
        Ok(file)
    } else {
        Err(not_regular())
    }
}

/// Removes temporary files of `target` that no process has locked. Killed runs have left these
/// files. Errors are ignored.
pub(super) fn sweep(target: &Path) {
    let prefix = prefix(target);
    let entries = fs::read_dir(folder_of(target)).into_iter().flatten().flatten();
    for entry in entries {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        let is_own = name.starts_with(&prefix) && name.ends_with(SUFFIX);
        let open = || open_own(OpenOptions::new().read(true), &entry.path());
        if is_own && open().is_ok_and(|file| matches!(try_lock(&file), Ok(Lock::Taken))) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// Lock of an output: other runs cannot write the output until the lock is dropped. The system
/// releases the lock when the process ends.
#[derive(Debug)]
pub struct OutputLock {
    /// The locked file and its path. `None` if the file system has no locks.
    held: Option<(File, PathBuf)>,
    /// True while the lock is held.
    is_held: Arc<AtomicBool>,
}

/// Path of the lock file that belongs to the output `target`.
fn lock_path(target: &Path) -> PathBuf {
    folder_of(target).join(prefix(target) + "lock")
}

/// Error that another process is writing the output `path`. The file `lock` holds the id of that
/// process.
fn in_use(path: &Path, lock: &File) -> FileError {
    let mut owner = String::new();
    let _ = lock.take(MAX_DIGITS).read_to_string(&mut owner);
    let owner = match owner.trim().parse::<u32>() {
        Ok(id) => format!("process {id}"),
        Err(_) => "another process".into(),
    };
    let error = FileError::new(path, format!("{owner} is writing this file"));
    error.help("wait until that process ends, or give another name")
}

/// Checks that no run has locked the output `target`, which the user calls `path`.
pub(super) fn check_unlocked(path: &Path, target: &Path) -> Result<(), FileError> {
    let lock = lock_path(target);
    for attempt in 1..=LOCK_ATTEMPTS {
        let file = match open_own(OpenOptions::new().read(true), &lock) {
            Ok(file) => file,
            Err(error) if error.kind() == io::ErrorKind::PermissionDenied => {
                let what = format!(
                    "cannot tell whether another process writes this file, from the lock {}",
                    lock.display()
                );
                let error = FileError::system(path, &what, &error);
                return Err(error.help("remove the lock if no process writes the file, or give another name"));
            }
            Err(_) => return Ok(()),
        };
        match try_shared_lock(&file) {
            Ok(Lock::Refused) if attempt == LOCK_ATTEMPTS => return Err(in_use(path, &file)),
            Ok(Lock::Refused) => thread::sleep(LOCK_PAUSE),
            _ => break,
        }
    }
    Ok(())
}

impl OutputLock {
    /// Locks the output `target`, which the user calls `path`. `is_held` is true while the output
    /// is locked.
    pub(super) fn take(path: &Path, target: &Path, is_held: &Arc<AtomicBool>) -> Result<Self, FileError> {
        let lock = lock_path(target);
        let failed = |error: io::Error| {
            let what = format!("cannot lock this file by {}", lock.display());
            FileError::system(path, &what, &error).help("remove the lock, or give another name")
        };
        let (mut attempts, mut tries) = (0, 0);
        while tries < MAX_TRIES {
            let mut options = OpenOptions::new();
            options.read(true).write(true).create(true).truncate(false);
            let mut file = open_own(&mut options, &lock).map_err(failed)?;
            match try_lock(&file).map_err(failed)? {
                Lock::Unknown => return Ok(Self::new(None, is_held)),
                Lock::Refused => {
                    attempts += 1;
                    if attempts == LOCK_ATTEMPTS {
                        return Err(in_use(path, &file));
                    }
                    thread::sleep(LOCK_PAUSE);
                }
                // The previous owner may have removed the file before it released the lock.
                Lock::Taken if !is_at(&file, &lock) => tries += 1,
                Lock::Taken if has_other_names(&file) => {
                    return Err(failed(io::Error::other("the lock has a second name (a hard link)")));
                }
                Lock::Taken => {
                    // Write the process id for the messages of other runs. The lock does not need
                    // the id.
                    let _ = file.set_len(0).and_then(|()| writeln!(file, "{}", std::process::id()));
                    return Ok(Self::new(Some((file, lock)), is_held));
                }
            }
        }
        Err(failed(io::Error::other("another program removes the lock")))
    }

    fn new(held: Option<(File, PathBuf)>, is_held: &Arc<AtomicBool>) -> Self {
        is_held.store(true, Ordering::SeqCst);
        let is_held = is_held.clone();
        Self { held, is_held }
    }
}

impl Drop for OutputLock {
    fn drop(&mut self) {
        self.is_held.store(false, Ordering::SeqCst);
        if let Some((file, path)) = &self.held {
            // Remove the lock file while it is locked, so that another process's file is not
            // removed.
            if is_at(file, path) {
                let _ = fs::remove_file(path);
            }
        }
    }
}

/// Result of an attempt to lock a file.
enum Lock {
    Taken,
    /// Another process holds the lock.
    Refused,
    /// The file system has no locks.
    Unknown,
}

#[cfg(unix)]
fn try_lock(file: &File) -> io::Result<Lock> {
    lock_by(file, rustix::fs::FlockOperation::NonBlockingLockExclusive)
}

/// Takes a shared lock.
#[cfg(unix)]
fn try_shared_lock(file: &File) -> io::Result<Lock> {
    lock_by(file, rustix::fs::FlockOperation::NonBlockingLockShared)
}

#[cfg(unix)]
fn lock_by(file: &File, operation: rustix::fs::FlockOperation) -> io::Result<Lock> {
    use rustix::io::Errno;
    loop {
        return match rustix::fs::flock(file, operation) {
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

#[cfg(not(unix))]
fn try_shared_lock(_: &File) -> io::Result<Lock> {
    Ok(Lock::Unknown)
}

/// Returns true if the file has several names (hard links).
#[cfg(unix)]
fn has_other_names(file: &File) -> bool {
    file.metadata().is_ok_and(|data| data.nlink() > 1)
}

#[cfg(not(unix))]
fn has_other_names(_: &File) -> bool {
    false
}

/// Returns true if `file` is still the file at `path`.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    let inode = |data: Metadata| (data.dev(), data.ino());
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
        // Keep the file without its lock, as after a kill.
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
        let take = || OutputLock::take(&target, &target, &Arc::default());
        let first = take().unwrap();
        for error in [take().unwrap_err(), check_unlocked(&target, &target).unwrap_err()] {
            assert!(error.message.contains(&std::process::id().to_string()), "{error}");
            assert!(error.help.is_some());
        }
        drop(first);
        check_unlocked(&target, &target).unwrap();
        assert_eq!(names(folder.path()), 0);
        // A lock file that a killed run left is not locked, so the output can be locked.
        fs::write(folder.path().join(prefix(&target) + "lock"), "1\n").unwrap();
        drop(take().unwrap());
        assert_eq!(names(folder.path()), 0);
    }

    /// Runs `work` in a thread. If `work` waits for a pipe forever, the test fails after a minute.
    fn within_a_minute<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> T {
        let (sender, receiver) = std::sync::mpsc::channel();
        thread::spawn(move || sender.send(work()));
        receiver
            .recv_timeout(Duration::from_secs(60))
            .expect("`work` does not end within a minute, or panics")
    }

    #[test]
    fn pipe_with_a_name_of_the_program_is_not_opened() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("x.exr");
        let pipe = |name: String| {
            let path = folder.path().join(name);
            let made = std::process::Command::new("mkfifo").arg(&path).status();
            assert!(made.unwrap().success());
            path
        };
        let left = pipe(prefix(&target) + "x.tmp");
        let lock = pipe(prefix(&target) + "lock");
        let file = target.clone();
        let error = within_a_minute(move || {
            sweep(&file);
            check_unlocked(&file, &file).unwrap();
            OutputLock::take(&file, &file, &Arc::default()).unwrap_err()
        });
        assert!(
            error.message.contains("not a regular file") && error.help.is_some(),
            "{error}"
        );
        assert!(left.exists() && lock.exists());
    }

    /// If another user has created a link with the name of the lock file, no process writes into
    /// the target of the link.
    #[test]
    fn lock_writes_into_no_other_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let target = path("x.exr");
        fs::write(path("notes"), "notes").unwrap();
        let lock = lock_path(&target);
        std::os::unix::fs::symlink("notes", &lock).unwrap();
        OutputLock::take(&target, &target, &Arc::default()).unwrap_err();
        fs::remove_file(&lock).unwrap();
        fs::hard_link(path("notes"), &lock).unwrap();
        let error = OutputLock::take(&target, &target, &Arc::default()).unwrap_err();
        assert!(error.message.contains("second name"), "{error}");
        assert_eq!(fs::read(path("notes")).unwrap(), b"notes");
    }

    #[test]
    fn replacing_file_has_permissions_of_the_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("x.exr");
        fs::write(&target, "").unwrap();
        for mode in [0o600, 0o640, 0o666, 0o755] {
            fs::set_permissions(&target, PermissionsExt::from_mode(mode)).unwrap();
            let file = temporary(&target).unwrap();
            assert_eq!(file.as_file().metadata().unwrap().mode() & 0o7777, mode, "{mode:o}");
        }
        // Only root can change the owner of a file.
        let give = |uid, gid| std::os::unix::fs::chown(&target, Some(uid), Some(gid));
        if give(65533, 65534).is_ok() {
            let data = temporary(&target).unwrap().as_file().metadata().unwrap();
            assert_eq!((data.uid(), data.gid(), data.mode() & 0o777), (65533, 65534, 0o755));
        }
    }
}
