//! Names of the pictures of a render without `-o`. The pictures are written to the current folder.
//!
//! A scene file `room.toml` gives `room.exr`. A bare OBJ `room.obj` gives `room.png` and
//! `room.exr`.
//!
//! A texture often has the stem of its OBJ file. If a picture of a bare OBJ would replace a file
//! that the scene reads, or a file that this program did not write, both pictures get other names,
//! such as `room.render.png`.

use crate::files::FileId;
use std::ffi::OsString;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// Number of bytes of a picture that are searched for the name of its program.
const HEADER_BYTES: u64 = 1 << 16;
/// Maximum number of names to try.
const MAX_NAMES: u32 = 100;

/// Names for the pictures of a bare OBJ.
pub(super) struct DefaultNames {
    pub paths: Vec<PathBuf>,
    /// Reason why the names do not have the stem of the OBJ; `None` if they have it.
    pub reason: Option<String>,
}

/// File name of `scene` without the folder, with `extension` in place of the last extension.
fn with_extension(scene: &Path, extension: &str) -> PathBuf {
    let mut name = OsString::from(scene.file_stem().unwrap_or_default());
    name.push(".");
    name.push(extension);
    name.into()
}

/// Default outputs of a scene file.
pub(super) fn of_scene_file(scene: &Path) -> Vec<PathBuf> {
    vec![with_extension(scene, "exr")]
}

/// Default outputs of a bare OBJ. They replace neither the files `read` by the scene nor files of
/// other programs. Both pictures have the same stem.
pub(super) fn of_obj(scene: &Path, read: &[PathBuf]) -> DefaultNames {
    let read: Vec<FileId> = read.iter().filter_map(|path| FileId::of(path)).collect();
    let mut reason = None;
    for n in 0..MAX_NAMES {
        let tag = match n {
            0 => String::new(),
            1 => "render.".into(),
            n => format!("render-{n}."),
        };
        let paths = ["png", "exr"].map(|extension| with_extension(scene, &format!("{tag}{extension}")));
        let Some(why) = paths.iter().find_map(|path| why_not(path, &read)) else {
            return DefaultNames {
                paths: paths.into(),
                reason,
            };
        };
        reason = reason.or(Some(why));
    }
    // If no name is free, use the usual names. The check of outputs later rejects a name if the
    // scene reads the file of this name.
    let paths = ["png", "exr"].map(|extension| with_extension(scene, extension));
    DefaultNames {
        paths: paths.into(),
        reason: None,
    }
}

/// Reason why a picture must not replace the file at `path`; `None` if it may.
fn why_not(path: &Path, read: &[FileId]) -> Option<String> {
    let name = path.display();
    if FileId::of(path).is_some_and(|id| read.contains(&id)) {
        return Some(format!("{name} is a file that this scene reads"));
    }
    let is_foreign = match path.metadata() {
        Ok(data) => data.is_file() && data.len() > 0 && !is_own(path),
        Err(error) if error.kind() == io::ErrorKind::NotFound => false,
        Err(error) => return Some(format!("the system does not say whether {name} exists ({error})")),
    };
    is_foreign.then(|| format!("{name} exists and was not written by this program"))
}

/// Returns true if the header of the picture at `path` names this program.
fn is_own(path: &Path) -> bool {
    let mut header = Vec::new();
    let read = File::open(path).and_then(|file| file.take(HEADER_BYTES).read_to_end(&mut header));
    let name = b"embrasure";
    read.is_ok() && header.windows(name.len()).any(|bytes| bytes == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dots_of_a_name_stay() {
        let names = |scene: &str| of_scene_file(Path::new(scene));
        assert_eq!(names("a/x.y.toml"), [PathBuf::from("x.y.exr")]);
        assert_eq!(names("x.toml"), [PathBuf::from("x.exr")]);
        let paths = of_obj(Path::new("far/no such.v2.obj"), &[]).paths;
        assert_eq!(paths, ["no such.v2.png", "no such.v2.exr"].map(PathBuf::from));
    }
}
