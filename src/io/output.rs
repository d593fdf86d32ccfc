use super::{ExrFormat, FileError, Metadata, State, exr, png};
use crate::color::Tone;
use crate::film::Image;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Image file formats that can be written.
#[derive(Clone, Debug, PartialEq)]
pub enum Format {
    /// OpenEXR: linear floats, all channels, metadata.
    Exr(ExrFormat),
    /// PNG: 8 bits for an sRGB display, which shows light as the tone says.
    Png(Tone),
}

/// A file that will be written: checked beforehand, replaced in one step at the end, never half-written.
#[derive(Clone, Debug)]
pub struct Output {
    /// As the user named it.
    path: PathBuf,
    /// Where the bytes go: `path` with symbolic links followed, so that a link stays a link.
    target: PathBuf,
}

impl Output {
    /// Checks that `path` can be written, by writing beside it.
    pub fn prepare(path: &Path) -> Result<Self, FileError> {
        if path.is_dir() {
            return Err(FileError::new(path, "cannot write: this is a directory").help("give a file name"));
        }
        let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
        if let Ok(metadata) = fs::metadata(&target) {
            if !metadata.is_file() {
                return Err(FileError::new(path, "cannot write: not a regular file").help("give another file name"));
            }
            if metadata.permissions().readonly() {
                return Err(FileError::new(path, "cannot write: the file is read-only")
                    .help("make it writable, or give another name"));
            }
        }
        let output = Self {
            path: path.to_path_buf(),
            target,
        };
        output.temporary()?;
        Ok(output)
    }

    /// As the user named it.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes with `content` to a temporary file beside the target, syncs it and renames it over the target.
    pub fn write(&self, content: impl FnOnce(&mut BufWriter<&mut File>) -> io::Result<()>) -> Result<(), FileError> {
        let failed = |error: io::Error| FileError::system(&self.path, "cannot write", &error);
        let mut temporary = self.temporary()?;
        let mut writer = BufWriter::new(temporary.as_file_mut());
        content(&mut writer).map_err(failed)?;
        writer.flush().map_err(failed)?;
        drop(writer);
        temporary.as_file().sync_all().map_err(failed)?;
        temporary.persist(&self.target).map_err(|e| failed(e.error))?;
        Ok(())
    }

    /// Writes `image` in `format`; an EXR also holds `state`, if there is one.
    pub fn write_image(
        &self,
        format: &Format,
        image: &Image,
        state: Option<&State>,
        metadata: &Metadata,
    ) -> Result<(), FileError> {
        self.write(|writer| match format {
            Format::Exr(format) => exr::write(writer, image, format, state, metadata),
            Format::Png(tone) => png::write(writer, image, metadata, tone),
        })
    }

    /// A new file in the target's folder, which vanishes unless it is persisted.
    fn temporary(&self) -> Result<tempfile::NamedTempFile, FileError> {
        let folder = match self.target.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        if !folder.is_dir() {
            return Err(FileError::new(
                &self.path,
                format!("cannot write: folder {} does not exist", folder.display()),
            )
            .help(format!(
                "create it (mkdir -p {}), or give another path",
                folder.display()
            )));
        }
        let mut builder = tempfile::Builder::new();
        builder.prefix(".embrasure-").suffix(".tmp");
        // Temporary files are private by default; this one becomes the user's picture, under the user's umask.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        builder.tempfile_in(folder).map_err(|error| {
            FileError::new(
                &self.path,
                format!("cannot write in folder {}: {}", folder.display(), error.kind()),
            )
            .help("make the folder writable, or give another path")
        })
    }
}

impl Format {
    /// By the file name's extension; a PNG clips what is too bright.
    pub fn of_path(path: &Path) -> Result<Self, FileError> {
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("exr") => Ok(Self::Exr(ExrFormat::default())),
            Some("png") => Ok(Self::Png(Tone::default())),
            other => Err(FileError::new(
                path,
                match other {
                    Some(e) => format!("unknown image format `.{e}`"),
                    None => "the file name has no extension to choose a format by".into(),
                },
            )
            .help("use .exr (linear floats) or .png (8-bit display)")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_by_extension() {
        assert_eq!(
            Format::of_path(Path::new("a/b.EXR")),
            Ok(Format::Exr(ExrFormat::default()))
        );
        assert_eq!(Format::of_path(Path::new("b.png")), Ok(Format::Png(Tone::default())));
        assert!(
            Format::of_path(Path::new("b.jpg"))
                .unwrap_err()
                .message
                .contains(".jpg")
        );
        assert!(Format::of_path(Path::new("b")).is_err());
    }

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
