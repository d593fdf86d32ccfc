//! Calibrated cameras: focal lengths and principal point in pixels, and the distortion of a lens by
//! the models of OpenCV.
//!
//! A model maps points (x, y) of the plane at distance 1 in front of the lens, or angles from the
//! axis, to distorted points (x', y'). The pixel coordinates of a distorted point are `fx x' + cx,
//! fy y' + cy`. Pixel centres are at .5, so the centre of a picture of W columns is W/2.
//!
//! Rays need the inverse of the model. The distorted radius increases up to
//! [`CalibratedLens::limit`]. Below this limit, Newton's method with bracketing inverts the radial
//! part of the distortion. If the distortion also has a tangential part, Newton's method in two
//! dimensions then inverts the whole model. It is an error if the picture extends beyond the limit.

use super::{Axes, Mapping, Plane, ScreenWindow};
use crate::camera::CameraError;
use crate::math::{DVec2, UVec2, Vec2, Vec3, encode_fields, encode_variants};
use std::f64::consts::PI;

/// Focal lengths and principal point of a camera, in pixels of its picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intrinsics {
    /// Focal lengths: horizontal and vertical.
    pub focal: [f64; 2],
    /// Principal point from the top left corner of the picture. The centre of the first pixel is
    /// 0.5, 0.5.
    pub center: [f64; 2],
}

/// Distortion of a lens, by the models of OpenCV.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Distortion {
    /// Distortion of a pinhole: k1, k2, p1, p2, k3.
    Pinhole([f64; 5]),
    /// Distortion of a fisheye: k1, k2, k3, k4.
    Fisheye([f64; 4]),
}

impl Distortion {
    /// Returns true if the camera is a pinhole whose coefficients are all 0.
    pub fn is_none(&self) -> bool {
        matches!(self, Self::Pinhole(k) if *k == [0.0; 5])
    }
}

impl Intrinsics {
    /// Intrinsics of the same camera, for a picture whose width and height are multiplied by
    /// `factor`.
    pub(in crate::camera) fn scaled(self, factor: DVec2) -> Self {
        Self {
            focal: (DVec2::from(self.focal) * factor).into(),
            center: (DVec2::from(self.center) * factor).into(),
        }
    }

    /// Returns an error if the numbers are out of range.
    pub fn check(&self) -> Result<(), CameraError> {
        if self.focal.iter().all(|f| *f > 0.0 && f.is_finite()) && self.center.iter().all(|c| c.is_finite()) {
            return Ok(());
        }
        let [[fx, fy], [cx, cy]] = [self.focal, self.center];
        let message = format!("must be two focal lengths above 0 and a finite point, not {fx},{fy},{cx},{cy}");
        Err(CameraError::wrong("intrinsics", message))
    }
}

encode_fields!(Intrinsics { focal, center });
encode_variants!(Distortion {
    0 => Pinhole(k),
    1 => Fisheye(k),
});

/// A calibrated camera for a picture of a given size.
#[derive(Clone, Copy, Debug)]
pub(in crate::camera) struct CalibratedLens {
    focal: DVec2,
    center: DVec2,
    distortion: Distortion,
    /// Radius up to which the distorted radius increases with the radius. It is a distance in the
    /// plane at distance 1, or an angle in radians for a fisheye.
    limit: f64,
}

/// Number of parts into which each side of a picture is divided for checks. Each line from the
/// centre is divided into as many parts.
const PARTS: u32 = 32;
/// Maximum distance of a point of the picture from the axis, in the plane at distance 1. This is an
/// angle of 89.9°.
const MAX_DISTANCE: f64 = 600.0;
/// Maximum number of steps of Newton's method, and number of steps of a bisection: somewhat more
/// than the number of bits of the mantissa of an f64.
const STEPS: u32 = 80;

impl CalibratedLens {
    /// Returns an error if the numbers are out of range, or if the distortion maps two directions
    /// to one point of the picture.
    pub fn new(intrinsics: Intrinsics, distortion: Distortion, size: UVec2) -> Result<Self, CameraError> {
        intrinsics.check()?;
        let Intrinsics { focal, center } = intrinsics;
        let mut lens = Self {
            focal: focal.into(),
            center: center.into(),
            distortion,
            limit: 0.0,
        };
        if lens.radial().iter().chain(&lens.tangential()).any(|k| !k.is_finite()) {
            return Err(CameraError::wrong("distortion", "must be finite numbers"));
        }
        lens.limit = lens.find_limit();
        let places = (0..=PARTS).flat_map(|y| (0..=PARTS).map(move |x| UVec2::new(x, y)));
        let places = places.map(|place| place.as_vec2() / PARTS as f32 * size.as_vec2());
        match places.into_iter().find(|film| !lens.is_regular(*film)) {
            None => Ok(lens),
            Some(film) => Err(CameraError {
                parameter: "distortion",
                message: format!(
                    "is not valid in the whole picture of {} × {} pixels: it folds over, so no ray belongs to the pixel {},{}",
                    size.x, size.y, film.x, film.y
                ),
                help: Some("use `distortion`, `intrinsics` and --size of the same calibration".into()),
            }),
        }
    }

    /// Returns true if the camera maps angles instead of points of a plane.
    pub fn is_fisheye(&self) -> bool {
        matches!(self.distortion, Distortion::Fisheye(_))
    }

    /// Width of a pixel in the centre, on the plane at distance 1.
    pub fn scale(&self) -> f32 {
        self.focal.element_product().sqrt().recip() as f32
    }

    /// Coefficients of the powers 2, 4, 6 and 8 of the radius.
    fn radial(&self) -> [f64; 4] {
        match self.distortion {
            Distortion::Pinhole([k1, k2, _, _, k3]) => [k1, k2, k3, 0.0],
            Distortion::Fisheye(k) => k,
        }
    }

    fn tangential(&self) -> [f64; 2] {
        match self.distortion {
            Distortion::Pinhole([_, _, p1, p2, _]) => [p1, p2],
            Distortion::Fisheye(_) => [0.0; 2],
        }
    }

    /// Distorted radius divided by `radius`.
    fn factor(&self, radius: f64) -> f64 {
        let s = radius * radius;
        let [a, b, c, d] = self.radial();
        1.0 + s * (a + s * (b + s * (c + s * d)))
    }

    /// Derivative of the distorted radius by `radius`.
    fn slope(&self, radius: f64) -> f64 {
        let s = radius * radius;
        let [a, b, c, d] = self.radial();
        1.0 + s * (3.0 * a + s * (5.0 * b + s * (7.0 * c + s * 9.0 * d)))
    }

    /// Radius up to which the distorted radius increases. If it increases without end, the result
    /// is π for a fisheye, else [`MAX_DISTANCE`].
    fn find_limit(&self) -> f64 {
        let end = if self.is_fisheye() { PI } else { MAX_DISTANCE };
        let mut last: f64 = 0.0;
        while last < end {
            let next = (last + 1e-3 * (1.0 + last)).min(end);
            if self.slope(next) <= 0.0 {
                return bisect(last, next, |radius| self.slope(radius) <= 0.0);
            }
            last = next;
        }
        end
    }

    /// Returns true if the film point `film` and its neighbours each have exactly one ray. Film
    /// points of a fisheye beyond an angle of 180° from the axis need no ray.
    fn is_regular(&self, film: Vec2) -> bool {
        let distorted = self.distorted(film);
        let is_beyond = distorted.length() > self.limit * self.factor(self.limit);
        if self.is_fisheye() {
            return !is_beyond || self.limit == PI;
        }
        let point = self.point_of(film);
        let (back, [across, down]) = self.distort(point);
        // Check that the distortion keeps the orientation on the line from the centre to the point.
        // Where it changes, the picture folds over
        let is_open = |part: f64| {
            let (_, [across, down]) = self.distort(part * point);
            across.perp_dot(down) > 0.0
        };
        let ways = (1..PARTS).all(|i| is_open(f64::from(i) / f64::from(PARTS)));
        ways && across.perp_dot(down) > 0.0 && back.distance(distorted) < 1e-7 * (1.0 + distorted.length())
    }

    /// Distorted point of the plane at `film`.
    fn distorted(&self, film: Vec2) -> DVec2 {
        (film.as_dvec2() - self.center) / self.focal
    }

    /// Film position of a distorted point.
    fn film(&self, distorted: DVec2) -> Vec2 {
        (distorted * self.focal + self.center).as_vec2()
    }

    /// Distorts a `point` of the plane. Returns the distorted point, and its derivatives with
    /// respect to x and y of `point`.
    fn distort(&self, point: DVec2) -> (DVec2, [DVec2; 2]) {
        let DVec2 { x, y } = point;
        let s = point.length_squared();
        let [a, b, c, _] = self.radial();
        let [p1, p2] = self.tangential();
        let factor = self.factor(s.sqrt());
        let change = a + s * (2.0 * b + s * 3.0 * c);
        let tangential = DVec2::new(
            2.0 * p1 * x * y + p2 * (s + 2.0 * x * x),
            p1 * (s + 2.0 * y * y) + 2.0 * p2 * x * y,
        );
        let mixed = 2.0 * (x * y * change + p1 * x + p2 * y);
        let by_x = DVec2::new(factor + 2.0 * x * x * change + 2.0 * p1 * y + 6.0 * p2 * x, mixed);
        let by_y = DVec2::new(mixed, factor + 2.0 * y * y * change + 6.0 * p1 * y + 2.0 * p2 * x);
        (point * factor + tangential, [by_x, by_y])
    }

    /// Returns the radius that the distortion maps to the radius `distorted`, at most
    /// [`CalibratedLens::limit`].
    fn radius_of(&self, distorted: f64) -> f64 {
        if self.radial() == [0.0; 4] {
            return distorted.min(self.limit);
        }
        if distorted >= self.limit * self.factor(self.limit) {
            return self.limit;
        }
        // Solve for the radius by Newton's method with bracketing
        let (mut low, mut high, mut radius) = (0.0, self.limit, distorted.min(self.limit));
        for _ in 0..STEPS {
            let error = radius * self.factor(radius) - distorted;
            if error > 0.0 {
                high = radius
            } else {
                low = radius
            }
            let next = radius - error / self.slope(radius);
            let next = if next > low && next < high {
                next
            } else {
                0.5 * (low + high)
            };
            if (next - radius).abs() <= 1e-15 * (1.0 + next) {
                return next;
            }
            radius = next;
        }
        radius
    }

    /// Point of the plane at `film`, for a pinhole.
    fn point_of(&self, film: Vec2) -> DVec2 {
        let distorted = self.distorted(film);
        let length = distorted.length();
        if length == 0.0 && self.tangential() == [0.0; 2] {
            return distorted;
        }
        let mut point = distorted * (self.radius_of(length) / length.max(f64::MIN_POSITIVE));
        if self.tangential() == [0.0; 2] {
            return point;
        }
        for _ in 0..STEPS {
            let (at, [across, down]) = self.distort(point);
            let error = at - distorted;
            let step = DVec2::new(error.perp_dot(down), across.perp_dot(error)) / across.perp_dot(down);
            if !step.is_finite() {
                return point;
            }
            point -= step;
            if step.length() <= 1e-15 * (1.0 + point.length()) {
                break;
            }
        }
        point
    }

    /// Point of the plane at `film`, for a pinhole; y downwards.
    fn plane_point(&self, film: Vec2) -> Vec2 {
        self.point_of(film).as_vec2()
    }

    /// Returns the film position of a `point` of the plane, and the ratio of a small area on the
    /// film to the same area on the plane. `None` beyond the limit of the distortion.
    pub fn plane_film(&self, point: Vec2) -> Option<(Vec2, f32)> {
        let point = point.as_dvec2();
        if point.length() > self.limit {
            return None;
        }
        let (distorted, [across, down]) = self.distort(point);
        let area = across.perp_dot(down) * self.focal.element_product();
        (area > 0.0).then(|| (self.film(distorted), area as f32))
    }

    /// For a fisheye, returns the angle of the ray at `film` from the axis, and the unit direction
    /// of the ray across the axis, y downwards.
    fn angle(&self, film: Vec2) -> (f32, Vec2) {
        let distorted = self.distorted(film);
        let angle = self.radius_of(distorted.length());
        (angle as f32, distorted.normalize_or_zero().as_vec2())
    }

    /// Film position of an `angle` from the axis in the unit direction `across`, for a fisheye.
    /// `None` beyond the limit of the distortion.
    fn angle_film(&self, angle: f32, across: Vec2) -> Option<Vec2> {
        let angle = f64::from(angle);
        (angle <= self.limit).then(|| self.film(across.as_dvec2() * (angle * self.factor(angle))))
    }
}

impl Mapping for CalibratedLens {
    fn ray(&self, film: Vec2, [right, up, forward]: Axes) -> (Vec3, Vec3) {
        if self.is_fisheye() {
            let (angle, across) = self.angle(film);
            let (sin, cos) = angle.sin_cos();
            let across = across.x * right - across.y * up;
            return (Vec3::ZERO, sin * across + cos * forward);
        }
        let point = self.plane_point(film);
        (Vec3::ZERO, point.x * right - point.y * up + forward)
    }

    fn place(&self, to: Vec3) -> Option<Vec2> {
        let plane = Vec2::new(to.x, -to.y);
        if self.is_fisheye() {
            let angle = plane.length().atan2(to.z);
            return (to != Vec3::ZERO).then(|| self.angle_film(angle, plane.normalize_or_zero()))?;
        }
        let point = (to.z > 0.0).then(|| plane / to.z)?;
        self.plane_film(point).map(|(film, _)| film)
    }

    fn sees(&self, film: Vec2) -> bool {
        !self.is_fisheye() || self.distorted(film).length() <= self.limit * self.factor(self.limit)
    }

    fn density(&self, to: Vec3) -> f32 {
        if !self.is_fisheye() {
            return 0.0;
        }
        let sin = to.x.hypot(to.y);
        let angle = f64::from(sin.atan2(to.z));
        let over_sin = if sin == 0.0 { 1.0 } else { angle / f64::from(sin) };
        (self.focal.element_product() * self.factor(angle) * self.slope(angle) * over_sin) as f32
    }

    fn plane(&self) -> Option<Plane> {
        let plane = || Plane {
            scale: self.focal,
            middle: self.center,
            is_parallel: false,
        };
        self.distortion.is_none().then(plane)
    }

    fn screen_window(&self, size: Vec2) -> Option<ScreenWindow> {
        let from_axis = (0.5 * size.as_dvec2() - self.center) / self.focal;
        let window = || ScreenWindow {
            center: [from_axis.x as f32, (0.0 - from_axis.y) as f32],
            width: (f64::from(size.x) / self.focal.x) as f32,
        };
        self.distortion.is_none().then(window)
    }
}

/// Returns the position between `low` and `high` at which `is_beyond` changes from false to true.
fn bisect(mut low: f64, mut high: f64, is_beyond: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..STEPS {
        let middle = 0.5 * (low + high);
        if is_beyond(middle) { high = middle } else { low = middle }
    }
    low
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: UVec2 = UVec2::new(640, 480);
    const INTRINSICS: Intrinsics = Intrinsics {
        focal: [500.0, 510.0],
        center: [331.0, 228.0],
    };

    fn lens(distortion: Distortion) -> Result<CalibratedLens, CameraError> {
        CalibratedLens::new(INTRINSICS, distortion, SIZE)
    }

    #[test]
    fn film_points_survive_a_round_trip() {
        for k in [
            [0.0; 5],
            [-0.25, 0.1, 0.003, -0.002, 0.01],
            [0.3, -0.1, -0.01, 0.01, 0.02],
            [-0.28, 0.05, 0.0, 0.0, 0.0],
        ] {
            let lens = lens(Distortion::Pinhole(k)).unwrap();
            for film in [[0.0, 0.0], [331.0, 228.0], [640.0, 480.0], [12.5, 400.0]].map(Vec2::from) {
                let (back, _) = lens.plane_film(lens.plane_point(film)).unwrap();
                assert!(back.distance(film) < 1e-3, "{k:?}: {film} becomes {back}");
            }
        }
        for k in [[0.0; 4], [0.05, -0.02, 0.01, -0.003]] {
            let lens = lens(Distortion::Fisheye(k)).unwrap();
            for film in [[0.0, 0.0], [331.0, 228.0], [640.0, 480.0], [12.5, 400.0]].map(Vec2::from) {
                let (angle, across) = lens.angle(film);
                let back = lens.angle_film(angle, across).unwrap();
                assert!(back.distance(film) < 1e-3, "{k:?}: {film} becomes {back}");
            }
        }
    }

    /// The distortion r (1 − r² / 2) has its maximum 0.544 at r = √(2/3). A narrow picture does not
    /// reach it.
    #[test]
    fn folding_distortion_is_an_error() {
        let folding = Distortion::Pinhole([-0.5, 0.0, 0.0, 0.0, 0.0]);
        let error = lens(folding).unwrap_err();
        assert_eq!(error.parameter, "distortion");
        assert!(error.to_string().contains("folds over"), "{error}");
        let narrow = Intrinsics {
            focal: [900.0, 900.0],
            ..INTRINSICS
        };
        let lens = CalibratedLens::new(narrow, folding, SIZE).unwrap();
        assert!((lens.limit - (2f64 / 3.0).sqrt()).abs() < 1e-9);
        assert_eq!(lens.plane_film(Vec2::new(0.9, 0.0)), None);
        for bad in [[f64::NAN; 5], [0.0, 0.0, 5.0, 0.0, 0.0]] {
            assert!(CalibratedLens::new(INTRINSICS, Distortion::Pinhole(bad), SIZE).is_err());
        }
        for focal in [[0.0, 500.0], [500.0, f64::INFINITY]] {
            let intrinsics = Intrinsics { focal, ..INTRINSICS };
            assert!(CalibratedLens::new(intrinsics, Distortion::Fisheye([0.0; 4]), SIZE).is_err());
        }
    }
}
