//! Conversion of pictures to 16-bit floats, with red, green and blue per pixel, for programs that
//! display the pictures.

use crate::film::{Channel, Film, Image};
use half::slice::{HalfBitsSliceExt, HalfFloatSliceExt};

/// Name of the layer with the light of the picture: the channels `R`, `G` and `B`.
pub const PICTURE: &str = "picture";

/// Name of the layer with object ids.
pub const IDS: &str = "id";

/// Largest finite 16-bit float.
pub const MAX_HALF: f32 = 65504.0;

/// Converts `values` to bits of 16-bit floats.
pub fn halves(values: &[f32]) -> Vec<u16> {
    let mut halves = vec![0; values.len()];
    halves
        .reinterpret_cast_mut::<half::f16>()
        .convert_from_f32_slice(values);
    halves
}

/// Appends `halves` to `bytes`, the low byte of each first.
pub fn append_bytes(halves: &[u16], bytes: &mut Vec<u8>) {
    bytes.extend(halves.iter().flat_map(|half| half.to_le_bytes()));
}

/// Red, green and blue of each pixel of the crop. NaN if the pixel has no sample.
pub fn light(film: &Film) -> Vec<f32> {
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

/// Coverage of each pixel by surfaces, as three values for red, green and blue. `None` if `film`
/// does not sum its background.
pub fn coverage(film: &Film) -> Option<Vec<f32>> {
    film.backing()?;
    let pixels = film.crop().pixels();
    Some(
        pixels
            .flat_map(|pixel| film.coverage(pixel).unwrap_or_default())
            .collect(),
    )
}

/// Values of the layers `names` of `image`, one layer after the other.
pub fn stacked(image: &Image, names: &[String]) -> Vec<f32> {
    names.iter().filter_map(|name| layer(image, name)).flatten().collect()
}

/// Clamps `value` to the range of a 16-bit float.
fn shown(value: f32) -> f32 {
    value.clamp(-MAX_HALF, MAX_HALF)
}

/// Names of the layers of `channels`, each once. The layer of `R`, `G` and `B` is [`PICTURE`].
pub fn layers<'a>(channels: impl Iterator<Item = &'a str>) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for name in channels.map(layer_of) {
        if names.iter().all(|known| known != name) {
            names.push(name.into());
        }
    }
    names
}

/// Layer of the channel `name`.
fn layer_of(name: &str) -> &str {
    match name.rsplit_once('.') {
        Some((layer, _)) => layer,
        None if matches!(name, "R" | "G" | "B") => PICTURE,
        None => name,
    }
}

/// Three values per pixel of a layer. A single channel is repeated three times. `None` if the layer
/// does not exist.
pub fn layer(image: &Image, name: &str) -> Option<Vec<f32>> {
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

/// Object id of each pixel as three values: the lowest eleven bits, the higher bits, and 0. A
/// 16-bit float holds eleven bits exactly. `None` if the image has no ids.
pub fn ids(image: &Image) -> Option<Vec<f32>> {
    const LAST: f32 = 2048.0;
    let channel = image.channels.iter().find(|c| c.name == "id.object")?;
    let split = |id: &f32| [id % LAST, (id / LAST).floor(), 0.0];
    Some(channel.values.iter().flat_map(split).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::Rect;
    use crate::math::UVec2;

    #[test]
    fn layers_have_three_values() {
        let size = UVec2::new(1, 1);
        let image = Film::new(size, Rect::full(size)).develop();
        let names = layers(image.channels.iter().map(|c| &*c.name));
        let expected = ["picture", "albedo", "N", "Z", "emitted", "variance", "samples"];
        assert_eq!(names, expected);
        for name in &names {
            assert_eq!(layer(&image, name).map(|values| values.len()), Some(3), "{name}");
        }
        assert_eq!(layer(&image, "Z"), Some(vec![65504.0; 3]));
        assert_eq!(layer(&image, "none"), None);
    }

    #[test]
    fn ids_are_exact() {
        let size = UVec2::new(3, 1);
        let mut image = Film::new(size, Rect::full(size)).develop();
        assert_eq!(ids(&image), None);
        image.channels.push(Channel {
            name: "id.object".into(),
            values: vec![0.0, 2047.0, 70_001.0],
        });
        let values = ids(&image).unwrap();
        assert_eq!(values, [0.0, 0.0, 0.0, 2047.0, 0.0, 0.0, 369.0, 34.0, 0.0]);
    }
}
