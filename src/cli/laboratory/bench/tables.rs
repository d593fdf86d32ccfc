use super::{BackendReport, BenchReport, SceneRuns, ThreadRun};
use std::fmt::Write;

/// Measurements as three Markdown tables: rays, renders, and the ratio of each other backend to the
/// first backend.
pub(super) fn tables(report: &BenchReport) -> String {
    let mut text = format!(
        "{}, {} cores; embrasure {}",
        report.cpu.as_deref().unwrap_or("unknown processor"),
        report.cores,
        report.version
    );
    for backend in report.scenes.first().map_or(&[][..], |s| &s.backends) {
        let _ = write!(text, ", {} {} ({})", backend.name, backend.version, backend.isa);
    }
    text += "\n\nMillion rays per second:\n\n";
    text += &table(
        &[
            "scene",
            "triangles",
            "backend",
            "threads",
            "camera",
            "1st bounce",
            "2nd bounce",
            "shadow",
        ],
        runs(report).map(|(scene, backend, run)| {
            let rates = &run.mrays_per_s;
            let mut row = heads(scene, backend, run);
            let rates = [rates.camera, rates.first_bounce, rates.second_bounce, rates.shadow];
            row.extend(rates.map(|rate| rate.map_or("-".into(), |r| figures(r, 3))));
            row
        }),
    );
    text +=
        "\nBuild with all threads; times of the renders, and of tracing their rays again without shading (replay):\n\n";
    text += &table(
        &[
            "scene",
            "triangles",
            "backend",
            "threads",
            "build s",
            "bytes a triangle",
            "M rays",
            "render s",
            "replay s",
            "render / replay",
        ],
        runs(report).map(|(scene, backend, run)| {
            let mut row = heads(scene, backend, run);
            row.extend([
                figures(backend.build_s, 2),
                format!("{:.1}", backend.bytes_per_triangle),
                figures(run.rays as f64 / 1e6, 3),
                figures(run.render_s, 3),
                figures(run.replay_s, 3),
                format!("{:.2}", run.render_over_replay),
            ]);
            row
        }),
    );
    let ratios: Vec<Vec<String>> = report.scenes.iter().flat_map(ratios).collect();
    if !ratios.is_empty() {
        text += "\nRatios to the first backend, with all threads; for rays, the ratio of the times per ray:\n\n";
        text += &table(
            &[
                "scene",
                "triangles",
                "backends",
                "build",
                "memory",
                "camera",
                "1st bounce",
                "2nd bounce",
                "shadow",
                "render",
            ],
            ratios.into_iter(),
        );
    }
    text
}

fn runs(report: &BenchReport) -> impl Iterator<Item = (&SceneRuns, &BackendReport, &ThreadRun)> {
    report.scenes.iter().flat_map(|scene| {
        let backends = scene.backends.iter();
        backends.flat_map(move |backend| backend.runs.iter().map(move |run| (scene, backend, run)))
    })
}

fn heads(scene: &SceneRuns, backend: &BackendReport, run: &ThreadRun) -> Vec<String> {
    vec![
        scene.scene.clone(),
        scene.triangles.to_string(),
        backend.name.to_string(),
        run.threads.to_string(),
    ]
}

/// Rows of the table of ratios: measurements of each other backend of a scene, relative to the
/// first backend.
fn ratios(scene: &SceneRuns) -> Vec<Vec<String>> {
    let Some((first, others)) = scene.backends.split_first() else {
        return Vec::new();
    };
    let row = |other: &BackendReport| {
        let (a, b) = (first.runs.last()?, other.runs.last()?);
        let slower = |a: Option<f64>, b: Option<f64>| a.zip(b).map_or("-".into(), |(a, b)| format!("{:.2}", a / b));
        let (p, q) = (&a.mrays_per_s, &b.mrays_per_s);
        Some(vec![
            scene.scene.clone(),
            scene.triangles.to_string(),
            format!("{} / {}", other.name, first.name),
            format!("{:.2}", other.build_s / first.build_s),
            format!("{:.2}", other.bytes_per_triangle / first.bytes_per_triangle),
            slower(p.camera, q.camera),
            slower(p.first_bounce, q.first_bounce),
            slower(p.second_bounce, q.second_bounce),
            slower(p.shadow, q.shadow),
            format!("{:.2}", b.render_s / a.render_s),
        ])
    };
    others.iter().filter_map(row).collect()
}

/// A Markdown table with aligned columns.
fn table(head: &[&str], rows: impl Iterator<Item = Vec<String>>) -> String {
    let head = head.iter().map(|h| h.to_string()).collect();
    let rows: Vec<Vec<String>> = std::iter::once(head).chain(rows).collect();
    let width = |column: usize| rows.iter().map(|row| row[column].len()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..rows[0].len()).map(width).collect();
    let mut text = String::new();
    for (i, row) in rows.iter().enumerate() {
        for (cell, width) in row.iter().zip(&widths) {
            let _ = write!(text, "| {cell:width$} ");
        }
        text += "|\n";
        if i == 0 {
            widths.iter().for_each(|w| text += &format!("|{}", "-".repeat(w + 2)));
            text += "|\n";
        }
    }
    text
}

/// `value` with at least `n` significant figures.
fn figures(value: f64, n: i32) -> String {
    let decimals = n - 1 - value.abs().max(1e-9).log10().floor() as i32;
    format!("{value:.0$}", decimals.clamp(0, 9) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn significant_figures() {
        assert_eq!(figures(0.012_345, 2), "0.012");
        assert_eq!(figures(123.4, 2), "123");
        assert_eq!(figures(9.876, 3), "9.88");
    }
}
