//! Errors and findings of the scene builder, with their places in the scene file.

use crate::lint::MaterialSource;
use crate::math::{excerpt_of_name, significant};
use crate::scene::{BuildError, SceneReport};
use crate::scene_file::file::SceneFile;
use crate::scene_file::{DEFAULT_LIGHT, FileError, Finding, Findings, Severity};
use std::collections::HashMap;

/// Error of the section `[ground]`. It points to the key that causes it.
pub(super) fn ground_error(file: &SceneFile, error: &BuildError) -> FileError {
    let span = file.ground.as_ref().and_then(|ground| ground.place_of(error));
    let error = match span {
        Some(span) => file.error(span, error.to_string()),
        None => file.whole(error.to_string()),
    };
    error.help("correct the value, or leave the key out")
}

/// Error of the scene builder, with help.
pub(super) fn scene_error(file: &SceneFile, error: &BuildError) -> FileError {
    if matches!(error, BuildError::BadGround { .. }) {
        return ground_error(file, error);
    }
    file.whole(error.to_string()).help(match error {
        BuildError::TooSmall { .. } => {
            "scale the scene up with `transform = { scale = ... }` in each [[object]], and scale camera and lights too"
        }
        BuildError::UnknownIrradiance | BuildError::TooManyLightsOfGround { .. } => {
            "use --no-ground, or light the scene with an environment or directional lights"
        }
        BuildError::BadPlacement { .. } => "correct the placement, or scale the object's own coordinates",
        _ => "split the scene, or remove a part of it",
    })
}

/// Maximum sum of reflectance and transmittance that can be explained by rounded numbers in files.
const MAX_ROUNDING: f32 = 1.01;

/// Reports triangles and instances that repeat others at the same place.
fn report_repetitions(file: &SceneFile, report: &SceneReport, findings: &mut Findings) {
    for (code, noun, count) in [
        ("repeated-triangles", "triangles", report.repeated_triangles),
        ("repeated-instances", "instances", report.repeated_instances),
    ] {
        if count > 0 {
            let error = file.whole(format!("{noun} that repeat others at the same place, skipped: {count}"));
            findings.push(Finding::new(Severity::Warning, code, error).repeated(count, []));
        }
    }
    let emitters = report.coincident_emitters;
    if emitters.triangles > 0 {
        let noun = if emitters.triangles == 1 {
            "triangle lies"
        } else {
            "triangles lie"
        };
        let message = format!(
            "{} emitting {noun} on others, up to {} at one place: light sampling counts all of them, but a ray hits only one, so the brightness is wrong there",
            emitters.triangles, emitters.max_at_one_place
        );
        let error = file.whole(message).help("delete all but one of them");
        findings.add(Severity::Warning, "coincident-emitters", error);
    }
    if report.coincident_triangles > 0 {
        let count = report.coincident_triangles;
        let message = format!(
            "up to {count} triangles of different materials or objects lie at one place: rays there are slow, and it is chance which material they show"
        );
        let error = file.whole(message).help("delete all but one of them");
        findings.add(Severity::Warning, "coincident-triangles", error);
    }
}

/// Reports the findings of the scene builder.
pub(super) fn report_findings(
    file: &SceneFile,
    report: &SceneReport,
    materials: &[MaterialSource],
    findings: &mut Findings,
) {
    if report.degenerate_triangles > 0 {
        let count = report.degenerate_triangles;
        let error = file.whole(format!("triangles without area, skipped: {count}"));
        findings.push(Finding::new(Severity::Warning, "degenerate-triangles", error).repeated(count, []));
    }
    let places: HashMap<&str, _> = materials.iter().map(|m| (m.name.as_str(), &m.place)).collect();
    // Numbers in files have few digits.
    let scaled = report.scaled_materials.iter().filter(|(_, sum)| *sum > MAX_ROUNDING);
    for (name, sum) in scaled {
        let message = format!(
            "material `{}` reflects up to {} times the light that it receives; its colours are scaled down to 1",
            excerpt_of_name(name),
            significant((*sum).into(), 4)
        );
        let error = match places.get(name.as_str()) {
            Some(Some((path, position))) => FileError::new(path, message).at(*position),
            _ => file.whole(message),
        };
        findings.add(Severity::Warning, "scaled-material", error);
    }
    if report.panes > 0 {
        let noun = if report.panes == 1 { "pane" } else { "panes" };
        let message = format!("Glass: {} {noun}, light passes straight", report.panes);
        let error = file
            .whole(message)
            .help("`panes = \"refract\"` in [render] makes them refracting bodies");
        findings.add(Severity::Note, "glass-panes", error);
    }
    if report.rectangles > 0 {
        let noun = if report.rectangles == 1 {
            "rectangle"
        } else {
            "rectangles"
        };
        let message = format!(
            "Lights: {} {noun} of two triangles, each sampled as one light",
            report.rectangles
        );
        let error = file
            .whole(message)
            .help("`triangle_sampling = \"solid-angle\"` in [render] samples the triangles separately");
        findings.add(Severity::Note, "rectangle-lights", error);
    }
    report_repetitions(file, report, findings);
    if report.degenerate_emitters > 0 {
        let noun = match report.degenerate_emitters {
            1 => "1 emitting triangle has".into(),
            count => format!("{count} emitting triangles have"),
        };
        let error = file.whole(format!("{noun} no area in 32-bit floats, so no light comes from there"));
        let error = error.help("scale such triangles up, move them closer to the origin, or use a sphere light");
        findings.add(Severity::Warning, "lost-emitter", error);
    }
    if report.is_dark {
        let message = "no light of the scene emits, so the picture is black";
        let error = match file.light.as_slice() {
            [only] => file.error(only.kind.span(), message).help(
                "give this light a radiance, intensity or irradiance above 0, or remove it for the default light; --sun AZ,EL adds a sun",
            ),
            _ => file.whole(message).help(
                "set the radiance, intensity or irradiance of the lights above 0, or remove the lights to get the default light",
            ),
        };
        findings.add(Severity::Warning, "no-light", error);
    }
    if report.default_light {
        let message = "nothing in the scene emits light; it is lit by a constant white environment of radiance 1";
        findings.add(Severity::Note, DEFAULT_LIGHT, file.whole(message));
    }
}
