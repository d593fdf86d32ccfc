//! A file for each face of a cube map: `-o 'sky_{face}.png'`.

use crate::camera::{FACE_NAMES, cube_faces};
use crate::film::{Image, Rect};
use std::path::{Path, PathBuf};

/// Placeholder in file names of `-o`. It stands for the names of the faces of a cube map.
pub(super) const FACE: &str = "{face}";

/// Returns true if `path` has the placeholder [`FACE`].
pub(super) fn has_face(path: &Path) -> bool {
    path.to_str().is_some_and(|text| text.contains(FACE))
}

/// File names of the six faces, for a path with the placeholder [`FACE`].
pub(super) fn names(path: &Path) -> [PathBuf; 6] {
    let text = path.to_string_lossy();
    FACE_NAMES.map(|name| text.replace(FACE, name).into())
}

/// Face `index` of the cube map `image`, as a whole picture.
///
/// # Errors
///
/// The picture is not a cube map, or is a part of one. The error is the reason.
pub(in crate::cli) fn face(image: &Image, index: usize) -> Result<Image, String> {
    let size = image.resolution;
    let faces = cube_faces(size).and_then(|(side, corners)| Some((side, *corners.get(index)?)));
    let Some((side, corner)) = faces else {
        return Err(format!(
            "the picture has {}x{} pixels, which are not six squares in a row, in a column or in two rows",
            size.x, size.y
        ));
    };
    if image.crop != Rect::full(size) {
        return Err("the file has only a part of the picture".into());
    }
    let end = corner + side;
    let face = image.cropped(Rect { min: corner, max: end });
    Ok(Image {
        resolution: end - corner,
        view: end - corner,
        crop: Rect::full(end - corner),
        ..face
    })
}
