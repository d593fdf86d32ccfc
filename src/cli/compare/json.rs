use super::{CHANNELS, Comparison, left_out, scale_name};
use crate::compare::{CommonErrors, Errors, ExtremeTest};
use crate::film::Rect;
use crate::options::name_of;
use serde_json::{Value, json};

impl Comparison<'_> {
    /// Result of the comparison as JSON, for `--json`.
    pub fn json(&self) -> Value {
        let (pair, errors, args) = (self.pair, &self.errors, self.args);
        let significance = self.significance.as_ref().map(|significance| {
            json!({
                "significance": significance.level,
                "p": significance.p,
                "differs": significance.differs(),
                "tests": significance.extremes.iter().map(extreme_json).collect::<Vec<_>>(),
                "worst": significance.worst().map(extreme_json),
                "common_errors": name_of(CommonErrors::NAMES, significance.common),
                "rare_samples": significance.rare,
                "left_out": left_out(significance),
                "before_denoiser": self.pair.is_denoised(),
            })
        });
        let limits = self.limits().map(|(flag, value, limit)| {
            (
                flag.replace('-', "_"),
                json!({ "limit": limit, "value": value, "passed": value <= limit }),
            )
        });
        let blocks = Errors::BLOCKS.iter().zip(errors.block_rel_mse);
        let block_rel_mse: serde_json::Map<String, Value> =
            blocks.map(|(edge, error)| (edge.to_string(), json!(error))).collect();
        json!({
            "reference": args.reference.display().to_string(),
            "image": args.image.display().to_string(),
            "resolution": pair.resolution,
            "window": corners(pair.window),
            "display_values": pair.is_display,
            "not_finite": { "reference": pair.not_finite[0], "image": pair.not_finite[1] },
            "reference_mean": errors.reference_mean,
            "mean": errors.mean,
            "bias": errors.bias(),
            "relative_bias": errors.relative_bias(),
            "mse": errors.mse,
            "rel_mse": errors.rel_mse,
            "block_rel_mse": block_rel_mse,
            "psnr_db": errors.psnr(),
            "max_levels": self.levels,
            "flip": {
                "mean": self.flip.mean,
                "exposures": self.flip.exposures.map(|e| json!({ "start": e.start, "stop": e.stop, "count": e.count })),
            },
            "outcome": self.outcome.words(),
            "biased_by": { "reference": pair.reference.bias, "image": pair.image.bias },
            "significance_test": significance,
            "limits": limits.collect::<serde_json::Map<String, Value>>(),
            "failed": self.fails(),
        })
    }
}

fn corners(window: Rect) -> [u32; 4] {
    [window.min.x, window.min.y, window.max.x, window.max.y]
}

fn extreme_json(e: &ExtremeTest) -> Value {
    json!({
        "scale": scale_name(e.scale),
        "tests": e.tests,
        "window": corners(e.window),
        "channel": CHANNELS[e.channel.min(2)],
        "reference": e.reference,
        "image": e.image,
        "difference": e.difference,
        "score": e.score,
        "p": e.p,
    })
}
