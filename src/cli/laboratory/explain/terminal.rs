//! Polar plots of a BSDF in a terminal.

use super::polar::{digits, largest, luminances, reaches_below, rows};
use crate::cli::plot::Braille;
use crate::lint::{LobeProfile, Profile};

/// Width of a plot, and gap between plots, in characters.
const COLUMNS: usize = 18;
const GAP: &str = "  ";
/// Number of dots from the origin to the rim.
const RADIUS: f64 = 17.0;

/// Prints two rows of plots for each lobe and for their sum: values and densities. Each row has a
/// plot for each angle of incidence.
pub(super) fn print(profiles: &[Profile]) {
    let is_two_sided = profiles.iter().any(reaches_below);
    for row in rows(profiles) {
        let values = row.iter().map(|lobe| luminances(lobe)).collect();
        print_row("f cos θ", profiles, &row, values, is_two_sided);
        let densities = row.iter().map(|lobe| lobe.pdf.clone()).collect();
        print_row("density", profiles, &row, densities, is_two_sided);
    }
}

fn print_row(what: &str, profiles: &[Profile], row: &[&LobeProfile], values: Vec<Vec<f32>>, is_two_sided: bool) {
    outln!(
        "\n  {what} of {} by viewing angle, for each angle of incidence with the maximum in sr⁻¹",
        row[0].name
    );
    let mut names = Vec::new();
    let mut plots = Vec::new();
    for ((profile, lobe), values) in profiles.iter().zip(row).zip(values) {
        let max = largest(&values);
        let name = format!(
            "{}° {}",
            profile.incidence,
            if max > 0.0 { digits(max) } else { "-".into() }
        );
        names.push(format!("{name:<COLUMNS$}"));
        plots.push(plot(profile, lobe, &values, max, is_two_sided));
    }
    outln!("  {}", names.join(GAP).trim_end());
    for line in 0..plots.first().map_or(0, Vec::len) {
        let line: Vec<&str> = plots.iter().map(|plot| plot[line].as_str()).collect();
        outln!("  {}", line.join(GAP));
    }
}

/// Lines of text that show a plot: the surface as dots, the curve of `values`, and a line for each
/// delta direction. The length of this line is proportional to the fraction of light in the
/// direction.
fn plot(profile: &Profile, lobe: &LobeProfile, values: &[f32], max: f32, is_two_sided: bool) -> Vec<String> {
    let mut picture = Braille::new(COLUMNS, if is_two_sided { 9 } else { 5 });
    let origin = [COLUMNS as f64 - 0.5, RADIUS + 1.0];
    let place = |angle: f32, share: f32| {
        let (sin, cos) = f64::from(angle).to_radians().sin_cos();
        [
            origin[0] + RADIUS * f64::from(share) * sin,
            origin[1] - RADIUS * f64::from(share) * cos,
        ]
    };
    (0..2 * COLUMNS as i64)
        .step_by(3)
        .for_each(|x| picture.dot(x, origin[1] as i64));
    if max > 0.0 {
        let places: Vec<[f64; 2]> = profile
            .angles
            .iter()
            .zip(values)
            .map(|(a, v)| place(*a, v / max))
            .collect();
        places.windows(2).for_each(|ends| picture.line(ends[0], ends[1]));
    }
    for delta in &lobe.deltas {
        picture.line(origin, place(delta.angle, delta.share.luminance().min(1.0)));
    }
    picture.rows().collect()
}
