//! Textures from files of every format. Some images are made in this test, others come from real
//! scenes.

use crate::support::program::{done, folder, printed, run, split, words};
use crate::support::{
    add, film_by, from_front, material, panel, path_tracer, read_channel, shared, sobol, with_world, write_png,
};
use ::exr::prelude::{self as exr, WritableImage, f16};
use embrasure::color::{Spectrum, srgb};
use embrasure::geometry::Mesh;
use embrasure::io::{LoadedTextures, TextureKind, TextureRequest, load_texture, load_textures};
use embrasure::material::{Map, Maps, Material};
use embrasure::math::{UVec2, Vec2};
use embrasure::sampler::{Dimension, Independent, SampleKey, Sampler};
use embrasure::scene::{Scene, SceneBuilder};
use embrasure::texture::{Channel, Curve, Mapping, Texels, Texture, TextureFilter, TextureId, Wrap};
use image::ExtendedColorType::{self, L8, Rgb8, Rgb16, Rgb32F, Rgba8};
use image::{ImageEncoder, codecs};
use png::{BitDepth, ColorType};
use std::io::Cursor;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

// An image of three columns and two rows. All texels differ, without symmetry.
const COLORS: [[u8; 3]; 6] = [
    [255, 0, 0],
    [0, 200, 0],
    [0, 0, 150],
    [90, 90, 90],
    [10, 60, 110],
    [250, 240, 5],
];
const ALPHAS: [u8; 6] = [255, 0, 51, 102, 153, 204];

/// The image with `channels` channels. Grey values are the red values of the colours.
fn picture(channels: usize) -> Vec<u8> {
    let texel = |i: usize| {
        let ([r, g, b], a) = (COLORS[i], ALPHAS[i]);
        match channels {
            1 => vec![r],
            2 => vec![r, a],
            3 => vec![r, g, b],
            _ => vec![r, g, b, a],
        }
    };
    (0..6).flat_map(texel).collect()
}

/// Faces without texture coordinates show the means of the textures, with one warning for each
/// material. Faces of the same material with texture coordinates show the texture.
#[test]
fn faces_without_coordinates_show_the_mean() {
    let folder = folder(&[
        (
            "a.mtl",
            "newmtl m\nKd 1 1 1\nmap_Kd a.png\nmap_Bump n.png\nnewmtl n\nKd 0.2 0.2 0.2\n",
        ),
        (
            "s.toml",
            "version = 1\n[camera]\nposition = [0, 0, 4]\nlook_at = [0, 0, 0]\n[image]\nwidth = 16\nheight = 8\n\
             [render]\nsamples = 16\n[[object]]\nobj = \"a.obj\"\n[[light]]\ntype = \"constant\"\nradiance = 1\n",
        ),
    ]);
    let at = folder.path();
    // The texel at (0, 0) is black.
    write_png(
        &at.join("a.png"),
        2,
        &[[200, 0, 90], [200, 160, 90], [0, 0, 90], [200, 0, 90]],
    );
    write_png(&at.join("n.png"), 1, &[[190, 60, 200]]);
    let mean = [
        0.75 * srgb::decode(200.0 / 255.0),
        0.25 * srgb::decode(160.0 / 255.0),
        srgb::decode(90.0 / 255.0),
    ];
    let render = |obj: &str| {
        std::fs::write(at.join("a.obj"), format!("mtllib a.mtl\n{obj}")).unwrap();
        let text = words(&done(at, &split("render s.toml --denoise=off -o t.exr")));
        let channels = ["albedo.R", "albedo.G", "albedo.B", "N.Z"].map(|name| read_channel(&at.join("t.exr"), name));
        (channels, text)
    };
    const LEFT: &str = "v -6 -6 0\nv 0 -6 0\nv 0 6 0\nv -6 6 0\nv 6 -6 0\nv 6 6 0\n";
    const UVS: &str = "vt 0.25 0.25\nvt 0.25 0.25\nvt 0.25 0.25\n";
    let left = "usemtl m\nf 1 2 3 4\n";
    let is_mean = |channels: &[Vec<f32>; 4], x: usize| {
        let near = |c: usize| channels[c].chunks(16).all(|row| (row[x] - mean[c]).abs() < 0.005);
        // A normal map without texture coordinates has no effect.
        (0..3).all(near) && channels[3].chunks(16).all(|row| row[x] > 0.999)
    };
    let (whole, text) = render(&format!("{LEFT}{left}f 2 5 6 3\n"));
    assert!(is_mean(&whole, 2) && is_mean(&whole, 13));
    let warning = "4 triangles of the textured material `m` have no texture coordinates; they show the mean colour of the texture";
    assert_eq!(text.matches(warning).count(), 1, "{text}");
    // With texture coordinates on the right, in any order of the faces
    let right = "usemtl m\nf 2/1 5/2 6/3 3/1\n";
    for (faces, part) in [
        (format!("{left}{right}"), ""),
        (format!("{right}{left}"), ""),
        (format!("{right}o x\n{left}"), "o x"),
    ] {
        let (mixed, text) = render(&format!("{LEFT}{UVS}{faces}"));
        assert!(is_mean(&mixed, 2), "{faces} {part}");
        assert!(mixed[0].chunks(16).all(|row| row[13] == 0.0), "{faces}");
        assert!(text.contains("2 triangles of the textured material `m`"), "{text}");
    }
    // Materials without textures need no texture coordinates.
    let (_, text) = render(&format!("{LEFT}usemtl n\nf 1 2 3 4\n"));
    assert!(!text.contains("texture coordinates"), "{text}");
    // Colours of vertices replace the texture.
    let (colored, text) = render(&format!("{}{left}", LEFT.replace(" 0\n", " 0 1 0 0\n")));
    assert!(
        colored[0].chunks(16).all(|row| (row[2] - 1.0).abs() < 0.005),
        "{:?}",
        colored[0]
    );
    assert!(text.contains("the colours of their vertices"), "{text}");
    let checked = printed(&run(at, &split("check s.toml")));
    assert_eq!(checked.matches("[missing-texture-coordinates]").count(), 1, "{checked}");
}

fn png_file(color: ColorType, depth: BitDepth, data: &[u8], palette: &[u8], alphas: &[u8]) -> Vec<u8> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, 3, 2);
    encoder.set_color(color);
    encoder.set_depth(depth);
    if !palette.is_empty() {
        encoder.set_palette(palette.to_vec());
        encoder.set_trns(alphas.to_vec());
    }
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(data).unwrap();
    writer.finish().unwrap();
    file
}

fn encoded(encoder: impl ImageEncoder, data: &[u8], size: (u32, u32), color: ExtendedColorType) {
    encoder.write_image(data, size.0, size.1, color).unwrap();
}

/// An uncompressed TGA file with rows from bottom to top and blue first, as most programs write it.
fn tga_file(channels: usize) -> Vec<u8> {
    let mut file = vec![
        0,
        0,
        2,
        0,
        0,
        0,
        0,
        0,
        0,
        0,
        0,
        0,
        3,
        0,
        2,
        0,
        8 * channels as u8,
        8 * (channels as u8 - 3),
    ];
    for y in [1, 0] {
        for texel in picture(channels).chunks(channels).skip(3 * y).take(3) {
            file.extend([texel[2], texel[1], texel[0]]);
            file.extend(&texel[3..]);
        }
    }
    file
}

/// A DDS file whose pixel format has `flags`, `name`, and the bit counts and masks of `masks`
/// (Microsoft, "Programming Guide for DDS").
fn dds_file(size: [u32; 2], flags: u32, name: &[u8; 4], masks: [u32; 5], data: &[u8]) -> Vec<u8> {
    let mut file = b"DDS ".to_vec();
    let numbers = |numbers: &[u32]| numbers.iter().flat_map(|n| n.to_le_bytes()).collect::<Vec<u8>>();
    file.extend(numbers(&[124, 0x1007, size[1], size[0], 0, 0, 0]));
    file.extend([0; 44]);
    file.extend(numbers(&[32, flags]));
    file.extend(name);
    file.extend(numbers(&masks));
    file.extend(numbers(&[0x1000, 0, 0, 0, 0]));
    file.extend(data);
    file
}

/// Content of an image file.
struct ImageContent {
    channels: usize,
    is_linear: bool,
    /// Maximum error of samples, relative to the value 1.
    tolerance: f64,
}

/// The image in files of every format and layout.
fn files(folder: &TempDir) -> Vec<(PathBuf, ImageContent)> {
    let mut all = Vec::new();
    let mut add = |name: &str, channels, is_linear, tolerance, bytes: &[u8]| {
        let path = folder.path().join(name);
        if !bytes.is_empty() {
            std::fs::write(&path, bytes).unwrap();
        }
        let sort = ImageContent {
            channels,
            is_linear,
            tolerance,
        };
        all.push((path, sort));
    };
    let layouts = [
        ColorType::Grayscale,
        ColorType::GrayscaleAlpha,
        ColorType::Rgb,
        ColorType::Rgba,
    ];
    for (channels, color) in (1..).zip(layouts) {
        let data = picture(channels);
        let wide: Vec<u8> = data.iter().flat_map(|&code| [code, code]).collect();
        let file = |depth, data| png_file(color, depth, data, &[], &[]);
        add(
            &format!("8-{channels}.png"),
            channels,
            false,
            0.0,
            &file(BitDepth::Eight, &data),
        );
        add(
            &format!("16-{channels}.png"),
            channels,
            false,
            0.0,
            &file(BitDepth::Sixteen, &wide),
        );
    }
    let palette = COLORS.as_flattened();
    let file = |depth, indices: &[u8]| png_file(ColorType::Indexed, depth, indices, palette, &ALPHAS);
    add(
        "palette-8.png",
        4,
        false,
        0.0,
        &file(BitDepth::Eight, &[0, 1, 2, 3, 4, 5]),
    );
    add(
        "palette-4.png",
        4,
        false,
        0.0,
        &file(BitDepth::Four, &[0x01, 0x20, 0x34, 0x50]),
    );

    // Blocks of 8 × 8, which keep their colours under compression
    let block = |channels: usize| -> Vec<u8> {
        let texel = |i: usize| picture(channels)[(i % 24 / 8 + i / (24 * 8) * 3) * channels..][..channels].to_vec();
        (0..24 * 16).flat_map(texel).collect()
    };
    for (channels, color) in [(1, L8), (3, Rgb8)] {
        let mut file = Vec::new();
        let encoder = codecs::jpeg::JpegEncoder::new_with_quality(&mut file, 100);
        encoded(encoder, &block(channels), (24, 16), color);
        add(&format!("{channels}.jpg"), channels, false, 0.02, &file);
    }
    for (channels, color) in [(1, L8), (3, Rgb8), (4, Rgba8)] {
        let mut file = Vec::new();
        encoded(
            codecs::tga::TgaEncoder::new(&mut file),
            &picture(channels),
            (3, 2),
            color,
        );
        add(&format!("packed-{channels}.tga"), channels, false, 0.0, &file);
        if channels > 1 {
            add(
                &format!("plain-{channels}.TGA"),
                channels,
                false,
                0.0,
                &tga_file(channels),
            );
        }
        let mut file = Cursor::new(Vec::new());
        encoded(
            codecs::bmp::BmpEncoder::new(&mut file),
            &picture(channels),
            (3, 2),
            color,
        );
        // A grey BMP has a palette.
        let read_as = if channels == 1 { 0 } else { channels };
        add(&format!("{channels}.bmp"), read_as, false, 0.0, file.get_ref());
    }

    for (channels, color) in [(1, L8), (3, Rgb8), (4, Rgba8)] {
        let mut file = Cursor::new(Vec::new());
        encoded(
            codecs::tiff::TiffEncoder::new(&mut file),
            &picture(channels),
            (3, 2),
            color,
        );
        add(&format!("{channels}.tif"), channels, false, 0.0, file.get_ref());
        if channels > 1 {
            let mut file = Vec::new();
            let encoder = codecs::webp::WebPEncoder::new_lossless(&mut file);
            encoded(encoder, &picture(channels), (3, 2), color);
            add(&format!("{channels}.webp"), channels, false, 0.0, &file);
        }
    }
    let wide: Vec<u8> = picture(3).iter().flat_map(|&code| [code, code]).collect();
    let mut file = Cursor::new(Vec::new());
    encoded(codecs::tiff::TiffEncoder::new(&mut file), &wide, (3, 2), Rgb16);
    add("16-3.tiff", 3, false, 0.0, file.get_ref());
    let floats = picture(3).into_iter().map(|code| f32::from(code) / 255.0);
    let floats: Vec<u8> = floats.flat_map(f32::to_ne_bytes).collect();
    let mut file = Cursor::new(Vec::new());
    encoded(codecs::tiff::TiffEncoder::new(&mut file), &floats, (3, 2), Rgb32F);
    add("float-3.tif", 3, true, 1e-6, file.get_ref());
    let mut file = Vec::new();
    let mut encoder = codecs::gif::GifEncoder::new(&mut file);
    encoder.encode(&picture(3), 3, 2, Rgb8).unwrap();
    drop(encoder);
    add("3.gif", 3, false, 0.0, &file);
    // Masks of red, green, blue and alpha, lowest byte first
    let masks = [32, 0xff, 0xff00, 0x00ff_0000, 0xff00_0000];
    add(
        "4.dds",
        4,
        false,
        0.0,
        &dds_file([3, 2], 0x41, &[0; 4], masks, &picture(4)),
    );

    let share = |i: usize| COLORS[i].map(|code| code as f32 / 255.0);
    let mut file = Vec::new();
    let pixels: Vec<_> = (0..6).map(|i| image::Rgb(share(i))).collect();
    codecs::hdr::HdrEncoder::new(&mut file).encode(&pixels, 3, 2).unwrap();
    add("3.hdr", 3, true, 0.005, &file);

    // EXR files store colour times alpha.
    let texel = |at: exr::Vec2<usize>| {
        let i = at.y() * 3 + at.x();
        let alpha = ALPHAS[i] as f32 / 255.0;
        let [r, g, b] = share(i).map(|value| if alpha > 0.0 { value * alpha } else { value });
        (r, g, b, alpha)
    };
    let write = |name: &str, channels, tolerance, written: Result<(), ::exr::error::Error>| {
        written.unwrap();
        (name.to_string(), channels, tolerance)
    };
    let path = |name: &str| folder.path().join(name);
    let whole = exr::SpecificChannels::rgba(texel);
    let short = exr::SpecificChannels::rgba(|at| {
        let (r, g, b, a) = texel(at);
        (f16::from_f32(r), f16::from_f32(g), f16::from_f32(b), f16::from_f32(a))
    });
    let grey = exr::SpecificChannels::build().with_channel("Y").with_channel("Z");
    let grey = grey.with_pixel_fn(|at: exr::Vec2<usize>| {
        let i = at.y() * 3 + at.x();
        (share(i)[0], 10.0 + i as f32)
    });
    let size = (3, 2);
    let written = [
        write(
            "4.exr",
            4,
            1e-6,
            exr::Image::from_channels(size, whole).write().to_file(path("4.exr")),
        ),
        write(
            "half-4.exr",
            4,
            2e-3,
            exr::Image::from_channels(size, short)
                .write()
                .to_file(path("half-4.exr")),
        ),
        write(
            "1.exr",
            1,
            1e-6,
            exr::Image::from_channels(size, grey).write().to_file(path("1.exr")),
        ),
    ];
    for (name, channels, tolerance) in written {
        add(&name, channels, true, tolerance, &[]);
    }
    all
}

/// Middle of the texel in column `i % 3` and row `i / 3` from the top.
fn middle(i: usize) -> Vec2 {
    Vec2::new((i % 3) as f32 + 0.5, 1.5 - (i / 3) as f32) / Vec2::new(3.0, 2.0)
}

/// The sRGB curve in f64, from its definition (IEC 61966-2-1).
fn linear(encoded: f64) -> f64 {
    if encoded <= 0.04045 {
        encoded / 12.92
    } else {
        ((encoded + 0.055) / 1.055).powf(2.4)
    }
}

#[test]
fn every_format_keeps_orientation_and_channels() {
    let folder = tempfile::tempdir().unwrap();
    let all = files(&folder);
    assert_eq!(all.len(), 33);
    for (path, sort) in all {
        let load = |kind| load_texture(&path, kind, Wrap::Clamp).unwrap_or_else(|error| panic!("{error}"));
        let (is_grey, has_alpha) = (sort.channels < 3, sort.channels == 2 || sort.channels == 4);
        let texture = load(TextureKind::Color);
        assert_eq!(texture.has_alpha(), has_alpha, "{}", path.display());
        assert!(texture.is_reflectance());
        for i in 0..6 {
            let codes = if is_grey { [COLORS[i][0]; 3] } else { COLORS[i] };
            let near = |what: &str, got: f32, expected: f64, slope: f64| {
                let max = slope * sort.tolerance + 2e-5;
                let place = format!("{} {what}, texel {i}", path.display());
                assert!((got as f64 - expected).abs() <= max, "{place}: {got}, not {expected}");
            };
            let shares = codes.map(|code| code as f64 / 255.0);
            let alpha = if has_alpha { ALPHAS[i] as f64 / 255.0 } else { 1.0 };
            let uv = middle(i);
            for (got, share) in texture.color(uv, 0.0).to_array().into_iter().zip(shares) {
                // The sRGB curve multiplies an error of the codes by its slope, which is at most
                // 2.3.
                if sort.is_linear {
                    near("colour", got, share, 1.0);
                } else {
                    near("colour", got, linear(share), 2.3);
                }
            }
            near("alpha", texture.alpha(uv, 0.0), alpha, 1.0);

            // Textures of data are linear.
            let value = |channel| load(TextureKind::Value(channel)).value(uv, 0.0);
            near("red", value(Channel::Red), shares[0], 1.0);
            near("green", value(Channel::Green), shares[1], 1.0);
            near("blue", value(Channel::Blue), shares[2], 1.0);
            near("matte", value(Channel::Matte), alpha, 1.0);
            let luminance = 0.2126 * shares[0] + 0.7152 * shares[1] + 0.0722 * shares[2];
            // The texel was rounded to 8 bits
            let step = if sort.is_linear { 0.0 } else { 0.5 / 255.0 };
            let error = (value(Channel::Luminance) as f64 - luminance).abs();
            assert!(
                error <= step + sort.tolerance + 2e-5,
                "{} luminance, texel {i}: {error}",
                path.display()
            );
            let opacity = if has_alpha {
                alpha
            } else {
                value(Channel::Luminance) as f64
            };
            near("opacity", value(Channel::Opacity), opacity, 1.0);
            if !is_grey && sort.channels > 0 {
                let normal = load(TextureKind::Normal).normal(uv, 0.0).to_array();
                for (got, share) in normal.into_iter().zip(shares) {
                    near("normal", got, 2.0 * share - 1.0, 2.0);
                }
            }
        }
    }
}

#[test]
fn textures_use_the_smallest_texel_size() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = |name: &str, kind| {
        load_texture(&folder.path().join(name), kind, Wrap::Repeat)
            .unwrap()
            .bytes()
    };
    files(&folder);
    // A texture has 3 × 2 texels, and one texel in the next mip level
    for (name, texel) in [
        ("8-1.png", 1),
        ("8-3.png", 3),
        ("8-4.png", 4),
        ("16-3.png", 6),
        ("4.exr", 16),
    ] {
        assert_eq!(bytes(name, TextureKind::Color), 7 * texel, "{name}");
    }
    assert_eq!(bytes("8-4.png", TextureKind::Value(Channel::Matte)), 7);
    assert_eq!(bytes("8-4.png", TextureKind::Normal), 7 * 3);
    // Alpha is not stored if all texels are opaque.
    let opaque: Vec<u8> = COLORS.iter().flat_map(|&[r, g, b]| [r, g, b, 255]).collect();
    let file = png_file(ColorType::Rgba, BitDepth::Eight, &opaque, &[], &[]);
    std::fs::write(folder.path().join("opaque.png"), file).unwrap();
    assert_eq!(bytes("opaque.png", TextureKind::Color), 7 * 3);
    let leaf = TextureKind::Value(Channel::Opacity);
    let texture = load_texture(&folder.path().join("opaque.png"), leaf, Wrap::Repeat).unwrap();
    assert!((texture.value(middle(0), 0.0) - 0.2126).abs() < 0.002);
}

#[test]
fn one_bit_is_black_or_white() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    std::fs::write(
        &path,
        png_file(
            ColorType::Grayscale,
            BitDepth::One,
            &[0b1010_0000, 0b0010_0000],
            &[],
            &[],
        ),
    )
    .unwrap();
    let texture = load_texture(&path, TextureKind::Color, Wrap::Repeat).unwrap();
    let seen: Vec<f32> = (0..6).map(|i| texture.value(middle(i), 0.0)).collect();
    assert_eq!(seen, [1.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
}

#[test]
fn depth_is_a_channel_of_exr() {
    let folder = tempfile::tempdir().unwrap();
    files(&folder);
    let load = |name: &str| {
        load_texture(
            &folder.path().join(name),
            TextureKind::Value(Channel::Depth),
            Wrap::Clamp,
        )
    };
    let texture = load("1.exr").unwrap();
    assert_eq!(texture.value(middle(4), 0.0), 14.0);
    assert!(!texture.is_reflectance());
    let error = load("4.exr").unwrap_err();
    assert!(
        error.message.contains("no depth; its channels are A, B, G, R"),
        "{error}"
    );
    assert!(load("8-3.png").unwrap_err().message.contains("no depth"));
}

/// The error for an EXR file with several values per pixel (deep data) differs from the error for a
/// damaged file.
#[test]
fn deep_exr_is_an_error_with_its_remedy() {
    use ::exr::prelude::{Encoding, Image, SpecificChannels, Vec2, WritableImage};
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("deep.exr");
    let pixels = SpecificChannels::rgb(|_: Vec2<usize>| (1.0f32, 0.5f32, 0.25f32));
    let image = Image::from_encoded_channels((2, 2), Encoding::UNCOMPRESSED, pixels);
    image.write().to_file(&path).unwrap();
    let mut bytes = std::fs::read(&path).unwrap();
    // Mark the file as deep, by bit 11 of the version field and by the attribute `type` ("OpenEXR
    // File Layout")
    bytes[5] |= 0x08;
    let name = b"type\0string\0";
    let start = bytes.windows(name.len()).position(|window| window == name);
    let old = start.map_or(8..8, |start| start..start + name.len() + 4 + "scanlineimage".len());
    let new = [&name[..], b"\x0c\0\0\0deepscanline"].concat();
    bytes.splice(old, new);
    std::fs::write(&path, bytes).unwrap();
    let errors = [
        load_texture(&path, TextureKind::Color, Wrap::Repeat).unwrap_err(),
        embrasure::io::read_exr(&path).unwrap_err(),
        embrasure::io::read_layers(&path).unwrap_err(),
        embrasure::io::read_rendering(&path).unwrap_err(),
    ];
    for error in errors {
        assert!(error.message.contains("deep data"), "{error}");
        assert!(error.help.as_ref().unwrap().contains("flatten"), "{error}");
    }
}

/// For missing files, files that are not images, and images of the wrong kind, the error states the
/// cause.
#[test]
fn texture_errors_state_the_cause() {
    let folder = tempfile::tempdir().unwrap();
    files(&folder);
    let error = |name: &str, bytes: Option<&[u8]>, kind| {
        let path = folder.path().join(name);
        if let Some(bytes) = bytes {
            std::fs::write(&path, bytes).unwrap();
        }
        let error = load_texture(&path, kind, Wrap::Repeat).unwrap_err();
        assert_eq!(error.file, path);
        error.message
    };
    let color = TextureKind::Color;
    assert!(error("gone.png", None, color).contains("no such"));
    assert!(error(".", None, color).contains("a directory"));
    assert!(error("a.gif", Some(b"GIF89a"), color).contains("cannot decode"));
    assert!(error("a.psd", Some(b"8BPS\0\x01"), color).contains("Photoshop"));
    assert!(error("a.dds", Some(b"DDS \x7c\0"), color).contains("cannot decode"));
    assert!(error("a.txt", Some(b"text"), color).contains("format is not supported"));
    assert!(error("a.png", Some(b""), color).contains("empty"));
    assert!(error("8-1.png", None, TextureKind::Normal).contains("grey"));
    // A wrong file extension is harmless.
    let path = folder.path().join("lie.jpg");
    std::fs::copy(folder.path().join("8-3.png"), &path).unwrap();
    assert!(load_texture(&path, color, Wrap::Repeat).is_ok());
    // A size that exceeds the bytes of the file is refused before memory is allocated.
    let mut bytes = std::fs::read(folder.path().join("3.bmp")).unwrap();
    bytes[18..26].copy_from_slice(&[0, 0x40, 0, 0, 0, 0x40, 0, 0]);
    assert!(error("large.bmp", Some(&bytes), color).contains("16384x16384"));
    let only_red = exr::SpecificChannels::build()
        .with_channel("R")
        .with_pixel_fn(|_| (0.5f32,));
    exr::Image::from_channels((2, 2), only_red)
        .write()
        .to_file(folder.path().join("r.exr"))
        .unwrap();
    assert!(error("r.exr", None, color).contains("its channels are R"));
}

/// Regression: a true-colour image with a palette of another depth than its pixels made the image
/// crate panic.
#[test]
fn tga_with_an_unused_palette_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.tga");
    let mut bytes = tga_file(4);
    (bytes[1], bytes[7], bytes[17]) = (1, 24, 0);
    std::fs::write(&path, &bytes).unwrap();
    let error = load_texture(&path, TextureKind::Color, Wrap::Repeat).unwrap_err();
    assert!(error.message.contains("a palette of 24 bits"), "{error}");
}

#[test]
fn repaired_texels_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let odd = [f32::NAN, -1.0, f32::INFINITY, 3.0];
    exr::write_rgb_file(&path, 2, 2, |x, y| (odd[2 * y + x], 1.0f32, 0.5f32)).unwrap();
    let request = TextureRequest {
        path,
        kind: TextureKind::Color,
        wrap: Wrap::Repeat,
        is_mean: false,
    };
    let loaded = load_textures(&[request], &());
    assert!(
        loaded.warnings[0]
            .to_string()
            .contains("a.exr: 3 texels are NaN, infinite or negative"),
        "{:?}",
        loaded.warnings
    );
    let color = loaded.textures[0].color(Vec2::new(0.25, 0.75), 0.0);
    assert_eq!(color, Spectrum::rgb(0.0, 1.0, 0.5));
}

#[test]
fn textures_are_read_once_with_any_thread_count() {
    let folder = tempfile::tempdir().unwrap();
    let all = files(&folder);
    let mut requests: Vec<TextureRequest> = Vec::new();
    for (path, _) in &all {
        for kind in [
            TextureKind::Color,
            TextureKind::Value(Channel::Luminance),
            TextureKind::Normal,
        ] {
            requests.push(TextureRequest {
                path: path.clone(),
                kind,
                wrap: Wrap::Repeat,
                is_mean: false,
            });
        }
    }
    requests.insert(
        5,
        TextureRequest {
            path: folder.path().join("gone.png"),
            ..requests[0].clone()
        },
    );
    let distinct = requests.len();
    // Use the first texture again, by another path and with another border
    let again = folder.path().join(".").join(all[0].0.file_name().unwrap());
    requests.push(TextureRequest {
        path: again,
        ..requests[0].clone()
    });
    requests.push(TextureRequest {
        wrap: Wrap::Clamp,
        is_mean: false,
        ..requests[0].clone()
    });

    let load = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| load_textures(&requests, &()))
    };
    let (one, four) = (load(1), load(4));
    assert_eq!(one.ids, four.ids);
    assert_eq!(one.bytes(), four.bytes());
    let colors = |loaded: &LoadedTextures| -> Vec<Spectrum> {
        let lookup = |texture: &Texture| (0..6).map(|i| texture.color(middle(i), 0.3)).collect::<Vec<_>>();
        loaded.textures.iter().flat_map(lookup).collect()
    };
    assert_eq!(colors(&one), colors(&four));
    assert_eq!(one.ids[0], Ok(TextureId(0)));
    assert!(one.ids[5].is_err());
    assert_eq!(one.ids[distinct], one.ids[0]);
    assert_eq!(one.ids[distinct + 1], Ok(TextureId(one.textures.len() as u32 - 1)));
    let ids: Vec<u32> = one.ids[..distinct].iter().flatten().map(|id| id.0).collect();
    assert!(ids.iter().copied().eq(0..ids.len() as u32));
}

/// All 65536 codes of 16 bits have their exact value, and no two of them have the same colour.
#[test]
fn codes_of_16_bits_are_exact() {
    const SIDE: usize = 256;
    let folder = tempfile::tempdir().unwrap();
    let codes: Vec<u8> = (0..=u16::MAX).flat_map(u16::to_ne_bytes).collect();
    let mut file = Cursor::new(Vec::new());
    encoded(
        codecs::tiff::TiffEncoder::new(&mut file),
        &codes,
        (256, 256),
        ExtendedColorType::L16,
    );
    let path = folder.path().join("codes.tif");
    std::fs::write(&path, file.get_ref()).unwrap();
    let colors = load_texture(&path, TextureKind::Color, Wrap::Clamp).unwrap();
    let values = load_texture(&path, TextureKind::Value(Channel::Red), Wrap::Clamp).unwrap();
    assert_eq!((colors.bytes(), values.bytes()), (174_762, 174_762));
    let mut last = -1.0;
    for code in 0..=u16::MAX {
        let (x, y) = (usize::from(code) % SIDE, usize::from(code) / SIDE);
        let uv = Vec2::new(x as f32 + 0.5, (SIDE - y) as f32 - 0.5) / SIDE as f32;
        let color = colors.color(uv, 0.0).to_array()[0];
        assert_eq!(color, srgb::decode(f32::from(code) / 65535.0), "{code}");
        assert!(color > last, "{code}");
        last = color;
        assert!(
            (values.value(uv, 0.0) * 65535.0 - f32::from(code)).abs() < 0.01,
            "{code}"
        );
    }
}

/// Blocks of GPU formats are decoded: BC1 with its two colours and the colours between them, BC5 as
/// a normal map, and BC7 in mode 6.
#[test]
fn blocks_of_dds_files_are_decoded() {
    let folder = tempfile::tempdir().unwrap();
    let texture = |name: &str, file: &[u8], kind| {
        let path = folder.path().join(name);
        std::fs::write(&path, file).unwrap();
        load_texture(&path, kind, Wrap::Clamp).unwrap_or_else(|error| panic!("{error}"))
    };
    let middle = |x: usize, y: usize| Vec2::new(x as f32 + 0.5, 3.5 - y as f32) / 4.0;
    // Red and blue, and a row of each of the four colours
    let bc1 = [
        0x00,
        0xf8,
        0x1f,
        0x00,
        0b0000_0000,
        0b0101_0101,
        0b1010_1010,
        0b1111_1111,
    ];
    let texture_of_bc1 = texture(
        "bc1.dds",
        &dds_file([4, 4], 4, b"DXT1", [0; 5], &bc1),
        TextureKind::Color,
    );
    assert!(!texture_of_bc1.has_alpha());
    for (y, [r, b]) in [[255, 0], [0, 255], [170, 85], [85, 170]].into_iter().enumerate() {
        let got = texture_of_bc1.color(middle(2, y), 0.0).to_array();
        let expected = [r, 0, b].map(|code| linear(f64::from(code) / 255.0));
        assert!(
            got.iter()
                .zip(expected)
                .all(|(got, e)| (f64::from(*got) - e).abs() < 1e-5),
            "{got:?}, row {y}"
        );
    }
    // Sizes of the level in the header that are too small, too large, or present without their flag
    for (flags, size) in [(0x81007u32, 1u32), (0x81007, 268), (0x81007, u32::MAX), (0x1007, 5)] {
        let mut file = dds_file([4, 4], 4, b"DXT1", [0; 5], &bc1);
        file[8..12].copy_from_slice(&flags.to_le_bytes());
        file[20..24].copy_from_slice(&size.to_le_bytes());
        let with_size = texture(&format!("{size}.dds"), &file, TextureKind::Color);
        for y in 0..4 {
            let [got, expected] = [&with_size, &texture_of_bc1].map(|texture| texture.color(middle(2, y), 0.0));
            assert_eq!(got, expected, "{size}, row {y}");
        }
    }
    // Both channels are 204 everywhere, so x = y = 0.6, and z completes a unit vector.
    let channel = [204, 204, 0, 0, 0, 0, 0, 0];
    let bc5 = [channel, channel].concat();
    let normals = texture(
        "bc5.dds",
        &dds_file([4, 4], 4, b"ATI2", [0; 5], &bc5),
        TextureKind::Normal,
    );
    let normal = normals.normal(middle(1, 1), 0.0).to_array();
    for (got, expected) in normal.into_iter().zip([0.6, 0.6, 0.28f32.sqrt()]) {
        assert!((got - expected).abs() < 0.01, "{normal:?}");
    }
    // Mode 6: endpoints of 7 bits and a shared lowest bit, all texels at the first endpoint
    let (mut bits, mut at) = (0u128, 0);
    for (value, count) in [
        (0x40, 7),
        (100, 7),
        (100, 7),
        (50, 7),
        (50, 7),
        (10, 7),
        (10, 7),
        (127, 7),
        (127, 7),
        (1, 1),
        (1, 1),
    ] {
        bits |= (value as u128) << at;
        at += count;
    }
    let mut bc7: Vec<u8> = [98u32, 3, 0, 1, 0].iter().flat_map(|n| n.to_le_bytes()).collect();
    bc7.extend(bits.to_le_bytes());
    let texture_of_bc7 = texture(
        "bc7.dds",
        &dds_file([4, 4], 4, b"DX10", [0; 5], &bc7),
        TextureKind::Color,
    );
    let got = texture_of_bc7.color(middle(0, 3), 0.0).to_array();
    let expected = [201, 101, 21].map(|code| linear(f64::from(code) / 255.0));
    assert!(
        got.iter()
            .zip(expected)
            .all(|(got, e)| (f64::from(*got) - e).abs() < 1e-5),
        "{got:?}"
    );
}

/// Truncated files and files with a few wrong bits must neither panic nor allocate too much memory.
#[test]
fn damaged_files_are_errors_or_pictures() {
    let folder = tempfile::tempdir().unwrap();
    let mut refused = 0;
    let mut state = 1u64;
    for (path, _) in files(&folder) {
        let sound = std::fs::read(&path).unwrap();
        let mut try_it = |bytes: &[u8]| {
            std::fs::write(&path, bytes).unwrap();
            match load_texture(&path, TextureKind::Color, Wrap::Repeat) {
                Ok(texture) => assert!(texture.bytes() < 32 * 1032 * bytes.len()),
                Err(_) => refused += 1,
            }
        };
        for length in (0..sound.len()).step_by(1 + sound.len() / 20) {
            try_it(&sound[..length]);
        }
        for at in (0..sound.len()).step_by(1 + sound.len() / 60) {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            for value in [sound[at] ^ 1 << (state >> 61), (state >> 40) as u8] {
                let mut bytes = sound.clone();
                bytes[at] = value;
                try_it(&bytes);
            }
        }
    }
    assert!(refused > 300, "{refused}");
}

/// Image files of real scenes that have one of the `extensions`.
fn pictures(extensions: &[&str]) -> Vec<PathBuf> {
    let folders = ["sponza-dabrovic", "living-room/textures", "staircase2/textures"];
    let folders = folders.iter().map(|name| shared(&format!("scenes/{name}")));
    let files = folders.flat_map(|folder| std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()));
    let mut files: Vec<PathBuf> = files
        .filter(|path| {
            let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
            extension.is_some_and(|e| extensions.contains(&e.as_str()))
        })
        .collect();
    files.sort();
    files
}

/// Middle of a texel; rows count from the top.
fn middle_of(texture: &Texture, x: usize, y: usize) -> Vec2 {
    let (width, height) = texture.size();
    Vec2::new((x as f32 + 0.5) / width as f32, 1.0 - (y as f32 + 0.5) / height as f32)
}

/// Writes images of 61 × 37 texels into `folder`: with alpha, without alpha, with lossy
/// compression, and with values above 1.
fn drawn_pictures(folder: &TempDir) -> [PathBuf; 4] {
    let (width, height) = (61, 37);
    let paths = ["alpha.png", "plain.png", "plain.jpg", "bright.exr"].map(|name| folder.path().join(name));
    let code = |x: u32, y: u32, c: u32| (x * (3 + c) + y * y + 17 * c) as u8;
    let rgba = image::RgbaImage::from_fn(width, height, |x, y| [0, 1, 2, 3].map(|c| code(x, y, c)).into());
    rgba.save(&paths[0]).unwrap();
    let rgb = image::RgbImage::from_fn(width, height, |x, y| [0, 1, 2].map(|c| code(x, y, c)).into());
    rgb.save(&paths[1]).unwrap();
    rgb.save(&paths[2]).unwrap();
    let bright = |x: usize, y: usize| {
        let [r, g, b] = [0, 1, 2].map(|c| f16::from_f32(f32::from(code(x as u32, y as u32, c)) / 8.0));
        (r, g, b)
    };
    exr::write_rgb_file(&paths[3], width as usize, height as usize, bright).unwrap();
    paths
}

/// Asserts that texels and means of a texture equal the texels and means by the crate `image`.
fn assert_decoded(path: &Path) {
    let picture = image::open(path).unwrap().to_rgba8();
    let texture = load_texture(path, TextureKind::Color, Wrap::Repeat).unwrap();
    assert_eq!(texture.size(), (picture.width() as usize, picture.height() as usize));
    let (mut sums, mut weights) = ([0.0; 3], 0.0);
    for (x, y, texel) in picture.enumerate_pixels() {
        let [r, g, b, a] = texel.0;
        let weight = if texture.has_alpha() {
            a as f64 / 255.0 + 1.0 / 1024.0
        } else {
            1.0
        };
        weights += weight;
        let uv = middle_of(&texture, x as usize, y as usize);
        let seen = texture.color(uv, 0.0).to_array();
        for ((sum, code), seen) in sums.iter_mut().zip([r, g, b]).zip(seen) {
            *sum += weight * linear(code as f64 / 255.0);
            // The column of the texel is computed in f32. The rounding error is up to 2⁻¹² of a
            // texel.
            assert!(
                (seen as f64 - linear(code as f64 / 255.0)).abs() < 5e-4,
                "{} {x} {y}: {seen}",
                path.display()
            );
        }
        assert!((texture.alpha(uv, 0.0) - a as f32 / 255.0).abs() < 5e-4);
    }
    let mean = texture.color(Vec2::ZERO, f32::INFINITY).to_array();
    for (m, sum) in mean.iter().zip(sums) {
        // Codes have 8 bits. The slope of the sRGB curve is at most 2.3, so half a step is at most
        // 2.3 · 0.5 / 255 = 0.0045 in linear light.
        assert!(
            (*m as f64 - sum / weights).abs() < 0.0045,
            "{}: {m}, not {}",
            path.display(),
            sum / weights
        );
    }
    let third = texture.bytes() as f64 / picture.pixels().len() as f64;
    println!("{}: mean {mean:.4?}, {third:.2} bytes a texel", path.display());
}

/// Asserts that an opacity map has the alpha of its image.
fn assert_opacity_is_alpha(path: &Path) {
    let kind = TextureKind::Value(Channel::Opacity);
    let texture = load_texture(path, kind, Wrap::Repeat).unwrap();
    let color = load_texture(path, TextureKind::Color, Wrap::Repeat).unwrap();
    for k in 0..100 {
        let uv = Vec2::new(0.013 * k as f32, 0.029 * k as f32);
        assert!((texture.value(uv, 0.0) - color.alpha(uv, 0.0)).abs() < 1e-6);
    }
    let mean = texture.value(Vec2::ZERO, f32::INFINITY);
    assert!(mean > 0.05 && mean < 0.95, "{mean}");
}

/// Asserts that an image of half floats keeps its maximum and its means, also above 1.
fn assert_unbounded(path: &Path) {
    let picture = embrasure::io::read_exr(path).unwrap();
    let texture = load_texture(path, TextureKind::Color, Wrap::Repeat).unwrap();
    assert_eq!(texture.size(), (picture.width, picture.height));
    let largest = picture.pixels.as_flattened().iter().fold(0.0f32, |max, &v| max.max(v));
    assert_eq!(texture.max_value(), largest);
    assert_eq!(texture.is_reflectance(), largest <= 1.0);
    let n = picture.pixels.len() as f64;
    let sum = |c: usize| picture.pixels.iter().map(|texel| texel[c] as f64).sum::<f64>() / n;
    let mean = texture.color(Vec2::ZERO, f32::INFINITY).to_array();
    for (c, m) in mean.into_iter().enumerate() {
        assert!(
            (m as f64 / sum(c) - 1.0).abs() < 1e-3,
            "{}: {m}, not {}",
            path.display(),
            sum(c)
        );
    }
    println!(
        "{}: mean {mean:.4?}, largest {largest}, {} bytes",
        path.display(),
        texture.bytes()
    );
}

#[test]
fn drawn_textures_match_the_image_crate() {
    let folder = tempfile::tempdir().unwrap();
    let [alpha, plain, lossy, bright] = drawn_pictures(&folder);
    for path in [&alpha, &plain, &lossy] {
        assert_decoded(path);
    }
    assert_opacity_is_alpha(&alpha);
    assert_unbounded(&bright);
    let texture = load_texture(&bright, TextureKind::Color, Wrap::Repeat).unwrap();
    assert!(texture.max_value() > 30.0, "{}", texture.max_value());
}

#[test]
#[cfg_attr(not(shared), ignore = "needs ../shared")]
#[cfg_attr(all(shared, not(long)), ignore = "long")]
fn real_textures_match_the_image_crate() {
    pictures(&["jpg", "png"]).iter().for_each(|path| assert_decoded(path));
    pictures(&["exr"]).iter().for_each(|path| assert_unbounded(path));
    // The leaf is cut out of its image by alpha.
    assert_opacity_is_alpha(&shared("scenes/living-room/textures/leaf.png"));
}

/// Number of pixels along a side of a panel, and number of texels along a side of a pixel.
const PIXELS: usize = 16;
const ACROSS: usize = 16;

/// A panel with a texture of noise.
fn noisy_panel(codes: &[u8], filter: TextureFilter) -> Scene {
    let n = PIXELS * ACROSS;
    let texels = Texels::Bytes(codes.to_vec(), Curve::Linear);
    let mut b = SceneBuilder::new();
    b.texture_filter(filter);
    b.set_textures(
        vec![Texture::new(n, n, 1, texels, Wrap::Repeat).unwrap()],
        &[Some(TextureId(0))],
    );
    let diffuse = Some(Map {
        texture: TextureId(0),
        mapping: Mapping::default(),
    });
    let painted = Material {
        maps: Maps {
            diffuse,
            ..Maps::default()
        },
        ..material(1.0, 0.0)
    };
    let plain = panel(0.0, 1.0);
    let uvs = plain
        .positions
        .iter()
        .map(|p| 0.5 + 0.5 * Vec2::new(p.x, p.y))
        .collect();
    add(&mut b, Mesh { uvs, ..plain }, painted);
    b.build().unwrap().0
}

/// Albedos of all pixels from `spp` samples each, row by row.
fn albedos(scene: &Scene, spp: u32) -> Vec<f64> {
    let resolution = UVec2::splat(PIXELS as u32);
    with_world(scene, from_front(), resolution, |world| {
        let integrator = path_tracer(world, Some(1));
        let film = film_by(&sobol(7), &integrator, resolution, spp);
        let mut albedos = vec![0.0; PIXELS * PIXELS];
        for (pixel, sums) in film.pixels() {
            albedos[pixel.y as usize * PIXELS + pixel.x as usize] = f64::from(sums.albedo(0));
        }
        albedos
    })
}

/// With few samples, mip levels reduce noise. With many samples, they keep detail, because a sample
/// covers only a small part of a pixel. Errors are measured against the closed-form integral of the
/// bilinear texture over each pixel.
#[test]
fn mip_levels_reduce_noise_and_keep_detail() {
    let n = PIXELS * ACROSS;
    let mut sampler = Independent::new(5);
    let code = |i: usize| {
        sampler.start(SampleKey::new((i % n) as u32, (i / n) as u32, 0));
        (256.0 * sampler.get_2d(Dimension::PIXEL).x) as u8
    };
    let codes: Vec<u8> = (0..n * n).map(code).collect();
    // Fraction of the bilinear hat function of a texel that is within the pixel: 1/8 for a texel
    // just outside the border, 7/8 for a texel just inside
    let weights = |pixel: usize| {
        (0..ACROSS + 2).map(move |k| {
            let weight = match k {
                0 => 0.125,
                1 => 0.875,
                _ if k == ACROSS => 0.875,
                _ if k == ACROSS + 1 => 0.125,
                _ => 1.0,
            };
            ((pixel * ACROSS + k + n - 1) % n, weight / ACROSS as f64)
        })
    };
    let expected: Vec<f64> = (0..PIXELS * PIXELS)
        .map(|i| {
            let rows = weights(i / PIXELS).flat_map(|(y, v)| weights(i % PIXELS).map(move |(x, u)| (y * n + x, u * v)));
            rows.map(|(texel, weight)| weight * f64::from(codes[texel]) / 255.0)
                .sum()
        })
        .collect();
    let mean = |values: &mut dyn Iterator<Item = f64>| values.sum::<f64>() / expected.len() as f64;
    let middle = mean(&mut expected.iter().copied());
    let variance = mean(&mut expected.iter().map(|e| (e - middle).powi(2)));
    let error = |filter, spp| {
        let seen = albedos(&noisy_panel(&codes, filter), spp);
        mean(&mut seen.iter().zip(&expected).map(|(s, e)| (s - e).powi(2))) / variance
    };
    use TextureFilter::{Bilinear, Mip};
    let [mip_64, bilinear_64, mip_1024, bilinear_1024] =
        [(Mip, 64), (Bilinear, 64), (Mip, 1024), (Bilinear, 1024)].map(|(filter, spp)| error(filter, spp));
    println!(
        "of the pixels' variance: {mip_64:.4}, not {bilinear_64:.4}, at 64; {mip_1024:.4}, {bilinear_1024:.4} at 1024"
    );
    assert!(mip_64 < 0.3 * bilinear_64, "{mip_64} and {bilinear_64}");
    assert!(
        bilinear_1024 < 0.02 && mip_1024 < 0.05,
        "{mip_1024} and {bilinear_1024}"
    );
}
