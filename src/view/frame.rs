//! Pictures for pages: a channel of a film as 16-bit floats.

use crate::film::{Channel, Film, Image};
use half::f16;
use half::slice::HalfFloatSliceExt;
use serde_json::{Value, json};
use tungstenite::Bytes;

/// The channel of light.
pub(super) const PICTURE: &str = "picture";
/// The same without its noise.
pub(super) const DENOISED: &str = "denoised";

/// The largest number that a 16-bit float can be.
const MAX_HALF: f32 = 65504.0;

/// A picture for pages.
#[derive(Clone)]
pub(super) struct Frame {
    /// Counts from 1.
    pub id: u64,
    /// The whole message.
    pub bytes: Bytes,
}

/// Red, green and blue of each pixel of the crop; NaN where it has no sample.
pub(super) fn light(film: &Film) -> Vec<f32> {
    let crop = film.crop();
    let width = crop.size().x as usize;
    let mut values = vec![f32::NAN; 3 * crop.area() as usize];
    for (pixel, sums) in film.pixels() {
        if sums.samples() > 0 {
            let at = pixel - crop.min;
            let first = 3 * (at.y as usize * width + at.x as usize);
            for (c, value) in values[first..first + 3].iter_mut().enumerate() {
                *value = shown(sums.mean(c) as f32);
            }
        }
    }
    values
}

/// What a page can be shown of `value`.
fn shown(value: f32) -> f32 {
    value.clamp(-MAX_HALF, MAX_HALF)
}

/// Layers of channels: each once, and [`PICTURE`] for light.
pub(super) fn layers<'a>(channels: impl Iterator<Item = &'a str>) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for name in channels.map(layer_of) {
        if names.iter().all(|known| known != name) {
            names.push(name.into());
        }
    }
    names
}

/// The layer that the channel `name` belongs to.
fn layer_of(name: &str) -> &str {
    match name.rsplit_once('.') {
        Some((layer, _)) => layer,
        None if matches!(name, "R" | "G" | "B") => PICTURE,
        None => name,
    }
}

/// Three values of each pixel of a layer, a single channel three times; `None`: there is no such layer.
pub(super) fn layer(image: &Image, name: &str) -> Option<Vec<f32>> {
    let channels: Vec<&Channel> = image
        .channels
        .iter()
        .filter(|c| layer_of(&c.name) == name)
        .take(3)
        .collect();
    let of = |c: usize| {
        channels
            .get(c)
            .or(if channels.len() == 1 { channels.first() } else { None })
    };
    channels.first()?;
    let mut values = vec![0.0; 3 * image.crop.area() as usize];
    for c in 0..3 {
        if let Some(channel) = of(c) {
            for (pixel, value) in values.chunks_exact_mut(3).zip(&channel.values) {
                pixel[c] = shown(*value);
            }
        }
    }
    Some(values)
}

/// The message of a picture of `size`, which is scaled to that of the whole picture on the page. `facts` join its header.
pub(super) fn message(id: u64, channel: &str, size: [u32; 2], values: &[f32], facts: &Value) -> Frame {
    let mut header = json!({ "frame": id, "channel": channel, "width": size[0], "height": size[1] });
    if let (Some(header), Some(facts)) = (header.as_object_mut(), facts.as_object()) {
        header.extend(facts.clone());
    }
    let header = header.to_string();
    let mut halves = vec![f16::ZERO; values.len()];
    halves.convert_from_f32_slice(values);
    let mut bytes = Vec::with_capacity(4 + header.len() + 2 * halves.len());
    bytes.extend_from_slice(&(header.len() as u32).to_le_bytes());
    bytes.extend_from_slice(header.as_bytes());
    halves
        .iter()
        .for_each(|half| bytes.extend_from_slice(&half.to_le_bytes()));
    Frame {
        id,
        bytes: Bytes::from(bytes),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Spectrum;
    use crate::film::{Block, Rect};
    use crate::math::UVec2;

    /// Pixels land where they belong, pixels without samples are NaN, and what is too bright stays finite.
    #[test]
    fn pixels_of_a_message() {
        let size = UVec2::new(20, 18);
        let mut film = Film::new(size, Rect::full(size));
        for pixel in [UVec2::new(0, 0), UVec2::new(19, 17)] {
            let mut block = Block::default();
            block.add(Spectrum::rgb(0.5, 2.0 + pixel.x as f32, 1e9), None);
            film.tile_at_mut(pixel).unwrap().sums_mut(pixel).unwrap().add(&block);
        }
        let values = light(&film);
        let frame = message(7, PICTURE, size.to_array(), &values, &json!({ "samples": 1 }));
        let (length, rest) = frame.bytes.split_at(4);
        let length = u32::from_le_bytes(length.try_into().unwrap()) as usize;
        let (header, pixels) = rest.split_at(length);
        let header: Value = serde_json::from_slice(header).unwrap();
        assert_eq!(
            header,
            json!({ "frame": 7, "channel": "picture", "width": 20, "height": 18, "samples": 1 })
        );
        assert_eq!(pixels.len(), 20 * 18 * 6);
        let half = |i: usize| f16::from_le_bytes([pixels[2 * i], pixels[2 * i + 1]]).to_f32();
        assert_eq!([half(0), half(1), half(2)], [0.5, 2.0, MAX_HALF]);
        assert!(half(3).is_nan());
        let last = 3 * (20 * 18 - 1);
        assert_eq!([half(last), half(last + 1)], [0.5, 21.0]);
    }

    #[test]
    fn layers_have_three_values() {
        let size = UVec2::new(1, 1);
        let image = Film::new(size, Rect::full(size)).develop();
        let names = layers(image.channels.iter().map(|c| &*c.name));
        assert_eq!(names, ["picture", "albedo", "N", "Z", "variance", "samples"]);
        for name in &names {
            assert_eq!(layer(&image, name).map(|values| values.len()), Some(3), "{name}");
        }
        assert_eq!(layer(&image, "Z"), Some(vec![65504.0; 3]));
        assert_eq!(layer(&image, "none"), None);
    }
}
