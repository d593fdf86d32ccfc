//! Masks of parts, objects and materials, from the Cryptomatte layers of the file.

use super::{cropped, scaled, scaled_size};
use crate::cli::args::DevelopArgs;
use crate::cli::error::CliError;
use crate::cli::outputs::Images;
use crate::cli::printing;
use crate::film::{Channel, Image};
use crate::io::{DevelopedPicture, ExrFormat, FileError, Format, Layers, png_bytes};
use crate::options::nearest;
use std::io::Write;
use std::process::ExitCode;

/// Maximum number of names in a message.
const MAX_NAMES: usize = 8;

/// Writes the mask of the names that match `pattern`: the coverage of each pixel, 0 to 1. The 8-bit
/// values of a PNG are proportional to the coverage, without a tone curve. An EXR has the channel
/// `Y`.
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
    for (format, output) in files.iter() {
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
    if !failures.is_empty() {
        return Err(CliError::of_failures(&failures));
    }
    if !args.quiet {
        let shown = mask.names.iter().take(MAX_NAMES).map(|name| format!("`{name}`"));
        let more = mask.names.len().saturating_sub(MAX_NAMES);
        errln!(
            "matte of {}: {}{}",
            mask.layer,
            shown.collect::<Vec<_>>().join(", "),
            if more > 0 {
                format!(" and {}", printing::count(more as u64, "other name"))
            } else {
                String::new()
            }
        );
    }
    Ok(ExitCode::SUCCESS)
}

/// Error for a pattern that matches no name. The error lists names that the file has.
fn no_match(args: &DevelopArgs, layers: &Layers, pattern: &str) -> FileError {
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
