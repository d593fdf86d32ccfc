//! The scene hash: a SHA-256 over an explicit encoding of all data of the scene and the camera that
//! affects pixels (`math/encode.rs`).

use crate::camera::CameraDescription;
use crate::math::Encode;
use crate::scene::Scene;
use sha2::{Digest, Sha256};

/// SHA-256 over the frozen scene and the camera's description, in hexadecimal.
///
/// Two renders with equal hash, settings and seed give the same picture, even if their scene files
/// differ.
pub(crate) fn scene_hash(scene: &Scene, camera: &CameraDescription) -> String {
    let mut hash = Sha256::new();
    let sink = &mut |bytes: &[u8]| hash.update(bytes);
    camera.encode(sink);
    scene.materials().encode(sink);
    scene.texture_filter().encode(sink);
    scene.textures().encode(sink);
    scene.lights().encode(sink);
    scene.light_groups().encode(sink);
    scene.meshes().encode(sink);
    for geom in scene.geom_ids() {
        scene.shape(geom).material.0.encode(sink);
    }
    scene.instances().len().encode(sink);
    // Encode thin surfaces only if there are any, so that hashes of other scenes do not change
    if scene.has_thin_surfaces() {
        "straight".encode(sink);
    }
    if let Some(ground) = scene.ground() {
        ground.encode(sink);
    }
    for instance in scene.instances() {
        scene.prototypes()[instance.prototype as usize].encode(sink);
        instance.placement.encode(sink);
    }
    format!("{:x}", hash.finalize())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bsdf::Fresnel;
    use crate::camera::{Aperture, CameraMotion, CameraParameters, Pose};
    use crate::color::Spectrum;
    use crate::light::{
        ConstantLight, DirectionalLight, DiskLight, EnvironmentLight, LatLongImage, Light, LightGroupId, LightGroups,
        PointLight, RectangleLight, SphereLight, SpotLight, SunLight,
    };
    use crate::material::{Gloss, Map, Material};
    use crate::math::{Quat, UVec2, Vec2, Vec3};
    use crate::scene::SceneBuilder;
    use crate::scene_file::{SceneFile, load_scene};
    use crate::session::{Settings, thread_pool};
    use crate::texture::{Channel, Curve, Mapping, Texels, Texture, TextureId, Wrap};
    use std::path::Path;

    /// If the encoding changes, this hash changes. All existing checkpoints then belong to another
    /// scene, so such a change must be intended.
    #[test]
    fn hash_of_the_cornell_box_is_fixed() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/cornell-box.toml");
        let file = SceneFile::load(&path).unwrap();
        let scene = load_scene(&file, SceneBuilder::new()).unwrap().scene;
        let settings = Settings::of(&file);
        let pool = thread_pool(1).unwrap();
        let camera = settings.camera_of(&file, &scene, &pool).unwrap().description;
        assert_eq!(
            scene_hash(&scene, &camera),
            "958c0c98a71789e1b916b0bdb99a445ec639468ba48ac90e5640e2d525e050c5"
        );
    }

    /// Asserts that each change of `value` gives a different encoding.
    fn assert_each_counts<T: Encode + Clone>(value: &T, changes: &[fn(&mut T)]) {
        let mut all = vec![value.encoded()];
        for (i, change) in changes.iter().enumerate() {
            let mut changed = value.clone();
            change(&mut changed);
            let bytes = changed.encoded();
            let other = all.iter().position(|other| *other == bytes);
            assert!(
                other.is_none(),
                "change {i} has the bytes of number {}",
                other.unwrap_or(0)
            );
            all.push(bytes);
        }
    }

    const MAP: Map = Map {
        texture: TextureId(3),
        mapping: Mapping {
            scale: Vec2::ONE,
            offset: Vec2::ZERO,
            wrap: Wrap::Repeat,
            channel: None,
            base: 0.0,
            gain: 1.0,
            bump: 1.0,
            flips_green: false,
        },
    };

    #[test]
    fn each_field_of_a_material_counts() {
        assert_each_counts(
            &Material::default(),
            &[
                |m| m.name = "x".into(),
                |m| m.diffuse = Spectrum::ONE,
                |m| m.specular = Spectrum::ONE,
                |m| m.gloss = Gloss::Phong(2.0),
                |m| m.gloss = Gloss::Metallic(1.0),
                |m| m.gloss = Gloss::Blinn(1.0, Fresnel::Full),
                |m| m.gloss = Gloss::Ggx(Fresnel::Full),
                |m| m.gloss = Gloss::Mirror(Fresnel::Full),
                |m| m.gloss = Gloss::Mirror(Fresnel::Dielectric { eta: 1.5 }),
                |m| m.gloss = Gloss::Mirror(Fresnel::Schlick { f0: [0.5; 3] }),
                |m| {
                    let [eta, k] = [[0.5; 3], [0.0; 3]];
                    m.gloss = Gloss::Mirror(Fresnel::Conductor { eta, k });
                },
                |m| {
                    let [eta, k] = [[0.5; 3], [0.0, 0.0, 1.0]];
                    m.gloss = Gloss::Mirror(Fresnel::Conductor { eta, k });
                },
                |m| m.roughness = 0.5,
                |m| m.anisotropy = 0.5,
                |m| m.anisotropy_rotation = 0.5,
                |m| m.clearcoat = 0.5,
                |m| m.clearcoat_roughness = 0.5,
                |m| m.sheen = Spectrum::ONE,
                |m| m.transmission = Spectrum::ONE,
                |m| m.ior = 1.25,
                |m| m.thin = true,
                |m| m.abbe = Some(30.0),
                |m| m.abbe = Some(40.0),
                |m| m.absorption = Spectrum::ONE,
                |m| m.absorption = Spectrum::rgb(1.0, 1.0, 2.0),
                |m| m.emission = Spectrum::ONE,
                |m| m.emission = Spectrum::rgb(1.0, 1.0, 2.0),
                |m| m.opacity = 0.5,
                |m| m.maps.diffuse = Some(MAP),
                |m| m.maps.specular = Some(MAP),
                |m| m.maps.emission = Some(MAP),
                |m| m.maps.exponent = Some(MAP),
                |m| m.maps.roughness = Some(MAP),
                |m| m.maps.metallic = Some(MAP),
                |m| m.maps.opacity = Some(MAP),
                |m| m.maps.bump = Some(MAP),
                |m| m.maps.normal = Some(MAP),
                |m| m.maps.vertex_color = true,
                |m| m.maps.vertex_alpha = true,
            ],
        );
    }

    #[test]
    fn each_field_of_a_map_counts() {
        assert_each_counts(
            &MAP,
            &[
                |m| m.texture = TextureId(4),
                |m| m.mapping.scale = Vec2::new(1.0, 2.0),
                |m| m.mapping.offset = Vec2::new(0.0, 1.0),
                |m| m.mapping.wrap = Wrap::Clamp,
                |m| m.mapping.wrap = Wrap::Mirror,
                |m| m.mapping.channel = Some(Channel::Red),
                |m| m.mapping.channel = Some(Channel::Depth),
                |m| m.mapping.base = 1.0,
                |m| m.mapping.gain = 2.0,
                |m| m.mapping.bump = 2.0,
                |m| m.mapping.flips_green = true,
            ],
        );
    }

    #[test]
    fn each_field_of_a_light_counts() {
        const SPOT: SpotLight = SpotLight {
            position: Vec3::ZERO,
            direction: Vec3::X,
            intensity: Spectrum::ONE,
            cos_inner: 0.5,
            cos_outer: 0.25,
        };
        fn environment(texel: f32, scale: f32, rotation: Quat) -> Light {
            let image = LatLongImage {
                width: 2,
                height: 1,
                texels: vec![Spectrum::ONE, Spectrum::splat(texel)],
            };
            Light::Environment(Box::new(EnvironmentLight::new(image, scale, rotation)))
        }
        let (position, direction) = (Vec3::ZERO, Vec3::ZERO);
        let [intensity, irradiance] = [Spectrum::ONE; 2];
        let turned = Quat::from_xyzw(0.0, 1.0, 0.0, 0.0);
        let (far, red) = (Vec3::X, Spectrum::rgb(2.0, 1.0, 1.0));
        let point = |position, intensity| Light::Point(PointLight { position, intensity });
        let parallel = |direction, irradiance| Light::Directional(DirectionalLight { direction, irradiance });
        let lights = [
            point(position, intensity),
            point(far, intensity),
            point(position, red),
            parallel(direction, irradiance),
            parallel(far, irradiance),
            parallel(direction, red),
            Light::Constant(ConstantLight {
                radiance: Spectrum::ONE,
            }),
            Light::Constant(ConstantLight { radiance: red }),
            Light::Spot(SPOT),
            Light::Spot(SpotLight { position: far, ..SPOT }),
            Light::Spot(SpotLight {
                direction: Vec3::Y,
                ..SPOT
            }),
            Light::Spot(SpotLight { intensity: red, ..SPOT }),
            Light::Spot(SpotLight {
                cos_inner: 0.75,
                ..SPOT
            }),
            Light::Spot(SpotLight {
                cos_outer: 0.125,
                ..SPOT
            }),
            Light::Sun(SunLight::new(Vec3::Y, irradiance, 1.0)),
            Light::Sun(SunLight::new(Vec3::X, irradiance, 1.0)),
            Light::Sun(SunLight::new(Vec3::Y, red, 1.0)),
            Light::Sun(SunLight::new(Vec3::Y, irradiance, 2.0)),
            Light::from(SphereLight::new(Vec3::Y, 1.0, red)),
            Light::from(SphereLight::new(Vec3::X, 1.0, red)),
            Light::from(SphereLight::new(Vec3::Y, 2.0, red)),
            Light::from(SphereLight::new(Vec3::Y, 1.0, irradiance)),
            Light::from(DiskLight::new(Vec3::Y, Vec3::Y, 1.0, red)),
            Light::from(DiskLight::new(Vec3::X, Vec3::Y, 1.0, red)),
            Light::from(DiskLight::new(Vec3::Y, Vec3::X, 1.0, red)),
            Light::from(DiskLight::new(Vec3::Y, Vec3::Y, 2.0, red)),
            Light::from(DiskLight::new(Vec3::Y, Vec3::Y, 1.0, irradiance)),
            Light::from(RectangleLight::new(Vec3::Y, [Vec3::X, Vec3::Y], red)),
            Light::from(RectangleLight::new(Vec3::X, [Vec3::X, Vec3::Y], red)),
            Light::from(RectangleLight::new(Vec3::Y, [Vec3::Y, Vec3::X], red)),
            Light::from(RectangleLight::new(Vec3::Y, [Vec3::X, Vec3::Y], irradiance)),
            environment(1.0, 1.0, Quat::IDENTITY),
            environment(2.0, 1.0, Quat::IDENTITY),
            environment(1.0, 2.0, Quat::IDENTITY),
            environment(1.0, 1.0, turned),
        ];
        for (i, a) in lights.iter().enumerate() {
            for (j, b) in lights.iter().enumerate() {
                assert_eq!(a.encoded() == b.encoded(), i == j, "lights {i} and {j}");
            }
        }
        let groups = |names: &[&str], group: u8| {
            let mut groups = LightGroups::new(names.iter().map(|name| name.to_string()).collect());
            groups.push(Some(LightGroupId(group)), 1);
            groups.encoded()
        };
        let all = [
            groups(&["a", "b"], 0),
            groups(&["a", "b"], 1),
            groups(&["ab"], 0),
            groups(&[], 0),
        ];
        assert!((0..4).all(|i| !all[..i].contains(&all[i])));
    }

    #[test]
    fn each_field_of_a_camera_counts() {
        const POSE: Pose = Pose {
            position: Vec3::ONE,
            look_at: Vec3::X,
            up: Vec3::Y,
        };
        let parameters = CameraParameters {
            position: Vec3::ONE,
            look_at: Vec3::X,
            up: Vec3::Y,
            vertical_fov: 40.0,
            lens_radius: 0.0,
            focus_distance: 1.0,
        };
        assert_each_counts(
            &CameraDescription::still(parameters),
            &[
                |c| c.parameters.position = Vec3::ZERO,
                |c| c.parameters.look_at = Vec3::ZERO,
                |c| c.parameters.up = Vec3::Z,
                |c| c.parameters.vertical_fov = 50.0,
                |c| c.parameters.lens_radius = 1.0,
                |c| c.parameters.focus_distance = 2.0,
                |c| {
                    let shutter = [0.0, 1.0];
                    c.motion = Some(CameraMotion { close: None, shutter });
                },
                |c| {
                    let shutter = [0.0, 0.5];
                    c.motion = Some(CameraMotion { close: None, shutter });
                },
                |c| {
                    let (close, shutter) = (Some(POSE), [0.0, 1.0]);
                    c.motion = Some(CameraMotion { close, shutter });
                },
                |c| {
                    let (blades, rotation) = (5, 0.0);
                    c.aperture = Some(Aperture { blades, rotation });
                },
                |c| {
                    let (blades, rotation) = (6, 0.0);
                    c.aperture = Some(Aperture { blades, rotation });
                },
                |c| {
                    let (blades, rotation) = (5, 30.0);
                    c.aperture = Some(Aperture { blades, rotation });
                },
            ],
        );
    }

    #[test]
    fn textures_and_their_curves_count() {
        let texture = |size: [usize; 2], channels, texels, wrap| {
            let texture = Texture::new(size[0], size[1], channels, texels, wrap);
            texture.unwrap().encoded()
        };
        let bytes = |codes: [u8; 4], curve| Texels::Bytes(codes.to_vec(), curve);
        let all = [
            texture([2, 2], 1, bytes([0, 1, 2, 3], Curve::Linear), Wrap::Repeat),
            texture([2, 2], 1, bytes([0, 1, 2, 4], Curve::Linear), Wrap::Repeat),
            texture([2, 2], 1, bytes([0, 1, 2, 3], Curve::Srgb), Wrap::Repeat),
            texture([2, 2], 1, bytes([0, 1, 2, 3], Curve::Linear), Wrap::Clamp),
            texture([4, 1], 1, bytes([0, 1, 2, 3], Curve::Linear), Wrap::Repeat),
            texture([2, 1], 2, bytes([0, 1, 2, 3], Curve::Linear), Wrap::Repeat),
            texture([2, 2], 1, Texels::Shorts(vec![0, 1, 2, 3], Curve::Linear), Wrap::Repeat),
            texture([2, 2], 1, Texels::Floats(vec![0.0, 1.0, 2.0, 3.0]), Wrap::Repeat),
            texture([2, 2], 1, Texels::Floats(vec![0.0, 1.0, 2.0, 0.1]), Wrap::Repeat),
        ];
        assert!((0..all.len()).all(|i| !all[..i].contains(&all[i])));
    }

    #[test]
    fn resolution_is_no_part_of_the_scene() {
        let settings = |side| Settings {
            resolution: UVec2::splat(side),
            ..Settings::default()
        };
        let file = SceneFile::of_obj(Path::new("none.obj"));
        let scene = SceneBuilder::new().build().unwrap().0;
        let [a, b] = [8, 16].map(|side| {
            let camera = settings(side)
                .camera_of(&file, &scene, &thread_pool(1).unwrap())
                .unwrap()
                .description;
            scene_hash(&scene, &camera)
        });
        assert_eq!(a, b);
    }
}
