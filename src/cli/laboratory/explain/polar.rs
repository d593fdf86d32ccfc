//! SVG picture of a BSDF: polar plots in the plane of incidence, and the albedo over the angle of
//! the viewer.

use crate::cli::plot::{SvgTarget, color, escaped, points, svg_head};
use crate::color::Spectrum;
use crate::lint::{LobeProfile, Profile};
use std::fmt::Write;

/// Width and radius of a polar plot. `HEIGHTS` has two heights of a plot: without the lower side of
/// the surface, and with it.
const WIDTH: f64 = 225.0;
const RADIUS: f64 = 95.0;
const HEIGHTS: [f64; 2] = [175.0, 275.0];
/// Position of the origin in a plot.
const ORIGIN: [f64; 2] = [0.5 * WIDTH, 130.0];
/// Height of the title of a row, and height of the albedo plot.
const TITLE: f64 = 26.0;
const ALBEDOS: f64 = 300.0;
/// Minimum distance between points of a curve.
const STEP: f64 = 1.2;

/// The picture of a material: a row of plots for each lobe and for their sum, with a plot for each
/// angle of incidence.
pub(super) fn svg(name: &str, profiles: &[Profile], albedos: &[(f32, Spectrum)]) -> String {
    let rows = rows(profiles);
    let is_two_sided = profiles.iter().any(reaches_below);
    let height = HEIGHTS[usize::from(is_two_sided)];
    let top = 40.0;
    let plots = rows.len() as f64 * (TITLE + height);
    let size = [WIDTH * profiles.len() as f64, top + plots + ALBEDOS];
    let mut text = svg_head(
        size,
        &format!("Scattering of {name} in the plane of incidence"),
        SvgTarget::File,
    );
    let _ = writeln!(
        text,
        "<text x=\"15\" y=\"24\" font-size=\"16\" font-weight=\"bold\">{}: f cos θ (full) and density (dashed), each divided by its maximum</text>",
        escaped(name)
    );
    for (i, row) in rows.iter().enumerate() {
        let y = top + i as f64 * (TITLE + height);
        let _ = writeln!(
            text,
            "<text x=\"15\" y=\"{}\" font-weight=\"bold\">{}</text>",
            y + 16.0,
            escaped(row[0].name)
        );
        for (column, (profile, lobe)) in profiles.iter().zip(row).enumerate() {
            draw(
                &mut text,
                profile,
                lobe,
                [WIDTH * column as f64, y + TITLE],
                is_two_sided,
            );
        }
    }
    draw_albedos(&mut text, albedos, [0.0, top + plots]);
    text + "</svg>\n"
}

/// Curves by row: a row for each lobe if there are several, and a row for their sum. Each row has
/// one curve per profile.
pub(super) fn rows(profiles: &[Profile]) -> Vec<Vec<&LobeProfile>> {
    let lobes = profiles.first().map_or(0, |profile| profile.lobes.len());
    let total = profiles.iter().map(|profile| &profile.total).collect();
    let single =
        (0..if lobes > 1 { lobes } else { 0 }).map(|i| profiles.iter().map(|profile| &profile.lobes[i]).collect());
    // A delta lobe has single directions instead of a curve. The row of the sum shows these
    // directions.
    let has_curve = |row: &Vec<&LobeProfile>| row.iter().any(|lobe| largest(&lobe.pdf) > 0.0);
    single.filter(has_curve).chain([total]).collect()
}

/// Returns true if light passes to the other side of the surface.
pub(super) fn reaches_below(profile: &Profile) -> bool {
    let total = &profile.total;
    let passes = profile.angles.iter().zip(&total.value);
    passes
        .into_iter()
        .any(|(angle, value)| angle.abs() > 90.5 && value.luminance() > 0.0)
        || total.deltas.iter().any(|delta| delta.angle.abs() > 90.0)
}

/// The values of a lobe as luminance.
pub(super) fn luminances(lobe: &LobeProfile) -> Vec<f32> {
    lobe.value.iter().map(|value| value.luminance()).collect()
}

/// The largest of `values`; 0 if empty.
pub(super) fn largest(values: &[f32]) -> f32 {
    values.iter().copied().fold(0.0, f32::max)
}

/// Point of a plot at `angle` degrees from the normal, and at the fraction `share` of the radius.
fn place(angle: f32, share: f32) -> [f64; 2] {
    let (sin, cos) = f64::from(angle).to_radians().sin_cos();
    let radius = RADIUS * f64::from(share);
    [ORIGIN[0] + radius * sin, ORIGIN[1] - radius * cos]
}

fn draw(text: &mut String, profile: &Profile, lobe: &LobeProfile, [x, y]: [f64; 2], is_two_sided: bool) {
    let _ = writeln!(text, "<g transform=\"translate({x} {y})\" font-size=\"11\">");
    let [cx, cy] = ORIGIN;
    // Draw the circle, the surface and the normal
    let [left, right] = [cx - RADIUS, cx + RADIUS];
    let circle = if is_two_sided {
        format!(
            "M{left} {cy}a{RADIUS} {RADIUS} 0 1 1 {0} 0a{RADIUS} {RADIUS} 0 1 1 -{0} 0",
            2.0 * RADIUS
        )
    } else {
        format!("M{left} {cy}a{RADIUS} {RADIUS} 0 1 1 {} 0", 2.0 * RADIUS)
    };
    let _ = writeln!(
        text,
        "<path d=\"{circle}M{left} {cy}H{right}M{cx} {cy}V{}\" fill=\"none\" stroke=\"currentColor\" stroke-opacity=\"0.25\"/>",
        cy - RADIUS
    );
    // Draw the direction to the viewer
    let [vx, vy] = place(profile.incidence, 1.1);
    let _ = writeln!(
        text,
        "<path d=\"M{cx} {cy}L{vx:.1} {vy:.1}\" stroke=\"currentColor\" stroke-dasharray=\"1 3\"/><circle cx=\"{vx:.1}\" cy=\"{vy:.1}\" r=\"3\"/>"
    );
    let values = luminances(lobe);
    let [max_value, max_pdf] = [&values, &lobe.pdf].map(|values| largest(values));
    curve(
        text,
        &profile.angles,
        &values,
        max_value,
        &format!("stroke=\"{}\" stroke-width=\"2\"", color(0)),
    );
    curve(
        text,
        &profile.angles,
        &lobe.pdf,
        max_pdf,
        &format!("stroke=\"{}\" stroke-width=\"1.5\" stroke-dasharray=\"5 3\"", color(1)),
    );
    for delta in &lobe.deltas {
        let share = delta.share.luminance();
        let ([dx, dy], [lx, ly]) = (place(delta.angle, share.min(1.0)), place(delta.angle, 0.8));
        let _ = writeln!(
            text,
            "<path d=\"M{cx} {cy}L{dx:.1} {dy:.1}\" stroke=\"{0}\" stroke-width=\"3\"/><text x=\"{lx:.1}\" y=\"{ly:.1}\" fill=\"{0}\">{share:.3}</text>",
            color(2)
        );
    }
    let below = if is_two_sided { cy + RADIUS + 16.0 } else { cy + 16.0 };
    let _ = writeln!(
        text,
        "<text x=\"{left}\" y=\"{below}\">{}°</text><text x=\"{right}\" y=\"{below}\" text-anchor=\"end\">{}</text>\n</g>",
        profile.incidence,
        maxima(max_value, max_pdf)
    );
}

/// Text with the largest value and density.
fn maxima(value: f32, pdf: f32) -> String {
    if pdf > 0.0 {
        format!("≤ {} and {} sr⁻¹", digits(value), digits(pdf))
    } else {
        "single directions".into()
    }
}

/// A number with three significant digits.
pub(super) fn digits(value: f32) -> String {
    let before = if value > 0.0 { value.log10().floor() as i32 } else { 0 };
    format!("{value:.*}", (2 - before).clamp(0, 9) as usize)
}

fn curve(text: &mut String, angles: &[f32], values: &[f32], max: f32, style: &str) {
    if max <= 0.0 {
        return;
    }
    let mut kept: Vec<[f64; 2]> = Vec::new();
    for (angle, value) in angles.iter().zip(values) {
        let next = place(*angle, value / max);
        if kept
            .last()
            .is_none_or(|last| (next[0] - last[0]).hypot(next[1] - last[1]) > STEP)
        {
            kept.push(next);
        }
    }
    let _ = writeln!(text, "<polygon points=\"{}\" fill=\"none\" {style}/>", points(kept));
}

/// Draws the albedo of each channel over the angle of the viewer.
fn draw_albedos(text: &mut String, albedos: &[(f32, Spectrum)], [x, y]: [f64; 2]) {
    const LEFT: f64 = 50.0;
    const RIGHT: f64 = 430.0;
    const TOP: f64 = 40.0;
    const BOTTOM: f64 = 260.0;
    let across = |angle: f32| LEFT + (RIGHT - LEFT) * f64::from(angle) / 90.0;
    let up = |albedo: f32| BOTTOM - (BOTTOM - TOP) * f64::from(albedo);
    let _ = writeln!(text, "<g transform=\"translate({x} {y})\">");
    let _ = writeln!(
        text,
        "<text x=\"15\" y=\"16\" font-weight=\"bold\">Albedo by viewing angle, for each channel; a value above 1 means a gain of energy</text>"
    );
    for tick in 0..=4 {
        let albedo = 0.25 * tick as f32;
        let opacity = if tick == 4 { 0.6 } else { 0.2 };
        let at = up(albedo);
        let _ = writeln!(
            text,
            "<path d=\"M{LEFT} {at:.1}H{RIGHT}\" stroke=\"currentColor\" stroke-opacity=\"{opacity}\"/><text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{albedo}</text>",
            LEFT - 6.0,
            at + 4.0
        );
    }
    for angle in [0.0, 30.0, 60.0, 90.0] {
        let at = across(angle);
        let _ = writeln!(
            text,
            "<path d=\"M{at:.1} {TOP}V{BOTTOM}\" stroke=\"currentColor\" stroke-opacity=\"0.2\"/><text x=\"{at:.1}\" y=\"{}\" text-anchor=\"middle\">{angle}°</text>",
            BOTTOM + 18.0
        );
    }
    // Draw wide lines first and narrow lines on top, so that equal channels stay visible
    for (channel, (color, width)) in [("#d33", 6), ("#2a2", 4), ("#46f", 2)].into_iter().enumerate() {
        let line = albedos
            .iter()
            .map(|(angle, albedo)| [across(*angle), up(albedo.to_array()[channel].clamp(0.0, 1.1))]);
        let _ = writeln!(
            text,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"{width}\"/>",
            points(line)
        );
    }
    *text += "</g>\n";
}
