//! `embrasure develop`: makes pictures from an EXR file, without a new render.
//!
//! `layer` finds the requested layer among the channels, and `figure` draws data in false colours.
//! Pixels are denoised before they are cropped, so that a crop looks as in the whole picture.
//! Scaling is the last step.

mod figure;
mod layer;
mod matte;
mod matte_set;

use super::args::{DevelopArgs, Scale};
use super::error::CliError;
use super::outputs::{Outputs, face, face_error};
use super::printing;
use crate::camera::FACE_NAMES;
use crate::color::{Spectrum, Tone};
use crate::denoise::Denoiser;
use crate::film::{Backing, Channel, Image, LINES, Rect, metered, resample, resample_nearest};
use crate::io::{DevelopedPicture, FileError, Format, Layers, describe_checkpoint, read_layers};
use crate::math::UVec2;
use crate::options::{Denoising, LineColor, OptionGroup, Value};
use crate::session::PictureParts;
use layer::{Layer, LayerKind};
use matte_set::PLACEHOLDERS;
use std::process::ExitCode;

/// Maximum number of pixels per side of a picture.
const MAX_SIDE: f64 = 65536.0;

/// Maximum number of names of each Cryptomatte layer in the text of `--list`. JSON has all names.
const MAX_LISTED: usize = 100;

/// Develops the file, or lists its contents.
pub(super) fn develop(args: &DevelopArgs) -> Result<ExitCode, CliError> {
    if let Some(invalid) = args.tone.0.invalid() {
        return Err(CliError::Usage(format!(
            "--{} {}\n  help: {}",
            invalid.flag, invalid.value, invalid.help
        )));
    }
    let mut outputs = Outputs::default();
    let exr = args.exr.format()?;
    if let Some(kind) = matte_set::Kind::of(args)? {
        return matte_set::write(args, &layers(args)?, kind, &mut outputs, &exr);
    }
    // Use the default tone here: the tone of the picture is known only after the file is read.
    let files = outputs.prepare_images(&args.output, Tone::default(), &exr)?;
    let has_faces = files.has_faces();
    if has_faces && (args.crop.is_some() || args.matte.is_some()) {
        let help = "leave them out, or write one file";
        return Err(face_error("a face cannot be written with --crop or --matte", help));
    }
    outputs.refuse_inputs([&*args.input])?;
    let layers = layers(args)?;
    if args.list {
        list(&layers, args.json);
        return Ok(ExitCode::SUCCESS);
    }

    if let Some(pattern) = &args.matte {
        return matte::write(args, &layers, pattern, &files, &exr);
    }

    let found = layer::find(&layers, args.channel.as_deref().or(raw(args, &layers)));
    let found = found.map_err(|(message, help)| FileError::new(&args.input, message).help(help))?;
    let mut steps = vec![format!("channel={}", found.title())];
    let mut image = image_of(&layers, &found);
    let (denoiser, radius) = denoiser(args, &layers, &found)?;
    if let Some(denoiser) = denoiser {
        let by = denoiser.version().map_err(|error| CliError::Usage(error.to_string()))?;
        let done = denoiser.apply_with(&mut image, radius);
        done.map_err(|error| FileError::new(&args.input, error.to_string()))?;
        steps.push(format!("denoiser={by}"));
    }
    // The whole picture is metered, so that a crop has the same exposure as the whole picture.
    let tone = metered(tone(args, &layers, found.kind), &image);
    let lines = lines(args, &layers, &found)?;
    let coverage = image.backing.map(Backing::channels).unwrap_or_default();
    image.channels.retain(|channel| {
        coverage.contains(&&*channel.name)
            || found.outputs().any(|name| channel.name == name)
            || (lines.is_some() && channel.name == LINES)
    });
    steps.extend(lines.map(|color| format!("lines={}", LineColor(color).text())));
    if let Some(crop) = args.crop {
        image = cropped(&image, crop)?;
        steps.push(format!("crop={}", crop.map(|at| at.to_string()).join(",")));
    }
    // Each file has the whole picture, or a face of it.
    let face_count = if has_faces { FACE_NAMES.len() } else { 0 };
    let pictures: Vec<Image> = (0..face_count)
        .map(|index| face(&image, index))
        .collect::<Result<_, _>>()
        .map_err(|reason| face_error(&reason, "use the whole picture of `render --projection cubemap`"))?;
    let picture_of = |face: Option<usize>| face.and_then(|index| pictures.get(index)).unwrap_or(&image);
    let has_figure = files.faces().any(|(_, (format, _))| {
        matches!(format, Format::Png(_)) && !matches!(found.kind, LayerKind::Colors | LayerKind::Reflectance)
    });
    if has_figure {
        let reason = "the colours of data in .png files are scaled for each face, so the faces would not fit together";
        return Err(face_error(reason, "write .exr files, or one .png file"));
    }
    let size_of = |image: &Image| {
        let size = args.scale.map(|scale| scaled_size(scale, image.crop.size()));
        size.transpose()
    };
    // Sizes are checked before a file is written.
    size_of(picture_of(None))?;
    pictures.first().map(size_of).transpose()?;
    let whole = files.whole().iter().map(|file| (None, file));
    let of_faces = files.faces().map(|(index, file)| (Some(index), file));

    let mut failures: Vec<FileError> = Vec::new();
    let mut said = Vec::new();
    for (face, (format, output)) in whole.chain(of_faces) {
        let name = output.path().display();
        let image = picture_of(face);
        let size = size_of(image)?;
        let mut steps = steps.clone();
        steps.extend(face.map(|index| format!("face={}", FACE_NAMES[index])));
        steps.extend(size.map(|[width, height]| format!("scale={width}x{height}")));
        let steps = steps.join(" ");
        // A scaled crop becomes a whole picture. The matrices of the camera do not describe this
        // picture, so the file does not get the matrices.
        let is_whole = image.crop == Rect::full(image.resolution);
        let camera = layers.camera.filter(|_| size.is_none() || is_whole);
        let camera = match face {
            Some(index) => camera.and_then(|camera| camera.of_face(index)),
            None => camera,
        };
        let developed = |image| DevelopedPicture {
            image,
            camera,
            lines,
            steps: steps.clone(),
        };
        let written = match (format, found.kind) {
            (Format::Exr(_), kind) => {
                said.push(format!("{name}: linear values"));
                let mut image = scaled(image.clone(), size, kind.is_colors());
                // Lines are not light, so they are drawn over the picture of an EXR file only if
                // `--lines` is given.
                if let Some(color) = lines.filter(|_| args.lines.is_some()) {
                    draw_lines(&mut image, color);
                }
                let picture = developed(image);
                picture.write_exr(output, &exr)
            }
            (Format::Png(_), LayerKind::Colors | LayerKind::Reflectance) => {
                said.push(format!("{name}: {tone}{}", exposure_change(args, &layers, &tone)));
                let picture = developed(scaled(image.clone(), size, true));
                picture.write_png(output, &tone)
            }
            (Format::Png(_), _) => {
                let figure = figure::draw(&found, image, size);
                said.push(format!("{name}: {}", figure.legend));
                figure.write(output)
            }
        };
        failures.extend(written.err());
    }
    if !args.quiet {
        said.iter().for_each(|line| errln!("{line}"));
    }
    if failures.is_empty() {
        return Ok(ExitCode::SUCCESS);
    }
    Err(CliError::of_failures(&failures))
}

/// Layers of the file. If the file is a checkpoint, the layers are computed from its sums, because
/// a checkpoint stores only the sums and `R G B`.
fn layers(args: &DevelopArgs) -> Result<Layers, CliError> {
    let extension = args.input.extension().and_then(|extension| extension.to_str());
    if extension.is_some_and(|extension| extension.eq_ignore_ascii_case("png")) && args.input.exists() {
        let help = "give an .exr file: `render -o NAME.exr` writes one";
        return Err(FileError::new(&args.input, "a PNG file has no light to develop")
            .help(help)
            .into());
    }
    let layers = read_layers(&args.input)?;
    let is_checkpoint = layers.channels.len() == 3 && describe_checkpoint(&args.input).is_ok();
    if args.list || args.channel.is_some() || !is_checkpoint {
        return Ok(layers);
    }
    let joined = PictureParts::describe(&[&args.input])?.join(true, true)?;
    Ok(Layers::of_image(joined.raw(), &joined.metadata))
}

/// Prints the layers with their channels.
fn list(layers: &Layers, json: bool) {
    let all = layer::all(layers);
    if json {
        let layers: Vec<_> = all.iter().map(|layer| layer.json(layers)).collect();
        outln!("{:#}", serde_json::Value::from(layers));
        return;
    }
    let UVec2 { x, y } = layers.resolution;
    outln!(
        "{x}x{y} pixels, {}",
        printing::count(layers.channels.len() as u64, "channel")
    );
    for layer in &all {
        let flag = match layer.kind {
            LayerKind::Matte => "--matte NAME".into(),
            _ if layer.is_picture => "no flag".into(),
            _ => format!("--channel {}", layer.title()),
        };
        outln!("  {}; {flag}", layer.describe(layers));
    }
    for (channel, names) in all.iter().flat_map(|layer| layer.numbers(layers)) {
        let numbered = names.iter().enumerate().take(MAX_LISTED);
        let numbered: Vec<String> = numbered.map(|(i, name)| format!("{} {name}", i + 1)).collect();
        let rest = if names.len() > MAX_LISTED {
            format!(", and {} more (--json lists all)", names.len() - MAX_LISTED)
        } else {
            String::new()
        };
        outln!("numbers of {channel}: {}{rest}", numbered.join(", "));
    }
    for mattes in &layers.mattes {
        let kind = PLACEHOLDERS.iter().find(|(_, layer)| mattes.layer.ends_with(layer));
        let all = kind.map_or(String::new(), |(name, _)| {
            format!("; a file for each name: -o '{{{name}}}.png'")
        });
        outln!(
            "{} has {}{all}",
            mattes.layer,
            printing::count(mattes.names.len() as u64, "name")
        );
        for (name, _) in mattes.names.iter().take(MAX_LISTED) {
            outln!("  {name}; --matte '{name}'");
        }
        if mattes.names.len() > MAX_LISTED {
            outln!("  and {} more (--json lists all)", mattes.names.len() - MAX_LISTED);
        }
    }
}

/// The layer as an image. The picture layer also gets the channels for metering and denoising.
fn image_of(layers: &Layers, found: &Layer) -> Image {
    let window = found.window(layers);
    let mut channels: Vec<Channel> = found
        .sources()
        .map(|(name, index)| Channel {
            name: name.into(),
            values: layers.channels[index].values.clone(),
        })
        .collect();
    if found.is_picture {
        for (name, index) in layer::guides(layers) {
            let source = &layers.channels[index];
            if source.window == window && channels.iter().all(|channel| channel.name != name) {
                channels.push(Channel {
                    name: name.into(),
                    values: source.values.clone(),
                });
            }
        }
    }
    let backing = if channels
        .iter()
        .any(|channel| channel.name == Backing::Transparent.channels()[0])
    {
        Some(Backing::Transparent)
    } else {
        layers.backing.filter(|_| found.is_picture)
    };
    Image {
        resolution: layers.resolution,
        view: layers.view,
        crop: window,
        channels,
        backing,
    }
}

/// Name of the picture before the denoiser, if `--denoise=off` asks for it and the file has it.
fn raw(args: &DevelopArgs, layers: &Layers) -> Option<&'static str> {
    let is_kept = || layers.channels.iter().any(|channel| channel.name == "raw.R");
    (args.denoise == Some(Some(Denoising::Off)) && is_kept()).then_some("raw")
}

/// Difference between the exposure of `tone` and the exposure that the render stored in the file;
/// empty without a difference. A given exposure replaces the stored one, so a user who wants one
/// stop more must know the stored exposure.
fn exposure_change(args: &DevelopArgs, layers: &Layers, tone: &Tone) -> String {
    let stored = layers.finish.tone.exposure.stops().unwrap_or(0.0);
    match (args.tone.0.exposure, tone.exposure.stops()) {
        (Some(_), Some(stops)) if stops != stored => {
            format!(
                " ({:+.2} stops from the exposure {stored:+.2} of the file)",
                stops - stored
            )
        }
        _ => String::new(),
    }
}

/// Denoiser and its radius. Without flags, a picture is denoised if its render requested a denoiser
/// but did not apply it, as in a checkpoint.
fn denoiser(args: &DevelopArgs, layers: &Layers, found: &Layer) -> Result<(Option<Denoiser>, Option<f32>), CliError> {
    let wanted = match args.denoise {
        None => {
            let left = layers
                .finish
                .denoiser
                .filter(|denoiser| found.is_picture && denoiser.version().is_ok());
            return Ok((left, args.denoise_radius.or(layers.finish.denoise_radius)));
        }
        Some(None) => Denoising::By(Denoiser::best()),
        Some(Some(wanted)) => wanted,
    };
    let denoiser = match wanted.denoiser() {
        Some(_) if found.kind != LayerKind::Colors => Err(CliError::Usage(format!(
            "--denoise {}: {} is not a layer of light\n  help: remove --denoise, or choose a layer of light with --channel",
            wanted.text(),
            found.title()
        ))),
        Some(denoiser) if args.denoise_radius.is_some() && denoiser.default_radius().is_none() => Err(CliError::Usage(
            "--denoise-radius: this denoiser has no radius\n  help: leave it out, or use --denoise=gaussian".into(),
        )),
        denoiser => Ok(denoiser),
    };
    Ok((denoiser?, args.denoise_radius))
}

/// Colour of the lines to draw over the picture; `None` for no lines. Without `--lines`, it is the
/// colour that the render stored in the file.
fn lines(args: &DevelopArgs, layers: &Layers, found: &Layer) -> Result<Option<Spectrum>, CliError> {
    let noted = layers.finish.lines.filter(|_| found.is_picture);
    let color = match args.lines {
        None => noted,
        Some(None) => Some(LineColor(Spectrum::ZERO)),
        Some(Some(lines)) => lines.0,
    };
    let Some(color) = color else {
        return Ok(None);
    };
    if found.is_picture && layers.channels.iter().any(|channel| channel.name == LINES) {
        return Ok(Some(color.0));
    }
    if args.lines.is_none() {
        return Ok(None);
    }
    let message = if found.is_picture {
        "the file has no channel `lines`\n  help: render with --aov lines"
    } else {
        "lines are drawn over the picture only\n  help: leave out --channel, or leave out --lines"
    };
    Err(CliError::Usage(format!("--lines: {message}")))
}

/// Draws the channel of lines over the light of `image`.
fn draw_lines(image: &mut Image, color: Spectrum) {
    let Some(at) = image.channels.iter().position(|channel| channel.name == LINES) else {
        return;
    };
    let shares = image.channels.swap_remove(at).values;
    let colors = ["R", "G", "B"].into_iter().zip(color.to_array());
    for (name, line) in colors.chain([("A", 1.0)]) {
        let channel = image.channels.iter_mut().find(|channel| channel.name == name);
        let values = channel.map(|channel| &mut channel.values).into_iter().flatten();
        for (value, share) in values.zip(&shares) {
            *value += share * (line - *value);
        }
    }
}

/// Tone curve and exposure. Missing flags keep the values that the render stored in the file.
/// Reflectances are shown without a tone curve.
fn tone(args: &DevelopArgs, layers: &Layers, kind: LayerKind) -> Tone {
    let noted = match kind {
        LayerKind::Colors => layers.finish.tone,
        _ => Tone::default(),
    };
    args.tone.0.over(noted)
}

/// Crops the image to the pixels from `x0, y0` to `x1, y1` of the full image. The end is excluded.
/// `--crop` has these numbers.
fn cropped(image: &Image, [x0, y0, x1, y1]: [u32; 4]) -> Result<Image, CliError> {
    let crop = Rect {
        min: UVec2::new(x0, y0),
        max: UVec2::new(x1, y1),
    };
    let there = image.crop;
    if crop.area() == 0 || crop.intersection(there) != crop {
        let (min, max) = (there.min, there.max);
        return Err(CliError::Usage(format!(
            "--crop {x0},{y0},{x1},{y1} holds no pixel or leaves the picture\n  help: use X0 < X1 and Y0 < Y1, inside {},{},{},{}",
            min.x, min.y, max.x, max.y
        )));
    }
    Ok(image.cropped(crop))
}

/// Width and height after scaling.
fn scaled_size(scale: Scale, size: UVec2) -> Result<[u32; 2], CliError> {
    let [width, height] = match scale {
        Scale::Size(size) => size.map(f64::from),
        Scale::Factor(factor) => [size.x, size.y].map(|n| (f64::from(n) * factor).round().max(1.0)),
    };
    if [width, height].iter().all(|n| (1.0..=MAX_SIDE).contains(n)) {
        return Ok([width as u32, height as u32]);
    }
    Err(CliError::Usage(format!(
        "--scale {scale}: the picture would have {width}x{height} pixels\n  help: use 1 to {MAX_SIDE} pixels a side"
    )))
}

/// The image in another size. The result is a whole picture, even for a crop. If `are_colors` is
/// false, values are not averaged: each pixel has the value of the nearest pixel.
fn scaled(image: Image, size: Option<[u32; 2]>, are_colors: bool) -> Image {
    let Some(size) = size else { return image };
    let from = image.crop.size().to_array().map(|n| n as usize);
    let to = size.map(|n| n as usize);
    let (resolution, backing) = (UVec2::from(size), image.backing);
    let channels = image.channels.into_iter().map(|channel| Channel {
        values: if are_colors {
            resample(&channel.values, from, to)
        } else {
            resample_nearest(&channel.values, from, to)
        },
        name: channel.name,
    });
    Image {
        resolution,
        view: resolution,
        crop: Rect::full(resolution),
        channels: channels.collect(),
        backing,
    }
}
