//! Warnings of `embrasure render` about the settings of a picture, and about a finished picture.

use super::args::RenderArgs;
use super::outputs::Images;
use super::printing;
use crate::color::{Exposure, Tone};
use crate::film::{Image, Spikes, metered};
use crate::io::{Format, Warning};
use crate::render::Statistics;
use crate::session::{Session, Settings};

/// Warning if a denoiser works on far more pixels than the picture has.
pub(super) fn narrow_picture(settings: &Settings) -> Option<Warning> {
    /// Number of pixels that every denoiser filters within seconds.
    const FEW: u64 = 1 << 18;
    let size = settings.crop().size();
    let pixels = settings.denoiser?.pixels(size);
    let is_slow = pixels > FEW && pixels > 2 * settings.crop().area();
    let text = || {
        format!(
            "denoising {}x{} pixels takes as long as {pixels} pixels, because Open Image Denoise pads both sides to multiples of 16 pixels\n  help: use --denoise=atrous, or --denoise=off",
            size.x, size.y
        )
    };
    is_slow.then(|| Warning::new("narrow-picture", text()))
}

/// Warning if a panorama does not have square pixels at the horizon.
pub(super) fn panorama_shape(session: &Session) -> Option<Warning> {
    let size = session.panorama_size()?;
    let text = || {
        let grid = session.settings().resolution / size;
        format!(
            "a panorama of {}x{} pixels is squeezed, because a full panorama is twice as wide as high\n  help: use a size such as --size {}x{}",
            size.x,
            size.y,
            size.x * grid.x,
            (size.x / 2).max(1) * grid.y
        )
    };
    (size.x != 2 * size.y).then(|| Warning::new("panorama-shape", text()))
}

/// Stops between the metered exposure and that of a PNG that is nearly black: mid-grey becomes a
/// code below 16.
const DARK: f32 = 5.0;
/// Stops between the exposure of a PNG that is nearly white and the metered exposure: mid-grey
/// becomes 2.9, and the tone curves show this as white.
const BRIGHT: f32 = 4.0;
/// Metered exposure, in stops, above which hardly any light reaches the surfaces of the picture.
const DIM: f32 = 8.0;

/// Returns true if hardly any light reaches what the camera sees: the metered exposure of `stops`
/// is high.
pub(super) fn is_dim(stops: f32) -> bool {
    stops > DIM
}

/// Warning if a PNG is nearly black or nearly white, because its exposure of `chosen` stops differs
/// from the metered exposure of `usual` stops. If the user has given the exposure (`is_given`), a
/// black picture is meant: it may be one of a series. A white picture hardly ever is.
pub(super) fn unusual_exposure(chosen: f32, usual: f32, is_given: bool) -> Option<String> {
    let (look, side, difference) = match chosen - usual {
        difference if difference < -DARK && !is_given => ("black", "below", -difference),
        difference if difference > BRIGHT => ("white", "above", difference),
        _ => return None,
    };
    let more = if look == "black" {
        "; `embrasure help black` lists other causes"
    } else {
        ""
    };
    Some(format!(
        "the PNG is nearly {look}, because its exposure {chosen:+} is {difference:.0} stops {side} the metered exposure\n  \
         help: use --exposure auto{more}"
    ))
}

/// Metered exposure of `image` in stops; `None` if the image is black.
pub(super) fn metered_stops(tone: Tone, image: &Image) -> Option<f32> {
    let exposure = Exposure::Auto;
    metered(Tone { exposure, ..tone }, image).exposure.stops()
}

/// Returns a note if the pixel filter may make pixels negative.
pub(super) fn negative_lobes(settings: &Settings) -> Option<Warning> {
    let text = "the mitchell filter has negative lobes: pixels of EXR files beside bright ones may be negative\n  \
                help: use --filter gaussian or blackman-harris if a program cannot read such pixels";
    let is_negative = settings.filter.has_negative_lobes();
    is_negative.then(|| Warning::new("negative-lobes", text))
}

/// Warning about `--aov` if no output has additional channels.
pub(super) fn idle_aov(args: &RenderArgs, images: &Images) -> Option<Warning> {
    let has_channels = images.iter().any(|(format, _)| matches!(format, Format::Exr(_)));
    let is_written = !images.is_empty() && args.pixel.is_none();
    let is_idle = !args.aov.is_empty() && is_written && !has_channels && args.checkpoint.is_none();
    let text = || {
        format!(
            "--aov {}: a PNG file has no further channels\n  help: add -o NAME.exr",
            args.aov.join(",")
        )
    };
    is_idle.then(|| Warning::new("idle-flag", text()))
}

/// Warning about NaN, infinite or negative samples, which count as black.
pub(super) fn dropped_warning(statistics: &Statistics) -> String {
    let first = statistics.first_dropped.first().map_or_else(String::new, |d| {
        format!(
            "; the first is sample {} of pixel {},{}",
            d.key.sample, d.key.x, d.key.y
        )
    });
    match statistics.dropped {
        1 => format!("1 sample was NaN, infinite or negative and counts as black{first}"),
        n => format!("{n} samples were NaN, infinite or negative and count as black{first}"),
    }
}

/// Minimum fraction of doubtful irradiance records at which the warning is given.
const MANY_DOUBTFUL: f64 = 0.02;

/// Warning that an irradiance cache does not suit the scene: the fraction `doubtful` of the records
/// gets most of its light from few rays.
pub(super) fn doubtful_warning(doubtful: f64) -> Option<String> {
    (doubtful >= MANY_DOUBTFUL).then(|| {
        format!(
            "{:.0} % of the irradiance records get most of their light from a few rays, as at caustics and small openings: the picture has wrong blotches, and more samples do not remove them\n  \
             help: use photon-map, sppm or path, or raise --cache-rays",
            100.0 * doubtful
        )
    })
}

/// Warning about pixels that a few iterations made bright.
pub(super) fn spikes_warning(spikes: Spikes) -> String {
    let Spikes {
        count,
        brightest,
        value,
        error,
        around,
    } = spikes;
    let pixels = match count {
        1 => "1 pixel gets most of its light".into(),
        n => format!("{n} pixels get most of their light"),
    };
    format!(
        "{pixels} from a few iterations: a chain was stuck there, or the path is very rare; pixel {},{} is {value:.3} ± {error:.3}, but the pixels around are {around:.3}\n  \
         help: do not trust such pixels; take more samples, or compare with bdpt or vcm",
        brightest.x, brightest.y
    )
}

/// Warning about `walks`, the number of rays that were cut off after 10,000 surfaces with opacity
/// below 1.
pub(super) fn cut_warning(walks: u64) -> String {
    format!(
        "{} passed 10,000 surfaces with an opacity below 1; everything behind them counts as opaque",
        printing::count(walks, "ray")
    )
}
