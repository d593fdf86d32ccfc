//! Subdivision of the faces of an OBJ file before triangulation. Materials, parts and colours are
//! kept. The surface is also smooth across borders between materials or parts.

use super::colors::Colors;
use super::outline::{Outline, Section};
use crate::files::memory::Allowance;
use crate::files::{MemoryLimit, in_words};
use crate::geometry::{ControlMesh, IrregularEdges};
use crate::io::load_options::LoadParameters;
use crate::io::{FileError, Finding, Findings, Severity};
use half::f16;
use std::path::Path;

/// Memory of the outline, the mesh and the acceleration structure per triangle of the result, in
/// bytes, in addition to [`ControlMesh::bytes`].
const BYTES_OF_TRIANGLE: u64 = 130;

/// Subdivides the faces of a file. `parameters` has the number of steps and the crease angle.
pub(super) fn subdivide(
    path: &Path,
    outline: &mut Outline,
    colors: &mut Colors,
    parameters: &LoadParameters,
    allowance: Allowance,
    findings: &mut Findings,
) -> Result<(), FileError> {
    let steps = parameters.subdivision().steps();
    if steps == 0 {
        return Ok(());
    }
    let (mut sizes, mut corners, mut uv_corners) = (Vec::new(), Vec::new(), Vec::new());
    for section in &outline.sections {
        sizes.extend_from_slice(section.sizes());
        corners.extend((0..section.corner_count()).map(|i| section.corner(i)[0]));
    }
    if outline.sections.iter().any(Section::has_uvs) {
        for section in &outline.sections {
            uv_corners.extend((0..section.corner_count()).map(|i| section.corner(i)[1]));
        }
    }
    if sizes.is_empty() {
        return Ok(());
    }
    let opacity = |i: usize| colors.alpha.get(i).copied().unwrap_or(f16::ONE);
    let of_vertex = |(i, rgb): (usize, &[f16; 3])| [rgb[0], rgb[1], rgb[2], opacity(i)].map(f16::to_f32);
    let of_vertices: Vec<[f32; 4]> = colors.rgb.iter().enumerate().map(of_vertex).collect();
    let mesh = ControlMesh {
        positions: &outline.vertices.positions,
        uvs: &outline.vertices.uvs,
        colors: &of_vertices,
        sizes: &sizes,
        corners: &corners,
        uv_corners: &uv_corners,
        crease_angle: parameters.crease_angle(),
    };
    check_memory(path, &mesh, steps, allowance)?;
    let fine = mesh.subdivided(steps);
    report_sharp_edges(path, fine.irregular, findings);
    let scheme = mesh.scheme();
    let mut start = 0;
    for section in &mut outline.sections {
        let of_faces = section.sizes().iter();
        let counts: Vec<usize> = of_faces
            .map(|&size| ControlMesh::triangles_of_face(scheme, size, steps) as usize)
            .collect();
        let end = start + counts.iter().sum::<usize>();
        let uvs = fine.uv_triangles.get(start..end).unwrap_or_default();
        let corners = [&fine.triangles[start..end], uvs, &fine.normal_triangles[start..end]];
        section.replace_faces(&counts, corners);
        start = end;
    }
    outline.vertices.positions = fine.positions;
    outline.vertices.normals = fine.normals;
    outline.vertices.uvs = fine.uvs;
    if !colors.rgb.is_empty() {
        let rgb = |c: &[f32; 4]| [c[0], c[1], c[2]].map(f16::from_f32);
        colors.rgb = fine.colors.iter().map(rgb).collect();
    }
    if !colors.alpha.is_empty() {
        colors.alpha = fine.colors.iter().map(|c| f16::from_f32(c[3])).collect();
    }
    Ok(())
}

/// Returns an error if `steps` steps need too much memory. The error states the number of steps
/// that fit.
fn check_memory(path: &Path, mesh: &ControlMesh, steps: u32, allowance: Allowance) -> Result<(), FileError> {
    let bytes_of = |steps: u32| mesh.bytes(steps) + mesh.triangles(steps) * BYTES_OF_TRIANGLE;
    let refusal = |steps: u32| {
        if !mesh.fits_indices(steps) {
            return Some("more than 32-bit indices can distinguish".to_string());
        }
        let bytes = bytes_of(steps);
        MemoryLimit::refusal(allowance.limit, allowance.kept.saturating_add(bytes), bytes)
    };
    let Some(why) = refusal(steps) else { return Ok(()) };
    let kept = match allowance.kept {
        0 => String::new(),
        kept => format!(", besides the {} of the files before", in_words(kept)),
    };
    let message = format!(
        "subdivision {steps} makes {} triangles from {} faces, which take about {}{kept}: {why}",
        mesh.triangles(steps),
        mesh.sizes.len(),
        in_words(bytes_of(steps)),
    );
    let help = match (0..steps).rev().find(|&fewer| refusal(fewer).is_none()) {
        Some(0) | None => "remove the subdivision, or allow more memory".to_string(),
        Some(fewer) => format!("use --subdivide {fewer}, which fits, or allow more memory"),
    };
    Err(FileError::new(path, message).help(help))
}

/// Adds a finding about edges that stay sharp because no smooth surface passes through them.
fn report_sharp_edges(path: &Path, irregular: IrregularEdges, findings: &mut Findings) {
    let count = |count: u64, one: &str, several: &str| match count {
        0 => None,
        1 => Some(format!("1 {one}")),
        count => Some(format!("{count} {several}")),
    };
    let non_manifold = count(
        irregular.non_manifold,
        "edge of three faces or more",
        "edges of three faces or more",
    );
    let flipped = count(
        irregular.flipped,
        "edge between faces of opposite winding",
        "edges between faces of opposite winding",
    );
    let words: Vec<String> = non_manifold.into_iter().chain(flipped).collect();
    if words.is_empty() {
        return;
    }
    let total = irregular.non_manifold + irregular.flipped;
    let verb = if total == 1 { "stays" } else { "stay" };
    let message = format!("subdivision: {} {verb} sharp", words.join(" and "));
    let error = FileError::new(path, message);
    let error = error.help("join the faces in a modelling program, and turn their fronts outwards");
    findings.push(Finding::new(Severity::Warning, "sharp-edges", error).repeated(total, []));
}
