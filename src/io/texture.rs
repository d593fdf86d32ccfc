use super::read_picture::{Picture, Samples, Wanted, read_picture};
use super::{FileError, LoadObserver};
use crate::color::{Spectrum, srgb};
use crate::texture::{Channel, Curve, Texels, Texture, TextureId, Wrap};
use rayon::prelude::*;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// What a texture is for, which decides how a file's numbers are meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TextureKind {
    /// Colours: numbers of 8 and 16 bits are sRGB-encoded. Alpha is kept where there is any.
    Color,
    /// One number of each texel, linear: opacity, roughness, heights.
    Value(Channel),
    /// A normal map: three numbers, linear.
    Normal,
}

/// A texture that is asked for.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct TextureRequest {
    /// The file.
    pub path: PathBuf,
    /// What it is for.
    pub kind: TextureKind,
    /// What lies beside the unit square.
    pub wrap: Wrap,
}

/// Textures that were read, each once.
#[derive(Debug)]
pub struct LoadedTextures {
    /// By id, in the order in which they were asked for first.
    pub textures: Vec<Texture>,
    /// For each request its texture, or why there is none.
    pub ids: Vec<Result<TextureId, FileError>>,
    /// What was repaired.
    pub warnings: Vec<FileError>,
}

impl LoadedTextures {
    /// Bytes of all textures.
    pub fn bytes(&self) -> usize {
        self.textures.iter().map(Texture::bytes).sum()
    }
}

/// Reads what is asked for in the current rayon pool. Requests for one file, also by different names, that agree in all else
/// share a texture. The number of threads has no influence on anything.
pub fn load_textures(requests: &[TextureRequest], observer: &dyn LoadObserver) -> LoadedTextures {
    // Requests by the first that asks for the same
    let mut firsts = HashMap::new();
    let mut distinct = Vec::new();
    let places: Vec<usize> = requests
        .iter()
        .map(|request| {
            let path = request.path.canonicalize().unwrap_or_else(|_| request.path.clone());
            *firsts.entry((path, request.kind, request.wrap)).or_insert_with(|| {
                distinct.push(request);
                distinct.len() - 1
            })
        })
        .collect();
    if !distinct.is_empty() {
        observer.begin("reading textures", distinct.len() as u64);
    }
    let load = |request: &&TextureRequest| {
        let texture = load_texture(&request.path, request.kind, request.wrap);
        observer.advance(1);
        texture
    };
    let results: Vec<Result<Texture, FileError>> = distinct.par_iter().map(load).collect();

    let (mut textures, mut warnings) = (Vec::new(), Vec::new());
    let mut ids = Vec::with_capacity(results.len());
    for (result, request) in results.into_iter().zip(&distinct) {
        ids.push(result.map(|texture| {
            if texture.replaced_texels() > 0 {
                let count = texture.replaced_texels();
                let message = format!("{count} texels are NaN, infinite or negative and count as 0");
                warnings.push(FileError::new(&request.path, message));
            }
            textures.push(texture);
            TextureId(textures.len() as u32 - 1)
        }));
    }
    LoadedTextures {
        textures,
        ids: places.into_iter().map(|place| ids[place].clone()).collect(),
        warnings,
    }
}

/// Reads a PNG, JPEG, TGA, BMP, Radiance or EXR picture as a texture of the given kind.
///
/// Pictures are taken as they are stored: without a look at gamma chunks, colour profiles or the camera's orientation.
pub fn load_texture(path: &Path, kind: TextureKind, wrap: Wrap) -> Result<Texture, FileError> {
    let wanted = match kind {
        TextureKind::Value(Channel::Depth) => Wanted::Depth,
        _ => Wanted::Colors,
    };
    let picture = read_picture(path, wanted)?;
    if kind == TextureKind::Normal && picture.channels < 3 {
        let error = FileError::new(path, "a normal map has red, green and blue, but this picture is grey");
        return Err(error.help("a picture of heights belongs to map_bump"));
    }
    let Picture {
        width,
        height,
        channels,
        samples,
    } = picture;
    let (channels, texels) = match samples {
        Samples::Bytes(samples) => {
            let curve = if kind == TextureKind::Color {
                Curve::Srgb
            } else {
                Curve::Linear
            };
            let (channels, samples) = chosen(samples, channels, kind);
            (channels, Texels::Bytes(samples, curve))
        }
        Samples::Shorts(samples) => {
            let (channels, mut samples) = chosen(samples, channels, kind);
            if kind == TextureKind::Color {
                linearize(&mut samples, channels);
            }
            (channels, Texels::Shorts(samples))
        }
        Samples::Floats(samples) => {
            let (channels, samples) = chosen(samples, channels, kind);
            (channels, Texels::Floats(samples))
        }
    };
    let refused = || {
        FileError::new(
            path,
            format!("a picture of {width}x{height} texels cannot be a texture"),
        )
    };
    Texture::new(width, height, channels, texels, wrap).ok_or_else(refused)
}

/// A number of a picture.
trait Sample: Copy + PartialEq {
    /// Of alpha, where all is covered.
    const OPAQUE: Self;

    /// Luminance of a colour, rounded to what this type has.
    fn luminance(rgb: [Self; 3]) -> Self;
}

impl Sample for u8 {
    const OPAQUE: Self = u8::MAX;

    fn luminance(rgb: [Self; 3]) -> Self {
        f32::luminance(rgb.map(f32::from)).round() as u8
    }
}

impl Sample for u16 {
    const OPAQUE: Self = u16::MAX;

    fn luminance(rgb: [Self; 3]) -> Self {
        f32::luminance(rgb.map(f32::from)).round() as u16
    }
}

impl Sample for f32 {
    const OPAQUE: Self = 1.0;

    fn luminance(rgb: [Self; 3]) -> Self {
        Spectrum::from(rgb).luminance()
    }
}

/// The samples of a picture that a texture of the given kind keeps, and how many those of a texel are.
fn chosen<T: Sample>(samples: Vec<T>, channels: usize, kind: TextureKind) -> (usize, Vec<T>) {
    let texels = || samples.chunks_exact(channels);
    let has_alpha = channels % 2 == 0;
    let is_opaque = !has_alpha || texels().all(|texel| texel[channels - 1] == T::OPAQUE);
    let colors = if channels < 3 { 1 } else { 3 };
    let first = |n: usize| texels().flat_map(|texel| &texel[..n]).copied().collect();

    let luminance = |texel: &[T]| match *texel {
        [r, g, b, ..] => T::luminance([r, g, b]),
        _ => texel[0],
    };
    let channel = match kind {
        TextureKind::Color if has_alpha && !is_opaque => return (channels, samples),
        TextureKind::Color | TextureKind::Normal if colors == channels => return (channels, samples),
        TextureKind::Color | TextureKind::Normal => return (colors, first(colors)),
        TextureKind::Value(Channel::Opacity) if is_opaque => Channel::Luminance,
        TextureKind::Value(Channel::Opacity) => Channel::Matte,
        TextureKind::Value(channel) => channel,
    };
    let value = |texel: &[T]| match channel {
        Channel::Green if colors == 3 => texel[1],
        Channel::Blue if colors == 3 => texel[2],
        Channel::Luminance => luminance(texel),
        Channel::Matte | Channel::Opacity if has_alpha => texel[channels - 1],
        Channel::Matte | Channel::Opacity => T::OPAQUE,
        _ => texel[0],
    };
    (1, texels().map(value).collect())
}

/// From the sRGB curve to linear values, but for alpha.
fn linearize(samples: &mut [u16], channels: usize) {
    let linear: Vec<u16> = (0..=u16::MAX)
        .map(|code| (srgb::decode(code as f32 / 65535.0) * 65535.0).round() as u16)
        .collect();
    for texel in samples.chunks_exact_mut(channels) {
        let colors = if channels < 3 { 1 } else { 3 };
        for sample in &mut texel[..colors] {
            *sample = linear[*sample as usize];
        }
    }
}
