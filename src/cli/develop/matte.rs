//! Masks of parts, objects and materials, from the Cryptomatte layers of the file.

use super::{cropped, scaled, scaled_size};
use crate::cli::args::DevelopArgs;
use crate::cli::error::CliError;
use crate::cli::outputs::Images;
use crate::cli::printing;
use crate::files::Output;
use crate::film::{Channel, Image};
use crate::io::{DevelopedPicture, ExrFormat, FileError, Format, Layers, MatteMask, png_bytes};
use crate::options::nearest;
use std::io::Write;
use std::process::ExitCode;

/// Maximum number of names in a message.
const MAX_NAMES: usize = 8;

/// Writes the mask of the names that match `pattern`.
pub(super) fn write(
    args: &DevelopArgs,
    layers: &Layers,
    pattern: &str,
    files: &Images,
    exr: &ExrFormat,
) -> Result<ExitCode, CliError> {
    let Some(mask) = layers.mask(pattern) else {
        return Err(no_match(args, layers, pattern).into());
    };
    let (layer, is_empty) = (mask.layer.clone(), mask.is_empty());
    let names = quoted(&mask.names);
    write_mask(args, layers, (mask, pattern), files, exr)?;
    if !args.quiet {
        errln!("matte of {layer}: {names}");
    }
    if is_empty {
        printing::warning(format_args!(
            "the mask is empty, because no pixel shows {names}\n  help: {WHY_EMPTY}"
        ));
    }
    Ok(ExitCode::SUCCESS)
}

/// Reasons for an empty mask.
pub(super) const WHY_EMPTY: &str = "surfaces are outside of the picture, behind or inside of other surfaces, or smaller than the distance of the samples";

/// List of the first `names` for messages.
pub(super) fn quoted(names: &[String]) -> String {
    let shown: Vec<String> = names.iter().take(MAX_NAMES).map(|name| format!("`{name}`")).collect();
    let more = names.len().saturating_sub(MAX_NAMES);
    let more = match more {
        0 => String::new(),
        more => format!(" and {}", printing::count(more as u64, "other name")),
    };
    shown.join(", ") + &more
}

/// Writes `mask`, which was selected by `pattern`: the coverage of each pixel, 0 to 1. The 8-bit
/// values of a PNG are proportional to the coverage, without a tone curve. An EXR has the channel
/// `Y`.
pub(super) fn write_mask(
    args: &DevelopArgs,
    layers: &Layers,
    (mask, pattern): (MatteMask, &str),
    files: &[(Format, Output)],
    exr: &ExrFormat,
) -> Result<(), CliError> {
    let mut image = Image {
        resolution: layers.resolution,
        crop: mask.window,
        view: layers.view,
        channels: vec![Channel {
            name: "Y".into(),
            values: mask.values,
        }],
        backing: None,
    };
    if let Some(crop) = args.crop {
        image = cropped(&image, crop)?;
    }
    let size = args
        .scale
        .map(|scale| scaled_size(scale, image.crop.size()))
        .transpose()?;
    let image = scaled(image, size, true);
    let size = image.crop.size().to_array();
    let mut failures: Vec<FileError> = Vec::new();
    for (format, output) in files {
        let written = match format {
            Format::Exr(_) => DevelopedPicture {
                image: image.clone(),
                camera: None,
                lines: None,
                steps: format!("matte={pattern}"),
            }
            .write_exr(output, exr),
            Format::Png(_) => {
                let shares = image.channels.iter().flat_map(|channel| &channel.values);
                let codes: Vec<u8> = shares
                    .map(|share| (share.clamp(0.0, 1.0) * 255.0).round() as u8)
                    .collect();
                output.write(|writer| writer.write_all(&png_bytes(1, size, &codes)?))
            }
        };
        failures.extend(written.err());
    }
    match failures.as_slice() {
        [] => Ok(()),
        failures => Err(CliError::of_failures(failures)),
    }
}

/// Error for a pattern that matches no name. The error lists names that the file has.
pub(super) fn no_match(args: &DevelopArgs, layers: &Layers, pattern: &str) -> FileError {
    if layers.mattes.is_empty() {
        return FileError::new(&args.input, "has no mattes").help("render with --aov cryptomatte");
    }
    let names = || {
        let names = layers.mattes.iter().flat_map(|mattes| &mattes.names);
        names.map(|(name, _)| name.as_str())
    };
    if names().any(|name| name == pattern) {
        return FileError::new(
            &args.input,
            format!("names `{pattern}`, but lacks the Cryptomatte channels of this name"),
        )
        .help("write all channels of the Cryptomatte layers to the file");
    }
    let near = nearest(pattern, names()).map_or(String::new(), |near| format!("did you mean `{near}`? "));
    let some: Vec<&str> = names().take(MAX_NAMES).collect();
    let more = if names().count() > MAX_NAMES { " and more" } else { "" };
    FileError::new(&args.input, format!("no part, object or material matches `{pattern}`"))
        .help(format!("{near}the file has {}{more}", some.join(", ")))
}
