//! Pictures for pages: channels of a film as 16-bit floats.

use super::coding::{ROUNDING, pack};
use crate::film::{Channel, Film, Image};
use half::slice::{HalfBitsSliceExt, HalfFloatSliceExt};
use serde_json::{Map, Value, json};
use std::sync::Arc;
use tungstenite::Bytes;

/// The channel of light.
pub(super) const PICTURE: &str = "picture";
/// The same without its noise.
pub(super) const DENOISED: &str = "denoised";
/// The light of each light group by itself, one below the other.
pub(super) const LIGHTS: &str = "lights";
/// The light of the render beside the first.
pub(super) const RIVAL: &str = "compared";

/// The largest number that a 16-bit float can be.
const MAX_HALF: f32 = 65504.0;

/// A picture for pages; copies share it.
#[derive(Clone)]
pub(super) struct Frame {
    /// Counts from 1.
    pub id: u64,
    header: Arc<Map<String, Value>>,
    /// Red, green and blue of each pixel, row by row.
    halves: Arc<Vec<u16>>,
    width: usize,
    /// Whether it stays: pages are then shown it without any loss.
    is_final: bool,
}

/// How a message has the numbers of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Coding {
    /// As they are.
    Plain,
    /// Packed, and rounded as long as the picture is not final.
    Packed,
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

/// The layers `names` of `image`, one after the other.
pub(super) fn stacked(image: &Image, names: &[String]) -> Vec<f32> {
    names.iter().filter_map(|name| layer(image, name)).flatten().collect()
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

impl Frame {
    /// The picture of `size`, which is scaled to that of the whole picture on the page; of `values` that are more, the rest stands below. `facts` join its header.
    pub fn new(id: u64, channel: &str, size: [u32; 2], values: &[f32], facts: &Value, is_final: bool) -> Self {
        let mut header = Map::new();
        header.insert("frame".into(), json!(id));
        header.insert("channel".into(), json!(channel));
        header.insert("width".into(), json!(size[0]));
        header.insert("height".into(), json!(size[1]));
        header.insert("final".into(), json!(is_final));
        if let Some(facts) = facts.as_object() {
            header.extend(facts.clone());
        }
        let mut halves = vec![0; values.len()];
        halves
            .reinterpret_cast_mut::<half::f16>()
            .convert_from_f32_slice(values);
        Self {
            id,
            header: Arc::new(header),
            halves: Arc::new(halves),
            width: size[0] as usize,
            is_final,
        }
    }

    /// The message of it.
    pub fn message(&self, coding: Coding) -> Bytes {
        let mut header = (*self.header).clone();
        let rounding = match (coding, self.is_final) {
            (Coding::Packed, false) => ROUNDING,
            _ => 0,
        };
        let packed = (coding == Coding::Packed).then(|| pack(&self.halves, self.width, rounding));
        if packed.is_some() {
            header.insert(
                "packed".into(),
                json!({ "rounding": rounding, "values": self.halves.len() }),
            );
        }
        let header = Value::Object(header).to_string();
        let mut bytes = Vec::with_capacity(4 + header.len() + packed.as_ref().map_or(2 * self.halves.len(), Vec::len));
        bytes.extend_from_slice(&(header.len() as u32).to_le_bytes());
        bytes.extend_from_slice(header.as_bytes());
        match packed {
            Some(packed) => bytes.extend_from_slice(&packed),
            None => self
                .halves
                .iter()
                .for_each(|half| bytes.extend_from_slice(&half.to_le_bytes())),
        }
        Bytes::from(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Spectrum;
    use crate::film::{Block, Rect};
    use crate::math::UVec2;
    use half::f16;

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
        let frame = Frame::new(7, PICTURE, size.to_array(), &values, &json!({ "samples": 1 }), false);
        let bytes = frame.message(Coding::Plain);
        let (length, rest) = bytes.split_at(4);
        let length = u32::from_le_bytes(length.try_into().unwrap()) as usize;
        let (header, pixels) = rest.split_at(length);
        let header: Value = serde_json::from_slice(header).unwrap();
        assert_eq!(
            header,
            json!({ "frame": 7, "channel": "picture", "width": 20, "height": 18, "final": false, "samples": 1 })
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
