//! Writes a camera into a scene file, whose comments and order stay (`toml_edit`).

use super::protocol::CameraView;
use crate::io::{FileError, Output};
use std::fs;
use std::io::Write;
use std::path::Path;
use toml_edit::{Array, DocumentMut, Item, Table, Value};

/// Replaces what the `[camera]` of the scene file at `path` says of place and lens.
///
/// # Errors
///
/// A file that cannot be read or written, or is none; it is as before then.
pub(super) fn save_camera(path: &Path, camera: &CameraView) -> Result<(), FileError> {
    let text = fs::read_to_string(path).map_err(|error| FileError::system(path, "cannot be read", &error))?;
    let text = with_camera(&text, camera).map_err(|message| FileError::new(path, message))?;
    let output = Output::prepare(path)?;
    output.write(|writer| writer.write_all(text.as_bytes()))
}

/// `text` with the camera.
fn with_camera(text: &str, camera: &CameraView) -> Result<String, String> {
    let mut document: DocumentMut = text.parse().map_err(|error| format!("not TOML: {error}"))?;
    let section = document.entry("camera").or_insert(Item::Table(Table::new()));
    let section = section
        .as_table_like_mut()
        .ok_or("`camera` is not a section; correct it first")?;
    // What places the camera otherwise cannot stand beside a position, nor an f-number beside the radius of the lens.
    for key in ["view", "orbit", "focus_at", "f_stop", "sensor_height"] {
        section.remove(key);
    }
    let values = [
        ("position", list(camera.position)),
        ("look_at", list(camera.look_at)),
        ("up", list(camera.up)),
        ("vertical_fov", number(camera.vertical_fov)),
        ("lens_radius", number(camera.lens_radius)),
        ("focus_distance", number(camera.focus_distance)),
    ];
    for (key, mut value) in values {
        match section.get_mut(key).and_then(Item::as_value_mut) {
            // Blanks and the comment of the line stay.
            Some(known) => {
                *value.decor_mut() = known.decor().clone();
                *known = value;
            }
            None => drop(section.insert(key, Item::Value(value))),
        }
    }
    Ok(document.to_string())
}

/// The number as few digits tell it.
fn number(value: f32) -> Value {
    value.to_string().parse::<f64>().unwrap_or(f64::from(value)).into()
}

fn list(values: [f32; 3]) -> Value {
    Value::Array(values.into_iter().map(number).collect::<Array>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::description::SceneFile;
    use crate::session::{CameraSettings, Settings};

    const VIEW: CameraView = CameraView {
        position: [0.1, -2.0, 3.5],
        look_at: [0.0, 0.25, 0.0],
        up: [0.0, 0.0, 1.0],
        vertical_fov: 39.3077,
        lens_radius: 0.05,
        focus_distance: 3.9,
    };

    #[test]
    fn comments_and_order_stay() {
        let text = "# A scene\nversion = 1\n\n[camera] # from the left\nposition = [0, 0, 3.9] # metres\nview = \"iso\"\nup = [0, 1, 0]\n\n[[object]]\nobj = 'a.obj' # the object\n";
        let written = with_camera(text, &VIEW).unwrap();
        assert_eq!(
            written,
            "# A scene\nversion = 1\n\n[camera] # from the left\nposition = [0.1, -2.0, 3.5] # metres\nup = [0.0, 0.0, 1.0]\n\
             look_at = [0.0, 0.25, 0.0]\nvertical_fov = 39.3077\nlens_radius = 0.05\nfocus_distance = 3.9\n\n[[object]]\nobj = 'a.obj' # the object\n"
        );
        assert!(with_camera("camera = 3", &VIEW).is_err());
        assert!(with_camera("[camera", &VIEW).is_err());
        assert!(
            with_camera("camera = { view = 'iso' }", &VIEW)
                .unwrap()
                .starts_with("camera = {")
        );
    }

    /// The file that is written gives the camera that was saved, to the bit.
    #[test]
    fn a_saved_camera_is_read_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.toml");
        fs::write(&path, "version = 1\n[[object]]\nobj = \"a.obj\"\n").unwrap();
        save_camera(&path, &VIEW).unwrap();
        let camera: CameraSettings = Settings::of(&SceneFile::load(&path).unwrap()).camera;
        assert_eq!(camera.position, Some(VIEW.parameters().position));
        assert_eq!(camera.look_at, Some(VIEW.parameters().look_at));
        assert_eq!(camera.up, Some(VIEW.parameters().up));
        assert_eq!(camera.vertical_fov, Some(39.3077));
        assert_eq!(camera.lens_radius, Some(0.05));
        assert_eq!(camera.focus_distance, Some(3.9));
        assert!(save_camera(&folder.path().join("none.toml"), &VIEW).is_err());
    }
}
