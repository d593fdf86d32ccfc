//! Images that a command writes, with their names and formats.

use super::faces::{FACE, face, has_face, names};
use super::{Outputs, default_names};
use crate::camera::{FACE_NAMES, ProjectionKind};
use crate::cli::args::RenderArgs;
use crate::cli::error::CliError;
use crate::cli::job::Job;
use crate::color::Tone;
use crate::files::Output;
use crate::film::{Image, metered};
use crate::io::{ExrFormat, FileError, Format, Metadata};
use std::ops::Deref;
use std::path::PathBuf;

/// Images to write: first the files with the whole picture, and then groups of six files, one for
/// each face of a cube map.
#[derive(Default)]
pub(in crate::cli) struct Images {
    files: Vec<(Format, Output)>,
    /// Number of files with the whole picture.
    whole: usize,
}

impl Deref for Images {
    type Target = [(Format, Output)];

    fn deref(&self) -> &[(Format, Output)] {
        &self.files
    }
}

impl Images {
    /// Files with the whole picture.
    pub fn whole(&self) -> &[(Format, Output)] {
        &self.files[..self.whole]
    }

    /// Files with a face of a cube map, each with the index of the face.
    pub fn faces(&self) -> impl Iterator<Item = (usize, &(Format, Output))> {
        let faces = self.files[self.whole..].iter().enumerate();
        faces.map(|(index, file)| (index % FACE_NAMES.len(), file))
    }

    pub fn has_faces(&self) -> bool {
        self.faces().next().is_some()
    }

    /// Sets the tone of PNG files.
    pub fn show(&mut self, tone: Tone) {
        for (format, _) in &mut self.files {
            if let Format::Png(shown) = format {
                *shown = tone;
            }
        }
    }

    /// Writes the faces of the cube map `image` to their files, and returns the errors. All faces
    /// have the exposure of the whole picture.
    pub fn write_faces(&self, image: &Image, metadata: &Metadata) -> Vec<FileError> {
        let write = |(index, (format, output)): (usize, &(Format, Output))| {
            let face = face(image, index).map_err(|reason| FileError::new(output.path(), reason))?;
            let format = match format {
                Format::Png(tone) => &Format::Png(metered(*tone, image)),
                format => format,
            };
            let metadata = Metadata {
                camera: metadata.camera.as_ref().and_then(|camera| camera.of_face(index)),
                ..metadata.clone()
            };
            output.write_image(format, &face, None, &metadata)
        };
        self.faces().filter_map(|file| write(file).err()).collect()
    }
}

impl Outputs {
    /// Checks that the images `paths` of `-o` can be written, and adds them to the outputs. A name
    /// with the placeholder [`FACE`] becomes six files. PNG files have the tone `tone`.
    ///
    /// # Errors
    ///
    /// A name without an image extension, a file that cannot be written, or the same file as
    /// another output.
    pub fn prepare_images(&mut self, paths: &[PathBuf], tone: Tone, exr: &ExrFormat) -> Result<Images, CliError> {
        // The file name of another format is wrong usage (exit code 2). An unwritable folder is a
        // failure (exit code 1).
        let (of_faces, whole): (Vec<&PathBuf>, Vec<&PathBuf>) = paths.iter().partition(|path| has_face(path));
        let whole_count = whole.len();
        let names = whole
            .into_iter()
            .cloned()
            .chain(of_faces.into_iter().flat_map(|path| names(path)));
        let prepared = names.map(|path| {
            let format = match Format::of_path(&path).map_err(|e| CliError::Usage(e.to_string()))? {
                Format::Png(_) => Format::Png(tone),
                Format::Exr(_) => Format::Exr(exr.clone()),
            };
            Ok((format, self.prepare("-o", &path)?))
        });
        Ok(Images {
            files: prepared.collect::<Result<_, CliError>>()?,
            whole: whole_count,
        })
    }
}

/// Error of a file name with the placeholder [`FACE`], with this reason and this help.
pub(in crate::cli) fn face_error(reason: &str, help: &str) -> CliError {
    CliError::Usage(format!("-o with {FACE}: {reason}\n  help: {help}"))
}

/// Returns an error if `job` does not render the faces of a cube map, but `images` have faces.
fn check_faces(images: &Images, job: &Job) -> Result<(), CliError> {
    if !images.has_faces() {
        return Ok(());
    }
    if job.settings.camera.projection() != ProjectionKind::Cubemap {
        return Err(face_error(
            "the picture is not a cube map",
            "add --projection cubemap, or give a name without the placeholder",
        ));
    }
    if job.settings.is_part() {
        let help = format!("write one file, and later: embrasure merge PART.exr... -o 'cube_{FACE}.png'");
        return Err(face_error("a part of a picture has no whole faces", &help));
    }
    Ok(())
}

/// Returns the images of a render, and a warning if their default names do not have the stem of the
/// scene. Adds the images to `outputs`. `read` are the known files of the scene.
pub(in crate::cli) fn images_of_render(
    args: &RenderArgs,
    job: &Job,
    read: &[PathBuf],
    outputs: &mut Outputs,
) -> Result<(Images, Option<String>), CliError> {
    let mut reason = None;
    let paths = if !args.output.is_empty() {
        args.output.clone()
    } else if args.samples.is_some() && args.checkpoint.is_some() {
        // `--samples` with a checkpoint needs no picture.
        Vec::new()
    } else if job.scene.is_file() || args.samples.is_some() {
        default_names::of_scene_file(&args.scene)
    } else {
        let names = default_names::of_obj(&args.scene, read);
        reason = names.reason;
        names.paths
    };
    let warning = reason.map(|reason| {
        let names: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
        format!(
            "{reason}, so the pictures are named {}\n  help: choose other names with -o",
            names.join(" and ")
        )
    });
    let images = outputs.prepare_images(&paths, job.settings.tone, &args.exr.format()?)?;
    check_faces(&images, job)?;
    Ok((images, warning))
}
