//! Tables of the directional albedos of lobes with an exponent: Phong's and Blinn's.
//!
//! Only auxiliary channels need these albedos; values and densities of the lobes do not. A row for
//! one exponent is computed by quadrature on first use, within 1 ms. The axis of exponents `n` is
//! `(2 / (n + 2))^¼`, the roughness of GGX facets of similar width. The axis of cosines is the axis
//! of [`Row`]. The interpolation error is below 0.004.

use super::energy::{NODES, Row, cell, coordinate, place};
use super::mirror_direction;
use crate::math::{Frame, Vec2, Vec3};
use crate::sampling::warp::cosine_power_hemisphere;
use std::sync::OnceLock;

/// Number of quadrature points for each of the two random numbers that sample a direction.
const POINTS: u32 = 48;

/// Directional albedo of Phong's lobe, by exponent.
static PHONG: [OnceLock<Row>; NODES] = [const { OnceLock::new() }; NODES];

/// Directional albedo of Blinn's lobe with mirror facets, by exponent: unweighted, and with each
/// reflection weighted by `(1 − cos)⁵`, where cos is the cosine between the direction and the
/// normal of the facet.
static BLINN: [OnceLock<[Row; 2]>; NODES] = [const { OnceLock::new() }; NODES];

/// Directional albedo of Phong's lobe with reflectance 1, towards a direction with the cosine
/// `cos`.
pub(super) fn phong_reflected(exponent: f32, cos: f32) -> f32 {
    let (node, t) = nodes(exponent);
    let [lower, upper] = [node, node + 1].map(|node| phong_row(node).at(cos));
    lower + t * (upper - lower)
}

/// Directional albedo of Blinn's lobe with mirror facets, towards a direction with the cosine
/// `cos`. The first value is unweighted. In the second value each reflection is weighted by `(1 −
/// c)⁵`, where c is the cosine between the direction and the normal of the facet.
pub(super) fn blinn_reflected(exponent: f32, cos: f32) -> [f32; 2] {
    let (node, t) = nodes(exponent);
    let (lower, upper) = (blinn_rows(node), blinn_rows(node + 1));
    [0, 1].map(|kind| (1.0 - t) * lower[kind].at(cos) + t * upper[kind].at(cos))
}

/// Returns the node before `exponent` on the axis, and the distance of `exponent` from this node in
/// steps.
fn nodes(exponent: f32) -> (usize, f32) {
    cell(place((2.0 / (exponent + 2.0)).sqrt().sqrt(), NODES), NODES)
}

/// Exponent of a node; `None` for the first node, which is a mirror.
fn exponent(node: usize) -> Option<f32> {
    let squared = coordinate(node, NODES) * coordinate(node, NODES);
    (node > 0).then(|| 2.0 / (squared * squared) - 2.0)
}

fn phong_row(node: usize) -> &'static Row {
    PHONG[node].get_or_init(|| {
        Row::of(|cos| {
            let Some(n) = exponent(node) else { return cos };
            let wo = towards(cos);
            let about_mirror = Frame::from_z(mirror_direction(wo));
            mean(|u| {
                let wi = about_mirror.to_world(cosine_power_hemisphere(u, n));
                [(n + 2.0) / (n + 1.0) * wi.z.max(0.0)]
            })[0]
        })
    })
}

fn blinn_rows(node: usize) -> &'static [Row; 2] {
    BLINN[node].get_or_init(|| {
        let shares = |cos: f32| match exponent(node) {
            Some(n) => blinn_shares(n, cos),
            None => [1.0, (1.0 - cos).powi(5)],
        };
        [0, 1].map(|kind| Row::of(|cos| shares(cos)[kind]))
    })
}

/// Quadrature for [`blinn_reflected`] with the exponent `n`. Facets are sampled as in Blinn's lobe.
fn blinn_shares(n: f32, cos: f32) -> [f32; 2] {
    // Keep `wo` above the horizon. At the horizon the weight would be 0 / 0
    let wo = towards(cos.max(1e-4));
    mean(|u| {
        let wh = cosine_power_hemisphere(u, n + 1.0);
        let cos_oh = wo.dot(wh);
        let cos_i = 2.0 * cos_oh * wh.z - wo.z;
        if cos_oh <= 0.0 || cos_i <= 0.0 {
            return [0.0; 2];
        }
        let shadowing = (2.0 * wh.z * wo.z.min(cos_i) / cos_oh).min(1.0);
        let weight = shadowing * cos_oh / (wo.z * wh.z);
        [weight, weight * (1.0 - cos_oh).max(0.0).powi(5)]
    })
}

fn towards(cos: f32) -> Vec3 {
    Vec3::new((1.0 - cos * cos).max(0.0).sqrt(), 0.0, cos)
}

/// Mean of `value` over the unit square, by midpoints.
fn mean<const K: usize>(value: impl Fn(Vec2) -> [f32; K]) -> [f32; K] {
    let middle = |i: u32| (i as f32 + 0.5) / POINTS as f32;
    let mut sums = [0.0f64; K];
    for (i, j) in (0..POINTS).flat_map(|i| (0..POINTS).map(move |j| (i, j))) {
        let values = value(Vec2::new(middle(i), middle(j)));
        sums.iter_mut()
            .zip(values)
            .for_each(|(sum, value)| *sum += f64::from(value));
    }
    sums.map(|sum| (sum / f64::from(POINTS * POINTS)) as f32)
}
