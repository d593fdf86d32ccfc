//! Output files, replaced atomically.
//!
//! A file is written beside its place, synced and renamed, and its folder is synced: after a kill, the previous file is there. `Output::write` is the
//! boundary around each output: an error or a panic within it is an error of that file, and the other outputs are written. Where neither an EXR file
//! nor a checkpoint could be written, `Renderer::rescue` writes `R G B` and all sums, without names and further channels, to a new file.
//!
//! `tests/processes/outputs.rs` makes each system call of a render, a resumed render, a merge and a comparison fail in turn (`tests/faults/inject.c`,
//! by `LD_PRELOAD`).

use super::guard::guarded;
use super::identity::{folder_of, follow_links};
use super::temporary::{sweep, temporary};
use super::{FileError, FileId, OutputLock};
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// Maximum number of rescued files of one name.
const MAX_RESCUES: u32 = 100;

/// A file that will be written: checked beforehand, replaced in one step at the end, never half-written.
#[derive(Clone, Debug)]
pub struct Output {
    /// As the user named it.
    path: PathBuf,
    /// Where the bytes go: `path` with symbolic links followed, so that a link stays a link, in a folder by its full name.
    target: PathBuf,
}

impl Output {
    /// Checks that `path` can be written, by writing beside it, and removes what killed runs have left there. A link is followed, also one whose
    /// target is not there yet.
    pub fn prepare(path: impl AsRef<Path>) -> Result<Self, FileError> {
        let path = path.as_ref();
        let refused = |what: &str| FileError::new(path, format!("cannot write: {what}"));
        let unusable = |error: io::Error| {
            FileError::system(path, "cannot write", &error).help("give another name in an existing folder")
        };
        if path.is_dir() || names_a_folder(path) {
            return Err(refused("this is a directory").help("give a file name"));
        }
        let target = follow_links(path).map_err(unusable)?;
        if names_a_folder(&target) {
            return Err(refused("this is a link to a directory").help("give a file name"));
        }
        let folder = folder_of(&target);
        if !folder.is_dir() {
            let folder = folder.display();
            return Err(refused(&format!("folder {folder} does not exist"))
                .help(format!("create it (mkdir -p {folder}), or give another path")));
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
        sweep(&target);
        let output = Self {
            path: path.to_path_buf(),
            target,
        };
        output.temporary()?;
        Ok(output)
    }

    /// Path as the user named it.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The file that it is, as long as no process writes it.
    pub fn id(&self) -> Option<FileId> {
        FileId::of(&self.target)
    }

    /// Keeps other runs of the program from locking the same output.
    ///
    /// # Errors
    ///
    /// Another run has locked it.
    pub fn lock(&self) -> Result<OutputLock, FileError> {
        OutputLock::take(&self.path, &self.target)
    }

    /// Writes with `content` to a temporary file beside the target, syncs it, renames it over the target and syncs the folder. A panic of `content` is
    /// an error.
    pub fn write(&self, content: impl FnOnce(&mut BufWriter<&mut File>) -> io::Result<()>) -> Result<(), FileError> {
        let failed = |error: io::Error| FileError::system(&self.path, "cannot write", &error);
        let mut temporary = self.temporary()?;
        let mut writer = BufWriter::new(temporary.as_file_mut());
        let written = guarded(|| content(&mut writer).and_then(|()| writer.flush()));
        // The buffer of a failed write is dropped.
        drop(writer.into_parts());
        match written {
            Ok(written) => written.map_err(failed)?,
            Err(panic) => {
                let message = format!("cannot write: internal error: {panic}");
                return Err(FileError::new(&self.path, message).help("please report this, with the command"));
            }
        }
        temporary.as_file().sync_all().map_err(failed)?;
        // The system's rename by the standard library: injected faults of the tests reach it, and not that of tempfile.
        let (_file, path) = temporary.into_parts();
        fs::rename(&path, &self.target).map_err(failed)?;
        // Nothing has the temporary name any more.
        let _ = path.keep();
        sync_folder(folder_of(&self.target)).map_err(|error| {
            let what = "written, but a power failure may lose it: cannot sync its folder";
            FileError::system(&self.path, what, &error)
        })
    }

    /// An output beside this one that replaces nothing, for what can be saved of it: `NAME.rescue.exr`.
    pub fn rescue(&self) -> Result<Self, FileError> {
        let stem = self.path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let name = |n: u32| match n {
            1 => format!("{stem}.rescue.exr"),
            n => format!("{stem}.rescue-{n}.exr"),
        };
        let paths = (1..=MAX_RESCUES).map(|n| self.path.with_file_name(name(n)));
        let mut free = paths.filter(|path| fs::symlink_metadata(path).is_err());
        let Some(path) = free.next() else {
            let message = format!("cannot write {}: {MAX_RESCUES} such files exist", name(1));
            return Err(FileError::new(&self.path, message).help("remove old ones"));
        };
        Self::prepare(&path)
    }

    /// A new file in the target's folder, which vanishes unless it is persisted.
    fn temporary(&self) -> Result<NamedTempFile, FileError> {
        temporary(&self.target).map_err(|error| {
            let folder = folder_of(&self.target).display();
            FileError::new(&self.path, format!("cannot write in folder {folder}: {}", error.kind()))
                .help("make the folder writable, or give another path")
        })
    }
}

/// Whether a path can only be that of a folder, by its last letters.
fn names_a_folder(path: &Path) -> bool {
    let bytes = path.as_os_str().as_encoded_bytes();
    let last = bytes.rsplit(|&byte| std::path::is_separator(byte as char)).next();
    last.is_some_and(|name| [&b""[..], b".", b".."].contains(&name))
}

/// Makes a rename in `folder` last through a power failure. Systems that cannot sync folders do without.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_what_was_there() {
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
    fn what_cannot_be_written_is_found_beforehand() {
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
}
