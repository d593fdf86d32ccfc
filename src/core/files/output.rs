//! Output files, replaced atomically.
//!
//! A file is written beside its target, synced and renamed, and its folder is synced. If the
//! program is killed, the previous file is intact. The new file has the permissions of the previous
//! file. Other names (hard links) of the previous file keep the old contents. `Output::other_names`
//! counts these names. `Output::write` converts a panic to an error of the file, so that the other
//! outputs are still written. If neither an EXR file nor a checkpoint could be written,
//! `Renderer::rescue` writes all sums and `R G B` to a new file, without additional channels.
//!
//! `tests/processes/outputs.rs` tests a render, a resumed render, a merge and a comparison. It
//! makes each of their system calls fail in turn (`tests/faults/inject.c`, by `LD_PRELOAD`).

use super::guard::guarded;
use super::identity::{folder_of, follow_links, untrusted_link};
use super::input::read_bytes;
use super::temporary::{check_unlocked, sweep, temporary};
use super::{FileError, FileId, OutputLock};
use std::fs::{self, File, Metadata};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use tempfile::NamedTempFile;

/// Maximum number of rescue files of one output.
const MAX_RESCUES: u32 = 100;

/// An output file. It is checked before the render and replaced atomically at the end.
#[derive(Clone, Debug)]
pub struct Output {
    /// Path as the user wrote it.
    path: PathBuf,
    /// Path of the file to replace: the end of the symbolic links of `path`. The links themselves
    /// are kept. The folder of `target` is a canonical path.
    target: PathBuf,
    /// True while this output holds the lock.
    is_locked: Arc<AtomicBool>,
}

impl Output {
    /// Checks that `path` can be written, by writing a temporary file beside it, and removes
    /// temporary files of killed runs. A link is followed, even if its target does not exist yet,
    /// unless another user has put the link into a sticky folder such as `/tmp`. A file that
    /// another process has locked is refused.
    pub fn prepare(path: impl AsRef<Path>) -> Result<Self, FileError> {
        let path = path.as_ref();
        let refused = |what: &str| FileError::new(path, format!("cannot write: {what}"));
        let unusable = |error: io::Error| {
            FileError::system(path, "cannot write", &error).help("give another name in an existing folder")
        };
        if path.is_dir() || names_a_folder(path) {
            return Err(refused("this is a directory").help("give a file name"));
        }
        if let Some(link) = untrusted_link(path).map_err(unusable)? {
            let link = link.display();
            return Err(refused(&format!(
                "{link} is a link of another user, in a folder that many users can write"
            ))
            .help("remove the link, or give the name of the file that it leads to"));
        }
        let target = follow_links(path).map_err(unusable)?;
        if names_a_folder(&target) {
            return Err(refused("this is a link to a directory").help("give a file name"));
        }
        let folder = folder_of(&target);
        match fs::metadata(folder) {
            Ok(_) => {}
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                let folder = folder.display();
                return Err(refused(&format!("folder {folder} does not exist"))
                    .help(format!("create it (mkdir -p {folder}), or give another path")));
            }
            Err(error) => return Err(unusable(error)),
        }
        let folder = fs::canonicalize(folder).map_err(unusable)?;
        let target = folder.join(target.file_name().unwrap_or_default());
        match fs::metadata(&target) {
            Ok(data) if !data.is_file() => return Err(refused("not a regular file").help("give another file name")),
            Ok(data) if data.permissions().readonly() => {
                return Err(refused("the file is read-only").help("make it writable, or give another name"));
            }
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(unusable(error)),
            _ => {}
        }
        check_unlocked(path, &target)?;
        sweep(&target);
        let output = Self {
            path: path.to_path_buf(),
            target,
            is_locked: Arc::default(),
        };
        output.temporary()?;
        Ok(output)
    }

    /// Path as the user wrote it.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Identity of the file, valid until a process replaces it.
    pub fn id(&self) -> Option<FileId> {
        FileId::of(&self.target)
    }

    /// Number of other names (hard links) of the file that will be replaced. These names keep the
    /// old contents.
    pub fn other_names(&self) -> u64 {
        #[cfg(unix)]
        {
            let data = fs::symlink_metadata(&self.target);
            data.map_or(0, |data| std::os::unix::fs::MetadataExt::nlink(&data).saturating_sub(1))
        }
        #[cfg(not(unix))]
        {
            0
        }
    }

    /// Locks the file, so that no other output can lock or replace the file, in this process or in
    /// another process.
    ///
    /// # Errors
    ///
    /// If another run has locked the file.
    pub fn lock(&self) -> Result<OutputLock, FileError> {
        OutputLock::take(&self.path, &self.target, &self.is_locked)
    }

    /// Calls `content` to write a temporary file beside the target. Then syncs the temporary file,
    /// renames it over the target, and syncs the folder. If `content` panics, or if another process
    /// has locked the target, an error is returned.
    pub fn write(&self, content: impl FnOnce(&mut BufWriter<&mut File>) -> io::Result<()>) -> Result<(), FileError> {
        self.write_if(|| Ok(true), content).map(drop)
    }

    /// Writes like [`Output::write`], but only if the file still consists of the bytes `old`.
    /// Returns the metadata of the new file. Returns `None` and keeps the file if it has other
    /// contents.
    ///
    /// Comparison and rename are two steps. Hold the [lock](Output::lock), so that no other process
    /// that uses the lock replaces the file between the steps.
    pub fn replace(
        &self,
        old: &[u8],
        content: impl FnOnce(&mut BufWriter<&mut File>) -> io::Result<()>,
    ) -> Result<Option<Metadata>, FileError> {
        let is_old = || {
            let now = read_bytes(&self.target, "the file");
            now.map(|now| now == old).map_err(|error| FileError {
                file: self.path.clone(),
                ..error
            })
        };
        self.write_if(is_old, content)
    }

    /// Writes a temporary file. Then calls `is_wanted`, and replaces the target with the temporary
    /// file if `is_wanted` returns true.
    fn write_if(
        &self,
        is_wanted: impl FnOnce() -> Result<bool, FileError>,
        content: impl FnOnce(&mut BufWriter<&mut File>) -> io::Result<()>,
    ) -> Result<Option<Metadata>, FileError> {
        let failed = |error: io::Error| FileError::system(&self.path, "cannot write", &error);
        let mut temporary = self.temporary()?;
        let mut writer = BufWriter::new(temporary.as_file_mut());
        let written = guarded(|| content(&mut writer).and_then(|()| writer.flush()));
        // After a failed write, drop the buffer without writing it.
        drop(writer.into_parts());
        match written {
            Ok(written) => written.map_err(failed)?,
            Err(panic) => {
                let message = format!("cannot write: internal error: {panic}");
                return Err(FileError::new(&self.path, message).help("please report this, with the command"));
            }
        }
        temporary.as_file().sync_all().map_err(failed)?;
        let written = temporary.as_file().metadata().map_err(failed)?;
        if !self.is_locked.load(Ordering::SeqCst) {
            check_unlocked(&self.path, &self.target)?;
        }
        if !is_wanted()? {
            return Ok(None);
        }
        // Use `fs::rename`, not the rename of tempfile, because the tests inject faults into
        // `fs::rename`.
        let (_file, path) = temporary.into_parts();
        fs::rename(&path, &self.target).map_err(failed)?;
        // The temporary name no longer exists, so there is nothing to remove.
        let _ = path.keep();
        sync_folder(folder_of(&self.target)).map_err(|error| {
            let what = "the file is written, but a power failure may lose it, since its folder cannot be synced";
            FileError::system(&self.path, what, &error)
        })?;
        Ok(Some(written))
    }

    /// Creates the output `NAME.rescue.exr` in the folder of this output. It is for the sums of a
    /// render whose outputs could not be written.
    pub fn rescue(&self) -> Result<Self, FileError> {
        let stem = self.path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let name = |n: u32| match n {
            1 => format!("{stem}.rescue.exr"),
            n => format!("{stem}.rescue-{n}.exr"),
        };
        let paths = (1..=MAX_RESCUES).map(|n| self.path.with_file_name(name(n)));
        let is_free =
            |path: &PathBuf| fs::symlink_metadata(path).is_err_and(|error| error.kind() == io::ErrorKind::NotFound);
        let mut free = paths.filter(is_free);
        let Some(path) = free.next() else {
            let message = format!("cannot write {}: {MAX_RESCUES} rescue files exist already", name(1));
            return Err(FileError::new(&self.path, message).help("remove old rescue files"));
        };
        Self::prepare(&path)
    }

    /// Creates a temporary file in the target's folder. The file is removed when the result is
    /// dropped, unless it was renamed or kept.
    fn temporary(&self) -> Result<NamedTempFile, FileError> {
        temporary(&self.target).map_err(|error| {
            let folder = folder_of(&self.target).display();
            let what = format!("cannot write in folder {folder}");
            let help = match error.kind() {
                io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => {
                    "free some space there, or give another path"
                }
                _ => "make the folder writable, or give another path",
            };
            // Use the source of tempfile's error, because the error itself includes the name of the
            // temporary file.
            let cause = error.get_ref().and_then(|named| named.source()?.downcast_ref());
            FileError::system(&self.path, &what, cause.unwrap_or(&error)).help(help)
        })
    }
}

/// Returns true if `path` ends with a separator, `.` or `..`, and is therefore a folder.
fn names_a_folder(path: &Path) -> bool {
    let bytes = path.as_os_str().as_encoded_bytes();
    let last = bytes.rsplit(|&byte| std::path::is_separator(byte as char)).next();
    last.is_some_and(|name| [&b""[..], b".", b".."].contains(&name))
}

/// Syncs `folder`, so that a rename in the folder survives a power failure. Does nothing on systems
/// that cannot sync folders.
fn sync_folder(folder: &Path) -> io::Result<()> {
    if !cfg!(unix) {
        return Ok(());
    }
    use io::ErrorKind::{InvalidInput, PermissionDenied, Unsupported};
    match File::open(folder).and_then(|folder| folder.sync_all()) {
        Err(error) if [InvalidInput, PermissionDenied, Unsupported].contains(&error.kind()) => Ok(()),
        synced => synced,
    }
}

/// Creates the folder `folder` and its parents, unless they exist.
pub fn create_folder(folder: &Path) -> Result<(), FileError> {
    fs::create_dir_all(folder).map_err(|error| FileError::system(folder, "cannot create the folder", &error))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn failed_write_keeps_the_previous_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.exr");
        fs::write(&path, "old").unwrap();
        let output = Output::prepare(&path).unwrap();
        let result = output.write(|w| {
            w.write_all(b"half")?;
            Err(io::Error::other("disk full"))
        });
        assert!(result.unwrap_err().to_string().contains("disk full"));
        assert_eq!(fs::read(&path).unwrap(), b"old");
        output.write(|w| w.write_all(b"new")).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_panic_is_an_error_of_its_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.exr");
        fs::write(&path, "old").unwrap();
        let output = Output::prepare(&path).unwrap();
        let error = output
            .write(|w| w.write_all(b"half").map(|()| panic!("row 3")))
            .unwrap_err();
        assert!(error.message.contains("row 3") && error.help.is_some(), "{error}");
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn preparing_unwritable_output_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        assert!(
            Output::prepare(folder.path())
                .unwrap_err()
                .message
                .contains("directory")
        );
        let nowhere = folder.path().join("no/such/x.exr");
        let error = Output::prepare(&nowhere).unwrap_err();
        assert!(error.message.contains("does not exist") && error.help.unwrap().contains("mkdir"));
        let locked = folder.path().join("locked.exr");
        fs::write(&locked, "").unwrap();
        let mut permissions = fs::metadata(&locked).unwrap().permissions();
        permissions.set_readonly(true);
        fs::set_permissions(&locked, permissions).unwrap();
        assert!(Output::prepare(&locked).unwrap_err().message.contains("read-only"));
    }

    #[cfg(unix)]
    #[test]
    fn links_are_followed() {
        let folder = tempfile::tempdir().unwrap();
        let (real, link) = (folder.path().join("real.exr"), folder.path().join("link.exr"));
        fs::write(&real, "old").unwrap();
        std::os::unix::fs::symlink(&real, &link).unwrap();
        Output::prepare(&link).unwrap().write(|w| w.write_all(b"new")).unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(&real).unwrap(), b"new");
    }

    #[cfg(unix)]
    #[test]
    fn replaced_file_keeps_its_permissions() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x.exr");
        let mode = || fs::metadata(&path).unwrap().permissions().mode() & 0o777;
        let output = Output::prepare(&path).unwrap();
        output.write(|w| w.write_all(b"new")).unwrap();
        let usual = mode();
        fs::set_permissions(&path, PermissionsExt::from_mode(0o600)).unwrap();
        output.write(|w| w.write_all(b"private")).unwrap();
        assert_eq!(mode(), 0o600);
        fs::remove_file(&path).unwrap();
        output.write(|w| w.write_all(b"new again")).unwrap();
        assert_eq!(mode(), usual);
        fs::hard_link(&path, folder.path().join("y.exr")).unwrap();
        assert_eq!(output.other_names(), 1);
        output.write(|w| w.write_all(b"of one name")).unwrap();
        assert_eq!(output.other_names(), 0);
        assert_eq!(fs::read(folder.path().join("y.exr")).unwrap(), b"new again");
    }

    #[test]
    fn changed_file_is_not_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("s.toml");
        fs::write(&path, "old").unwrap();
        let output = Output::prepare(&path).unwrap();
        let written = output.replace(b"old", |w| w.write_all(b"new")).unwrap().unwrap();
        let now = fs::metadata(&path).unwrap();
        assert_eq!(written.modified().unwrap(), now.modified().unwrap());
        assert_eq!(written.len(), now.len());
        assert!(output.replace(b"old", |w| w.write_all(b"lost")).unwrap().is_none());
        assert_eq!(fs::read(&path).unwrap(), b"new");
        fs::remove_file(&path).unwrap();
        let error = output.replace(b"new", |w| w.write_all(b"lost")).unwrap_err();
        assert!(error.message.contains("no such file") && error.file == path, "{error}");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }

    #[cfg(unix)]
    #[test]
    fn locked_file_is_replaced_by_its_owner_only() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("c.exr");
        let (owner, other) = (Output::prepare(&path).unwrap(), Output::prepare(&path).unwrap());
        let lock = owner.lock().unwrap();
        owner.clone().write(|w| w.write_all(b"checkpoint")).unwrap();
        for error in [
            other.write(|w| w.write_all(b"picture")).unwrap_err(),
            Output::prepare(&path).unwrap_err(),
        ] {
            assert!(error.message.contains("is writing this file"), "{error}");
        }
        assert_eq!(fs::read(&path).unwrap(), b"checkpoint");
        drop(lock);
        other.write(|w| w.write_all(b"picture")).unwrap();
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
