//! `embrasure points`: the points of a sampler, their discrepancy, and the convergence of
//! integrals.
//!
//! `projections` has the points, `convergence` has the integrals, and `picture` draws both.

mod convergence;
mod picture;
mod projections;

use crate::cli::args::{PointSet, PointsArgs};
use crate::cli::error::CliError;
use crate::cli::outputs::Outputs;
use crate::cli::printing;
use crate::integrator::Directions;
use crate::math::Vec2;
use crate::options::{ChosenIntegrator, IntegratorKind, IntegratorOptions, Named, name_of};
use crate::sampler::{Bounce, Dimension, RenderSampler, SampleKey, Sampler, SamplerKind};
use convergence::{Convergence, FIRST_FITTED, SEEDS, convergences, fitted};
use projections::{PointDomain, Projection, projections};
use serde_json::{Value, json};
use std::io::Write;
use std::process::ExitCode;

/// Number of sets of `count` independent points from which the mean discrepancy is computed. The
/// number falls with `count`, so that the computation takes no longer than the other work.
fn compared(count: u32) -> u32 {
    ((1 << 28) / count.pow(2).max(1)).clamp(1, 16)
}

/// A random decision of a path, such as the point on the lens: its name and its dimension.
type Decision = (&'static str, Dimension);

impl PointSet {
    /// The points of `count` samples in `dimension`.
    fn points(self, seed: u64, count: u32, dimension: Dimension) -> Vec<Vec2> {
        let mut sampler = self.sampler(seed, count);
        let point = |sample| {
            sampler.start(SampleKey::new(0, 0, sample));
            sampler.get_2d(dimension)
        };
        (0..count).map(point).collect()
    }

    /// The sampler of a render with `count` samples per pixel.
    fn sampler(self, seed: u64, count: u32) -> RenderSampler {
        let (kind, directions) = match self {
            Self::Sampler(kind) => (kind, Directions::Bsdf),
            Self::Directions(directions) => (SamplerKind::NAMES[0].1, directions),
        };
        let integrator = ChosenIntegrator::new(&IntegratorOptions {
            integrator: Some(IntegratorKind::Path),
            directions: Some(directions),
            ..IntegratorOptions::default()
        });
        integrator.sampler(kind, seed, count)
    }

    /// Decisions of a path that are shown for this point set.
    fn decisions(self) -> Vec<Decision> {
        let direction = |depth| Dimension::bounce(depth, Bounce::Direction);
        let directions = [("direction 1", direction(0)), ("direction 4", direction(3))];
        match self {
            Self::Sampler(_) => [
                ("pixel", Dimension::PIXEL),
                ("lens", Dimension::LENS),
                ("light 1", Dimension::bounce(0, Bounce::LightPoint)),
            ]
            .into_iter()
            .chain(directions)
            .collect(),
            Self::Directions(_) => directions.into(),
        }
    }

    /// Pairs of decisions. A projection shows the first random numbers of both decisions as x and
    /// y.
    fn pairs(self) -> Vec<[Decision; 2]> {
        let direction = |depth| Dimension::bounce(depth, Bounce::Direction);
        let directions = [("direction 1", direction(0)), ("direction 2", direction(1))];
        match self {
            Self::Sampler(_) => vec![
                [("pixel", Dimension::PIXEL), directions[0]],
                [
                    ("choice of light 1", Dimension::bounce(0, Bounce::Decisions)),
                    ("light 1", Dimension::bounce(0, Bounce::LightPoint)),
                ],
                directions,
            ],
            Self::Directions(_) => vec![directions],
        }
    }
}

/// Prints the measurements of the points, and draws them.
pub(in crate::cli) fn points(args: &PointsArgs) -> Result<ExitCode, CliError> {
    let mut outputs = Outputs::default();
    let output = args
        .output
        .as_deref()
        .map(|path| outputs.prepare("-o", path))
        .transpose()?;
    let name = name_of(PointSet::NAMES, args.set);
    let independent = projections::independent(args.seed, args.count, compared(args.count));
    let shown = projections(args.set, args.seed, args.count);
    let measured = convergences(args.set, args.seed, args.count);
    if args.json {
        outln!("{:#}", facts(args, name, independent, &shown, &measured))
    } else {
        print_text(args, name, independent, &shown, &measured)
    }
    if let Some(output) = output {
        let picture = picture::svg((name, args.count), independent, &shown, &measured);
        output.write(|writer| writer.write_all(picture.as_bytes()))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn facts(
    args: &PointsArgs,
    name: &str,
    [star, cap]: [f64; 2],
    shown: &[Projection],
    measured: &[Convergence],
) -> Value {
    let projection = |projection: &Projection| {
        let points: Vec<_> = projection.points.iter().map(|p| [p.x, p.y]).collect();
        let mut facts = json!({ "name": projection.name, "axes": projection.axes, "points": points });
        facts[projection.shape.measure()] = json!(projection.discrepancy);
        facts
    };
    let convergence = |convergence: &Convergence| {
        let curve = |(decision, curve): &(&str, Vec<[f64; 2]>)| {
            let errors = curve.iter().map(|[n, error]| json!({ "n": n, "rms_error": error }));
            json!({ "decision": decision, "slope": fitted(curve), "errors": errors.collect::<Vec<_>>() })
        };
        let integral = &convergence.integral;
        json!({
            "integral": integral.name,
            "formula": integral.formula,
            "exact": integral.exact,
            "variance": integral.variance,
            "curves": convergence.curves.iter().map(curve).collect::<Vec<_>>(),
        })
    };
    json!({
        "sampler": name,
        "points": args.count,
        "seed": args.seed,
        "independent": { "star_discrepancy": star, "cap_discrepancy": cap, "sets": compared(args.count) },
        "projections": shown.iter().map(projection).collect::<Vec<_>>(),
        "convergence": measured.iter().map(convergence).collect::<Vec<_>>(),
        "convergence_seeds": SEEDS,
    })
}

fn print_text(args: &PointsArgs, name: &str, [star, cap]: [f64; 2], shown: &[Projection], measured: &[Convergence]) {
    outln!(
        "{name}, {} of pixel 0,0, seed {}",
        printing::count(args.count.into(), "point"),
        args.seed
    );
    for (shape, independent) in [(PointDomain::Square, star), (PointDomain::Disk, cap)] {
        let measure = shape.measure().replace('_', " ");
        outln!("\n{measure} (independent points: {independent:.4})");
        let of_shape = shown.iter().filter(|projection| projection.shape == shape);
        for (projection, discrepancy) in of_shape.filter_map(|p| Some((p, p.discrepancy?))) {
            outln!("  {:<32} {discrepancy:.4}", projection.name);
        }
    }
    outln!("\nroot mean square error of integrals, over {SEEDS} seeds, from {FIRST_FITTED} samples on");
    for convergence in measured {
        outln!("  {} {}", convergence.integral.name, convergence.integral.formula);
        for (decision, errors) in &convergence.curves {
            let falls = match fitted(errors) {
                Some(slope) => format!("falls as N^{slope:.2}, "),
                None => String::new(),
            };
            let last = errors.last().map_or(String::new(), |[n, error]| {
                format!(
                    "{} with {}",
                    printing::measured(*error),
                    printing::count(*n as u64, "sample")
                )
            });
            outln!("    {decision:<30} {falls}{last}");
        }
    }
}
