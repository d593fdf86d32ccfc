//! Traces as lines of an OBJ file, for any viewer of meshes.

use super::trace::{Technique, Trace, VertexPlace};
use crate::math::Vec3;
use std::fmt::Write;

/// Length of the line towards an infinitely distant light, relative to the size of the paths.
const FAR: f32 = 0.25;

/// Text of the file: an object for each sample. The groups of an object are paths, unoccluded
/// shadow rays, occluded shadow rays, and connections.
pub(super) fn text(samples: &[(u32, Vec<Trace>)]) -> String {
    let mut file = File {
        text: "# embrasure paths: scattered paths, shadow rays and connections as lines\n".into(),
        vertices: 0,
    };
    for (sample, traces) in samples {
        let _ = writeln!(file.text, "o sample_{sample}");
        file.group(*sample, "paths", traces.iter().flat_map(paths));
        file.group(
            *sample,
            "shadow_rays",
            traces.iter().flat_map(|trace| shadow_rays(trace, false)),
        );
        file.group(
            *sample,
            "occluded",
            traces.iter().flat_map(|trace| shadow_rays(trace, true)),
        );
        file.group(*sample, "connections", traces.iter().flat_map(connections));
    }
    file.text
}

struct File {
    text: String,
    vertices: usize,
}

impl File {
    fn group(&mut self, sample: u32, name: &str, lines: impl Iterator<Item = Vec<Vec3>>) {
        let mut lines = lines.filter(|line| line.len() > 1).peekable();
        if lines.peek().is_some() {
            let _ = writeln!(self.text, "g sample_{sample}_{name}");
        }
        for line in lines {
            line.iter().for_each(|p| {
                let _ = writeln!(self.text, "v {} {} {}", p.x, p.y, p.z);
            });
            let indices: Vec<String> = (1..=line.len()).map(|i| (self.vertices + i).to_string()).collect();
            let _ = writeln!(self.text, "l {}", indices.join(" "));
            self.vertices += line.len();
        }
    }
}

/// Paths of a trace, each from its start to a vertex without a successor.
pub(super) fn paths(trace: &Trace) -> Vec<Vec<Vec3>> {
    let mut has_next = vec![false; trace.vertices.len()];
    trace
        .vertices
        .iter()
        .filter_map(|vertex| vertex.parent)
        .for_each(|parent| has_next[parent] = true);
    let ends = (0..trace.vertices.len()).filter(|v| !has_next[*v]);
    ends.map(|end| {
        let back = std::iter::successors(Some(end), |v| trace.vertices[*v].parent);
        let mut line: Vec<Vec3> = back.map(|v| trace.vertices[v].p).collect();
        line.reverse();
        line
    })
    .collect()
}

/// Shadow rays of `trace`: the occluded rays if `is_occluded` is true, else the rays that are not.
pub(super) fn shadow_rays(trace: &Trace, is_occluded: bool) -> Vec<Vec<Vec3>> {
    let points = trace.vertices.iter().map(|vertex| vertex.p);
    let size = points
        .clone()
        .zip(points.skip(1))
        .map(|(a, b)| a.distance(b))
        .fold(0.0, f32::max);
    let of_vertex = |vertex: &super::trace::Vertex| {
        let samples = vertex.light_samples.iter().filter_map(|sample| {
            let transmittance = sample.transmittance?;
            let end = sample.target.unwrap_or(vertex.p + FAR * size * sample.direction);
            (transmittance.is_black() == is_occluded).then(|| vec![vertex.p, end])
        });
        samples.collect::<Vec<_>>()
    };
    trace.vertices.iter().flat_map(of_vertex).collect()
}

/// Connections as lines. A line connects a subpath from the camera with a subpath from a light. For
/// path reuse, a line connects the first surface of the pixel with the end of a reused path.
pub(super) fn connections(trace: &Trace) -> Vec<Vec<Vec3>> {
    let at = |v: &usize| trace.vertices[*v].p;
    let connection = |contribution: &super::trace::Contribution| match contribution.technique {
        Technique::Connection(s, t, ..) if s > 1 => {
            let [a, b] = [contribution.path.get(t.checked_sub(1)?)?, contribution.path.get(t)?];
            Some(vec![at(a), at(b)])
        }
        Technique::Shared(_, end) => {
            let first = trace
                .vertices
                .iter()
                .find(|vertex| matches!(vertex.place, VertexPlace::Surface { .. }))?;
            Some(vec![first.p, end])
        }
        _ => None,
    };
    trace.contributions.iter().filter_map(connection).collect()
}
