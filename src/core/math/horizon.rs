use super::{DVec3, Quat, Vec3};

/// Directions by azimuth and elevation above a horizontal plane.
///
/// With +y up, azimuth 0 is +z. A camera at this azimuth looks along −z, as a camera without
/// rotation. Azimuths grow towards +x, which is counter-clockwise seen from above. For another up
/// axis, the frame is turned by the smallest rotation from +y to this axis. The direction that is
/// perpendicular to both axes stays the same. With +z up, azimuth 0 is −y, and +x stays at 90°.
/// With −y up, the smallest rotation is not unique; the rotation around +x is used.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Horizon {
    up: Vec3,
    rotation: Quat,
}

impl Horizon {
    /// Horizon of the plane with the unit normal `up`.
    pub fn new(up: Vec3) -> Self {
        // The half vector of +y and `up` gives the smallest rotation. Its length is 0 if `up` is
        // −y.
        let half = DVec3::Y + up.as_dvec3().normalize();
        let rotation = if half.length_squared() > 1e-10 {
            let half = half.normalize();
            let axis = DVec3::Y.cross(half);
            Quat::from_xyzw(axis.x as f32, axis.y as f32, axis.z as f32, half.y as f32).normalize()
        } else {
            Quat::from_xyzw(1.0, 0.0, 0.0, 0.0)
        };
        Self { up, rotation }
    }

    /// Unit vector that points up.
    pub fn up(&self) -> Vec3 {
        self.up
    }

    /// Up direction in the image of a camera. `back` is the unit vector opposite to the view
    /// direction. The result is [`Horizon::up`] unless the camera looks nearly straight up or down.
    /// If it does, the direction of azimuth 0 is at the top of the image for a camera that looks
    /// up, and at the bottom for a camera that looks down.
    pub fn image_up(&self, back: Vec3) -> Vec3 {
        let height = back.dot(self.up);
        if height.abs() > 0.999 {
            self.point(Vec3::NEG_Z) * height.signum()
        } else {
            self.up
        }
    }

    /// Coordinates of the point `p` along three axes: the direction of azimuth 90°, the up
    /// direction, and the direction of azimuth 0.
    pub fn coordinates(&self, p: Vec3) -> Vec3 {
        self.rotation.inverse() * p
    }

    /// Point with these [`Horizon::coordinates`].
    pub fn point(&self, coordinates: Vec3) -> Vec3 {
        self.rotation * coordinates
    }

    /// Rotation from the frame with +y up to the world.
    pub fn rotation(&self) -> Quat {
        self.rotation
    }

    /// Unit vector at `azimuth` and `elevation`, in degrees.
    pub fn direction(&self, azimuth: f32, elevation: f32) -> Vec3 {
        let (sin_azimuth, cos_azimuth) = f64::from(azimuth).to_radians().sin_cos();
        let (sin, cos) = f64::from(elevation).to_radians().sin_cos();
        let w = [cos * sin_azimuth, sin, cos * cos_azimuth].map(|x| x as f32);
        (self.rotation * Vec3::from(w)).normalize()
    }

    /// Azimuth of a direction of any length, in degrees from −180 to 180; `None` if the direction
    /// is vertical or zero.
    pub fn azimuth(&self, direction: Vec3) -> Option<f32> {
        let w = self.rotation.inverse() * direction.try_normalize()?;
        (w.x.hypot(w.z) > 1e-4).then(|| w.x.atan2(w.z).to_degrees())
    }
}

/// The positive or negative coordinate axis that is nearest to `v`. `None` if `v` is zero or not
/// finite.
pub fn nearest_axis(v: Vec3) -> Option<Vec3> {
    let nearest = v.abs().max_position();
    let mut axis = Vec3::ZERO;
    axis[nearest] = v[nearest].signum();
    (v.is_finite() && v != Vec3::ZERO).then_some(axis)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn azimuth_0_is_position_of_unrotated_camera() {
        let at = |up, azimuth, elevation, expected: Vec3| {
            let w = Horizon::new(up).direction(azimuth, elevation);
            assert!(w.distance(expected) < 1e-6, "{up} {azimuth} {elevation}: {w}");
        };
        at(Vec3::Y, 0.0, 0.0, Vec3::Z);
        at(Vec3::Y, 90.0, 0.0, Vec3::X);
        at(Vec3::Y, -90.0, 0.0, Vec3::NEG_X);
        at(Vec3::Y, 180.0, 0.0, Vec3::NEG_Z);
        at(Vec3::Y, 70.0, 90.0, Vec3::Y);
        at(Vec3::Y, 0.0, 30.0, Vec3::new(0.0, 0.5, 0.75f32.sqrt()));
        at(Vec3::Z, 0.0, 0.0, Vec3::NEG_Y);
        at(Vec3::Z, 90.0, 0.0, Vec3::X);
        at(Vec3::Z, 90.0, 90.0, Vec3::Z);
        at(Vec3::X, 0.0, 0.0, Vec3::Z);
        at(Vec3::NEG_Y, 0.0, 0.0, Vec3::NEG_Z);
        at(Vec3::NEG_Y, 90.0, 0.0, Vec3::X);
        at(Vec3::NEG_Y, 0.0, 90.0, Vec3::NEG_Y);
        // Test an up axis close to −y
        let up = Vec3::new(1e-3, -1.0, 0.0).normalize();
        at(up, 0.0, 90.0, up);
    }

    #[test]
    fn directions_have_azimuths() {
        for up in [Vec3::Y, Vec3::Z, Vec3::new(0.3, -0.8, 0.5).normalize()] {
            let horizon = Horizon::new(up);
            for azimuth in [-170.0, -45.0, 0.0, 90.0, 135.0] {
                for elevation in [-60.0, 0.0, 80.0] {
                    let found = horizon.azimuth(3.0 * horizon.direction(azimuth, elevation)).unwrap();
                    assert!((found - azimuth).abs() < 1e-3, "{azimuth} {elevation}: {found}");
                }
            }
            assert_eq!(horizon.azimuth(2.0 * up), None);
            assert_eq!((horizon.azimuth(Vec3::ZERO), horizon.azimuth(Vec3::NAN)), (None, None));
        }
    }

    #[test]
    fn rotation_maps_y_to_up() {
        for up in [Vec3::X, Vec3::NEG_Z, Vec3::new(0.3, -0.8, 0.5).normalize()] {
            let horizon = Horizon::new(up);
            assert!((horizon.rotation() * Vec3::Y).distance(up) < 1e-6);
            assert!(horizon.direction(123.0, 0.0).dot(up).abs() < 1e-6);
        }
    }
}
