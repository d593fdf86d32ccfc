//! Pictures of a difference.

use super::{Comparison, Pair};
use crate::cli::args::Map;
use crate::cli::error::CliError;
use crate::color::false_color;
use crate::compare::{pixel_scores, relative_differences};
use crate::io::Figure;

/// Draws the difference of `pair`.
///
/// # Errors
///
/// `map` is [`Map::Scores`], and an image has no variance channels.
pub(super) fn draw(map: Map, pair: &Pair, comparison: &Comparison) -> Result<Figure, CliError> {
    let size = pair.window.size();
    let figure = |pixels, legend| Figure {
        size: [size.x, size.y],
        pixels,
        legend,
    };
    let diverging = |values: &[f32], range: f32| values.iter().map(|v| false_color::diverging(v / range)).collect();
    match map {
        Map::Flip => {
            let pixels = comparison.flip.map.iter().map(|e| false_color::magma(*e)).collect();
            Ok(figure(pixels, "FLIP: black is 0, pale yellow is 1".into()))
        }
        Map::Error => {
            let values = relative_differences(&pair.image.image, &pair.reference.image);
            let range = round_range(&values);
            let percent = 100.0 * range;
            let legend = format!(
                "relative error of luminance, (Y - Yref) / (Yref² + 0.01)^(1/2): blue is -{percent} %, grey 0, red +{percent} %"
            );
            Ok(figure(diverging(&values, range), legend))
        }
        Map::Scores => {
            let scores = pair
                .noisy()
                .and_then(|[reference, image]| pixel_scores(pair.window, reference, image));
            let Some(scores) = scores else {
                let message = "--map z: one of the images has no variance channels\n  help: use --map error or flip";
                return Err(CliError::Failed(message.into()));
            };
            const RANGE: f32 = 6.0;
            let legend = "difference divided by its standard deviation, of the channel with the largest ratio: blue is -6, grey 0, red +6";
            Ok(figure(diverging(&scores, RANGE), legend.into()))
        }
    }
}

/// The smallest of 0.01, 0.02, 0.05, 0.1, 0.2, … that is not below the 99th percentile of the
/// absolute values.
fn round_range(values: &[f32]) -> f32 {
    let mut sizes: Vec<f32> = values.iter().map(|v| v.abs()).collect();
    sizes.sort_by(f32::total_cmp);
    let usual = sizes
        .get(sizes.len().saturating_sub(1) * 99 / 100)
        .copied()
        .unwrap_or(0.0);
    let steps = (0..).flat_map(|decade| [1.0, 2.0, 5.0].map(|step| step * 10f32.powi(decade - 2)));
    steps.take(60).find(|step| *step >= usual).unwrap_or(1.0)
}
