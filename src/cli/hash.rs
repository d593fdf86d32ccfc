use crate::camera::CameraParameters;
use crate::light::Light;
use crate::scene::Scene;
use sha2::{Digest, Sha256};

/// Names what is rendered: SHA-256 over the frozen scene and the camera, in hexadecimal.
///
/// Two renders with the same hash, settings and seed show the same picture, whatever files they were read from.
pub(super) fn scene_hash(scene: &Scene, camera: &CameraParameters) -> String {
    let mut hash = Sha256::new();
    let mut floats = |values: &[f32]| values.iter().for_each(|v| hash.update(v.to_bits().to_le_bytes()));
    for v in [camera.position, camera.look_at, camera.up] {
        floats(&v.to_array());
    }
    floats(&[camera.vertical_fov, camera.lens_radius, camera.focus_distance]);
    for material in scene.materials() {
        floats(&material.diffuse.to_array());
        floats(&material.emission.to_array());
    }
    // Triangle lights follow from meshes and materials.
    for light in scene.lights() {
        match light {
            Light::Triangle(_) => {}
            Light::Point(l) => {
                floats(&l.position.to_array());
                floats(&l.intensity.to_array());
            }
            Light::Constant(l) => floats(&l.radiance.to_array()),
        }
    }
    for (geom, mesh) in scene.geom_ids().zip(scene.meshes()) {
        hash.update(scene.shape(geom).material.0.to_le_bytes());
        hash.update((mesh.positions.len() as u64).to_le_bytes());
        for p in &mesh.positions {
            p.to_array().iter().for_each(|v| hash.update(v.to_bits().to_le_bytes()));
        }
        for triangle in &mesh.triangles {
            triangle.iter().for_each(|i| hash.update(i.to_le_bytes()));
        }
    }
    format!("{:x}", hash.finalize())
}
