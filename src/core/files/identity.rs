//! Identity of files: device and inode. A file that does not exist yet is identified by its folder
//! and its name.
//!
//! A symbolic link in the path of an output is not followed if another user has created the link in
//! a sticky folder such as `/tmp`. The link could lead to any file of the user. Linux has the same
//! rule (`fs.protected_symlinks`), but only for the last name of a path and only if the rule is
//! enabled.
//!
//! `cli/outputs` uses these identities to protect inputs. Before any file is read, it compares all
//! outputs with each other and with the scene file. Before the acceleration structure is built, it
//! compares them with `Session::files`. No flag permits an output to overwrite an input.

use std::ffi::OsString;
use std::fs::{self, Metadata};
use std::io;
#[cfg(unix)]
use std::path::Component;
use std::path::{Path, PathBuf};

/// Maximum number of symbolic links that are followed for one name, as in Linux.
const MAX_LINKS: usize = 40;

/// Identity of a file, the same for all names and links of the file. The file need not exist.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum FileId {
    /// A file that exists.
    Existing(Inode),
    /// A name in a folder that exists.
    Future(Inode, OsString),
}

/// Device and inode of a file.
#[cfg(unix)]
type Inode = (u64, u64);
/// Canonical path, on systems without inodes. Hard links count as different files.
#[cfg(not(unix))]
type Inode = PathBuf;

impl FileId {
    /// Identity of the file at `path`. `None` if the folder of `path` does not exist.
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

/// The folder of `path`: `.` if `path` is only a name.
pub(super) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Follows symbolic links at the last name of `path`, even if there is no file at the end of the
/// links yet.
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

/// First symbolic link on the way to `path` that another user has put into a sticky folder. The
/// link belongs neither to the user nor to the owner of the folder.
#[cfg(unix)]
pub(super) fn untrusted_link(path: &Path) -> io::Result<Option<PathBuf>> {
    let user = rustix::process::geteuid().as_raw();
    let mut folder = std::env::current_dir()?;
    let mut rest: Vec<OsString> = names_reversed(path);
    let mut links = 0;
    while let Some(name) = rest.pop() {
        match Path::new(&name).components().next() {
            Some(Component::ParentDir) => drop(folder.pop()),
            Some(Component::Normal(_)) => {
                let here = folder.join(&name);
                match fs::symlink_metadata(&here) {
                    Ok(link) if link.is_symlink() => {
                        links += 1;
                        if links > MAX_LINKS {
                            return Err(io::Error::other("too many symbolic links"));
                        }
                        if !is_trusted(&link, &fs::metadata(&folder)?, user) {
                            return Ok(Some(here));
                        }
                        rest.extend(names_reversed(&fs::read_link(&here)?));
                    }
                    _ => folder = here,
                }
            }
            // A root (`/`) replaces all names before the root.
            _ => folder.push(&name),
        }
    }
    Ok(None)
}

/// The parts of a path, the last one first.
#[cfg(unix)]
fn names_reversed(path: &Path) -> Vec<OsString> {
    let names = path.components().filter(|part| *part != Component::CurDir);
    names.rev().map(|part| part.as_os_str().to_owned()).collect()
}

/// Returns true if the user with the id `user` may follow `link` in `folder`.
#[cfg(unix)]
fn is_trusted(link: &Metadata, folder: &Metadata, user: u32) -> bool {
    use std::os::unix::fs::MetadataExt;
    const STICKY: u32 = 0o1000;
    folder.mode() & STICKY == 0 || link.uid() == user || link.uid() == folder.uid()
}

#[cfg(not(unix))]
pub(super) fn untrusted_link(_: &Path) -> io::Result<Option<PathBuf>> {
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A link of another user is not followed in a sticky folder. Only root can create such a link.
    /// Without root, the test ends after it has called `is_trusted` directly.
    #[cfg(unix)]
    #[test]
    fn strangers_link_in_a_sticky_folder_is_not_trusted() {
        use std::os::unix::fs::{MetadataExt, PermissionsExt, lchown, symlink};
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        fs::create_dir(path("home")).unwrap();
        fs::create_dir(path("tmp")).unwrap();
        fs::set_permissions(path("tmp"), fs::Permissions::from_mode(0o1777)).unwrap();
        symlink("../home/x.exr", path("tmp/x.exr")).unwrap();
        symlink("../home", path("tmp/sub")).unwrap();
        symlink("tmp/sub", path("own")).unwrap();
        for name in [
            "tmp/x.exr",
            "tmp/./sub/x.exr",
            "own/x.exr",
            "tmp/../tmp/sub/new/x.exr",
            "gone/x.exr",
        ] {
            assert_eq!(untrusted_link(&path(name)).unwrap(), None, "{name}");
        }
        let [link, sticky, plain] = ["tmp/x.exr", "tmp", "home"].map(|name| fs::symlink_metadata(path(name)).unwrap());
        let stranger = link.uid() + 1;
        assert!(is_trusted(&link, &sticky, link.uid()) && is_trusted(&link, &plain, stranger));
        assert!(
            is_trusted(&link, &sticky, stranger),
            "the folder's owner has made the link"
        );

        let give = |name: &str| lchown(path(name), Some(65534), None);
        if give("tmp/x.exr").is_err() {
            return;
        }
        give("tmp/sub").unwrap();
        for (name, link) in [
            ("tmp/x.exr", "tmp/x.exr"),
            ("tmp/./sub/x.exr", "tmp/sub"),
            ("own/x.exr", "tmp/sub"),
            ("home/../tmp/sub/new/x.exr", "tmp/sub"),
        ] {
            let found = untrusted_link(&path(name)).unwrap().unwrap();
            assert!(found.ends_with(link), "{name}: {}", found.display());
        }
        fs::set_permissions(path("tmp"), fs::Permissions::from_mode(0o777)).unwrap();
        assert_eq!(untrusted_link(&path("tmp/x.exr")).unwrap(), None);
    }

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
