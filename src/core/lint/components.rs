//! Checks that connected components of faces that refract or emit are closed and face outwards.
//!
//! Other faces are not checked, because only surfaces that refract or emit must be closed. Faces
//! with a common edge are found by sorting all edges, which take 16 bytes each. Volumes are
//! computed by the divergence theorem.

use super::Use;
use super::tally::{Tally, counted};
use crate::io::{Face, Finding, ObjFaces, Severity};
use crate::math::{Bounds3, DVec3};
use std::collections::BTreeMap;
use std::path::Path;

/// Checks the connected components of faces that refract, and of faces that emit. Faces with a
/// common point belong to one component. `points` has, for each position, the index of the first
/// equal position. A component that encloses everything in the file may face inwards without a
/// finding, if it encloses other faces or the camera. `is_around` is true if the camera is inside
/// the scene.
pub(super) fn inspect(path: &Path, faces: &ObjFaces, uses: &[Use], points: &[u32], is_around: bool) -> Vec<Finding> {
    let mut findings = Vec::new();
    if uses.iter().any(|u| u.refracts) {
        let components = Components::of(faces, points, |material| uses.get(material).is_some_and(|u| u.refracts));
        findings.extend(components.refracting(path, is_around));
    }
    if uses.iter().any(|u| u.emits) {
        let components = Components::of(faces, points, |material| uses.get(material).is_some_and(|u| u.emits));
        findings.extend(components.emitting(path, is_around));
    }
    findings
}

/// A connected component of faces.
struct Component {
    /// Line of the component's first face.
    line: usize,
    faces: u64,
    bounds: Bounds3,
    /// Six times the enclosed volume, negative if the faces face inwards.
    volume: f64,
    /// Line of a face with an edge that no other face has. `None` if there is no such face.
    open: Option<usize>,
    /// Line of a face with an edge that more than two faces share. `None` if there is no such face.
    crowded: Option<usize>,
    /// Line of a face with an edge that two faces traverse in the same direction, so one of the two
    /// faces is turned over. `None` if there is no such face.
    turned: Option<usize>,
}

struct Components {
    components: Vec<Component>,
    /// Bounds and number of all faces of the file, including faces that are in no component.
    whole: (Bounds3, u64),
}

/// Maximum number of components that are tested for a cavity inside. The largest are tested.
const MAX_BODIES: usize = 64;

/// An edge of a face: the smaller and the larger index of its points, true if the face traverses
/// the edge from the larger to the smaller index, and the line of the face.
type Edge = (u32, u32, bool, u32);

impl Components {
    fn of(faces: &ObjFaces, points: &[u32], takes_part: impl Fn(usize) -> bool) -> Self {
        let all = || faces.faces().filter(|face| takes_part(face.material));
        let ring = |face: &Face<'_>| -> Vec<u32> {
            let found = face.positions.iter().filter_map(|&i| points.get(i as usize));
            let mut ring: Vec<u32> = found.copied().collect();
            // Remove equal consecutive corners, because there is no edge between them.
            ring.dedup();
            while ring.len() > 1 && ring.first() == ring.last() {
                ring.pop();
            }
            ring
        };
        let mut sets = Sets::new(points.len());
        let mut edges: Vec<Edge> = Vec::new();
        for face in all() {
            let ring = ring(&face);
            let next = ring.iter().cycle().skip(1);
            for (&a, &b) in ring.iter().zip(next).filter(|(a, b)| a != b) {
                sets.join(a, b);
                edges.push((a.min(b), a.max(b), a > b, face.line as u32));
            }
        }

        // All points of a component have the same representative (root) in `sets`, which identifies
        // the component. By the divergence theorem, the volume of a component is the sum of the
        // volumes of pyramids whose bases are the faces and whose apex is the component's first
        // point.
        let mut index_of: BTreeMap<u32, usize> = BTreeMap::new();
        let mut components: Vec<Component> = Vec::new();
        let mut apexes: Vec<DVec3> = Vec::new();
        let position = |i: u32| faces.positions().get(i as usize).copied().unwrap_or_default();
        for face in all() {
            let ring = ring(&face);
            let Some(&first) = ring.first() else { continue };
            let index = *index_of.entry(sets.root(first)).or_insert_with(|| {
                apexes.push(position(first).as_dvec3());
                components.push(Component {
                    line: face.line,
                    faces: 0,
                    bounds: Bounds3::EMPTY,
                    volume: 0.0,
                    open: None,
                    crowded: None,
                    turned: None,
                });
                components.len() - 1
            });
            let (component, apex) = (&mut components[index], apexes[index]);
            component.faces += 1;
            ring.iter().for_each(|&i| component.bounds.extend(position(i)));
            let from_apex = |i: &u32| position(*i).as_dvec3() - apex;
            let p0 = from_apex(&first);
            for pair in ring.windows(2).skip(1) {
                let [p1, p2] = [from_apex(&pair[0]), from_apex(&pair[1])];
                component.volume += p0.dot(p1.cross(p2));
            }
        }

        edges.sort_unstable();
        for same in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            let Some(&index) = index_of.get(&sets.root(same[0].0)) else {
                continue;
            };
            let component = &mut components[index];
            let line = same.iter().map(|edge| edge.3 as usize).max().unwrap_or(0);
            let fault = match same {
                [_] => &mut component.open,
                [a, b] if a.2 == b.2 => &mut component.turned,
                [_, _] => continue,
                _ => &mut component.crowded,
            };
            *fault = Some(fault.map_or(line, |known| known.min(line)));
        }
        let corners = faces.faces().flat_map(|face| face.positions);
        let whole = (corners.map(|&i| position(i)).collect(), faces.faces().count() as u64);
        Self { components, whole }
    }

    /// Number and lines of the components for which `fault` returns a line.
    fn tally(&self, fault: impl Fn(&Component) -> Option<usize>) -> Tally {
        let mut lines: Vec<usize> = self.components.iter().filter_map(fault).collect();
        lines.sort_unstable();
        let mut tally = Tally::default();
        lines.into_iter().for_each(|line| tally.add(line));
        tally
    }

    /// Number and lines of the components that are closed but inside out. Two kinds are not
    /// counted: a cavity inside another component, and a component around everything else.
    fn inside_out(&self, is_around: bool) -> Tally {
        let contains = |a: &Bounds3, b: &Bounds3| a.min.cmple(b.min).all() && a.max.cmpge(b.max).all();
        let mut bodies: Vec<&Component> = self
            .components
            .iter()
            .filter(|component| component.volume > 0.0)
            .collect();
        bodies.sort_by(|a, b| b.volume.total_cmp(&a.volume));
        bodies.truncate(MAX_BODIES);
        self.tally(|component| {
            let is_closed = component.open.is_none() && component.crowded.is_none() && component.turned.is_none();
            if !is_closed || component.volume >= 0.0 {
                return None;
            }
            let is_cavity = bodies.iter().any(|body| contains(&body.bounds, &component.bounds));
            let is_around_all =
                contains(&component.bounds, &self.whole.0) && (is_around || component.faces < self.whole.1);
            (!is_cavity && !is_around_all).then_some(component.line)
        })
    }

    fn refracting(&self, path: &Path, is_around: bool) -> Vec<Finding> {
        let warning = |code| (Severity::Warning, code);
        let bodies = |n| counted(n, "refracting component");
        let open = self.tally(|s| s.open).finding(warning("open-shell"), path, |n| {
            let message = format!("{}: not closed, so light enters the body and never leaves", bodies(n));
            (message, "close the body, or make the material thin")
        });
        let crowded = self.tally(|s| s.crowded).finding(warning("non-manifold"), path, |n| {
            let message = format!("{}: more than two faces at one edge", bodies(n));
            (message, "separate the bodies, so that inside and outside are defined")
        });
        let turned = self.tally(|s| s.turned).finding(warning("mixed-winding"), path, |n| {
            let message = format!("{}: neighbouring faces have opposite winding", bodies(n));
            (message, "wind all faces counter-clockwise as seen from outside")
        });
        let inside_out = self.inside_out(is_around).finding(warning("inside-out"), path, |n| {
            let message = format!("{}: closed, but wound inside out, so the body lies outside", bodies(n));
            (message, "turn the faces over")
        });
        [open, crowded, turned, inside_out].into_iter().flatten().collect()
    }

    /// Findings for components that emit. An open component is not reported, because lamps are
    /// often single faces.
    fn emitting(&self, path: &Path, is_around: bool) -> Vec<Finding> {
        let warning = |code| (Severity::Warning, code);
        let lamps = |n| counted(n, "emitting part");
        let turned = self.tally(|s| s.turned).finding(warning("mixed-winding"), path, |n| {
            let message = format!(
                "{}: neighbouring faces have opposite winding and emit to opposite sides",
                lamps(n)
            );
            (
                message,
                "wind all faces the same way: a face emits on the side from which it is counter-clockwise",
            )
        });
        let inside_out = self.inside_out(is_around).finding(warning("light-inwards"), path, |n| {
            let message = format!("{}: closed, and wound so that it emits only inwards", lamps(n));
            (message, "turn the faces over")
        });
        [turned, inside_out].into_iter().flatten().collect()
    }
}

/// Disjoint sets of points (Tarjan 1975), by path halving.
struct Sets(Vec<u32>);

impl Sets {
    fn new(len: usize) -> Self {
        Self((0..len as u32).collect())
    }

    fn root(&mut self, mut point: u32) -> u32 {
        loop {
            let parent = self.0[point as usize];
            if parent == point {
                return point;
            }
            let above = self.0[parent as usize];
            self.0[point as usize] = above;
            point = above;
        }
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}
