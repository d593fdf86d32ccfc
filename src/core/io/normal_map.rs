//! Recognition of normal maps and height maps. MTL libraries use `map_Bump` for both.

use super::picture::{Picture, Samples};
use crate::color::srgb;

/// Content of a picture that a `map_Bump` statement names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum BumpContent {
    /// Heights: the picture is grey.
    Heights,
    /// A tangent-space normal map.
    Normals,
    /// A tangent-space normal map whose numbers are encoded by the sRGB curve, like colours.
    EncodedNormals,
    /// Other content, such as a coloured picture.
    Unknown,
}

/// Maximum number of texels that are examined.
const MAX_TEXELS: usize = 1 << 14;
/// A picture counts as grey if the mean difference between the largest and the smallest channel is
/// at most this number. It is not 0, because channels may differ after lossy compression.
const GREY: f32 = 0.02;
/// Maximum difference between 1 and the length of a unit vector. Filtering makes unit vectors
/// shorter.
const LENGTH_ERROR: f32 = 0.2;
/// In a normal map, at least this fraction of the vectors are unit vectors.
const UNIT_SHARE: f32 = 0.75;
/// In a normal map, at least this fraction of the opaque texels are vectors. Other texels are black
/// or grey, because they are the background of an atlas.
const USED_SHARE: f32 = 0.02;
/// Minimum z of the mean of all vectors of a normal map. z is the component away from the surface.
/// A large z makes a normal map bluish.
const MIN_UP: f32 = 0.35;
/// Maximum absolute x and y of the mean of all vectors. x and y are the components along the
/// surface.
const MAX_TILT: f32 = 0.2;

impl BumpContent {
    /// Recognises the content of a picture from its stored numbers.
    pub fn of(picture: &Picture) -> Self {
        let channels = picture.channels;
        if channels < 3 {
            return Self::Heights;
        }
        match &picture.samples {
            Samples::Bytes(samples) => Self::of_texels(samples, channels, |byte| f32::from(byte) / 255.0),
            Samples::Shorts(samples) => Self::of_texels(samples, channels, |short| f32::from(short) / 65535.0),
            Samples::Floats(samples) => match Self::of_texels(samples, channels, |value| value) {
                Self::EncodedNormals => Self::Unknown,
                content => content,
            },
        }
    }

    /// Content of a coloured picture with the samples `samples`, `channels` per texel.
    fn of_texels<T: Copy>(samples: &[T], channels: usize, value: impl Fn(T) -> f32) -> Self {
        // An odd step visits all columns of a picture whose width is a power of 2.
        let step = (samples.len() / channels / MAX_TEXELS) | 1;
        let texels = samples.chunks_exact(channels).step_by(step);
        let opaque = texels.filter(|texel| channels == 3 || value(texel[3]) > 0.0);
        let colors = opaque.map(|texel| [0, 1, 2].map(|c| value(texel[c])));
        let colors = colors.filter(|rgb| rgb.iter().all(|c| c.is_finite()));

        // Most pictures are grey, and decoding is slow, so vectors are computed only if they are
        // needed
        let (mut spread, mut seen) = (0.0, 0.0);
        for [r, g, b] in colors.clone() {
            spread += r.max(g).max(b) - r.min(g).min(b);
            seen += 1.0;
        }
        if spread <= GREY * seen {
            Self::Heights
        } else if Vectors::of(colors.clone()).are_normals(seen) {
            Self::Normals
        } else if Vectors::of(colors.map(|rgb| rgb.map(srgb::decode))).are_normals(seen) {
            Self::EncodedNormals
        } else {
            Self::Unknown
        }
    }
}

/// Sums over the texels of a picture, read as vectors.
#[derive(Default)]
struct Vectors {
    count: f32,
    /// Number of texels whose vector is a unit vector.
    units: f32,
    sum: [f32; 3],
}

impl Vectors {
    fn of(texels: impl Iterator<Item = [f32; 3]>) -> Self {
        let mut vectors = Self::default();
        texels.for_each(|rgb| vectors.add(rgb));
        vectors
    }

    /// Adds the vector of a texel. A black or grey texel is the background of an atlas and is
    /// skipped.
    fn add(&mut self, rgb: [f32; 3]) {
        let vector = rgb.map(|c| 2.0 * c - 1.0);
        let length = vector.iter().map(|c| c * c).sum::<f32>().sqrt();
        if rgb != [0.0; 3] && length > 0.1 {
            self.count += 1.0;
            self.units += f32::from((length - 1.0).abs() < LENGTH_ERROR);
            self.sum = [0, 1, 2].map(|c| self.sum[c] + vector[c]);
        }
    }

    /// Returns true if the vectors are normals: most of them are unit vectors, and their mean
    /// points away from the surface. `seen` is the number of opaque texels of the picture.
    fn are_normals(&self, seen: f32) -> bool {
        let [x, y, z] = self.sum.map(|component| component / self.count);
        let is_upright = z > MIN_UP && x.abs() < MAX_TILT && y.abs() < MAX_TILT;
        is_upright && self.units >= UNIT_SHARE * self.count && self.count >= USED_SHARE * seen
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Content of a picture of 32 × 32 texels with the colours `color`, stored in each of three
    /// precisions.
    fn content(color: impl Fn(f32, f32) -> [f32; 3]) -> [BumpContent; 3] {
        let at = |i: usize| color((i % 32) as f32 / 31.0, (i / 32) as f32 / 31.0);
        let floats: Vec<f32> = (0..32 * 32).flat_map(at).collect();
        let bytes = floats.iter().map(|c| (c * 255.0).round() as u8).collect();
        let shorts = floats.iter().map(|c| (c * 65535.0).round() as u16).collect();
        let of = |samples| {
            BumpContent::of(&Picture {
                width: 32,
                height: 32,
                channels: 3,
                samples,
                orientation: 1,
            })
        };
        [
            of(Samples::Bytes(bytes)),
            of(Samples::Shorts(shorts)),
            of(Samples::Floats(floats)),
        ]
    }

    /// Test picture: normals of a dome, as colours.
    fn dome(u: f32, v: f32) -> [f32; 3] {
        let (x, y) = (u - 0.5, v - 0.5);
        [x, y, (1.0 - x * x - y * y).sqrt()].map(|c| 0.5 * c + 0.5)
    }

    #[test]
    fn content_is_recognised_in_any_precision() {
        use BumpContent::{EncodedNormals, Heights, Normals, Unknown};
        assert_eq!(content(dome), [Normals; 3]);
        assert_eq!(content(|_, _| [0.5, 0.5, 1.0]), [Normals; 3], "a flat normal map");
        let on_black = |u, v| if u < 0.9 { [0.0; 3] } else { dome(0.5, v) };
        assert_eq!(content(on_black), [Normals; 3], "a small part of an atlas");
        assert_eq!(content(|u, v| [u * v; 3]), [Heights; 3]);
        assert_eq!(content(|_, _| [0.0; 3]), [Heights; 3], "all is black");
        assert_eq!(content(|u, v| [u, v, u + 0.005].map(|c| c.min(1.0)))[0], Unknown);
        assert_eq!(
            content(|u, _| [u, u, (u + 0.01).min(1.0)]),
            [Heights; 3],
            "tinted by compression"
        );
        for blue in [[0.4, 0.5, 0.8], [0.53, 0.81, 0.92], [0.0, 0.0, 1.0]] {
            assert_eq!(content(|_, _| blue), [Unknown; 3], "{blue:?}");
        }
        let encoded = [EncodedNormals, EncodedNormals, Unknown];
        assert_eq!(content(|u, v| dome(u, v).map(srgb::encode)), encoded);
        // Object-space normals point in all directions, so the picture is not a tangent-space
        // normal map.
        assert_eq!(content(|u, v| dome(u, v).map(|c| 1.0 - c)), [Unknown; 3]);
    }

    #[test]
    fn transparent_texels_are_ignored() {
        let of = |alpha: u8| {
            let samples = [[128, 128, 255, 255], [200, 10, 10, alpha]].repeat(8).concat();
            BumpContent::of(&Picture {
                width: 16,
                height: 1,
                channels: 4,
                samples: Samples::Bytes(samples),
                orientation: 1,
            })
        };
        assert_eq!([0, 255].map(of), [BumpContent::Normals, BumpContent::Unknown]);
    }
}
