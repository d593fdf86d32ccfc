//! Identity of files: device and inode, or for a file that does not exist yet its folder's and its name.
//!
//! `cli/outputs` compares all outputs with each other and with the scene file before anything is read, and with `Session::files` before the
//! acceleration structure is built. No flag overwrites inputs.

use std::ffi::OsString;
use std::fs::{self, Metadata};
use std::io;
use std::path::{Path, PathBuf};

/// Symbolic links that a name may lead through: as many as Linux follows.
const MAX_LINKS: usize = 40;

/// The file that a path leads to, by whichever of its names: through links, and also where it is not there yet.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum FileId {
    /// A file that is there.
    Existing(Inode),
    /// A name in a folder that is there.
    Future(Inode, OsString),
}

/// Device and inode.
#[cfg(unix)]
type Inode = (u64, u64);
/// The canonical path: hard links count as different files.
#[cfg(not(unix))]
type Inode = PathBuf;

impl FileId {
    /// Identity of `path`; `None` where not even its folder is there.
    pub fn of(path: &Path) -> Option<Self> {
        let target = follow_links(path).ok()?;
        match fs::metadata(&target) {
            Ok(data) => Some(Self::Existing(inode(&target, &data)?)),
            Err(_) => {
                let folder = folder_of(&target);
                let data = fs::metadata(folder).ok()?;
                Some(Self::Future(inode(folder, &data)?, target.file_name()?.to_owned()))
            }
        }
    }
}

#[cfg(unix)]
fn inode(_: &Path, data: &Metadata) -> Option<Inode> {
    use std::os::unix::fs::MetadataExt;
    Some((data.dev(), data.ino()))
}

#[cfg(not(unix))]
fn inode(path: &Path, _: &Metadata) -> Option<Inode> {
    fs::canonicalize(path).ok()
}

/// The folder that `path` is in, by a name that the system knows.
pub(super) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// `path` with the links followed that its last name stands for, even where they lead to no file yet.
pub(super) fn follow_links(path: &Path) -> io::Result<PathBuf> {
    let mut path = path.to_path_buf();
    for _ in 0..MAX_LINKS {
        match fs::symlink_metadata(&path) {
            Ok(data) if data.is_symlink() => path = folder_of(&path).join(fs::read_link(&path)?),
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            _ => return Ok(path),
        }
    }
    Err(io::Error::other("too many symbolic links"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_known_by_any_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        fs::create_dir(path("sub")).unwrap();
        fs::write(path("a"), "").unwrap();
        let same = |one: &str, other: &str| FileId::of(&path(one)) == FileId::of(&path(other));
        assert!(same("a", "sub/../a") && same("new", "./sub/../new"));
        assert!(!same("a", "new") && !same("new", "sub/new"));
        assert_eq!(FileId::of(&path("gone/new")), None);
        #[cfg(unix)]
        {
            use std::os::unix::fs::symlink;
            fs::hard_link(path("a"), path("hard")).unwrap();
            for (to, link) in [("a", "soft"), ("new", "dangling"), ("sub", "folder"), ("loop", "loop")] {
                symlink(to, path(link)).unwrap();
            }
            assert!(same("a", "hard") && same("a", "soft"));
            assert!(same("new", "dangling") && same("sub/new", "folder/new"));
            assert_eq!(FileId::of(&path("loop")), None);
        }
    }
}
