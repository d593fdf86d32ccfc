//! A file for each face of a cube map: `-o 'sky_{face}.png'`.

use super::cropped;
use crate::camera::{FACE_NAMES, cube_faces};
use crate::cli::error::CliError;
use crate::cli::outputs::FACE;
use crate::film::{Image, Rect};
use std::path::PathBuf;

/// Names of the files to write, each with the index of its face. A name with the placeholder
/// [`FACE`] becomes six names. Other names have no face.
pub(super) fn names(outputs: &[PathBuf]) -> Vec<(PathBuf, Option<usize>)> {
    let mut names = Vec::new();
    for path in outputs {
        match path.to_str().filter(|text| text.contains(FACE)) {
            Some(text) => {
                let faces = FACE_NAMES.iter().enumerate();
                names.extend(faces.map(|(index, name)| (text.replace(FACE, name).into(), Some(index))));
            }
            None => names.push((path.clone(), None)),
        }
    }
    names
}

/// Face `index` of the cube map `image`, as a whole picture.
///
/// # Errors
///
/// The picture is not a cube map, or is a part of one.
pub(super) fn face(image: &Image, index: usize) -> Result<Image, CliError> {
    let size = image.resolution;
    let refused = |reason: &str| {
        let help = "use the whole picture of `render --projection cubemap`";
        CliError::Usage(format!("-o with {FACE}: {reason}\n  help: {help}"))
    };
    let faces = cube_faces(size).and_then(|(side, corners)| Some((side, *corners.get(index)?)));
    let Some((side, corner)) = faces else {
        return Err(refused(&format!(
            "the picture has {}x{} pixels, which are not six squares in a row, in a column or in two rows",
            size.x, size.y
        )));
    };
    if image.crop != Rect::full(size) {
        return Err(refused("the file has only a part of the picture"));
    }
    let end = corner + side;
    let mut face = cropped(image, [corner.x, corner.y, end.x, end.y])?;
    face.resolution = end - corner;
    face.view = face.resolution;
    face.crop = Rect::full(face.resolution);
    Ok(face)
}
