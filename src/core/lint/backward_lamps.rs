//! Flat lamps that face a near surface and turn their backs to the room.

use super::SceneErrorMaker;
use super::view::two_digits;
use crate::accel::Accel;
use crate::geometry::{GeomId, Hit, InstanceId, PrimId};
use crate::io::{Finding, Severity};
use crate::math::{Ray, Vec3};
use crate::scene::Scene;
use std::collections::BTreeMap;

/// A lamp may face the wrong way if the distance to the surface in front of the lamp is at most
/// this fraction of the distance to the surface behind the lamp.
const NEAR: f32 = 0.05;
/// A lamp is reported if at least this fraction of its area faces the wrong way.
const MIN_AREA: f64 = 0.9;
/// Maximum number of triangles that are checked in each mesh.
const MAX_TRIANGLES: usize = 256;
/// Distance of a ray's origin from the triangle, as a fraction of the scene's radius.
const OFFSET: f32 = 1e-4;

/// A part of an emitting mesh.
#[derive(Default)]
struct Lamp {
    /// Area of the triangles that were checked.
    area: f64,
    /// Area of the triangles that face the wrong way.
    backward: f64,
    /// Largest distance from a triangle that faces the wrong way to the surface in front of it.
    distance: f32,
    /// Sum of the area vectors of the triangles.
    normal: Vec3,
}

/// Finds flat lamps that face a near surface and have free space behind them.
pub fn inspect_lamps(accel: &dyn Accel, scene: &Scene, whole: SceneErrorMaker) -> Vec<Finding> {
    let mut lamps: BTreeMap<u32, Lamp> = BTreeMap::new();
    let offset = OFFSET * scene.bounds().radius();
    for geom in scene.world_meshes().map(GeomId) {
        if scene.shape(geom).first_light.is_none() {
            continue;
        }
        let mesh = scene.mesh(geom);
        let stride = mesh.triangles.len().div_ceil(MAX_TRIANGLES).max(1);
        for prim in (0..mesh.triangles.len() as u32).step_by(stride).map(PrimId) {
            let [a, b, c] = mesh.corners(prim);
            let normal = 0.5 * (b - a).cross(c - a);
            let Some(n) = normal.try_normalize() else { continue };
            let middle = (a + b + c) / 3.0;
            // Distance to the first surface, if the surface belongs to another mesh. `None` if
            // there is no surface: a panel under the open sky faces the right way.
            let free = |w: Vec3| {
                let hit = accel.intersect(&Ray::new(middle + offset * w, w))?;
                (hit.geom != geom || hit.inst != InstanceId::NONE).then_some(hit.t)
            };
            let part = scene.part(&Hit::at_corner(geom, prim, InstanceId::NONE));
            let lamp = lamps.entry(part).or_default();
            let area = f64::from(normal.length());
            lamp.area += area;
            lamp.normal += normal;
            let near = free(n).zip(free(-n)).filter(|(front, back)| *front < NEAR * back);
            if let Some((front, _)) = near {
                lamp.backward += area;
                lamp.distance = lamp.distance.max(front);
            }
        }
    }
    let backward = lamps
        .into_iter()
        .filter(|(_, lamp)| lamp.backward >= MIN_AREA * lamp.area);
    backward
        .map(|(part, lamp)| finding(scene, part, &lamp, whole))
        .collect()
}

fn finding(scene: &Scene, part: u32, lamp: &Lamp, whole: SceneErrorMaker) -> Finding {
    let name = scene.part_name(part);
    let message = format!(
        "lamp `{name}` faces a surface that is {} units away, and the back of the lamp faces the room",
        two_digits(lamp.distance)
    );
    let has_name = part as usize >= scene.objects().len();
    let help = match (has_name, lamp.normal.abs().max_position()) {
        (false, _) => "turn the faces of the lamp over, or the `direction` of a light of the scene file".into(),
        // A half turn about an axis in the plane of the lamp turns it over.
        (true, 0) => format!("--part '{name}.rotate=[0,180,0]' turns it over"),
        (true, _) => format!("--part '{name}.rotate=[180,0,0]' turns it over"),
    };
    Finding::new(Severity::Warning, "light-backward", whole(message).help(help))
}
