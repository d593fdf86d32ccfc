use crate::light::{Light, LightId};
use crate::scene::Scene;
use crate::texture::TextureFilter;
use sha2::{Digest, Sha256};

/// Names what is rendered: SHA-256 over the frozen scene and the camera's description, in hexadecimal.
///
/// Two renders with the same hash, settings and seed show the same picture, whatever files they were read from.
pub(crate) fn scene_hash(scene: &Scene, camera: &str) -> String {
    let mut hash = Sha256::new();
    // Small records go in as their debug text: it names types and fields, and gives every float exactly.
    hash.update(format!("{camera}\n"));
    for material in scene.materials() {
        hash.update(format!("{material:?}\n"));
    }
    // Nothing is added for the usual way, so that scenes keep their names.
    if scene.texture_filter() != TextureFilter::Mip {
        hash.update(format!("{:?}\n", scene.texture_filter()));
    }
    for texture in scene.textures() {
        texture.visit_bytes(|bytes| hash.update(bytes));
    }
    // Triangle lights follow from meshes, instances and materials.
    for light in scene.lights() {
        match light {
            Light::Triangle(_) | Light::MovingTriangle(_) | Light::Textured(_) => {}
            // A picture is too large for text.
            Light::Environment(light) => {
                let image = light.image();
                hash.update(format!("environment {:?} {}\n", light.placement(), image.width));
                hash.update((image.texels.len() as u64).to_le_bytes());
                for texel in &image.texels {
                    texel
                        .to_array()
                        .iter()
                        .for_each(|v| hash.update(v.to_bits().to_le_bytes()));
                }
            }
            light => hash.update(format!("{light:?}\n")),
        }
    }
    // Nothing is added where lights are not told apart, so that these scenes keep their names.
    if !scene.light_groups().is_empty() {
        let groups = scene.light_groups();
        hash.update(format!("{:?}\n", groups.names()));
        let of_lights = (0..scene.lights().len() as u32).map(|id| groups.of(LightId(id)) as u8);
        hash.update(of_lights.collect::<Vec<u8>>());
    }
    for (geom, mesh) in scene.geom_ids().zip(scene.meshes()) {
        hash.update(scene.shape(geom).material.0.to_le_bytes());
        hash.update((mesh.positions.len() as u64).to_le_bytes());
        for p in &mesh.positions {
            p.to_array().iter().for_each(|v| hash.update(v.to_bits().to_le_bytes()));
        }
        hash.update((mesh.normals.len() as u64).to_le_bytes());
        for n in &mesh.normals {
            n.to_array().iter().for_each(|v| hash.update(v.to_bits().to_le_bytes()));
        }
        hash.update((mesh.uvs.len() as u64).to_le_bytes());
        for uv in &mesh.uvs {
            uv.to_array()
                .iter()
                .for_each(|v| hash.update(v.to_bits().to_le_bytes()));
        }
        hash.update((mesh.triangles.len() as u64).to_le_bytes());
        for triangle in &mesh.triangles {
            triangle.iter().for_each(|i| hash.update(i.to_le_bytes()));
        }
        // Nothing is added for what does not move, so that still scenes keep their names.
        for p in mesh.positions_close.iter().chain(&mesh.normals_close) {
            p.to_array().iter().for_each(|v| hash.update(v.to_bits().to_le_bytes()));
        }
    }
    for instance in scene.instances() {
        let meshes = &scene.prototypes()[instance.prototype as usize];
        hash.update(format!("instance of {meshes:?}\n"));
        for step in instance.placement.steps() {
            let elements = step.to_cols_array();
            elements.iter().for_each(|v| hash.update(v.to_bits().to_le_bytes()));
        }
    }
    format!("{:x}", hash.finalize())
}
