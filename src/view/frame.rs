//! Pictures for pages: pixel values and headers. `io::half_picture` computes the pixel values.

use crate::film::{Backing, Film};
use crate::io::half_picture;
use crate::io::packed::{ROUNDING, pack};
use serde_json::{Map, Value, json};
use std::sync::Arc;
use tungstenite::Bytes;

/// Channel of the denoised picture.
pub(super) const DENOISED: &str = "denoised";
/// Channel of the light groups, stacked from top to bottom.
pub(super) const LIGHTS: &str = "lights";
/// Channel of the second render.
pub(super) const RIVAL: &str = "compared";

/// A picture for pages. Clones share the data.
#[derive(Clone)]
pub(super) struct Frame {
    /// Number of the picture; the first picture has the number 1.
    pub id: u64,
    header: Arc<Map<String, Value>>,
    /// Red, green and blue of each pixel, row by row.
    halves: Arc<Vec<u16>>,
    width: usize,
    /// True if the pixel values must not be rounded: final pictures are sent without loss, and ids
    /// are never rounded.
    is_exact: bool,
}

/// Encoding of the pixel values in a message.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Encoding {
    /// The 16-bit floats are sent unchanged.
    Plain,
    /// The 16-bit floats are packed, and rounded if the picture is not final.
    Packed,
}

impl Frame {
    /// A picture of `size`, which the page scales to the size of the whole picture. If `values` has
    /// more rows than `size`, the further rows are data below the picture. `facts` are added to the
    /// header.
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
        Self {
            id,
            header: Arc::new(header),
            halves: Arc::new(half_picture::halves(values)),
            width: size[0] as usize,
            is_exact: is_final || channel == half_picture::IDS,
        }
    }

    /// A frame with the light of `film`. If the film has a background, its coverage is added.
    pub fn of_film(id: u64, channel: &str, film: &Film, facts: &Value, is_final: bool) -> Self {
        let size = film.crop().size().to_array();
        let frame = Self::new(id, channel, size, &half_picture::light(film), facts, is_final);
        match film.backing().zip(half_picture::coverage(film)) {
            Some((backing, coverage)) => frame.over(backing, &coverage),
            None => frame,
        }
    }

    /// Adds the background `backing`. `coverage` has red, green and blue of each pixel, and is
    /// appended below the picture.
    pub fn over(self, backing: Backing, coverage: &[f32]) -> Self {
        let mut header = (*self.header).clone();
        header.insert(
            "backing".into(),
            match backing {
                Backing::Transparent => json!("transparent"),
                Backing::Color(color) => json!(color.to_array()),
            },
        );
        let mut halves = (*self.halves).clone();
        halves.extend(half_picture::halves(coverage));
        Self {
            header: Arc::new(header),
            halves: Arc::new(halves),
            ..self
        }
    }

    /// The message for pages, with the pixel values encoded as `coding`.
    pub fn message(&self, coding: Encoding) -> Bytes {
        let mut header = (*self.header).clone();
        let rounding = match (coding, self.is_exact) {
            (Encoding::Packed, false) => ROUNDING,
            _ => 0,
        };
        let packed = (coding == Encoding::Packed).then(|| pack(&self.halves, self.width, rounding));
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
            None => half_picture::append_bytes(&self.halves, &mut bytes),
        }
        Bytes::from(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Spectrum;
    use crate::film::{Film, FilmSample, Rect, SampleChange};
    use crate::io::half_picture::{MAX_HALF, PICTURE, light};
    use crate::math::UVec2;
    use half::f16;

    /// Pixels have the right position, pixels without samples are NaN, and very bright values stay
    /// finite.
    #[test]
    fn pixels_of_a_message() {
        let size = UVec2::new(20, 18);
        let mut film = Film::new(size, Rect::full(size));
        for pixel in [UVec2::new(0, 0), UVec2::new(19, 17)] {
            let tile = film.tile_at_mut(pixel).unwrap();
            let mut block = tile.block();
            block.add(&FilmSample {
                radiance: Spectrum::rgb(0.5, 2.0 + pixel.x as f32, 1e9),
                ..FilmSample::default()
            });
            tile.change(pixel, &block, SampleChange::Add);
        }
        let values = light(&film);
        let frame = Frame::new(7, PICTURE, size.to_array(), &values, &json!({ "samples": 1 }), false);
        let bytes = frame.message(Encoding::Plain);
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

    /// Light may be rounded if it is packed and not final. Ids are never rounded.
    #[test]
    fn ids_are_not_rounded() {
        let rounding = |channel, is_final| {
            let frame = Frame::new(1, channel, [1, 1], &[129.0, 3.0, 0.0], &json!({}), is_final);
            let bytes = frame.message(Encoding::Packed);
            let length = u32::from_le_bytes(bytes[..4].try_into().unwrap()) as usize;
            let header: Value = serde_json::from_slice(&bytes[4..4 + length]).unwrap();
            header["packed"]["rounding"].as_u64().unwrap()
        };
        assert!(rounding(PICTURE, false) > 0);
        assert_eq!(
            [(PICTURE, true), (half_picture::IDS, false)].map(|(c, f)| rounding(c, f)),
            [0, 0]
        );
    }
}
