//! Environment maps: latitude-longitude pictures (Radiance, EXR) for infinitely distant light.
//!
//! Files contain invalid values for two reasons: resampling and colour conversions leave small
//! negative values, and a sun brighter than 65504 is infinite in 16-bit files. The reader replaces
//! such values with a warning: negative values and NaN by 0, infinite values by 65504. For infinite
//! values, 0 would remove the sun, and a value above 65504 would be a guess.

use super::FileError;
use super::header_limits::check_size;
pub use super::read_image::BYTES_OF_A_NEW_TEXEL;
use super::read_image::read_exr_within;
use crate::color::Spectrum;
use crate::files::input::Input;
use crate::files::memory::Allowance;
use crate::light::LatLongImage;
use image::codecs::hdr::HdrDecoder;
use image::{DynamicImage, ImageDecoder};
use std::path::Path;

/// Permanent memory of a texel of an environment, in bytes: its colour, and its entry in the
/// sampling tables.
const BYTES_OF_A_TEXEL: u64 = 20;

/// Permanent memory of an environment of `texels` texels, in bytes.
pub fn environment_bytes(texels: u64) -> u64 {
    texels * BYTES_OF_A_TEXEL
}

/// Value that replaces infinite channels: the largest 16-bit float.
const LARGEST_HALF: f32 = 65504.0;

/// An environment map, with a description of the values that were replaced.
#[derive(Debug)]
pub struct Environment {
    /// The picture. All channels are finite and at least 0.
    pub image: LatLongImage,
    /// Descriptions of the replaced channels.
    pub repairs: Vec<String>,
}

/// Reads a latitude-longitude picture, Radiance `.hdr` or `.exr`, in linear Rec.709.
pub fn read_environment(path: &Path, allowance: Allowance) -> Result<Environment, FileError> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    let mut image = match extension.as_deref() {
        Some("hdr" | "pic") => read_hdr(path, allowance)?,
        Some("exr") => {
            let image = read_exr_within(path, allowance)?;
            LatLongImage {
                width: image.width,
                height: image.height,
                texels: image.pixels.into_iter().map(Spectrum::from).collect(),
            }
        }
        _ => {
            return Err(FileError::new(path, "an environment must be an .hdr or .exr file"));
        }
    };
    if image.texels.is_empty() {
        return Err(FileError::new(path, "the image has no pixels"));
    }
    let repairs = repair(&mut image);
    Ok(Environment { image, repairs })
}

/// Counts the values that were replaced for one reason: negative, infinite or NaN.
#[derive(Clone, Copy, Default)]
struct ReplacedChannels {
    /// Number of texels with a replaced channel.
    texels: usize,
    /// Index of the texel with the replaced value of the largest magnitude, and this value.
    largest: Option<(usize, f32)>,
}

impl ReplacedChannels {
    /// Counts the replaced `values` of the texel `index`.
    fn count(&mut self, index: usize, values: impl Iterator<Item = f32>) {
        let mut found = false;
        for value in values {
            found = true;
            if self.largest.is_none_or(|(_, largest)| value.abs() > largest.abs()) {
                self.largest = Some((index, value));
            }
        }
        self.texels += usize::from(found);
    }

    /// Description of the replaced values. `what` is the reason, such as "negative", and `instead`
    /// the new value. `None` if nothing was replaced.
    fn sentence(&self, width: usize, what: &str, instead: &str) -> Option<String> {
        let (index, value) = self.largest?;
        let (noun, counts) = if self.texels == 1 {
            ("texel", "counts")
        } else {
            ("texels", "count")
        };
        let place = format!("column {}, row {}", index % width, index / width);
        let has_size = !value.is_nan() && value != f32::INFINITY;
        let place = match (self.texels, has_size) {
            (1, true) => format!("{value} at {place}"),
            (1, false) => format!("at {place}"),
            (_, true) => format!("the largest is {value} at {place}"),
            (_, false) => format!("the first at {place}"),
        };
        Some(format!(
            "{} {noun} with {what} channels ({place}), which {counts} as {instead}",
            self.texels
        ))
    }
}

/// Replaces channels that are negative, infinite or NaN, and describes them.
fn repair(image: &mut LatLongImage) -> Vec<String> {
    let [mut negative, mut infinite, mut nan] = [ReplacedChannels::default(); 3];
    for (index, texel) in image.texels.iter_mut().enumerate() {
        if texel.is_valid() {
            continue;
        }
        let values = texel.to_array();
        let of = |is: fn(f32) -> bool| values.into_iter().filter(move |value| is(*value));
        negative.count(index, of(|value| value < 0.0));
        infinite.count(index, of(|value| value == f32::INFINITY));
        nan.count(index, of(f32::is_nan));
        *texel = Spectrum::from(values.map(|value| match value {
            f32::INFINITY => LARGEST_HALF,
            _ if value > 0.0 => value,
            _ => 0.0,
        }));
    }
    let sentences = [
        negative.sentence(image.width, "negative", "0"),
        nan.sentence(image.width, "NaN", "0"),
        infinite.sentence(image.width, "infinite", "65504, the largest 16-bit float"),
    ];
    sentences.into_iter().flatten().collect()
}

fn read_hdr(path: &Path, allowance: Allowance) -> Result<LatLongImage, FileError> {
    let input = Input::open(path, "the picture").map_err(|error| error.help_if_none("check the path"))?;
    let (length, failure) = (input.length(), input.failure());
    let failed = |error: &dyn std::fmt::Display| {
        let error = FileError::new(path, format!("cannot decode the image: {error}"));
        failure.or(
            path,
            error.help("the file is damaged or no .hdr file: export or download it again"),
        )
    };
    let decoder = HdrDecoder::new(input.buffered(path)?).map_err(|e| failed(&e))?;
    let (width, height) = decoder.dimensions();
    check_size(path, length, width as usize, height as usize)?;
    allowance.check(path, u64::from(width) * u64::from(height) * BYTES_OF_A_NEW_TEXEL)?;
    let image = DynamicImage::from_decoder(decoder)
        .map_err(|e| failed(&e))?
        .into_rgb32f();
    Ok(LatLongImage {
        width: image.width() as usize,
        height: image.height() as usize,
        texels: image.pixels().map(|p| Spectrum::from(p.0)).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_environment(path: &Path) -> Result<LatLongImage, FileError> {
        super::read_environment(path, Allowance::default()).map(|environment| environment.image)
    }

    #[test]
    fn both_formats_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let color = |x: usize, y: usize| [0.25 * x as f32, 0.5, 2.0 * y as f32];

        let exr = folder.path().join("a.exr");
        ::exr::prelude::write_rgb_file(&exr, 4, 2, |x, y| color(x, y).into()).unwrap();
        let image = read_environment(&exr).unwrap();
        assert_eq!((image.width, image.height), (4, 2));
        assert_eq!(image.texels[4 + 3].to_array(), color(3, 1));

        let hdr = folder.path().join("a.HDR");
        let pixels: Vec<image::Rgb<f32>> = (0..8).map(|i| image::Rgb(color(i % 4, i / 4))).collect();
        let file = std::fs::File::create(&hdr).unwrap();
        image::codecs::hdr::HdrEncoder::new(file).encode(&pixels, 4, 2).unwrap();
        let image = read_environment(&hdr).unwrap();
        let texel = image.texels[4 + 3].to_array();
        assert!(
            texel.iter().zip(color(3, 1)).all(|(a, b)| (a - b).abs() < 0.02),
            "{texel:?}"
        );
    }

    #[test]
    fn invalid_environment_is_an_error() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str, bytes: &[u8]| {
            let path = folder.path().join(name);
            std::fs::write(&path, bytes).unwrap();
            read_environment(&path).unwrap_err().message
        };
        assert!(file("a.png", b"x").contains(".hdr or .exr"));
        assert!(file("a.hdr", b"#?RADIANCE\n\n-Y 2 +X").contains("decode"));
        assert!(file("a.hdr", b"#?RADIANCE\n\n-Y 900000 +X 900000\n").contains("900000x900000"));
        assert!(file("a.exr", b"no").contains("cannot read"));
        assert!(
            read_environment(Path::new("gone.hdr"))
                .unwrap_err()
                .message
                .contains("no such")
        );
    }

    #[test]
    fn invalid_channels_are_replaced_and_described() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("n.exr");
        let texels = [
            [-1e-5, 2.0, 3.0],
            [1.0, -0.25, -0.5],
            [f32::NAN, 1.0, 1.0],
            [f32::INFINITY, 70000.0, f32::NEG_INFINITY],
        ];
        ::exr::prelude::write_rgb_file(&path, 4, 1, |x, _| <(f32, f32, f32)>::from(texels[x])).unwrap();
        let Environment { image, repairs } = super::read_environment(&path, Allowance::default()).unwrap();
        let read: Vec<[f32; 3]> = image.texels.iter().map(|texel| texel.to_array()).collect();
        assert_eq!(
            read,
            [
                [0.0, 2.0, 3.0],
                [1.0, 0.0, 0.0],
                [0.0, 1.0, 1.0],
                [65504.0, 70000.0, 0.0]
            ]
        );
        assert_eq!(
            repairs,
            [
                "3 texels with negative channels (the largest is -inf at column 3, row 0), which count as 0",
                "1 texel with NaN channels (at column 2, row 0), which counts as 0",
                "1 texel with infinite channels (at column 3, row 0), which counts as 65504, the largest 16-bit float",
            ]
        );
    }
}
