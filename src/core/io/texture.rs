//! Textures from pictures. A texture stores only the samples that it needs: an opacity map of 8
//! bits has one byte per texel, even if the file has colours.

use super::normal_map::BumpContent;
use super::picture::{Picture, PictureHeader, Samples};
use super::read_picture::{ChannelSelection, picture_size, png_gamma, read_picture};
use super::udim::Tiles;
use super::{FileError, LoadObserver};
use crate::color::Spectrum;
use crate::files::memory::Allowance;
use crate::texture::{Channel, Curve, Texels, Texture, TextureId, Wrap};
use rayon::prelude::*;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Use of a texture, which determines how the numbers of a file are interpreted.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TextureKind {
    /// Colours: numbers of 8 and 16 bits are sRGB-encoded. Alpha is kept unless it is 1 everywhere.
    Color,
    /// One linear number per texel: opacity, roughness, heights.
    Value(Channel),
    /// Opacity: the alpha of a picture of colours. If alpha is not the opacity of a cut-out
    /// (`Picture::is_cut_out`), reading the texture fails.
    CutOut,
    /// A normal map: three linear numbers.
    Normal,
    /// A normal map whose numbers are sRGB-encoded, as some programs write it.
    EncodedNormal,
    /// Heights. A picture that is a normal map is used as a normal map.
    HeightsOrNormals,
    /// A normal map. A grey picture is used as heights.
    NormalsOrHeights,
}

impl TextureKind {
    /// A height map whose heights are the luminances of the picture.
    pub const HEIGHTS: Self = Self::Value(Channel::Luminance);

    /// Replaces a kind that depends on the content of the picture (heights, normals and cut-outs)
    /// by the final kind.
    fn decided(self, picture: &Picture) -> Self {
        match self {
            Self::HeightsOrNormals | Self::NormalsOrHeights => match (BumpContent::of(picture), self) {
                (BumpContent::Normals, _) => Self::Normal,
                (BumpContent::EncodedNormals, _) => Self::EncodedNormal,
                (BumpContent::Heights, _) | (BumpContent::Unknown, Self::HeightsOrNormals) => Self::HEIGHTS,
                (BumpContent::Unknown, _) => Self::Normal,
            },
            Self::CutOut if picture.is_cut_out() => Self::Value(Channel::Matte),
            kind => kind,
        }
    }

    /// Returns true if the texture is a normal map.
    pub fn is_normal(self) -> bool {
        matches!(self, Self::Normal | Self::EncodedNormal)
    }

    /// Returns true if numbers of 8 and 16 bits are sRGB-encoded.
    fn is_encoded(self) -> bool {
        matches!(self, Self::Color | Self::EncodedNormal)
    }
}

/// A requested texture.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct TextureRequest {
    /// Path of the file.
    pub path: PathBuf,
    /// Use of the texture.
    pub kind: TextureKind,
    /// Extension of the picture beyond the unit square.
    pub wrap: Wrap,
    /// True for a texture of one texel, the mean of the picture. A normal map becomes flat.
    pub is_mean: bool,
}

/// Loaded textures. A texture that is requested several times is loaded once.
#[derive(Debug)]
pub struct LoadedTextures {
    /// Textures by id, in the order of their first request.
    pub textures: Vec<Texture>,
    /// Kinds of the textures, as requested or as determined by the picture.
    pub kinds: Vec<TextureKind>,
    /// Texture of each request, or the reason for its absence.
    pub ids: Vec<Result<TextureId, FileError>>,
    /// Warnings about repaired texels.
    pub warnings: Vec<FileError>,
    /// Messages about ignored metadata of pictures.
    pub ignored: Vec<FileError>,
}

impl LoadedTextures {
    /// Size of all textures in bytes.
    pub fn bytes(&self) -> usize {
        self.textures.iter().map(Texture::bytes).sum()
    }
}

/// Loads textures in the current rayon pool. Requests that differ only in the path to the same
/// file share one texture. Textures do not depend on the number of threads. If all textures
/// together need more memory than is free, no texture is loaded.
pub fn load_textures(requests: &[TextureRequest], observer: &dyn LoadObserver) -> LoadedTextures {
    load_textures_within(requests, Allowance::of_system(), observer).unwrap_or_else(|error| LoadedTextures {
        textures: Vec::new(),
        kinds: Vec::new(),
        ids: vec![Err(error); requests.len()],
        warnings: Vec::new(),
        ignored: Vec::new(),
    })
}

/// Loads textures within a memory limit. Returns an error if the textures need more memory.
pub fn load_textures_within(
    requests: &[TextureRequest],
    allowance: Allowance,
    observer: &dyn LoadObserver,
) -> Result<LoadedTextures, FileError> {
    // Find, for each request, the index of the first equal request
    let mut firsts = HashMap::new();
    let mut distinct = Vec::new();
    let places: Vec<usize> = requests
        .iter()
        .map(|request| {
            let path = request.path.canonicalize().unwrap_or_else(|_| request.path.clone());
            *firsts
                .entry((path, request.kind, request.wrap, request.is_mean))
                .or_insert_with(|| {
                    distinct.push(request);
                    distinct.len() - 1
                })
        })
        .collect();
    if !distinct.is_empty() {
        observer.begin("reading textures", distinct.len() as u64);
    }
    check_memory(&distinct, allowance)?;
    let load = |request: &&TextureRequest| {
        let texture = load_texture_within(&request.path, request.kind, request.wrap, allowance);
        observer.advance(1);
        texture
    };
    let results: Vec<Result<_, FileError>> = distinct.par_iter().map(load).collect();

    let (mut textures, mut kinds, mut warnings, mut ignored) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let mut ids = Vec::with_capacity(results.len());
    for (result, request) in results.into_iter().zip(&distinct) {
        ids.push(result.map(|(texture, kind, remarks)| {
            ignored.extend(remarks);
            if texture.replaced_texels() > 0 {
                let count = texture.replaced_texels();
                let message = match count {
                    1 => "1 texel is NaN, infinite or negative and counts as 0".into(),
                    _ => format!("{count} texels are NaN, infinite or negative and count as 0"),
                };
                warnings.push(FileError::new(&request.path, message));
            }
            let texture = match request.is_mean {
                true if kind.is_normal() => flat_normals(request.wrap).unwrap_or(texture),
                true => texture.mean(),
                false => texture,
            };
            textures.push(texture);
            kinds.push(kind);
            TextureId(textures.len() as u32 - 1)
        }));
    }
    Ok(LoadedTextures {
        textures,
        kinds,
        ids: places.into_iter().map(|place| ids[place].clone()).collect(),
        warnings,
        ignored,
    })
}

/// Normal map of one texel, whose normal is that of the surface.
fn flat_normals(wrap: Wrap) -> Option<Texture> {
    Texture::new(1, 1, 3, Texels::Floats(vec![0.5, 0.5, 1.0]), wrap)
}

/// Returns an error if all textures together need too much memory. The memory is estimated from the
/// headers, before the textures are read. Each thread reads one texture at a time. In the worst
/// case, the threads read the largest textures at the same time.
fn check_memory(requests: &[&TextureRequest], allowance: Allowance) -> Result<(), FileError> {
    let cost = |request: &&TextureRequest| {
        let size = header_of(&request.path, request.kind, allowance);
        // The error of an invalid header is reported when the picture is read.
        size.map_or((0, 0), |size| cost(&size, request.kind))
    };
    let costs: Vec<(u64, u64)> = requests.par_iter().map(cost).collect();
    let mut passing: Vec<u64> = costs.iter().map(|(_, passing)| *passing).collect();
    passing.sort_unstable_by(|a, b| b.cmp(a));
    let at_once: u64 = passing.iter().take(rayon::current_num_threads()).sum();
    let bytes = costs.iter().map(|(kept, _)| kept).sum::<u64>() + at_once;
    match costs
        .iter()
        .zip(requests)
        .max_by_key(|((kept, passing), _)| kept + passing)
    {
        Some((_, largest)) => {
            let what = match requests.len() {
                1 => "this file".to_string(),
                n => format!("all {n} textures, of which this is the largest,"),
            };
            let checked = allowance.check_reading(&largest.path, &what, bytes);
            checked.map_err(FileError::unreadable)
        }
        None => Ok(()),
    }
}

/// Header of a picture, or of all tiles of a picture together.
fn header_of(path: &Path, kind: TextureKind, allowance: Allowance) -> Result<PictureHeader, FileError> {
    let size = |path: &Path| picture_size(path, channels_for(kind), allowance);
    match Tiles::of_path(path) {
        Some(tiles) => size(tiles.files().next().unwrap_or(path)).map(|one| tiles.header(one)),
        None => size(path),
    }
}

/// Width and height of a picture in texels; `None` if it cannot be read.
pub fn texture_size(path: &Path) -> Option<(u64, u64)> {
    let header = picture_size(path, ChannelSelection::Colors, Allowance::of_system()).ok()?;
    Some((header.width, header.height))
}

/// Returns true if the header of a picture, or of one of its tiles, has alpha.
pub fn has_alpha(path: &Path) -> bool {
    let header = header_of(path, TextureKind::Color, Allowance::of_system());
    header.is_ok_and(|header| header.channels % 2 == 0)
}

/// Returns true if the colours of a picture, or of its first tile, are a tangent-space normal map.
/// Returns false if the picture cannot be read.
pub fn is_normal_map(path: &Path) -> bool {
    let tiles = Tiles::of_path(path);
    let first = tiles.as_ref().and_then(|tiles| tiles.files().next());
    let picture = read_picture(first.unwrap_or(path), ChannelSelection::Colors, Allowance::of_system());
    let content = picture.ok().map(|picture| BumpContent::of(&picture));
    matches!(content, Some(BumpContent::Normals | BumpContent::EncodedNormals))
}

/// Memory of a texture in bytes. The first number is the permanent memory. The second number is the
/// additional memory while the texture is read and its levels are computed.
fn cost(size: &PictureHeader, kind: TextureKind) -> (u64, u64) {
    let channels = match kind {
        TextureKind::Value(_) | TextureKind::CutOut => 1,
        _ => size.channels,
    };
    let halved = |(width, height): (u64, u64)| ((width / 2).max(1), (height / 2).max(1));
    let finest = (size.width, size.height);
    let levels = std::iter::successors(Some(finest), |&level| (level != halved(level)).then(|| halved(level)));
    let texels: u64 = levels.map(|(width, height)| width * height).sum();
    let kept = texels * channels * size.sample_bytes;
    // Levels are computed as floats. This needs memory for two rows of texels, the previous level
    // and the next level.
    let (width, height) = halved(finest);
    let floats = channels * (2 * size.width + width * height * 3 / 2);
    let chosen = size.width * size.height * channels * size.sample_bytes;
    let levelling = chosen + kept + floats * size_of::<f32>() as u64;
    (kept, size.reading_bytes().max(levelling) - kept)
}

/// Channels to read for a texture of this kind.
fn channels_for(kind: TextureKind) -> ChannelSelection {
    match kind {
        TextureKind::Value(Channel::Depth) => ChannelSelection::Depth,
        _ => ChannelSelection::Colors,
    }
}

/// Reads a picture as a texture of the given kind.
///
/// Pictures are used as they are stored: gamma chunks, colour profiles and the camera's orientation
/// are ignored.
pub fn load_texture(path: &Path, kind: TextureKind, wrap: Wrap) -> Result<Texture, FileError> {
    load_texture_within(path, kind, wrap, Allowance::of_system()).map(|(texture, ..)| texture)
}

/// Encoding exponent of sRGB in a chunk gAMA (PNG 3, §11.3.2.2).
const SRGB_GAMMA: f32 = 0.45455;

/// Messages about metadata of the picture at `path` that this program ignores, but other programs
/// apply.
fn ignored_metadata(path: &Path, kind: TextureKind, orientation: u8) -> Vec<FileError> {
    let mut ignored = Vec::new();
    if orientation != 1 {
        let message = format!("EXIF orientation {orientation} is ignored: the texture is not rotated");
        ignored.push(FileError::new(path, message).help("rotate the pixels, and save the picture without orientation"));
    }
    let gamma = (kind == TextureKind::Color).then(|| png_gamma(path)).flatten();
    if let Some(gamma) = gamma.filter(|gamma| (gamma / SRGB_GAMMA - 1.0).abs() > 0.02) {
        let message = format!("the exponent {gamma} in gAMA is ignored: colours are decoded by the sRGB curve");
        ignored.push(FileError::new(path, message).help("convert the picture to sRGB, and save it without gAMA"));
    }
    ignored
}

/// Reads a texture. Also returns the kind of the texture, and messages about ignored metadata.
fn load_texture_within(
    path: &Path,
    kind: TextureKind,
    wrap: Wrap,
    allowance: Allowance,
) -> Result<(Texture, TextureKind, Vec<FileError>), FileError> {
    let read = |path: &Path| read_picture(path, channels_for(kind), allowance);
    let picture = match Tiles::of_path(path) {
        Some(tiles) => tiles.picture(read)?,
        None => read(path)?,
    };
    let kind = kind.decided(&picture);
    if kind == TextureKind::CutOut {
        return Err(FileError::new(path, "the alpha of this picture is not a cut-out"));
    }
    if kind == TextureKind::Normal && picture.channels < 3 {
        let error = FileError::new(path, "a normal map has red, green and blue, but this picture is grey");
        return Err(error.help("use `bump_map` for a height map"));
    }
    let Picture {
        width,
        height,
        channels,
        samples,
        orientation,
    } = picture;
    let ignored = ignored_metadata(path, kind, orientation);
    let curve = if kind.is_encoded() { Curve::Srgb } else { Curve::Linear };
    let (channels, texels) = match samples {
        Samples::Bytes(samples) => {
            let (channels, samples) = chosen(samples, channels, kind);
            (channels, Texels::Bytes(samples, curve))
        }
        Samples::Shorts(samples) => {
            let (channels, samples) = chosen(samples, channels, kind);
            (channels, Texels::Shorts(samples, curve))
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
    let texture = Texture::new(width, height, channels, texels, wrap).ok_or_else(refused)?;
    Ok((texture, kind, ignored))
}

/// A sample of a picture.
trait Sample: Copy + PartialEq {
    /// Value of alpha for an opaque texel.
    const OPAQUE: Self;

    /// Luminance of a colour, rounded to this type.
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

/// Samples of a picture that a texture of the given kind keeps, and their number per texel.
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
        TextureKind::Value(Channel::Opacity) if is_opaque => Channel::Luminance,
        TextureKind::Value(Channel::Opacity) => Channel::Matte,
        TextureKind::Value(channel) => channel,
        _ if colors == channels => return (channels, samples),
        _ => return (colors, first(colors)),
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
