//! Normals of smoothing groups.

use crate::support::load;
use crate::support::program::folder;
use embrasure::math::Vec3;

/// Each of the three faces at a corner of a cube has an angle of 90° there. The normal of the
/// corner is therefore the mean of the three face normals, for any triangulation.
#[test]
fn group_normals_do_not_depend_on_triangles() {
    // Faces x = 0, y = 0 and z = 0; the first is two triangles that meet at the corner.
    let corner = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 0 1 1\nv 1 0 1\nv 1 1 0\ns 1\n";
    let [whole, cut] = ["f 1 3 5 4\n", "f 1 3 5\nf 1 5 4\n"].map(|face| {
        let files = folder(&[("a.obj", &format!("{corner}{face}f 1 4 6 2\nf 1 2 7 3\n"))]);
        let scene = load(&files.path().join("a.obj"));
        let mesh = &scene.meshes()[0];
        let vertex = mesh.positions.iter().position(|p| *p == Vec3::ZERO).unwrap();
        mesh.normals[vertex]
    });
    let expected = Vec3::ONE.normalize();
    for normal in [whole, cut] {
        assert!(normal.dot(expected).abs() > 1.0 - 1e-6, "{normal}");
    }
}
