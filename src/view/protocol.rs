//! What pages and the render tell each other. A page sends a JSON object with the key `do`; the render sends JSON objects with the key `type`, and pictures as binary
//! messages: the length of a JSON header (u32, little-endian), the header, and 16-bit floats, red, green and blue of each pixel row by row. NaN stands for a pixel
//! without samples. Where the header has `packed`, `io::packed` tells what the floats became.
//!
//! Messages of the render, by `type`:
//!
//! - `page`: the number of the page; `hello`: the scene, its materials, lights and presets, and all keys and parameters that can be set;
//!   `state`: camera, settings and changes
//! - `status`: `phase` is `loading`, `rendering`, `paused` or `complete`. While the scene is loaded, `doing` says which part of
//!   the work it is, and `share` how much of it is done, 0 to 1. After that: samples, rate, noise, and `exposure`, the one that `render` would use
//! - `camera`: the camera that a page has moved; `note` and `error`: a text for people
//! - `pick`: `object` and `material` of the pixel and its `position`, without them where nothing is; `outline`: the cells of a grid of
//!   `size` that show them, as numbers of cells without and with them, in turns, row by row
//! - `views`: cameras with flags and words; `view-picture`: a PNG of the view with this `index`, in base64
//! - `inspect`, `brightest`, `errors`: paths of a pixel, its brightest samples, and errors of compared renders
//!
//! The header of a picture has its `channel` and size, `size` of the whole picture, `samples`, `moves` of the camera, `preview`, `final`,
//! `exposure`, and `denoised`: false for pictures of the channel of that name which still have their noise.

use crate::camera::{CameraDescription, CameraParameters};
use crate::math::Vec3;
use serde::{Deserialize, Serialize, Serializer};

/// What a page asks for.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(tag = "do", rename_all = "kebab-case", deny_unknown_fields)]
pub(super) enum Command {
    /// Look through this camera.
    Camera(PageCamera),
    /// Set a parameter, by its key in scene files, to what a flag would say; nothing for the default.
    Set { key: String, value: Option<String> },
    /// Render no further samples for now.
    Pause {},
    /// Go on.
    Resume {},
    /// Render from the first sample on.
    Restart {},
    /// The numbers of a sample of a pixel.
    Inspect { x: u32, y: u32, sample: u32 },
    /// The object and the material of a pixel.
    Pick { x: u32, y: u32 },
    /// Cameras to choose from, with their pictures.
    Views {},
    /// Write the camera into the scene file.
    SaveCamera {},
    /// Change a key of a material.
    Material { name: String, key: String, value: String },
    /// Change a key of the light with this index in the scene file.
    Light { index: usize, key: String, value: String },
    /// Take all changes of materials and lights back.
    ResetChanges {},
    /// Write all changes of materials and lights into the scene file.
    SaveChanges {},
    /// The samples of a pixel that made it the brightest.
    Brightest { x: u32, y: u32 },
    /// Render beside the picture what it is with these settings, `KEY=VALUE` or an integrator, joined by `+`; nothing ends that.
    Compare { with: Option<String> },
    /// Show this channel on the page that asks, and a second one.
    Channel {
        name: String,
        #[serde(default)]
        second: Option<String>,
    },
    /// The page has shown a picture, for which it took so many milliseconds.
    Shown {
        frame: u64,
        #[serde(default)]
        ms: f64,
    },
}

/// A camera as pages know it: [`CameraParameters`] as lists of numbers.
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

/// The f64 that is written like `value`: 39.3077, not 39.307701110839844.
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
    /// Values of a camera at the beginning of its motion.
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

    /// The same as the rest of the program has it.
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
    /// Reads what a page has sent.
    ///
    /// # Errors
    ///
    /// What is wrong with it, in words.
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

    /// Whatever a page sends, there is an answer.
    #[test]
    fn nonsense_is_refused_in_words() {
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

    /// A camera that goes to a page and comes back has the same bits.
    #[test]
    fn cameras_come_back_as_they_went() {
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
