//! Points in two dimensions: in the unit square, and on the sphere seen along an axis.

use super::PointSet;
use crate::math::{Vec2, Vec3};
use crate::sampler::{Bounce, Dimension, SamplerKind, cap_discrepancy, star_discrepancy};
use crate::sampling::warp::{
    cosine_hemisphere, cosine_hemisphere_of_sphere, uniform_hemisphere, uniform_hemisphere_of_sphere, uniform_sphere,
};

/// Domain of the points of a projection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum PointDomain {
    /// The unit square.
    Square,
    /// The unit disk, for directions without their third coordinate.
    Disk,
}

impl PointDomain {
    /// JSON key of the discrepancy that is measured in this domain.
    pub fn measure(self) -> &'static str {
        match self {
            Self::Square => "star_discrepancy",
            Self::Disk => "cap_discrepancy",
        }
    }
}

/// Points of a point set in two dimensions, with their discrepancy.
pub(super) struct Projection {
    pub name: String,
    pub axes: [String; 2],
    pub shape: PointDomain,
    pub points: Vec<Vec2>,
    /// Star discrepancy in the square; cap discrepancy for a whole sphere.
    pub discrepancy: Option<f64>,
}

/// All projections of a set of `count` points.
pub(super) fn projections(set: PointSet, seed: u64, count: u32) -> Vec<Projection> {
    let points = |dimension| set.points(seed, count, dimension);
    let square = |name: String, axes: [String; 2], points: Vec<Vec2>| Projection {
        name,
        axes,
        shape: PointDomain::Square,
        discrepancy: Some(star_discrepancy(&points)),
        points,
    };
    let single = |(name, dimension): (&str, Dimension)| {
        square(
            name.into(),
            ["x", "y"].map(|axis| format!("{name} {axis}")),
            points(dimension),
        )
    };
    let pair = |[(x, of_x), (y, of_y)]: [(&str, Dimension); 2]| {
        let both = points(of_x).into_iter().zip(points(of_y));
        let axes = [x, y].map(|name| format!("{name} x"));
        square(
            format!("{x} and {y}"),
            axes,
            both.map(|(x, y)| Vec2::new(x.x, y.x)).collect(),
        )
    };
    let squares = set.decisions().into_iter().map(single);
    let squares: Vec<_> = squares.chain(set.pairs().into_iter().map(pair)).collect();
    let on_sphere = directions(set, &points(Dimension::bounce(0, Bounce::Direction)));
    squares.into_iter().chain(on_sphere).collect()
}

/// Four projections of the directions at the first vertex: the upper and the lower half of the
/// sphere, the uniform hemisphere, and the hemisphere with a density proportional to the cosine.
fn directions(set: PointSet, points: &[Vec2]) -> [Projection; 4] {
    let on_sphere: Vec<Vec3> = points.iter().map(|u| uniform_sphere(*u)).collect();
    let disk = |name: &str, points: Vec<Vec3>, discrepancy| Projection {
        name: name.into(),
        axes: ["x", "y"].map(String::from),
        shape: PointDomain::Disk,
        points: points.iter().map(|w| Vec2::new(w.x, w.y)).collect(),
        discrepancy,
    };
    let half = |sign: f32| on_sphere.iter().copied().filter(|w| w.z * sign >= 0.0).collect();
    let [uniform, cosine]: [fn(Vec2) -> Vec3; 2] = match set {
        PointSet::Sampler(_) => [uniform_hemisphere, cosine_hemisphere],
        PointSet::Directions(_) => [uniform_hemisphere_of_sphere, cosine_hemisphere_of_sphere],
    };
    let warped = |warp: fn(Vec2) -> Vec3| points.iter().map(|u| warp(*u)).collect();
    [
        disk("sphere, upper half", half(1.0), Some(cap_discrepancy(&on_sphere))),
        disk("sphere, lower half", half(-1.0), None),
        disk("hemisphere, uniform", warped(uniform), None),
        disk("hemisphere, by the cosine", warped(cosine), None),
    ]
}

/// Mean star discrepancy and mean cap discrepancy of `sets` sets of `count` independent points.
pub(super) fn independent(seed: u64, count: u32, sets: u32) -> [f64; 2] {
    let random = PointSet::Sampler(SamplerKind::Independent);
    let sum = (0..sets).fold([0.0; 2], |sum: [f64; 2], set| {
        let points = random.points(seed.wrapping_add(set.into()), count, Dimension::PIXEL);
        let on_sphere: Vec<Vec3> = points.iter().map(|u| uniform_sphere(*u)).collect();
        [sum[0] + star_discrepancy(&points), sum[1] + cap_discrepancy(&on_sphere)]
    });
    sum.map(|sum| sum / f64::from(sets))
}
