//! Reasons why a picture has no light or shows no surface.

use super::SceneErrorMaker;
use super::view::{camera_rays, fine_camera_rays, inspect_view};
use crate::accel::Accel;
use crate::camera::Camera;
use crate::color::Spectrum;
use crate::geometry::{GeomId, Hit};
use crate::math::{Ray, UVec2};
use crate::scene::Scene;

/// Lamps are reported if at least this fraction of their triangles face inwards, or if at least
/// this fraction of the camera rays that hit lamps hit their backs.
const MIN_SHARE: f32 = 0.9;
/// Maximum number of triangles of a lamp that are checked.
const MAX_TRIANGLES: usize = 256;
/// Distance of a ray's origin from the triangle, as a fraction of the scene's radius.
const OFFSET: f32 = 1e-4;

/// Reason, as text for a message, why a picture of `scene` from `camera` has no light.
pub fn reason_for_darkness(
    accel: &dyn Accel,
    scene: &Scene,
    camera: &Camera,
    resolution: UVec2,
    whole: SceneErrorMaker,
) -> String {
    let is_invisible = scene.materials().iter().all(|material| material.opacity == 0.0);
    if scene.triangle_count() > 0 && is_invisible {
        return "all surfaces are invisible (opacity 0)".into();
    }
    if scene.lights().iter().all(|light| light.power(1.0) == 0.0) {
        return "no light of the scene emits".into();
    }
    if let Some(finding) = inspect_view(accel, scene, camera, resolution, whole) {
        return finding.error.message;
    }
    let of_lamps = dark_lamps(accel, scene, camera, resolution);
    of_lamps
        .unwrap_or("no light reaches the surfaces that the camera sees")
        .into()
}

/// Text for a message that says what is wrong with the lamps of `scene`. `None` if no fault is
/// found.
pub fn dark_lamps(accel: &dyn Accel, scene: &Scene, camera: &Camera, resolution: UVec2) -> Option<&'static str> {
    if face_inwards(accel, scene) {
        return Some("the lamps face inwards: they light nothing but themselves");
    }
    show_backs(accel, scene, camera, resolution)
        .then_some("the camera sees the backs of the lamps, and nothing that they light")
}

/// Maximum number of invisible surfaces that a ray passes through.
const MAX_PASSED: usize = 64;

/// Reason, in words, why a picture of `scene` from `camera` shows no surface of the scene. `None`
/// if the picture shows a surface, or if the scene has no surfaces.
pub fn reason_for_emptiness(accel: &dyn Accel, scene: &Scene, camera: &Camera, resolution: UVec2) -> Option<String> {
    if scene.triangle_count() == 0 {
        return None;
    }
    let offset = OFFSET * scene.bounds().radius();
    let mut passes_surfaces = false;
    for mut ray in fine_camera_rays(camera, resolution) {
        for _ in 0..MAX_PASSED {
            let is_ground = |hit: &Hit| scene.ground().is_some_and(|ground| ground.is_at(hit));
            let Some(hit) = accel.intersect(&ray).filter(|hit| !is_ground(hit)) else {
                break;
            };
            let material = scene.material(&hit);
            let is_clear = material.thin && material.ior == 1.0 && material.transmission == Spectrum::ONE;
            if scene.opacity(&hit) > 0.0 && !is_clear {
                return None;
            }
            passes_surfaces = true;
            ray = Ray::new(ray.at(hit.t + offset), ray.direction);
        }
    }
    let reason = if passes_surfaces {
        "all surfaces in the picture are invisible"
    } else {
        "the camera sees none of the scene's surfaces"
    };
    Some(reason.into())
}

/// Returns true if most triangles of lamps face another triangle of their mesh.
fn face_inwards(accel: &dyn Accel, scene: &Scene) -> bool {
    let offset = OFFSET * scene.bounds().radius();
    let (mut inwards, mut all) = (0.0, 0.0);
    for (geom, mesh) in (0..).map(GeomId).zip(scene.meshes()) {
        if scene.shape(geom).first_light.is_none() {
            continue;
        }
        let stride = mesh.triangles.len().div_ceil(MAX_TRIANGLES).max(1);
        for triangle in mesh.triangles.iter().step_by(stride) {
            let [a, b, c] = triangle.map(|corner| mesh.positions[corner as usize]);
            let n = (b - a).cross(c - a).normalize_or_zero();
            let ray = Ray::new((a + b + c) / 3.0 + offset * n, n);
            all += 1.0;
            if accel.intersect(&ray).is_some_and(|hit| hit.geom == geom) {
                inwards += 1.0;
            }
        }
    }
    all > 0.0 && inwards >= MIN_SHARE * all
}

/// Returns true if camera rays hit lamps, and most of them hit the backs of the lamps.
fn show_backs(accel: &dyn Accel, scene: &Scene, camera: &Camera, resolution: UVec2) -> bool {
    let (mut backs, mut all) = (0.0, 0.0);
    for ray in camera_rays(camera, resolution) {
        let Some(hit) = accel
            .intersect(&ray)
            .filter(|hit| scene.shape(hit.geom).first_light.is_some())
        else {
            continue;
        };
        all += 1.0;
        if scene.surface_point(&hit, 0.0).ng.dot(ray.direction) > 0.0 {
            backs += 1.0;
        }
    }
    all > 0.0 && backs >= MIN_SHARE * all
}
