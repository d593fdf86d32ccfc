//! The upright axis of a scene.

use super::triangles::{Triangle, for_each_triangle};
use crate::math::{Bounds3, Vec3};
use crate::scene::Scene;

/// Triangles whose normal is nearer to an axis than this cosine lie flat on it.
const FLAT: f32 = 0.98;
/// Share of the extent along an axis within which vertices touch its lowest plane.
const CONTACT: f32 = 0.015;
/// Triangles that the guess looks at, evenly spread over the scene's.
const MAX_TRIANGLES: u64 = 1 << 20;

/// Upright axes by how usual they are in OBJ files: most programs write +y up, some +z.
const AXES: [(Vec3, f32); 3] = [(Vec3::Y, 1.0), (Vec3::Z, 0.6), (Vec3::X, 0.0)];

/// The upright axis of the scene's shapes: +y, unless they stand on another one.
///
/// Each axis scores by how usual it is. An object's axis also scores by how much of its outline rests on its lowest plane (feet and bases; what rests on
/// both ends is no evidence), by how tall it stands on it, and a little by the area that lies flat on it. In an interior, where walls, floor and ceiling are
/// alike, what stands in it lies low.
pub(super) fn guess_up(scene: &Scene, is_interior: bool) -> Vec3 {
    let bounds = scene.bounds();
    let extent = bounds.max - bounds.min;
    let mut evidence = [Evidence::default(); 3];
    for_each_triangle(scene, MAX_TRIANGLES, |triangle| {
        for (axis, evidence) in evidence.iter_mut().enumerate() {
            evidence.add(axis, triangle, bounds);
        }
    });
    let flat: f64 = evidence.iter().map(|e| e.flat).sum();
    let score = |(axis, usual): (Vec3, f32)| {
        let axis = axis.abs().max_position();
        let evidence = &evidence[axis];
        if is_interior {
            return usual + 2.0 * (0.5 - evidence.mean_height());
        }
        let [low, high] = evidence.contacts.map(|contact| share_of_outline(contact, extent, axis));
        let rests = (low - high).max(0.0);
        let lies = if flat > 0.0 { (evidence.flat / flat) as f32 } else { 0.0 };
        let others = (extent.element_sum() - extent[axis]) * 0.5;
        let stands = (extent[axis] / others.max(f32::MIN_POSITIVE)).clamp(1.0, 2.0) - 1.0;
        usual + 1.2 * rests + 0.4 * stands + 0.2 * lies
    };
    let mut best = (Vec3::Y, score(AXES[0]));
    for axis in &AXES[1..] {
        let score = score(*axis);
        if score > best.1 + 0.02 {
            best = (axis.0, score);
        }
    }
    best.0
}

/// Evidence that an axis is upright.
#[derive(Clone, Copy, Debug)]
struct Evidence {
    /// Boxes around what touches the lowest and the highest plane.
    contacts: [Bounds3; 2],
    /// Area that lies flat on the axis, away from both planes.
    flat: f64,
    /// Area away from both planes, and the same times its height, from 0 at the lowest plane to 1.
    inner: [f64; 2],
}

impl Default for Evidence {
    fn default() -> Self {
        Self {
            contacts: [Bounds3::EMPTY; 2],
            flat: 0.0,
            inner: [0.0; 2],
        }
    }
}

impl Evidence {
    fn add(&mut self, axis: usize, triangle: &Triangle, bounds: Bounds3) {
        let (low, high) = (bounds.min[axis], bounds.max[axis]);
        let near = CONTACT * (high - low);
        let mut touches = false;
        for &p in &triangle.corners {
            if p[axis] <= low + near {
                self.contacts[0].extend(p);
                touches = true;
            }
            if p[axis] >= high - near {
                self.contacts[1].extend(p);
                touches = true;
            }
        }
        if touches {
            return;
        }
        if triangle.normal[axis].abs() > FLAT {
            self.flat += triangle.area;
        }
        let [p0, p1, p2] = triangle.corners;
        let height = ((p0 + p1 + p2)[axis] / 3.0 - low) / (high - low);
        self.inner[0] += triangle.area;
        self.inner[1] += triangle.area * f64::from(height);
    }

    /// Height of what touches neither plane, on average; 0.5 where there is none.
    fn mean_height(&self) -> f32 {
        let [area, moment] = self.inner;
        if area > 0.0 { (moment / area) as f32 } else { 0.5 }
    }
}

/// Area of `contact` over that of the whole outline, both seen along `axis`.
fn share_of_outline(contact: Bounds3, extent: Vec3, axis: usize) -> f32 {
    if contact.is_empty() {
        return 0.0;
    }
    let size = contact.max - contact.min;
    let [a, b] = [(axis + 1) % 3, (axis + 2) % 3];
    let whole = extent[a] * extent[b];
    if whole > 0.0 { size[a] * size[b] / whole } else { 0.0 }
}
