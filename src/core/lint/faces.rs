use super::Use;
use super::tally::{Tally, counted};
use crate::io::{Face, FileError, Finding, MAX_PLACES, ObjFaces, Position, Severity, area_vector, weld};
use crate::math::{Vec3, hash::mix};
use std::path::Path;

/// Fraction, among the faces with vertex normals, of faces whose normals point to the back. The
/// winding defines the front. Above this fraction, the finding is a warning instead of a note.
const FLIPPED_SHARE: f64 = 0.01;

/// Checks the faces of an OBJ file one by one.
pub(super) struct FaceLint<'a> {
    path: &'a Path,
    faces: &'a ObjFaces,
    uses: &'a [Use],
    /// For each position, the index of the first position that equals it.
    points: Vec<u32>,
}

/// A face with keys to compare it with the other faces.
struct PlacedFace {
    /// Key of the set of points, independent of their order.
    key: [u32; 4],
    line: usize,
    material: usize,
    /// Hashes of the sequence of points, in forward and in reverse order.
    turns: [u64; 2],
}

impl PlacedFace {
    /// Returns true if both faces have the same corners in opposite orders.
    fn is_back_of(&self, other: &Self) -> bool {
        let [forwards, backwards] = other.turns;
        self.turns == [backwards, forwards]
    }
}

impl<'a> FaceLint<'a> {
    pub fn new(path: &'a Path, faces: &'a ObjFaces, uses: &'a [Use]) -> Self {
        Self {
            path,
            faces,
            uses,
            points: weld(faces.positions()),
        }
    }

    /// For each position, the index of the first position that equals it.
    pub fn points(&self) -> &[u32] {
        &self.points
    }

    pub fn findings(&self) -> Vec<Finding> {
        let (mut repeated, mut degenerate, mut crossing, mut flipped) = <(Tally, Tally, Tally, Tally)>::default();
        let mut without_uvs: Vec<Tally> = self.uses.iter().map(|_| Tally::default()).collect();
        let mut with_normals = 0u64;
        let mut corners: Vec<Vec3> = Vec::new();
        let mut points: Vec<u32> = Vec::new();
        for face in self.faces.faces() {
            corners.clear();
            corners.extend(
                face.positions
                    .iter()
                    .filter_map(|&i| self.faces.positions().get(i as usize)),
            );
            self.sorted_points(&face, &mut points);
            let normal = area_vector(&corners);
            if points.windows(2).any(|pair| pair[0] == pair[1]) {
                repeated.add(face.line);
            } else if normal.length() == 0.0 {
                degenerate.add(face.line);
            } else if corners.len() > 3 && !ObjFaces::is_simple(&corners) {
                crossing.add(face.line);
            }
            let given = face
                .normals
                .iter()
                .filter_map(|&i| self.faces.normals().get(i as usize));
            let mut given = given.filter(|n| **n != Vec3::ZERO).peekable();
            if given.peek().is_some() {
                with_normals += 1;
                if given.all(|n| n.as_dvec3().dot(normal) < 0.0) {
                    flipped.add(face.line);
                }
            }
            if let (Some(tally), false) = (without_uvs.get_mut(face.material), face.has_uvs) {
                tally.add(face.line);
            }
        }

        let warning = Severity::Warning;
        let share = flipped.count as f64 / with_normals.max(1) as f64;
        let flipped_severity = if share > FLIPPED_SHARE { warning } else { Severity::Note };
        let mut findings: Vec<Finding> = [
            repeated.finding((warning, "repeated-vertex"), self.path, |n| {
                let message = format!("{} with the same point at several corners", counted(n, "face"));
                (message, "name each point once; a render skips triangles without area")
            }),
            degenerate.finding((warning, "degenerate-face"), self.path, |n| {
                let message = format!("{} without area", counted(n, "face"));
                (message, "delete these faces; a render skips them")
            }),
            crossing.finding((warning, "crossing-face"), self.path, |n| {
                let message = format!("{} whose outline crosses itself: triangles overlap", counted(n, "face"));
                (message, "cut the face into triangles in the program that exported the file")
            }),
            flipped.finding((flipped_severity, "flipped-normal"), self.path, |n| {
                let message = format!(
                    "{} of {with_normals} with normals ({:.1} %) have normals against their winding; the winding decides which side is the front",
                    counted(n, "face"),
                    100.0 * share
                );
                (message, "turn the faces over, or compute their normals anew")
            }),
        ]
        .into_iter()
        .flatten()
        .collect();
        findings.extend(self.duplicates().into_iter().flatten());
        for (tally, used) in without_uvs.iter().zip(self.uses) {
            if used.has_maps {
                findings.extend(tally.finding((warning, "missing-texture-coordinates"), self.path, |n| {
                    let faces = counted(n, "face");
                    let message = format!(
                        "{faces} of the textured material `{}` without texture coordinates",
                        used.name
                    );
                    (
                        message,
                        "export texture coordinates (`vt`); without them, these faces show the mean colour of the texture",
                    )
                }));
            }
        }
        findings.extend(self.unused_vertices());
        findings
    }

    /// Fills `points` with the points of a face, sorted.
    fn sorted_points(&self, face: &Face, points: &mut Vec<u32>) {
        points.clear();
        points.extend(face.positions.iter().filter_map(|&i| self.points.get(i as usize)));
        points.sort_unstable();
    }

    /// Finds faces with the same points: faces that repeat another face, and faces on the back of
    /// another face.
    fn duplicates(&self) -> [Option<Finding>; 2] {
        let mut points: Vec<u32> = Vec::new();
        let mut count = 0;
        let place = |face: Face| {
            count += 1;
            self.sorted_points(&face, &mut points);
            // Leave out faces that contain a point twice, which another finding reports.
            let is_whole = points.windows(2).all(|pair| pair[0] != pair[1]);
            is_whole.then(|| PlacedFace {
                key: key_of(&points),
                line: face.line,
                material: face.material,
                turns: self.turns(&face),
            })
        };
        let mut faces: Vec<PlacedFace> = self.faces.faces().filter_map(place).collect();
        faces.sort_unstable_by_key(|face| (face.key, face.line));
        let places = || faces.chunk_by(|a, b| a.key == b.key).filter(|place| place.len() > 1);
        let is_pair = |[a, b]: [&PlacedFace; 2]| a.material != b.material && a.is_back_of(b);
        let pairs = places().filter(|place| matches!(place, [a, b] if is_pair([a, b])));
        let are_apart = ObjFaces::are_two_sided(pairs.count(), count);

        let (mut repeated, mut backs) = (Vec::new(), Vec::new());
        for place in places() {
            for (i, face) in place.iter().enumerate().skip(1) {
                let first = &place[0];
                let is_harmless = if face.material == first.material {
                    let used = self.uses.get(face.material);
                    used.is_some_and(|used| used.is_same_from_behind() && (!used.emits || place.len() == 2))
                } else {
                    are_apart && place.len() == 2
                };
                let is_first_back = place[1..i].iter().all(|other| other.turns != face.turns);
                if face.is_back_of(first) && is_first_back && is_harmless {
                    backs.push((face.line, first.line))
                } else {
                    repeated.push((face.line, place[i - 1].line))
                }
            }
        }
        let tally = |mut lines: Vec<(usize, usize)>| {
            lines.sort_unstable();
            let mut tally = Tally::default();
            lines.iter().for_each(|&(line, _)| tally.add(line));
            (tally, lines.first().map_or(0, |lines| lines.1))
        };
        let (repeated, of_repeated) = tally(repeated);
        let (backs, of_back) = tally(backs);
        [
            repeated.finding((Severity::Warning, "duplicate-face"), self.path, |n| {
                let faces = counted(n, "face");
                let message =
                    format!("{faces} with the same points as another face; the first repeats line {of_repeated}");
                (
                    message,
                    "delete one of the faces: which of them a ray hits is arbitrary",
                )
            }),
            backs.finding((Severity::Note, "two-sided"), self.path, |n| {
                let faces = counted(n, "face");
                let message = format!(
                    "{faces} on the back of another face; the first is on the back of the face in line {of_back}"
                );
                let effect = if are_apart {
                    "nothing to do: each side shows its own material"
                } else {
                    "nothing to do: both sides show the same material, and emit if it emits"
                };
                (message, effect)
            }),
        ]
    }

    /// Hashes of the sequence of points, in forward and in reverse order of the corners. Both
    /// sequences start at the point with the smallest index.
    fn turns(&self, face: &Face) -> [u64; 2] {
        let points: Vec<u32> = face
            .positions
            .iter()
            .filter_map(|&i| self.points.get(i as usize).copied())
            .collect();
        let n = points.len();
        let start = (0..n).min_by_key(|&i| points[i]).unwrap_or(0);
        let hash = |order: &mut dyn Iterator<Item = usize>| {
            order.fold(0, |hash, i| mix(hash ^ u64::from(points[(start + i) % n])))
        };
        [hash(&mut (0..n)), hash(&mut (0..n).map(|i| n - i))]
    }

    /// Finds positions that no face uses.
    fn unused_vertices(&self) -> Option<Finding> {
        let mut is_used = vec![false; self.faces.positions().len()];
        for &i in self.faces.faces().flat_map(|face| face.positions) {
            if let Some(used) = is_used.get_mut(i as usize) {
                *used = true;
            }
        }
        let unused = || is_used.iter().enumerate().filter(|(_, used)| !**used).map(|(i, _)| i);
        let count = unused().count() as u64;
        if count == 0 {
            return None;
        }
        let first: Vec<usize> = unused().take(1 + MAX_PLACES).collect();
        let mut places = ObjFaces::lines_of_positions(self.path, &first)
            .into_iter()
            .map(Position::line);
        let message = match count {
            1 => "1 vertex is used by no face".into(),
            _ => format!("{count} vertices are used by no face"),
        };
        let mut error = FileError::new(self.path, message);
        error.position = places.next();
        Some(Finding::new(Severity::Note, "unused-vertex", error).repeated(count, places))
    }
}

/// Key that is equal for faces with the same points. The key is the list of the sorted points if
/// there are at most four. If there are more points, the key is a hash of 128 bits.
fn key_of(points: &[u32]) -> [u32; 4] {
    let mut key = [u32::MAX; 4];
    if points.len() <= key.len() {
        key[..points.len()].copy_from_slice(points);
        return key;
    }
    let hash = |seed: u64| points.iter().fold(seed, |hash, &point| mix(hash ^ u64::from(point)));
    let [a, b] = [hash(1), hash(2)];
    [(a >> 32) as u32, a as u32, (b >> 32) as u32, b as u32]
}
