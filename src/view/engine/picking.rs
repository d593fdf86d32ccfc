//! The object and material under the pointer of a page.

use super::Engine;
use super::groups::is_of_light;
use crate::math::UVec2;
use crate::session::Renderer;
use serde_json::{Value, json};

/// Maximum number of columns and rows of an outline.
const MAX_CELLS: u32 = 512;

impl Engine<'_> {
    /// Object and material of a pixel, and their outline in the picture.
    pub(super) fn pick(&self, renderer: &Renderer, pixel: [u32; 2]) -> Result<Value, String> {
        let session = renderer.session();
        let (scene, size) = (session.scene(), session.settings().resolution);
        if pixel[0] >= size.x || pixel[1] >= size.y {
            return Err(format!("pixel {},{} is outside the image", pixel[0], pixel[1]));
        }
        let mut answer = json!({ "type": "pick", "pixel": pixel, "moves": self.moves });
        if let Some(picked) = renderer.pick(pixel.into()) {
            let longest = size.max_element();
            let cells = (size * MAX_CELLS.min(longest) / longest).max(UVec2::ONE);
            let material = &scene.material(&picked.hit).name;
            answer["object"] = json!(scene.objects().get(scene.object(&picked.hit) as usize));
            answer["material"] = json!(material);
            // Surfaces of `[[light]]` have materials that a page cannot change.
            answer["is_light"] = json!(is_of_light(material));
            answer["position"] = json!(picked.position.to_array());
            answer["outline"] = json!({ "size": cells.to_array(), "runs": renderer.outline(&picked, cells) });
        }
        Ok(answer)
    }
}
