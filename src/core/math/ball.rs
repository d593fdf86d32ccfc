use super::{Bounds3, Frame, Vec2, Vec3, float::gamma};

/// A ball in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball {
    /// Centre.
    pub center: Vec3,
    /// Radius in scene units.
    pub radius: f32,
}

impl Ball {
    /// Bounding sphere of `bounds`, enlarged by the rounding error of points on its surface. The
    /// radius is 1 if `bounds` is empty or a single point.
    pub fn around(bounds: Bounds3) -> Self {
        let (center, radius) = (bounds.center(), bounds.radius());
        let rounding = gamma(16) * (center.length() + radius);
        Self {
            center,
            radius: if radius > 0.0 { radius + rounding } else { 1.0 },
        }
    }

    /// Point on a disk in front of the ball, for light that travels in the unit direction `w`. The
    /// disk is perpendicular to `w`, touches the ball, and has the radius of the ball. All light in
    /// the direction `w` that hits the ball crosses this disk first. The parameter `disk` is a
    /// point of the unit disk, which is mapped to the disk in front of the ball.
    pub fn before(&self, w: Vec3, disk: Vec2) -> Vec3 {
        let across = Frame::from_z(w).to_world(Vec3::new(disk.x, disk.y, 0.0));
        self.center + self.radius * (across - w)
    }

    /// Area of the disk of [`Ball::before`].
    pub fn disk_area(&self) -> f32 {
        std::f32::consts::PI * self.radius * self.radius
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// For light from any direction, every corner of a box lies behind the disk of `Ball::before`.
    /// The distance of each corner from the centre of the ball is less than the radius.
    #[test]
    fn boxes_lie_behind_the_disk() {
        for (place, size) in [(0.0, 1.0), (1e4, 1.0), (-3e6, 2.0), (1e-9, 1e-12), (9e17, 1e17)] {
            let min = Vec3::new(place, -place, 0.3 * place);
            let max = min + size * Vec3::new(1.0, 0.2, 3.0);
            let ball = Ball::around(Bounds3 { min, max });
            assert!(ball.disk_area().is_finite());
            for corner in (Bounds3 { min, max }).corners() {
                let p = corner.as_dvec3();
                let center = ball.center.as_dvec3();
                assert!(p.distance(center) < ball.radius as f64);
                for w in [
                    Vec3::NEG_Y,
                    (center - p).as_vec3a(),
                    (p - center).as_vec3a(),
                    Vec3::new(1.0, -2.0, 0.5),
                ] {
                    let Some(w) = w.try_normalize() else { continue };
                    for disk in [Vec2::ZERO, Vec2::new(0.6, -0.8), Vec2::new(-0.1, 0.3)] {
                        let start = ball.before(w, disk).as_dvec3();
                        let along = (p - start).dot(w.as_dvec3());
                        assert!(along > 0.0, "{place} {size}: {along}");
                    }
                }
            }
        }
    }

    #[test]
    fn ball_around_point_has_radius_1() {
        assert_eq!(
            Ball::around(Bounds3::EMPTY),
            Ball {
                center: Vec3::ZERO,
                radius: 1.0
            }
        );
        let point = Bounds3 {
            min: Vec3::X,
            max: Vec3::X,
        };
        assert_eq!(
            Ball::around(point),
            Ball {
                center: Vec3::X,
                radius: 1.0
            }
        );
    }
}
