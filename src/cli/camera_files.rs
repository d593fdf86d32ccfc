//! `--write-cameras`: the camera of a render, written when the scene is loaded.

use super::error::CliError;
use super::job::Job;
use super::outputs::{Images, Outputs};
use crate::scene_file::FileCamera;
use crate::session::Session;
use std::path::Path;

/// Checks that the camera files of `path` can be written: the file itself, or the files of a COLMAP
/// folder.
pub(super) fn prepare_cameras(path: &Path, outputs: &mut Outputs) -> Result<(), CliError> {
    for file in FileCamera::files(path)? {
        // A missing folder is created later.
        if file
            .parent()
            .is_none_or(|folder| folder.as_os_str().is_empty() || folder.is_dir())
        {
            outputs.prepare("--write-cameras", &file)?;
        }
    }
    Ok(())
}

/// Writes the camera of `session` to `path`. The name of the camera is the path of its picture,
/// which is the first of `images`, or the path of the scene if there are no images.
pub(super) fn write_camera(path: &Path, images: &Images, job: &Job, session: &Session) -> Result<(), CliError> {
    let image = images.iter().next().map(|(_, output)| output.path());
    let picture = image.unwrap_or(&job.scene_path);
    // Make the name relative to the folder of the camera file, if the picture is below that folder
    let folder = path.parent().unwrap_or(Path::new(""));
    let name = picture.strip_prefix(folder).unwrap_or(picture);
    let size = session.settings().resolution;
    let origin = session.settings().camera.origin;
    let camera = FileCamera::of(name.display().to_string(), session.camera_description(), size, origin);
    Ok(camera.write(path)?)
}
