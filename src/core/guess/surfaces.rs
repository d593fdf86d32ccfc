//! Measures of a scene's surfaces along its axes, as evidence for its upright axis (`up`).

use super::lathe::Lathe;
use super::parts::SceneParts;
use super::scene_tracer::SceneTracer;
use super::spread::radical_inverse;
use super::triangles::{Triangle, for_each_triangle};
use crate::geometry::PartNames;
use crate::math::{Bounds3, Vec2, Vec3};
use crate::sampling::warp::uniform_triangle;
use crate::scene::Scene;
use rayon::prelude::*;
use std::collections::{BTreeSet, HashMap};

/// Maximum number of triangles that are measured, evenly spread over the scene's triangles.
const MAX_TRIANGLES: u64 = 1 << 20;
/// Number of points on the surfaces, evenly spread over their area.
const POINTS: f64 = 16384.0;
/// Number of parts whose names one task reads.
const PARTS: usize = 4096;
/// Maximum number of points from which rays are traced.
const RAYS: usize = 1024;
/// Offset of a ray's origin from its surface, in radii of the scene.
const OFF_SURFACE: f32 = 1e-4;
/// Number of cells along each axis of the grid in which a scene is compared with its images.
const CELLS: i32 = 20;
/// Points are on the lowest plane along an axis if their distance from it is within this fraction
/// of the extent.
const CONTACT: f32 = 0.015;
/// Minimum |cos| between up and the normals of a flat end.
const FLAT_END: f32 = 0.98;
/// Number of cells along each edge of the outline in which flat ends are measured.
const END_CELLS: u32 = 16;
/// Minimum cosine between up and the normal of a surface that faces up.
const MIN_UP_COSINE: f32 = 0.2;
/// Maximum distance from 0, as a fraction of the extent along an axis, of a coordinate that counts
/// as 0.
const AT_ORIGIN: f32 = 0.02;
/// Added to the divisor of the fraction of standing parts, so that a few standing parts are weak
/// evidence.
const FEW_STAND: f32 = 0.02;

/// Words in names of materials and parts that belong to high things in an object or a room.
const HIGH: [&str; 17] = [
    "antenna", "bulb", "ceiling", "chimney", "crown", "flame", "foliage", "hair", "hat", "head", "leaf", "leave",
    "roof", "sky", "smoke", "top", "window",
];
/// Words in names of materials and parts that belong to a face, or to the front of a vehicle. They
/// are high or in front, and rarely low.
const FACE: [&str; 5] = ["eye", "eyebrow", "face", "teeth", "windscreen"];
/// Words in names of materials and parts that belong to low things in an object or a room.
const LOW: [&str; 28] = [
    "asphalt", "bark", "base", "boot", "bottom", "carpet", "dirt", "feet", "floor", "foot", "grass", "ground", "jean",
    "leg", "pant", "rim", "road", "rug", "sand", "shoe", "sole", "stem", "street", "terrain", "tire", "trunk", "tyre",
    "wheel",
];

/// A direction along an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Direction {
    pub axis: usize,
    pub is_negative: bool,
}

impl Direction {
    /// The six directions.
    pub const ALL: [Self; 6] = [
        Self::new(0, false),
        Self::new(0, true),
        Self::new(1, false),
        Self::new(1, true),
        Self::new(2, false),
        Self::new(2, true),
    ];

    const fn new(axis: usize, is_negative: bool) -> Self {
        Self { axis, is_negative }
    }

    fn sign(self) -> f32 {
        if self.is_negative { -1.0 } else { 1.0 }
    }

    pub fn vector(self) -> Vec3 {
        // Adding 0 turns −0 into 0.
        self.sign() * Vec3::AXES[self.axis] + Vec3::ZERO
    }

    pub fn opposite(self) -> Self {
        Self::new(self.axis, !self.is_negative)
    }

    /// Index of the direction in [`Direction::ALL`].
    pub fn index(self) -> usize {
        2 * self.axis + usize::from(self.is_negative)
    }
}

/// Measures of the surfaces.
pub(super) struct Surfaces {
    /// Similarity of the scene and its mirror image along each axis, 0 to 1.
    pub mirror: [f32; 3],
    /// Similarity of the scene and the scene turned by a right angle around each axis, 0 to 1.
    pub turn: [f32; 3],
    /// Similarity of the scene and a body of revolution around each axis, 0 to 1.
    pub round: [f32; 3],
    /// Ratio of the scene's length along each axis to its smaller width across the axis.
    pub slimness: [f32; 3],
    /// Distance of the box's centre from the origin along each axis, as a fraction of the extent,
    /// at most 1/2.
    pub off_center: [f32; 3],
    /// Distance of the surfaces' centre from the box's centre along each axis, as a fraction of the
    /// extent.
    pub off_balance: [f32; 3],
    /// Mean direction in which the texture coordinate v increases.
    pub v: Vec3,
    /// Vector from the middle of the surfaces with a word of [`LOW`] in the names of their
    /// materials or parts to the middle of the surfaces with a word of [`HIGH`]. Each component is
    /// divided by the scene's extent.
    pub named: Vec3,
    /// Vector from the middle of all surfaces to the middle of the surfaces with names of a face.
    /// Each component is divided by the scene's extent.
    pub face: Vec3,
    /// Fraction of the surfaces with a word of [`LOW`] in the names of their materials.
    pub low: f32,
    /// Extents of the scene.
    pub extent: Vec3,
    measures: [UprightMeasures; 6],
}

/// Measures of a scene for one direction that may be up.
#[derive(Clone, Copy)]
pub(super) struct UprightMeasures {
    /// Fraction of the parts that stand if this direction is up, among the parts that stand in any
    /// direction.
    pub standing: f32,
    /// Area of the box around the lowest points, as a fraction of the scene's outline.
    pub contact: f32,
    /// Fraction of the scene's outline in which the lowest surface is flat and lies on the ground.
    pub flat_end: f32,
    /// Fraction of the surfaces that face up.
    pub faces_up: f32,
    /// Fraction of the surfaces with nothing above.
    pub open: f32,
    /// Depth of the first surfaces below the top of a body of revolution around the axis, as a
    /// fraction of the extent.
    pub depth: f32,
    /// True if the lowest point has the height 0.
    pub is_on_zero: bool,
}

impl Surfaces {
    pub fn new(tracer: &SceneTracer) -> Self {
        let bounds = tracer.region.bounds;
        let extent = (bounds.max - bounds.min).max(Vec3::splat(f32::MIN_POSITIVE));
        let points = points(tracer);
        let count = (points.len() as f32).max(1.0);
        let mean = |of: fn(&Point) -> Vec3| points.iter().map(of).sum::<Vec3>() / count;
        let cells = Cells::new(&points, bounds);
        let standing = SceneParts::of(tracer).standing(&Direction::ALL.map(Direction::vector));
        let stand: f32 = standing.iter().sum();
        let oriented: Vec<(Vec3, Vec3)> = points.iter().map(|point| (point.p, point.n)).collect();
        let lathes = [0, 1, 2].map(|axis| Lathe::new(&oriented, bounds, axis));
        let materials = tracer.scene.materials();
        let are_low: Vec<bool> = materials
            .iter()
            .map(|material| is_high(&material.name) == Some(false))
            .collect();
        let levels = levels(tracer.scene, &points, is_high);
        let is_face = |name: &str| side_of(name, &FACE, &[]);
        let faces = self::levels(tracer.scene, &points, is_face);
        Self {
            mirror: [0, 1, 2].map(|axis| cells.mirror(axis)),
            turn: [0, 1, 2].map(|axis| turn(&points, bounds, axis)),
            round: lathes.map(|lathe| lathe.likeness),
            slimness: [0, 1, 2].map(|axis| extent[axis] / extent[(axis + 1) % 3].min(extent[(axis + 2) % 3])),
            off_center: (bounds.center().abs() / extent).min(Vec3::splat(0.5)).to_array(),
            off_balance: ((mean(|point| point.p) - bounds.center()).abs() / extent).to_array(),
            v: mean(|point| point.v),
            named: offset(&points, &levels) / extent,
            face: offset(&points, &faces) / extent,
            low: share(&points, |point| are_low[point.material as usize]),
            extent,
            measures: Direction::ALL.map(|up| UprightMeasures {
                standing: standing[up.index()] / (stand + FEW_STAND),
                contact: contact(&points, bounds, up),
                flat_end: flat_end(&points, bounds, up),
                faces_up: share(&points, |point| point.n.dot(up.vector()) > MIN_UP_COSINE),
                open: open(tracer, &points, up.vector()),
                depth: lathes[up.axis].depth(tracer, up.vector()),
                is_on_zero: lowest(bounds, up).abs() <= AT_ORIGIN * extent[up.axis],
            }),
        }
    }

    pub fn measures(&self, up: Direction) -> &UprightMeasures {
        &self.measures[up.index()]
    }
}

/// A point of a surface.
pub(super) struct Point {
    pub p: Vec3,
    /// Unit normal, from the winding.
    pub n: Vec3,
    /// Direction in which the texture coordinate v increases; zero without texture coordinates.
    v: Vec3,
    material: u32,
    part: u32,
}

/// Points all over the scene's surfaces; empty if the surfaces have no area.
pub(super) fn points(tracer: &SceneTracer) -> Vec<Point> {
    let mut area = 0.0;
    for_each_triangle(tracer.scene, MAX_TRIANGLES, |triangle| area += triangle.area);
    let (mut points, mut due) = (Vec::new(), 0.5);
    for_each_triangle(tracer.scene, MAX_TRIANGLES, |triangle| {
        due += POINTS * triangle.area / area;
        while due >= 1.0 {
            due -= 1.0;
            let i = points.len() as u32;
            let (b1, b2) = uniform_triangle(Vec2::new(radical_inverse(2, i), radical_inverse(3, i)));
            let [p0, p1, p2] = triangle.corners;
            points.push(Point {
                p: p0 + b1 * (p1 - p0) + b2 * (p2 - p0),
                n: triangle.normal,
                v: v_direction(triangle),
                material: triangle.material,
                part: triangle.part,
            });
        }
    });
    points
}

/// Unit vector along which v increases in a triangle while u is constant; zero without texture
/// coordinates.
fn v_direction(triangle: &Triangle) -> Vec3 {
    let [p0, p1, p2] = triangle.corners;
    let Some([t0, t1, t2]) = triangle.uvs else {
        return Vec3::ZERO;
    };
    let (d1, d2) = (t1 - t0, t2 - t0);
    let determinant = d1.perp_dot(d2);
    if determinant == 0.0 {
        Vec3::ZERO
    } else {
        (determinant.signum() * (d1.x * (p2 - p0) - d2.x * (p1 - p0))).normalize_or_zero()
    }
}

/// Fraction of the points for which `is` returns true.
fn share(points: &[Point], is: impl Fn(&Point) -> bool) -> f32 {
    points.iter().filter(|point| is(point)).count() as f32 / (points.len() as f32).max(1.0)
}

/// Coordinate of the lowest points along the axis of `up`.
fn lowest(bounds: Bounds3, up: Direction) -> f32 {
    if up.is_negative {
        bounds.max[up.axis]
    } else {
        bounds.min[up.axis]
    }
}

/// Area of the box around the lowest points, as a fraction of the scene's outline.
fn contact(points: &[Point], bounds: Bounds3, up: Direction) -> f32 {
    let extent = (bounds.max - bounds.min).max(Vec3::splat(f32::MIN_POSITIVE));
    let is_low = |p: &Vec3| (p[up.axis] - lowest(bounds, up)).abs() < CONTACT * extent[up.axis];
    let low: Bounds3 = points.iter().map(|point| point.p).filter(is_low).collect();
    let shares = ((low.max - low.min) / extent).clamp(Vec3::ZERO, Vec3::ONE);
    if low.is_empty() {
        0.0
    } else {
        shares[(up.axis + 1) % 3] * shares[(up.axis + 2) % 3]
    }
}

/// Fraction of the scene's outline that the flat surfaces on the lowest plane cover.
fn flat_end(points: &[Point], bounds: Bounds3, up: Direction) -> f32 {
    let extent = (bounds.max - bounds.min).max(Vec3::splat(f32::MIN_POSITIVE));
    let is_of_end = |point: &&Point| {
        let is_low = (point.p[up.axis] - lowest(bounds, up)).abs() < CONTACT * extent[up.axis];
        is_low && point.n[up.axis].abs() >= FLAT_END
    };
    let cell = |point: &Point| {
        let of = |axis: usize| {
            let share = (point.p[axis] - bounds.min[axis]) / extent[axis];
            ((share * END_CELLS as f32) as u32).min(END_CELLS - 1)
        };
        of((up.axis + 1) % 3) * END_CELLS + of((up.axis + 2) % 3)
    };
    let cells: BTreeSet<u32> = points.iter().filter(is_of_end).map(cell).collect();
    cells.len() as f32 / (END_CELLS * END_CELLS) as f32
}

/// Fraction of the points that have no surface above them.
fn open(tracer: &SceneTracer, points: &[Point], up: Vec3) -> f32 {
    let offset = OFF_SURFACE * tracer.region.bounds.radius() * up;
    let is_open = |point: &&Point| tracer.trace(point.p + offset, up).is_none();
    let tried = || points.iter().step_by(points.len().div_ceil(RAYS).max(1));
    tried().filter(is_open).count() as f32 / (tried().count() as f32).max(1.0)
}

/// Number of points in each cell of a grid.
struct Cells {
    counts: HashMap<[i32; 3], u32>,
    points: usize,
}

impl Cells {
    fn new(points: &[Point], bounds: Bounds3) -> Self {
        let extent = (bounds.max - bounds.min).max(Vec3::splat(f32::MIN_POSITIVE));
        let mut counts = HashMap::new();
        for point in points {
            let place = (point.p - bounds.min) / extent * CELLS as f32;
            let cell = place.to_array().map(|x| (x as i32).clamp(0, CELLS - 1));
            *counts.entry(cell).or_default() += 1;
        }
        Self {
            counts,
            points: points.len(),
        }
    }

    /// Similarity of the points and their image, 0 to 1: the fraction of points with a counterpart
    /// in the image. `image` returns the cell of the image for a cell.
    fn similarity(&self, image: impl Fn([i32; 3]) -> [i32; 3]) -> f32 {
        let shared = |(cell, count): (&[i32; 3], &u32)| {
            let other = self.counts.get(&image(*cell)).copied().unwrap_or(0);
            u64::from(other.min(*count))
        };
        self.counts.iter().map(shared).sum::<u64>() as f32 / (self.points as f32).max(1.0)
    }

    fn mirror(&self, axis: usize) -> f32 {
        self.similarity(|mut cell| {
            cell[axis] = CELLS - 1 - cell[axis];
            cell
        })
    }
}

/// Similarity of the scene and the scene turned by a right angle around the axis `axis` through its
/// middle, 0 to 1.
fn turn(points: &[Point], bounds: Bounds3, axis: usize) -> f32 {
    let [a, b] = [(axis + 1) % 3, (axis + 2) % 3];
    let (extent, center) = (bounds.max - bounds.min, bounds.center());
    let half = 0.5 * extent[a].max(extent[b]);
    let mut square = bounds;
    for across in [a, b] {
        (square.min[across], square.max[across]) = (center[across] - half, center[across] + half);
    }
    Cells::new(points, square).similarity(|cell| {
        let mut turned = cell;
        (turned[a], turned[b]) = (cell[b], CELLS - 1 - cell[a]);
        turned
    })
}

/// Level of each point by the name of its material, or else of its part: `level_of` returns true
/// for the names of one kind, false for the names of the opposite kind.
fn levels(scene: &Scene, points: &[Point], level_of: impl Fn(&str) -> Option<bool> + Sync) -> Vec<Option<bool>> {
    let materials: Vec<Option<bool>> = scene.materials().iter().map(|m| level_of(&m.name)).collect();
    let of_material = |point: &Point| materials.get(point.material as usize).copied().flatten();
    // Name only the parts of points, because a file may have a million parts
    let mut parts: Vec<u32> = points.iter().map(|point| point.part).collect();
    parts.sort_unstable();
    parts.dedup();
    let of_parts = levels_of_names(scene.part_names(), &parts, level_of);
    let of_part = |point: &Point| of_parts[parts.binary_search(&point.part).ok()?];
    points
        .iter()
        .map(|point| of_material(point).or_else(|| of_part(point)))
        .collect()
}

/// Levels of the names of `parts`: the results of `level_of`, which must not depend on digits at
/// the end of a name. `level_of` is called once for consecutive parts that differ by such digits.
pub(super) fn levels_of_names(
    names: &PartNames,
    parts: &[u32],
    level_of: impl Fn(&str) -> Option<bool> + Sync,
) -> Vec<Option<bool>> {
    let of_chunk = |parts: &[u32]| {
        let (mut last, mut level) = (String::new(), level_of(""));
        let of_part = |&part: &u32| {
            let name = names.name(part);
            let start = name.trim_end_matches(|c: char| c.is_ascii_digit());
            if start != last {
                last.clear();
                last.push_str(start);
                level = level_of(start);
            }
            level
        };
        parts.iter().map(of_part).collect::<Vec<_>>()
    };
    parts.par_chunks(PARTS).flat_map_iter(of_chunk).collect()
}

/// Vector from the middle of the points with the level false to the middle of the points with the
/// level true. If a level has no points, the middle of all points is used.
fn offset(points: &[Point], levels: &[Option<bool>]) -> Vec3 {
    let middle = |is_in: &dyn Fn(Option<bool>) -> bool| {
        let chosen = points.iter().zip(levels).filter(|(_, level)| is_in(**level));
        let (sum, count) = chosen.fold((Vec3::ZERO, 0.0f32), |(sum, count), (point, _)| {
            (sum + point.p, count + 1.0)
        });
        (count > 0.0).then(|| sum / count)
    };
    let all = middle(&|_| true).unwrap_or_default();
    let of_level = |of: bool| middle(&|level| level == Some(of)).unwrap_or(all);
    of_level(true) - of_level(false)
}

/// Returns `Some(true)` for the name of a high thing, `Some(false)` for the name of a low thing,
/// and `None` for all other names.
fn is_high(name: &str) -> Option<bool> {
    side_of(name, &HIGH, &LOW)
}

/// Returns `Some(true)` if the name has words of the list `first` only, `Some(false)` if it has
/// words of the list `second` only, and `None` otherwise. Words may be in singular or in plural.
pub(super) fn side_of(name: &str, first: &[&str], second: &[&str]) -> Option<bool> {
    // Compare first letters before words, because a file may have a million names
    let has = |list: &[&str], word: &str| {
        let first = word.as_bytes().first();
        list.iter()
            .any(|known| known.as_bytes().first() == first && *known == word)
    };
    let is_in = |list: &[&str], word: &str| {
        let singular = word.trim_end_matches('s');
        has(list, word) || singular.len() < word.len() && has(list, singular)
    };
    let (mut has_first, mut has_second) = (false, false);
    for_each_word(name, |word| {
        has_first |= is_in(first, word);
        has_second |= is_in(second, word);
    });
    (has_first != has_second).then_some(has_first)
}

/// Calls `visit` with the words of a name in lower case. A word ends at a capital letter after a
/// small letter, and at characters that are not letters.
fn for_each_word(name: &str, mut visit: impl FnMut(&str)) {
    let mut word = String::new();
    let mut was_lower = false;
    for c in name.chars() {
        if !word.is_empty() && (!c.is_alphabetic() || was_lower && c.is_uppercase()) {
            visit(&word);
            word.clear();
        }
        was_lower = c.is_lowercase();
        if c.is_ascii_alphabetic() {
            word.push(c.to_ascii_lowercase());
        } else if c.is_alphabetic() {
            word.extend(c.to_lowercase());
        }
    }
    if !word.is_empty() {
        visit(&word);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbered_parts_have_the_levels_of_their_names() {
        let mut names = PartNames::default();
        for i in 0..3 * PARTS {
            let word = ["Roof", "wheel", "7", "Roof wheel ", "1roof", "Box"][i / 5 % 6];
            match i % 3 {
                0 => names.find_or_add(&format!("{word}{i}"), ""),
                1 => names.find_or_add(&format!("{word}.{i:03}"), ""),
                _ => names.find_or_add(&format!("{i}{word}"), word),
            };
        }
        let parts: Vec<u32> = (0..=names.len() as u32).collect();
        let expected: Vec<Option<bool>> = parts.iter().map(|&part| is_high(&names.name(part))).collect();
        assert_eq!(levels_of_names(&names, &parts, is_high), expected);
        assert!(
            [Some(true), Some(false), None]
                .iter()
                .all(|level| expected.contains(level))
        );
    }

    #[test]
    fn names_of_materials_are_high_or_low() {
        for (name, expected) in [
            ("Roof_tiles.001", Some(true)),
            ("carWheels", Some(false)),
            ("GRASS", Some(false)),
            ("Leaves", Some(true)),
            ("laptop", None),
            ("roof and floor", None),
            ("", None),
        ] {
            assert_eq!(is_high(name), expected, "{name}");
        }
    }

    #[test]
    fn v_increases_along_its_direction() {
        let triangle = |uvs: Option<[Vec2; 3]>| Triangle {
            name: 0,
            corners: [Vec3::ZERO, Vec3::X, 2.0 * Vec3::Z],
            normal: Vec3::NEG_Y,
            area: 1.0,
            uvs,
            material: 0,
            part: 0,
        };
        let upright = [Vec2::ZERO, Vec2::X, Vec2::Y];
        assert_eq!(v_direction(&triangle(Some(upright))), Vec3::Z);
        assert_eq!(
            v_direction(&triangle(Some(upright.map(|uv| Vec2::new(uv.y, uv.x))))),
            Vec3::X
        );
        assert_eq!(v_direction(&triangle(Some(upright.map(|uv| -uv)))), Vec3::NEG_Z);
        assert_eq!(v_direction(&triangle(Some([Vec2::ZERO; 3]))), Vec3::ZERO);
        assert_eq!(v_direction(&triangle(None)), Vec3::ZERO);
    }

    #[test]
    fn direction_has_its_index() {
        for (index, direction) in Direction::ALL.into_iter().enumerate() {
            assert_eq!(direction.index(), index);
            assert_eq!(direction.opposite().vector(), -direction.vector());
        }
    }
}
