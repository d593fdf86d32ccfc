use super::{Vec3, Vec3Lanes};

/// A right-handed orthonormal frame whose local +z is the given normal.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    x: Vec3,
    y: Vec3,
    z: Vec3,
}

impl Frame {
    /// Frame around the unit vector `z` (Duff et al. 2017, "Building an Orthonormal Basis,
    /// Revisited").
    pub fn from_z(z: Vec3) -> Self {
        let sign = 1f32.copysign(z.z);
        let a = -1.0 / (sign + z.z);
        let b = z.x * z.y * a;
        Self {
            x: Vec3::new(1.0 + sign * z.x * z.x * a, sign * b, -sign * z.x),
            y: Vec3::new(b, sign + z.y * z.y * a, -z.y),
            z,
        }
    }

    /// Frame around the unit vector `z` whose local +x is as near to `x` as possible, then rotated
    /// by `angle` radians around `z`. `None` if `x` is parallel to `z`.
    pub fn from_zx(z: Vec3, x: Vec3, angle: f32) -> Option<Self> {
        let x = (x - z * x.dot(z)).try_normalize()?;
        let y = z.cross(x);
        let (sin, cos) = angle.sin_cos();
        Some(Self {
            x: cos * x + sin * y,
            y: cos * y - sin * x,
            z,
        })
    }

    /// Converts a world direction to a local direction.
    #[inline(always)]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.x), v.dot(self.y), v.dot(self.z))
    }

    /// Converts world directions to local directions.
    #[inline(always)]
    pub fn to_local_lanes(&self, v: &Vec3Lanes) -> Vec3Lanes {
        let along = |axis| v.dot(&Vec3Lanes::splat(axis));
        Vec3Lanes {
            x: along(self.x),
            y: along(self.y),
            z: along(self.z),
        }
    }

    /// The normal: local +z.
    #[inline(always)]
    pub fn normal(&self) -> Vec3 {
        self.z
    }

    /// Converts a local direction to a world direction.
    #[inline(always)]
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        v.x * self.x + v.y * self.y + v.z * self.z
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_orthonormal_right_handed_and_invertible() {
        let normals = [
            Vec3::X,
            Vec3::NEG_Y,
            Vec3::Z,
            Vec3::NEG_Z,
            Vec3::new(0.6, 0.0, -0.8),
            Vec3::new(1e-20, 0.0, -1.0),
            Vec3::new(0.3, -0.2, 0.9).normalize(),
        ];
        for n in normals {
            let f = Frame::from_z(n);
            assert!(f.x.cross(f.y).distance(f.z) < 1e-6, "{n}");
            assert!(f.x.is_normalized() && f.y.is_normalized());
            let v = Vec3::new(0.1, -0.7, 0.4);
            assert!(f.to_world(f.to_local(v)).distance(v) < 1e-6);
            assert!(f.to_world(Vec3::Z).distance(n) < 1e-7);
        }
    }

    #[test]
    fn frame_of_tangent_has_x_along_tangent() {
        let z = Vec3::new(0.3, -0.2, 0.9).normalize();
        let along = Vec3::new(1.0, 2.0, -0.5);
        let f = Frame::from_zx(z, along, 0.0).unwrap();
        // The tangent lies in the plane of the frame's x and z axes.
        assert!(f.to_local(along).y.abs() < 1e-6 && f.to_local(along).x > 0.0);
        assert!(f.x.cross(f.y).distance(z) < 1e-6 && f.x.is_normalized());
        // A rotation by 90° maps the frame's x axis to its y axis.
        let turned = Frame::from_zx(z, along, std::f32::consts::FRAC_PI_2).unwrap();
        assert!(turned.x.distance(f.y) < 1e-6 && turned.y.distance(-f.x) < 1e-6);
        assert!(Frame::from_zx(Vec3::Z, Vec3::NEG_Z, 1.0).is_none());
    }
}
