//! Images that a command writes, with their names and formats.

use super::Outputs;
use super::default_names;
use crate::cli::args::RenderArgs;
use crate::cli::error::CliError;
use crate::cli::job::Job;
use crate::color::Tone;
use crate::files::Output;
use crate::io::{ExrFormat, Format};
use std::path::PathBuf;

/// Placeholder in file names of `develop -o`. It stands for the names of the faces of a cube map.
pub(in crate::cli) const FACE: &str = "{face}";

/// Images to write.
pub(in crate::cli) type Images = Vec<(Format, Output)>;

impl Outputs {
    /// Checks that the images `paths` of `-o` can be written, and adds them to the outputs. PNG
    /// files have the tone `tone`.
    ///
    /// # Errors
    ///
    /// A name without an image extension, a file that cannot be written, or the same file as
    /// another output.
    pub fn prepare_images(&mut self, paths: &[PathBuf], tone: Tone, exr: &ExrFormat) -> Result<Images, CliError> {
        // The file name of another format is wrong usage (exit code 2). An unwritable folder is a
        // failure (exit code 1).
        let prepared = paths.iter().map(|path| {
            if path.to_str().is_some_and(|text| text.contains(FACE)) {
                let help = format!("render one file, and then: embrasure develop cube.exr -o 'cube_{FACE}.png'");
                let message = format!("-o {}: only `develop` writes a file for each face", path.display());
                return Err(CliError::Usage(format!("{message}\n  help: {help}")));
            }
            let format = match Format::of_path(path).map_err(|e| CliError::Usage(e.to_string()))? {
                Format::Png(_) => Format::Png(tone),
                Format::Exr(_) => Format::Exr(exr.clone()),
            };
            Ok((format, self.prepare("-o", path)?))
        });
        prepared.collect()
    }
}

/// Sets the tone of PNG files among `images`.
pub(in crate::cli) fn show(images: &mut Images, tone: Tone) {
    for (format, _) in images {
        if let Format::Png(shown) = format {
            *shown = tone;
        }
    }
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
    Ok((images, warning))
}
