//! Discrepancies: measures of how unevenly points are distributed.

use super::hash::numbered;
use super::sphere::pair;
use crate::math::{Vec2, Vec3};
use crate::sampling::warp::uniform_sphere;

/// Star discrepancy of points in the unit square: the largest difference between the area of a box
/// with a corner at the origin and the fraction of `points` inside the box.
///
/// The result is exact except for f64 rounding. The largest difference occurs at a box whose edges
/// go through points (Niederreiter 1972, "Discrepancy and Convex Programming"). A sweep over x with
/// a sorted list of y visits these boxes in O(n²) steps. Returns 0 if there are no points.
pub fn star_discrepancy(points: &[Vec2]) -> f64 {
    let mut sorted: Vec<[f64; 2]> = points.iter().map(|p| [p.x.into(), p.y.into()]).collect();
    sorted.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let share = |count: usize| count as f64 / points.len() as f64;
    // Sorted heights of the points to the left of the sweep
    let mut heights: Vec<f64> = Vec::with_capacity(points.len());
    let mut largest = 0.0f64;
    // Open boxes contain too few points: extend each box up to the next point.
    let open = |width: f64, heights: &[f64]| {
        let tops = heights.iter().copied().chain([1.0]).enumerate();
        tops.fold(0.0, |max: f64, (below, top)| max.max(width * top - share(below)))
    };
    for column in sorted.chunk_by(|a, b| a[0] == b[0]) {
        let width = column[0][0];
        largest = largest.max(open(width, &heights));
        for [_, y] in column {
            let place = heights.partition_point(|height| height <= y);
            heights.insert(place, *y);
        }
        // Closed boxes contain too many points: end each box at its last point.
        let tops = heights.iter().enumerate();
        largest = tops.fold(largest, |max, (below, top)| max.max(share(below + 1) - width * top));
    }
    if points.is_empty() {
        return 0.0;
    }
    largest.max(open(1.0, &heights))
}

/// Largest difference between the fraction of `points` in a spherical cap and the fraction of the
/// sphere's area in the cap. Caps with 512 axes and 199 heights are tested, so the result is a
/// lower bound of the spherical cap discrepancy.
pub fn cap_discrepancy(points: &[Vec3]) -> f64 {
    let axes = (0..512).map(|i| uniform_sphere(pair(numbered(1, i))));
    let of_axis = |axis: Vec3| {
        let heights = (1..200).map(|i| i as f32 / 100.0 - 1.0);
        let mut cosines: Vec<f32> = points.iter().map(|p| p.dot(axis)).collect();
        cosines.sort_by(f32::total_cmp);
        let difference = |cos: f32| {
            let inside = cosines.len() - cosines.partition_point(|&c| c <= cos);
            (inside as f64 / cosines.len() as f64 - 0.5 * (1.0 - cos as f64)).abs()
        };
        heights.map(difference).fold(0.0, f64::max)
    };
    axes.map(of_axis).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::{Dimension, SamplerKind, points};

    /// Star discrepancy by testing all boxes whose corners have coordinates of points.
    fn by_brute_force(points: &[Vec2]) -> f64 {
        let edges = |axis: usize| points.iter().map(move |p| p[axis]).chain([1.0]).collect::<Vec<f32>>();
        let n = points.len() as f64;
        let mut largest = 0.0f64;
        for corner in edges(0)
            .iter()
            .flat_map(|x| edges(1).into_iter().map(|y| Vec2::new(*x, y)))
        {
            let area = corner.x as f64 * corner.y as f64;
            let inside = points.iter().filter(|p| p.cmplt(corner).all()).count() as f64;
            let closed = points.iter().filter(|p| p.cmple(corner).all()).count() as f64;
            largest = largest.max(area - inside / n).max(closed / n - area);
        }
        largest
    }

    #[test]
    fn star_discrepancy_is_maximum_over_all_boxes() {
        for (name, kind) in SamplerKind::NAMES {
            for n in [1, 2, 7, 50] {
                let points = points(kind.with_seed(3, n), 1, Dimension::PIXEL, 0..n);
                let (found, expected) = (star_discrepancy(&points), by_brute_force(&points));
                assert!((found - expected).abs() < 1e-12, "{name} {n}: {found} for {expected}");
            }
        }
        // Equal points, and points on one line
        let line = [[0.5, 0.25], [0.5, 0.25], [0.5, 0.75], [0.0, 0.75], [0.25, 0.25]].map(Vec2::from);
        assert!((star_discrepancy(&line) - by_brute_force(&line)).abs() < 1e-12);
        assert_eq!(star_discrepancy(&[Vec2::splat(0.5)]), 0.75);
        assert_eq!(star_discrepancy(&[]), 0.0);
    }

    /// Star discrepancy of Hammersley's set of 2ᵐ points in base 2: m/3 + 13/9 − (−1)ᵐ 4/(9·2ᵐ)
    /// divided by the number of points (Halton and Zaremba 1969, "The Extreme and L² Discrepancies
    /// of Some Plane Sets").
    #[test]
    fn star_discrepancy_of_hammersley_points_is_in_closed_form() {
        for m in 2..=10u32 {
            let n = 1u32 << m;
            let inverse = |i: u32| i.reverse_bits() as f32 / 2f32.powi(32);
            let points: Vec<Vec2> = (0..n).map(|i| Vec2::new(i as f32 / n as f32, inverse(i))).collect();
            let sign = if m % 2 == 0 { 1.0 } else { -1.0 };
            let (m, n) = (f64::from(m), f64::from(n));
            let expected = (m / 3.0 + 13.0 / 9.0 - sign * 4.0 / (9.0 * n)) / n;
            let found = star_discrepancy(&points);
            assert!((found - expected).abs() < 1e-9, "{n}: {found} for {expected}");
        }
    }
}
