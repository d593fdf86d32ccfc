use super::{Affine3A, Mat4, Quat, Vec3};
use glam::EulerRot;

/// Rotation around the fixed x, y and z axes in this order, in degrees.
pub fn rotation_from_degrees(degrees: Vec3) -> Quat {
    let r = degrees * std::f32::consts::PI / 180.0;
    // Rotations around fixed axes x, y, z are rotations around moving axes z, y, x.
    Quat::from_euler(EulerRot::ZYX, r.z, r.y, r.x)
}

/// Scales, then rotates around the fixed x, y and z axes in this order (degrees), then translates.
pub fn affine_from_trs(translate: Vec3, rotate_degrees: Vec3, scale: Vec3) -> Affine3A {
    let rotation = rotation_from_degrees(rotate_degrees);
    Affine3A::from_scale_rotation_translation(scale.into(), rotation, translate.into())
}

/// Transform from the four rows of a matrix that acts on column vectors; `None` unless the last row
/// is `0 0 0 1`.
pub fn affine_from_rows(rows: [[f32; 4]; 4]) -> Option<Affine3A> {
    (rows[3] == [0.0, 0.0, 0.0, 1.0]).then(|| Affine3A::from_mat4(Mat4::from_cols_array_2d(&rows).transpose()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn order_is_scale_rotate_x_y_z_translate() {
        // x = (1,0,0): scaled to 2x, rotated around z to y, moved by 5z.
        let m = affine_from_trs(Vec3::new(0.0, 0.0, 5.0), Vec3::new(0.0, 0.0, 90.0), Vec3::splat(2.0));
        let p = m.transform_point3a(Vec3::X);
        assert!(p.distance(Vec3::new(0.0, 2.0, 5.0)) < 1e-6, "{p}");
        // y around x by 90° gives z; then around y by 90° gives x.
        let m = affine_from_trs(Vec3::ZERO, Vec3::new(90.0, 90.0, 0.0), Vec3::ONE);
        let p = m.transform_point3a(Vec3::Y);
        assert!(p.distance(Vec3::X) < 1e-6, "{p}");
    }

    #[test]
    fn rows_act_on_columns() {
        let m = affine_from_rows([
            [1.0, 0.0, 0.0, 3.0],
            [0.0, 0.0, -1.0, 4.0],
            [0.0, 1.0, 0.0, 5.0],
            [0.0, 0.0, 0.0, 1.0],
        ])
        .unwrap();
        assert_eq!(m.transform_point3a(Vec3::Y), Vec3::new(3.0, 4.0, 6.0));
        assert!(affine_from_rows([[0.0; 4]; 4]).is_none());
    }
}
