//! Writes a camera, and changes of materials and lights, into the text of a scene file, and saves
//! the text. Comments and order are kept (`toml_edit`).

use super::protocol::PageCamera;
use super::{FileLight, LightEdit, MaterialEdit};
use crate::files::Output;
use crate::io::FileError;
use crate::scene_file::glob_of_name;
use std::fs::Metadata;
use std::io::Write;
use std::path::Path;
use toml_edit::{Array, DocumentMut, Item, Table, TableLike, Value};

/// Byte-order mark (U+FEFF), which some editors write at the start of a file.
const BYTE_ORDER_MARK: char = '\u{feff}';

/// Returns the scene file `text` with new position and lens in `[camera]`.
///
/// # Errors
///
/// A text that is not TOML, or a `camera` that is not a section.
pub(super) fn with_camera(text: &str, camera: &PageCamera) -> Result<String, String> {
    changed(text, |document| set_camera(document, camera))
}

/// Returns the scene file `text` with changed keys: `materials` as patches, and `lights` in their
/// sections.
///
/// # Errors
///
/// A text that is not TOML, or an unknown light.
pub(super) fn with_changes(text: &str, materials: &[MaterialEdit], lights: &[LightEdit]) -> Result<String, String> {
    changed(text, |document| set_changes(document, materials, lights))
}

/// Result of a save.
pub(super) struct SaveResult {
    /// Metadata of the new file, read before the file replaced the old file.
    pub metadata: Metadata,
    /// Number of other names (hard links) of the old file, which keep the old contents.
    pub other_names: u64,
}

/// Replaces the contents of the file at `path` by `new`, if the contents are `old`. Returns `None`
/// if the file has other contents, and keeps them.
///
/// # Errors
///
/// A file that cannot be read or written, or that another process has locked. The file is then
/// unchanged.
pub(super) fn save(path: &Path, old: &str, new: &str) -> Result<Option<SaveResult>, FileError> {
    let output = Output::prepare(path)?;
    let _lock = output.lock()?;
    let other_names = output.other_names();
    let written = output.replace(old.as_bytes(), |writer| writer.write_all(new.as_bytes()))?;
    Ok(written.map(|metadata| SaveResult { metadata, other_names }))
}

/// Text of the sections that changes of materials add to a scene file.
pub(super) fn patches(materials: &[MaterialEdit]) -> String {
    let mut document = DocumentMut::new();
    match set_changes(&mut document, materials, &[]) {
        Ok(()) => document.to_string(),
        Err(words) => format!("# {words}\n"),
    }
}

/// Text of the sections of the changed `lights`, which replace the old sections in a scene file.
pub(super) fn light_sections(lights: &[FileLight], edits: &[LightEdit]) -> String {
    let is_changed = |light: &&FileLight| edits.iter().any(|edit| edit.index == light.index);
    let section = |light: &FileLight| {
        let keys = toml::to_string(&light.section).unwrap_or_else(|error| format!("# {error}\n"));
        format!("# In place of light {}\n[[light]]\n{keys}", light.index + 1)
    };
    let sections: Vec<String> = lights.iter().filter(is_changed).map(section).collect();
    sections.join("\n")
}

/// Returns `text` with `change` applied. A byte-order mark is kept. Windows line breaks are kept if
/// most lines have them.
fn changed(text: &str, change: impl FnOnce(&mut DocumentMut) -> Result<(), String>) -> Result<String, String> {
    let (mark, content) = match text.strip_prefix(BYTE_ORDER_MARK) {
        Some(content) => (BYTE_ORDER_MARK.to_string(), content),
        None => (String::new(), text),
    };
    let content = content.replace("\r\n", "\n");
    let is_windows = 2 * text.matches("\r\n").count() > text.matches('\n').count();
    let mut document: DocumentMut = content.parse().map_err(|error| format!("not TOML: {error}"))?;
    change(&mut document)?;
    let content = document.to_string();
    Ok(if is_windows {
        mark + &content.replace('\n', "\r\n")
    } else {
        mark + &content
    })
}

fn set_changes(document: &mut DocumentMut, materials: &[MaterialEdit], lights: &[LightEdit]) -> Result<(), String> {
    for MaterialEdit { name, key, value } in materials {
        let patches = document.entry("patch").or_insert_with(|| {
            let mut table = Table::new();
            table.set_implicit(true);
            Item::Table(table)
        });
        let patches = patches
            .as_table_like_mut()
            .ok_or("`patch` is not a section; correct it first")?;
        let patch = patches.entry(&glob_of_name(name)).or_insert(Item::Table(Table::new()));
        let patch = patch
            .as_table_like_mut()
            .ok_or("`patch` has an entry that is not a section; correct it first")?;
        set(patch, key, parsed(value));
    }
    for &LightEdit {
        index,
        ref key,
        ref value,
    } in lights
    {
        let light = match document.get_mut("light") {
            Some(Item::ArrayOfTables(lights)) => lights.get_mut(index).map(|light| light as &mut dyn TableLike),
            Some(Item::Value(Value::Array(lights))) => lights
                .get_mut(index)
                .and_then(Value::as_inline_table_mut)
                .map(|light| light as &mut dyn TableLike),
            _ => None,
        };
        let light = light.ok_or_else(|| format!("the file has no light number {}", index + 1))?;
        set(light, key, parsed(value));
    }
    Ok(())
}

/// Parses `text` as a TOML value, which a comment may follow. Any other text becomes a string.
fn parsed(text: &str) -> Value {
    let line: Result<DocumentMut, _> = format!("value = {text}").parse();
    let value = line.ok().filter(|line| line.len() == 1);
    let value = value.and_then(|mut line| line.remove("value")?.into_value().ok());
    value.map_or_else(|| Value::from(text), |value| value.decorated(" ", ""))
}

/// Sets a key. Blanks and the comment of the line are kept.
fn set(section: &mut dyn TableLike, key: &str, mut value: Value) {
    match section.get_mut(key).and_then(Item::as_value_mut) {
        Some(known) => {
            *value.decor_mut() = known.decor().clone();
            *known = value;
        }
        None => drop(section.insert(key, Item::Value(value))),
    }
}

fn set_camera(document: &mut DocumentMut, camera: &PageCamera) -> Result<(), String> {
    let section = document.entry("camera").or_insert(Item::Table(Table::new()));
    let section = section
        .as_table_like_mut()
        .ok_or("`camera` is not a section; correct it first")?;
    // Remove keys that exclude a position, and the f-number, which excludes a lens radius.
    for key in ["view", "orbit", "stand", "yaw", "focus_at", "f_stop", "sensor_height"] {
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
    for (key, value) in values {
        set(section, key, value);
    }
    Ok(())
}

/// The number with the fewest digits that restore the same 32 bits.
fn number(value: f32) -> Value {
    value.to_string().parse::<f64>().unwrap_or(f64::from(value)).into()
}

fn list(values: [f32; 3]) -> Value {
    Value::Array(values.into_iter().map(number).collect::<Array>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene_file::{LightSection, SceneFile};
    use crate::session::{CameraSettings, Settings};
    use std::fs;

    const VIEW: PageCamera = PageCamera {
        position: [0.1, -2.0, 3.5],
        look_at: [0.0, 0.25, 0.0],
        up: [0.0, 0.0, 1.0],
        vertical_fov: 39.3077,
        lens_radius: 0.05,
        focus_distance: 3.9,
    };

    fn material(name: &str, key: &str, value: &str) -> MaterialEdit {
        let [name, key, value] = [name, key, value].map(String::from);
        MaterialEdit { name, key, value }
    }

    fn light(index: usize, key: &str, value: &str) -> LightEdit {
        let [key, value] = [key, value].map(String::from);
        LightEdit { index, key, value }
    }

    #[test]
    fn changes_are_sections() {
        let edits = [
            material("a = *b.c", "roughness", "0.25"),
            material("a = *b.c", "model", "ggx"),
        ];
        assert_eq!(
            patches(&edits),
            "[patch.'a = \\*b.c']\nroughness = 0.25\nmodel = \"ggx\"\n"
        );
        assert_eq!(patches(&[]), "");
        let edits = [
            material("a", "roughness", "0.5 # rough"),
            material("a", "model", "ggx\nb = 1"),
        ];
        assert_eq!(
            patches(&edits),
            "[patch.a]\nroughness = 0.5\nmodel = \"\"\"\nggx\nb = 1\"\"\"\n"
        );
        let mut section = LightSection::constant(0..0, [0.1, 0.2, 4.0]);
        section.group = Some(toml::Spanned::new(0..0, "sky".into()));
        let lights = [0, 2].map(|index| FileLight {
            index,
            section: section.clone(),
        });
        let text = light_sections(&lights, &[light(2, "radiance", "[0.1, 0.2, 4.0]")]);
        assert_eq!(
            text,
            "# In place of light 3\n[[light]]\ntype = \"constant\"\ngroup = \"sky\"\nradiance = [0.1, 0.2, 4.0]\n"
        );
        assert!(text.parse::<DocumentMut>().is_ok());
    }

    #[test]
    fn materials_and_lights_are_changed_in_place() {
        let text = "version = 1\n[patch.\"a b\"]\nroughness = 0.5 # dull\n\n[[light]]\ntype = 'point'\n[[light]]\ntype = 'spot'\nangle = 20 # degrees\n";
        let materials = [
            material("a b", "roughness", "0.25"),
            material("c.d", "diffuse", "[0.5, 0.5, 0.5]"),
            material("c.d", "model", "glass"),
        ];
        let lights = [light(1, "angle", "30.5"), light(0, "intensity", "[1, 2, 3]")];
        let written = with_changes(text, &materials, &lights).unwrap();
        for part in [
            "roughness = 0.25 # dull",
            "[patch.\"c.d\"]\ndiffuse = [0.5, 0.5, 0.5]\nmodel = \"glass\"\n",
            "type = 'point'\nintensity = [1, 2, 3]\n",
            "angle = 30.5 # degrees",
        ] {
            assert!(written.contains(part), "{part}\n{written}");
        }
        assert!(written.parse::<DocumentMut>().is_ok(), "{written}");
        let none = [light(2, "angle", "1")];
        assert!(with_changes(text, &[], &none).unwrap_err().contains("number 3"));
        assert!(with_changes("patch = 3", &materials, &[]).is_err());
    }

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

    /// The written file has the saved camera, bit for bit.
    #[test]
    fn a_saved_camera_is_read_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.toml");
        let text = "version = 1\n[[object]]\nobj = \"a.obj\"\n";
        fs::write(&path, text).unwrap();
        let new = with_camera(text, &VIEW).unwrap();
        assert!(
            save(&path, &new, text).unwrap().is_none(),
            "the file has other contents"
        );
        save(&path, text, &new).unwrap().unwrap();
        let camera: CameraSettings = Settings::of(&SceneFile::load(&path).unwrap()).camera;
        let [position, look_at] = [camera.position, camera.look_at].map(|point| point.map(|p| p.as_vec3a()));
        assert_eq!(position, Some(VIEW.parameters().position));
        assert_eq!(look_at, Some(VIEW.parameters().look_at));
        assert_eq!(camera.up, Some(VIEW.parameters().up));
        assert_eq!(camera.vertical_fov, Some(39.3077));
        assert_eq!(camera.lens_radius, Some(0.05));
        assert_eq!(camera.focus_distance, Some(3.9));
        assert!(save(&folder.path().join("none.toml"), text, &new).is_err());
    }

    #[test]
    fn byte_order_mark_and_line_breaks_stay() {
        let text = "\u{feff}version = 1\r\n# À gauche\r\n[camera] # here\r\nview = 'iso'\r\n";
        let written = with_camera(text, &VIEW).unwrap();
        assert!(
            written.starts_with("\u{feff}version = 1\r\n# À gauche\r\n[camera] # here\r\nposition"),
            "{written:?}"
        );
        assert_eq!(
            written.matches('\n').count(),
            written.matches("\r\n").count(),
            "{written:?}"
        );
        let unix = text.replace(['\r', '\u{feff}'], "");
        let unix = with_camera(&unix, &VIEW).unwrap();
        assert_eq!(written, format!("\u{feff}{}", unix.replace('\n', "\r\n")));
        // Mixed line breaks: a single line of Windows in a file with Unix line breaks
        let mixed = format!("# mixed\r\n{}", text.replace(['\r', '\u{feff}'], ""));
        assert_eq!(with_camera(&mixed, &VIEW).unwrap(), format!("# mixed\n{unix}"));
    }
}
