//! Colours of vertices: three or four numbers after the coordinates of a `v` line, or ZBrush's
//! `#MRGB` comments. A mesh stores the colours in linear light
//! ([`Mesh::colors`](crate::geometry::Mesh::colors)).

use super::outline::{NO_COLOR, VertexData};
use crate::color::srgb;
use crate::io::load_options::{LoadParameters, VertexColorSpace, VertexColors};
use crate::io::{FileError, Finding, Severity};
use half::f16;
use std::path::Path;

/// Greys that exporters write for all vertices of an unpainted mesh: 191/255 and 192/255 (MeshLab),
/// 0.8 (Blender), and white.
const DEFAULT_GREYS: [f32; 4] = [191.0 / 255.0, 192.0 / 255.0, 0.8, 1.0];
/// Maximum difference from a grey of [`DEFAULT_GREYS`]: half a step of 8 bits.
const GREY_TOLERANCE: f32 = 0.5 / 255.0;

/// Largest number of colours that are not whole. Exporters of linear light may write numbers a few
/// times above 1, which are clamped.
const MAX_LIGHT: f32 = 16.0;

/// Colours of the vertices of a file, indexed by position. Empty if there are none.
#[derive(Default)]
pub(super) struct Colors {
    /// Linear Rec.709 colours.
    pub rgb: Vec<[f16; 3]>,
    /// Opacities; empty if all vertices are opaque.
    pub alpha: Vec<f16>,
}

/// Parses the colour of a vertex from the `words` after its coordinates. Returns `None` if there is
/// at most one word: a single word is a weight, not a colour. Returns an error unless all words are
/// three or four finite numbers.
pub(super) fn color_of<'a>(words: impl Iterator<Item = &'a str>) -> Result<Option<[f32; 4]>, ()> {
    let words: Vec<&str> = words.take(5).collect();
    match words.len() {
        0 | 1 => return Ok(None),
        3 | 4 => {}
        _ => return Err(()),
    }
    let mut color = [f32::NAN, f32::NAN, f32::NAN, 1.0];
    for (slot, word) in color.iter_mut().zip(words) {
        *slot = word.parse().map_err(|_| ())?;
    }
    if color.iter().all(|c| c.is_finite()) {
        Ok(Some(color))
    } else {
        Err(())
    }
}

/// Adds the colours of a `#MRGB` comment, from 0 to 1. `groups` is a sequence of groups `MMRRGGBB`
/// of hexadecimal digits. MM is a mask, which is ignored. Returns an error if a group is incomplete
/// or not hexadecimal.
pub(super) fn read_mrgb(groups: &str, colors: &mut Vec<[f32; 4]>) -> Result<(), ()> {
    for group in groups.as_bytes().chunks(8) {
        let text = std::str::from_utf8(group).map_err(|_| ())?;
        let [_, r, g, b] = u32::from_str_radix(text, 16).map_err(|_| ())?.to_be_bytes();
        if group.len() < 8 {
            return Err(());
        }
        colors.push([r, g, b, 255].map(|c| f32::from(c) / 255.0));
    }
    Ok(())
}

/// Returns true if the numbers of `colors` are 8-bit codes: all numbers are whole and a number is
/// above 1, or a number is above [`MAX_LIGHT`].
fn are_bytes(colors: &[[f32; 4]]) -> bool {
    let numbers = || colors.iter().flatten().copied().filter(|c| !c.is_nan());
    let largest = numbers().fold(0.0, f32::max);
    largest > MAX_LIGHT || (largest > 1.0 + GREY_TOLERANCE && numbers().all(|c| c.fract() == 0.0))
}

/// Moves the colours that a render uses out of `vertices`. Adds findings about the colours.
pub(super) fn take_colors(
    path: &Path,
    vertices: &mut VertexData,
    parameters: &LoadParameters,
    findings: &mut Vec<Finding>,
) -> Colors {
    let (mut colors, blocks) = (std::mem::take(&mut vertices.colors), std::mem::take(&mut vertices.mrgb));
    let mut report = |severity, code, message: String, help: &str| {
        let error = FileError::new(path, message);
        let error = if help.is_empty() { error } else { error.help(help) };
        findings.push(Finding::new(severity, code, error));
    };
    let count = vertices.positions.len();
    if colors.is_empty() && !blocks.is_empty() {
        if blocks.len() != count {
            let message = format!(
                "the #MRGB lines have {} colours for {count} vertices; the colours are not used",
                blocks.len()
            );
            report(Severity::Warning, "bad-vertex-color", message, "export the file again");
            return Colors::default();
        }
        colors = blocks;
    }
    if !colors.is_empty() {
        colors.resize(count, NO_COLOR);
    }
    let mode = parameters.vertex_colors();
    if colors.is_empty() || mode == VertexColors::Off {
        return Colors::default();
    }

    let is_bytes = are_bytes(&colors);
    if is_bytes {
        let has_alpha = colors.iter().any(|color| color[3] > 1.0);
        let scale = [255.0, 255.0, 255.0, if has_alpha { 255.0 } else { 1.0 }];
        for color in &mut colors {
            *color = [0, 1, 2, 3].map(|c| color[c] / scale[c]);
        }
    }
    let is_default = |&[r, g, b, a]: &[f32; 4]| {
        let near = |grey: f32| [r, g, b].iter().all(|c| (c - grey).abs() <= GREY_TOLERANCE);
        a == 1.0 && DEFAULT_GREYS.into_iter().any(near)
    };
    if mode == VertexColors::Auto && colors.iter().all(|color| color[0].is_nan() || is_default(color)) {
        let grey = colors.iter().map(|color| color[0]).find(|c| !c.is_nan()).unwrap_or(1.0);
        if grey < 1.0 - GREY_TOLERANCE {
            let message =
                format!("all vertices have the grey {grey:.3}, which exporters write by default, so it is not used");
            report(
                Severity::Note,
                "default-vertex-color",
                message,
                "--vertex-colors on uses it",
            );
        }
        return Colors::default();
    }
    let missing = colors.iter().filter(|color| color[0].is_nan()).count();
    if missing > 0 {
        let (has, they) = if missing == 1 {
            ("has", "it is")
        } else {
            ("have", "they are")
        };
        let message = format!("{missing} of {count} vertices {has} no colour; {they} white");
        report(
            Severity::Warning,
            "bad-vertex-color",
            message,
            "export all colours, or use --vertex-colors off",
        );
    }
    let is_outside = |c: &f32| *c < -GREY_TOLERANCE || *c > 1.0 + GREY_TOLERANCE;
    let outside = colors.iter().filter(|color| color.iter().any(is_outside)).count();
    if outside > 0 {
        let noun = if outside == 1 { "vertex has" } else { "vertices have" };
        let range = if is_bytes { "0 to 255" } else { "0 to 1" };
        let message = format!("{outside} {noun} a colour with a number outside {range}; the number is clamped");
        report(
            Severity::Warning,
            "bad-vertex-color",
            message,
            "export the colours again, or use --vertex-colors off",
        );
    }
    let mut words = match count - missing {
        1 => "1 vertex has a colour".to_string(),
        some => format!("{some} vertices have a colour"),
    };
    if is_bytes {
        words += ", with numbers from 0 to 255";
    }
    report(
        Severity::Note,
        "vertex-colors",
        words,
        "--vertex-colors off ignores them",
    );

    let linear = |c: f32| match parameters.vertex_color_space() {
        VertexColorSpace::Srgb => srgb::decode(c),
        VertexColorSpace::Linear => c,
    };
    let value = |c: f32| f16::from_f32(if c.is_nan() { 1.0 } else { linear(c.clamp(0.0, 1.0)) });
    let alpha = |a: f32| f16::from_f32(if a.is_nan() { 1.0 } else { a.clamp(0.0, 1.0) });
    let has_alpha = colors.iter().any(|color| color[3] < 1.0);
    Colors {
        rgb: colors.iter().map(|&[r, g, b, _]| [r, g, b].map(value)).collect(),
        alpha: if has_alpha {
            colors.iter().map(|color| alpha(color[3])).collect()
        } else {
            Vec::new()
        },
    }
}
