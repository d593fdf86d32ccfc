//! The upright axis of a scene.
//!
//! Six directions compete, each with a score in natural logarithms of odds. The score of a
//! direction is how usual it is in OBJ files, plus a weighted sum of evidence. Weights were fitted
//! to 190 public files whose upright axis was told by eye.
//!
//! - Parts stand on others, and little hangs (`parts`).
//! - An object rests on a wide base, and has flat ends.
//! - Faces look up rather than down: terrain, plates, bodies that stand on the ground.
//! - Left and right are alike, front and back often so; top and bottom are not.
//! - Surfaces of man-made things are horizontal.
//! - A room is wider than it is high, and its ceiling is clearer than its floor.

use super::look::Looker;
use super::parts::Parts;
use super::spread::radical_inverse;
use super::triangles::for_each_triangle;
use crate::math::{Bounds3, Vec2, Vec3};
use crate::sampling::warp::uniform_triangle;
use crate::scene::Scene;
use std::collections::HashMap;

/// The directions: two of each axis.
const UPS: [[Vec3; 2]; 3] = [[Vec3::X, Vec3::NEG_X], [Vec3::Y, Vec3::NEG_Y], [Vec3::Z, Vec3::NEG_Z]];
/// How usual each direction is: most programs write +y up, some +z.
const USUAL: [[f32; 2]; 3] = [[-1.5, -1.5], [2.5, -0.6], [1.0, -0.6]];
/// How usual each direction is in interiors, whose evidence is clearer.
const USUAL_INSIDE: [[f32; 2]; 3] = [[-0.3, -0.3], [0.3, 0.0], [0.2, 0.0]];
/// Score of the axis that the program which wrote the file usually writes: for objects and for
/// interiors.
const USUAL_FOR_PROGRAM: [f32; 2] = [1.2, 0.2];
/// Score by which another direction must be better than +y.
const MARGIN: f32 = 0.02;

/// Triangles that the guess looks at, evenly spread over the scene's.
const MAX_TRIANGLES: u64 = 1 << 20;
/// Points of the scene's surfaces, evenly spread over their area.
const POINTS: f64 = 16384.0;
/// Cells along each axis of the grid in which halves of a scene are compared.
const CELLS: i32 = 20;
/// Share of the extent along an axis within which points touch its lowest or highest plane.
const CONTACT: f32 = 0.015;
/// Cosine from which on a normal is along an axis.
const FLAT: f32 = 0.98;
/// Share of the outline from which on what is below is wide: rims and table tops are no bases.
const WIDE: f32 = 0.3;
/// Largest difference of the shares of surfaces that look up and down.
const MAX_LOOKS: f32 = 0.15;
/// Cosine from which on a normal looks up.
const LOOKS_UP: f32 = 0.2;

/// The upright axis of the scene's shapes; of an interior by points inside of its rooms. `usual` is
/// the axis that the program usually writes, if that is known.
pub(super) fn guess_up(looker: &Looker, rooms: Option<&[Vec3]>, usual: Option<Vec3>) -> Vec3 {
    let mut scores = match rooms {
        Some(rooms) => scores_inside(looker, rooms),
        None => scores_outside(looker),
    };
    if let Some(usual) = usual {
        scores[usual.abs().max_position()][0] += match rooms {
            Some(_) => USUAL_FOR_PROGRAM[1],
            None => USUAL_FOR_PROGRAM[0],
        };
    }
    let mut best = (Vec3::Y, scores[1][0] + MARGIN);
    for (up, score) in UPS.iter().flatten().zip(scores.iter().flatten()) {
        if *score > best.1 {
            best = (*up, *score);
        }
    }
    best.0
}

/// Scores of the directions of an object.
fn scores_outside(looker: &Looker) -> [[f32; 2]; 3] {
    let bounds = looker.region.bounds;
    let (points, area) = points(looker.scene);
    let standing = shares(Parts::of(looker).standing(&UPS));
    let symmetry = [0, 1, 2].map(|axis| symmetry(&points, bounds, axis));
    std::array::from_fn(|axis| {
        let others = symmetry[(axis + 1) % 3].max(symmetry[(axis + 2) % 3]);
        let ends = Ends::new(&points, bounds, axis);
        let (outlines, looks) = (ends.outlines(bounds, axis), ends.looks_up());
        let of_axis = 1.8 * ends.bases(bounds, axis, area) + 3.5 * ends.flat_share() - 1.7 * (symmetry[axis] - others);
        std::array::from_fn(|side| {
            let rests = outlines[side].min(WIDE) - outlines[1 - side].min(WIDE);
            let looks_up = (looks[side] - looks[1 - side]).clamp(-MAX_LOOKS, MAX_LOOKS);
            USUAL[axis][side] + of_axis + 5.5 * rests + 9.0 * looks_up + 3.3 * standing[axis][side]
        })
    })
}

/// Scores of the directions of an interior.
fn scores_inside(looker: &Looker, rooms: &[Vec3]) -> [[f32; 2]; 3] {
    let standing = shares(Parts::of(looker).standing(&UPS));
    let rays = UPS.map(|ups| ups.map(|up| Free::along(looker, rooms, up)));
    let lengths = [0, 1, 2].map(|axis| (rays[axis][0].mean + rays[axis][1].mean).max(f32::MIN_POSITIVE));
    std::array::from_fn(|axis| {
        let across = (lengths[(axis + 1) % 3] * lengths[(axis + 2) % 3]).sqrt();
        let is_low = (across / lengths[axis]).ln().clamp(-0.8, 0.8);
        std::array::from_fn(|side| {
            let clearer = rays[axis][side].clear - rays[axis][1 - side].clear;
            USUAL_INSIDE[axis][side] + 1.5 * standing[axis][side] + 0.8 * is_low + clearer.clamp(-0.15, 0.15)
        })
    })
}

/// Shares of a sum, which are small if all of it is.
fn shares(values: [[f32; 2]; 3]) -> [[f32; 2]; 3] {
    const FEW: f32 = 0.02;
    let sum: f32 = values.iter().flatten().sum();
    values.map(|sides| sides.map(|value| value / (sum + FEW)))
}

/// A point of a surface, and its normal.
struct Point {
    p: Vec3,
    n: Vec3,
}

/// Points all over the scene's surfaces, none without area; and the area of all surfaces.
fn points(scene: &Scene) -> (Vec<Point>, f32) {
    let mut area = 0.0;
    for_each_triangle(scene, MAX_TRIANGLES, |triangle| area += triangle.area);
    let stride = scene.placed_triangle_count().div_ceil(MAX_TRIANGLES).max(1);
    let (mut points, mut due) = (Vec::new(), 0.5);
    for_each_triangle(scene, MAX_TRIANGLES, |triangle| {
        due += POINTS * triangle.area / area;
        while due >= 1.0 {
            due -= 1.0;
            let i = points.len() as u32;
            let (b1, b2) = uniform_triangle(Vec2::new(radical_inverse(2, i), radical_inverse(3, i)));
            let [p0, p1, p2] = triangle.corners;
            points.push(Point {
                p: p0 + b1 * (p1 - p0) + b2 * (p2 - p0),
                n: triangle.normal,
            });
        }
    });
    (points, (area * stride as f64) as f32)
}

/// Area of a box seen along an axis.
fn outline(bounds: Bounds3, axis: usize) -> f32 {
    let size = (bounds.max - bounds.min).max(Vec3::ZERO);
    size[(axis + 1) % 3] * size[(axis + 2) % 3]
}

/// How alike the halves of a scene on both sides of the middle of an axis are, from 0 to 1.
fn symmetry(points: &[Point], bounds: Bounds3, axis: usize) -> f32 {
    let extent = (bounds.max - bounds.min).max(Vec3::splat(f32::MIN_POSITIVE));
    let mut counts: HashMap<[i32; 3], [u32; 2]> = HashMap::new();
    for point in points {
        let place = (point.p - bounds.min) / extent * CELLS as f32;
        let mut cell = place.to_array().map(|x| (x as i32).clamp(0, CELLS - 1));
        let is_far = 2 * cell[axis] >= CELLS;
        if is_far {
            cell[axis] = CELLS - 1 - cell[axis];
        }
        counts.entry(cell).or_default()[usize::from(is_far)] += 1;
    }
    let alike: u32 = counts.values().map(|[a, b]| 2 * a.min(b)).sum();
    alike as f32 / (points.len() as f32).max(1.0)
}

/// Both ends of a scene along an axis: first the one that is below if the axis points up, then the
/// other one.
struct Ends {
    count: usize,
    /// Boxes around the points of the outermost planes, and those of them that face outwards.
    contacts: [Bounds3; 2],
    facing_out: [usize; 2],
    /// Points with a component of the normal towards the other end.
    looking_up: [usize; 2],
    /// Points between the planes whose normals are along the axis.
    flat: usize,
}

impl Ends {
    fn new(points: &[Point], bounds: Bounds3, axis: usize) -> Self {
        let mut ends = Self {
            count: points.len(),
            contacts: [Bounds3::EMPTY; 2],
            facing_out: [0; 2],
            looking_up: [0; 2],
            flat: 0,
        };
        let extent = (bounds.max[axis] - bounds.min[axis]).max(f32::MIN_POSITIVE);
        for point in points {
            let height = (point.p[axis] - bounds.min[axis]) / extent;
            let mut is_inner = true;
            for (side, height, up) in [(0, height, point.n[axis]), (1, 1.0 - height, -point.n[axis])] {
                ends.looking_up[side] += usize::from(up > LOOKS_UP);
                if height < CONTACT {
                    is_inner = false;
                    ends.contacts[side].extend(point.p);
                    ends.facing_out[side] += usize::from(up < -FLAT);
                }
            }
            ends.flat += usize::from(is_inner && point.n[axis].abs() > FLAT);
        }
        ends
    }

    fn share(&self, count: usize) -> f32 {
        count as f32 / self.count.max(1) as f32
    }

    /// Area of the box around each contact over that of the whole outline.
    fn outlines(&self, bounds: Bounds3, axis: usize) -> [f32; 2] {
        let whole = outline(bounds, axis).max(f32::MIN_POSITIVE);
        self.contacts.map(|contact| match contact.is_empty() {
            true => 0.0,
            false => outline(contact, axis) / whole,
        })
    }

    /// Shares of the outline, summed, that surfaces cover which lie in either contact and face
    /// outwards; `area` is that of all surfaces.
    fn bases(&self, bounds: Bounds3, axis: usize, area: f32) -> f32 {
        let whole = outline(bounds, axis).max(f32::MIN_POSITIVE);
        let covered = self.facing_out.map(|count| (self.share(count) * area / whole).min(1.0));
        covered.iter().sum()
    }

    /// Share of the points that look up.
    fn looks_up(&self) -> [f32; 2] {
        self.looking_up.map(|count| self.share(count))
    }

    /// Share of the points whose normals are along the axis, but for both contacts.
    fn flat_share(&self) -> f32 {
        self.share(self.flat)
    }
}

/// Rays from points inside of an interior in one direction.
struct Free {
    /// Mean length, to the scene's box where nothing is met.
    mean: f32,
    /// Share of the rays that meet nothing but the outermost surfaces.
    clear: f32,
}

impl Free {
    /// Share of the extent in which the outermost surfaces lie.
    const OUTERMOST: f32 = 0.05;

    fn along(looker: &Looker, rooms: &[Vec3], direction: Vec3) -> Self {
        let bounds = looker.region.bounds;
        let axis = direction.abs().max_position();
        let end = if direction[axis] > 0.0 {
            bounds.max[axis]
        } else {
            bounds.min[axis]
        };
        let extent = bounds.max[axis] - bounds.min[axis];
        let (mut sum, mut clear, mut count) = (0.0, 0.0, 0.0f32);
        for &p in rooms {
            let rest = (end - p[axis]).abs();
            let length = looker.look(p, direction).map_or(rest, |seen| seen.distance.min(rest));
            sum += length;
            clear += f32::from(u8::from(rest - length <= Self::OUTERMOST * extent));
            count += 1.0;
        }
        Self {
            mean: sum / count.max(1.0),
            clear: clear / count.max(1.0),
        }
    }
}
