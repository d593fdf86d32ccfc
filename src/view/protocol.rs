//! Messages between pages and the render. A page sends a JSON object with the key `do`. The render
//! sends JSON objects with the key `type`, and pictures as binary messages. A binary message has
//! the length of a JSON header (u32, little-endian), the header, and 16-bit floats. The floats are
//! red, green and blue of each pixel, row by row. They are NaN if the pixel has no samples. If the
//! header has `packed`, the floats are packed by `io::packed`.
//!
//! Messages of the render, by `type`:
//!
//! - `page`: the number of the page; `hello`: the scene, its materials, lights and presets, and all
//!   settable keys and parameters; `state`: camera, settings and changes
//! - `status`: `phase` is `loading`, `rendering`, `paused` or `complete`. During loading, `doing`
//!   names the current work, and `share` is its completed fraction, 0 to 1. Later: samples, rate,
//!   noise, and `exposure`, the exposure that `render` would use
//! - `camera`: a camera moved by a page; `note` and `error`: a text for users
//! - `pick`: `object` and `material` of the pixel and its `position`, missing if there is no
//!   surface; `outline`: a grid of `size` cells over the picture. `runs` has lengths of runs of
//!   cells, row by row: first cells that do not show the object with the material, then cells that
//!   show it, and so on
//! - `views`: cameras with flags and text; `view-picture`: a PNG in base64 of the view with this
//!   `index`
//! - `inspect`, `brightest`, `errors`: paths of a pixel, its brightest samples, and errors of
//!   compared renders
//!
//! The header of a picture has its `channel`, its width and height, the `size` of the whole
//! picture, `samples`, `moves` (the number of camera moves), `preview`, `final` and `exposure`. For
//! the channel `denoised` it also has `denoised`, which is false if the picture is still noisy.

use crate::camera::{CameraDescription, CameraParameters};
use crate::math::Vec3;
use serde::{Deserialize, Serialize, Serializer};

/// Command of a page.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(tag = "do", rename_all = "kebab-case", deny_unknown_fields)]
pub(super) enum Command {
    /// Change the camera.
    Camera(PageCamera),
    /// Set a parameter, by its key in scene files, to the value of a flag; `None` for the default.
    Set { key: String, value: Option<String> },
    /// Pause the render.
    Pause {},
    /// Continue the render.
    Resume {},
    /// Restart with the first sample.
    Restart {},
    /// Send the paths of a sample of a pixel.
    Inspect { x: u32, y: u32, sample: u32 },
    /// Send object and material of a pixel.
    Pick { x: u32, y: u32 },
    /// Send candidate cameras with their pictures.
    Views {},
    /// Write the camera into the scene file.
    SaveCamera {},
    /// Change a key of a material.
    Material { name: String, key: String, value: String },
    /// Change a key of the light with index `index` in the scene file.
    Light { index: usize, key: String, value: String },
    /// Undo all changes of materials and lights.
    ResetChanges {},
    /// Write all changes of materials and lights into the scene file.
    SaveChanges {},
    /// Send the samples that contribute most light to a pixel.
    Brightest { x: u32, y: u32 },
    /// Render a second picture with these settings, `KEY=VALUE` or an integrator, joined by `+`.
    /// `None` ends the comparison.
    Compare { with: Option<String> },
    /// Show this channel on the requesting page, and optionally a second channel.
    Channel {
        name: String,
        #[serde(default)]
        second: Option<String>,
    },
    /// The page has shown a picture. Decoding and drawing it took `ms` milliseconds.
    Shown {
        frame: u64,
        #[serde(default)]
        ms: f64,
    },
}

/// A camera for pages: [`CameraParameters`] as lists of numbers.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PageCamera {
    #[serde(serialize_with = "as_decimals")]
    pub position: [f32; 3],
    #[serde(serialize_with = "as_decimals")]
    pub look_at: [f32; 3],
    #[serde(serialize_with = "as_decimals")]
    pub up: [f32; 3],
    #[serde(serialize_with = "as_decimal")]
    pub vertical_fov: f32,
    #[serde(serialize_with = "as_decimal")]
    pub lens_radius: f32,
    #[serde(serialize_with = "as_decimal")]
    pub focus_distance: f32,
}

/// The f64 with the same decimal text as `value`: 39.3077, not 39.307701110839844.
fn decimal(value: f32) -> f64 {
    value.to_string().parse().unwrap_or(f64::from(value))
}

fn as_decimal<S: Serializer>(value: &f32, serializer: S) -> Result<S::Ok, S::Error> {
    decimal(*value).serialize(serializer)
}

fn as_decimals<S: Serializer>(values: &[f32; 3], serializer: S) -> Result<S::Ok, S::Error> {
    values.map(decimal).serialize(serializer)
}

impl PageCamera {
    /// Values of a camera at the start of its motion.
    pub fn of(description: &CameraDescription) -> Self {
        let c = &description.parameters;
        Self {
            position: c.position.to_array(),
            look_at: c.look_at.to_array(),
            up: c.up.to_array(),
            vertical_fov: c.vertical_fov,
            lens_radius: c.lens_radius,
            focus_distance: c.focus_distance,
        }
    }

    /// Converts to the camera parameters of the program.
    pub fn parameters(&self) -> CameraParameters {
        CameraParameters {
            position: Vec3::from(self.position),
            look_at: Vec3::from(self.look_at),
            up: Vec3::from(self.up),
            vertical_fov: self.vertical_fov,
            lens_radius: self.lens_radius,
            focus_distance: self.focus_distance,
        }
    }
}

impl Command {
    /// Reads a message of a page.
    ///
    /// # Errors
    ///
    /// Text of the error in the message.
    pub fn read(text: &str) -> Result<Self, String> {
        serde_json::from_str(text).map_err(|error| format!("not understood: {error}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_are_read() {
        let camera = r#"{"do":"camera","position":[0,0.1,3.9],"look_at":[0,0,0],"up":[0,1,0],"vertical_fov":39.3,"lens_radius":0,"focus_distance":3.9}"#;
        let Ok(Command::Camera(view)) = Command::read(camera) else {
            panic!("a camera")
        };
        assert_eq!(view.position, [0.0, 0.1, 3.9]);
        assert_eq!(Command::read(r#"{"do":"pause"}"#), Ok(Command::Pause {}));
        let set = r#"{"do":"set","key":"max_depth","value":null}"#;
        let key = "max_depth".into();
        assert_eq!(Command::read(set), Ok(Command::Set { key, value: None }));
    }

    /// Every invalid message gets an error.
    #[test]
    fn invalid_message_has_an_error() {
        for text in [
            "",
            "{",
            "[]",
            "1e999",
            r#"{"do":"unknown"}"#,
            r#"{"do":"pause","more":1}"#,
            r#"{"do":"inspect","x":-1,"y":0,"sample":0}"#,
            r#"{"do":"camera","position":[0,0,1e99]}"#,
            "\u{0}",
        ] {
            let said = Command::read(text).unwrap_err();
            assert!(said.starts_with("not understood: "), "{text}: {said}");
        }
        let deep = "[".repeat(100_000);
        assert!(Command::read(&deep).is_err());
    }

    /// A camera sent to a page and back keeps its bits.
    #[test]
    fn page_camera_keeps_its_bits() {
        let view = PageCamera {
            position: [0.1, -1.0 / 3.0, 1e-30],
            look_at: [f32::MIN_POSITIVE, 16_777_217.0, 0.0],
            up: [0.0, 1.0, 0.0],
            vertical_fov: 39.3077,
            lens_radius: 0.0,
            focus_distance: 3.9,
        };
        let text = serde_json::to_string(&view).unwrap();
        // Browsers read numbers as f64.
        let number: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!(number["vertical_fov"], 39.3077);
        let back: PageCamera = serde_json::from_str(&number.to_string()).unwrap();
        assert_eq!(back, view);
    }
}
