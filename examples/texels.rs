//! Writes the texels of a picture as a texture of the renderer has them, to compare them with other
//! programs (`benches/peers/textures.py`):
//!
//! ```text
//! cargo run --release --example texels -- picture.tif color out/texels.bin
//! ```
//!
//! The second argument is the kind of texture: `color` for linear colours of sRGB codes, `normal`
//! for three linear numbers, or `value` for the linear number of the first channel. The file has
//! width, height and number of values per texel as `u32`. Then it has the values as `f32`, row by
//! row from the top, with alpha last if the texture has alpha.

use embrasure::io::{TextureKind, load_texture};
use embrasure::math::Vec2;
use embrasure::texture::{Channel, Wrap};
use std::error::Error;
use std::path::Path;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [input, kind, output] = arguments.as_slice() else {
        return Err("three arguments are expected: a picture, its kind, and the file to write".into());
    };
    let kind = match kind.as_str() {
        "color" => TextureKind::Color,
        "normal" => TextureKind::Normal,
        "value" => TextureKind::Value(Channel::Red),
        _ => return Err(format!("{kind}: the kind is color, normal or value").into()),
    };
    let texture = load_texture(Path::new(input), kind, Wrap::Clamp)?;
    let (width, height) = texture.size();
    let mut values = Vec::new();
    for y in 0..height {
        for x in 0..width {
            let size = Vec2::new(width as f32, height as f32);
            let uv = Vec2::new(x as f32 + 0.5, (height - y) as f32 - 0.5) / size;
            match kind {
                TextureKind::Normal => values.extend((0.5 * (texture.normal(uv, 0.0) + 1.0)).to_array()),
                TextureKind::Color => values.extend(texture.color(uv, 0.0).to_array()),
                _ => values.push(texture.value(uv, 0.0)),
            }
            if texture.has_alpha() {
                values.push(texture.alpha(uv, 0.0));
            }
        }
    }
    let channels = values.len() / (width * height);
    let header = [width, height, channels].map(|n| (n as u32).to_le_bytes());
    let values = values.iter().flat_map(|value| value.to_le_bytes());
    let bytes: Vec<u8> = header.into_iter().flatten().chain(values).collect();
    std::fs::write(output, bytes)?;
    Ok(())
}
