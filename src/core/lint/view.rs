use super::SceneErrorMaker;
use crate::accel::Accel;
use crate::camera::Camera;
use crate::geometry::{GeomId, Placement, rounding};
use crate::io::{Finding, Severity};
use crate::math::{Bounds3, Ray, UVec2, Vec2, Vec3};
use crate::sampling::warp::uniform_sphere;
use crate::scene::{Instance, Scene};
use std::ops::Range;

/// Number of camera rays along a side of the image.
const RAYS: u32 = 16;
/// Minimum number of f32 steps across the scene: its size divided by the distance between
/// neighbouring f32 numbers at its largest coordinate. With fewer steps, shapes are visibly
/// rounded.
const MIN_STEPS: f32 = 1e5;
/// Maximum rounding error of an instance, as a fraction of its size. With a larger error, the
/// instance is too far from the origin.
const MAX_ROUNDING: f32 = 0.01;
/// A camera counts as inside a wall only if all surfaces around it are nearer than this fraction of
/// the scene's radius. If they are farther away, the camera is in a room.
const WALL_SHARE: f32 = 0.05;

/// Finds coordinates that are too large for f32.
pub fn inspect_extent(scene: &Scene, whole: SceneErrorMaker) -> Vec<Finding> {
    let findings = [inspect_bounds(scene, whole), inspect_instances(scene, whole)];
    findings.into_iter().flatten().collect()
}

/// Finds coordinates that are so much larger than the scene that rounding to f32 changes its
/// shapes.
fn inspect_bounds(scene: &Scene, whole: SceneErrorMaker) -> Option<Finding> {
    let bounds = scene.bounds();
    let (size, largest) = (
        2.0 * bounds.radius(),
        bounds.min.abs().max(bounds.max.abs()).max_element(),
    );
    // Number of f32 steps across the scene, at the largest coordinate
    let steps = size / (largest * f32::EPSILON);
    if bounds.is_empty() || steps.is_nan() || steps >= MIN_STEPS {
        return None;
    }
    let message = format!(
        "the scene is {size} wide, but {largest} from the origin: 32-bit coordinates have only {steps:.0} steps across the scene"
    );
    let error = whole(message).help("move the scene to the origin");
    Some(Finding::new(Severity::Warning, "far-from-origin", error))
}

/// Finds instances that are too far from the origin. The transformation of a ray into the
/// instance's space has a rounding error, and rays start at this distance from the surface. The
/// distance must be small relative to the instance's size.
fn inspect_instances(scene: &Scene, whole: SceneErrorMaker) -> Option<Finding> {
    let extents: Vec<Bounds3> = scene.prototypes().iter().map(|p| bounds_of(scene, p.clone())).collect();
    let share = |instance: &Instance| {
        let bounds = extents[instance.prototype as usize];
        // Measure each step of a motion separately. The box of all steps would be too large if the
        // object moves far.
        let shares = instance.placement.steps().iter().map(|&step| {
            let placed = Placement::Still(step).bounds(bounds);
            let corner = placed.min.abs().max(placed.max.abs());
            rounding(&step, corner).length() / (2.0 * placed.radius())
        });
        if bounds.is_empty() {
            0.0
        } else {
            shares.fold(0.0, f32::max)
        }
    };
    let far: Vec<(&Instance, f32)> = scene
        .instances()
        .iter()
        .map(|i| (i, share(i)))
        .filter(|(_, s)| *s > MAX_ROUNDING)
        .collect();
    let (instance, share) = far.first()?;
    let object = scene.objects().get(instance.object as usize).map_or("", String::as_str);
    let which = match far.len() {
        1 => format!("an instance of `{object}` is"),
        n => format!("{n} instances, the first of `{object}`, are"),
    };
    let message = format!(
        "{which} so far from the origin that rays start {:.1} % of its size off its surfaces, and light may leak",
        100.0 * share
    );
    let error = whole(message).help("move the scene to the origin, or scale the object up");
    Some(Finding::new(Severity::Warning, "far-instance", error).repeated(far.len() as u64, []))
}

/// Bounds of the meshes of a prototype, in the space of the prototype.
fn bounds_of(scene: &Scene, meshes: Range<u32>) -> Bounds3 {
    let meshes = meshes.map(|geom| scene.mesh(GeomId(geom)));
    meshes
        .flat_map(|m| m.positions.iter().chain(&m.positions_close).copied())
        .collect()
}

/// Centres of the cells of the coarse grid over a unit square.
fn cells() -> impl Iterator<Item = Vec2> {
    grid(RAYS)
}

/// Centres of the cells of a grid with `count` cells along each side of a unit square.
fn grid(count: u32) -> impl Iterator<Item = Vec2> {
    (0..count * count).map(move |i| Vec2::new((i % count) as f32 + 0.5, (i / count) as f32 + 0.5) / count as f32)
}

/// Camera rays over the whole picture, at shutter open.
pub(super) fn camera_rays(camera: &Camera, resolution: UVec2) -> impl Iterator<Item = Ray> {
    cells().map(move |cell| camera.ray(cell * resolution.as_vec2(), Vec2::splat(0.5), 0.0))
}

/// Camera rays over the whole picture at shutter open, dense enough to hit small things.
pub(super) fn fine_camera_rays(camera: &Camera, resolution: UVec2) -> impl Iterator<Item = Ray> {
    grid(FINE_RAYS).map(move |cell| camera.ray(cell * resolution.as_vec2(), Vec2::splat(0.5), 0.0))
}

/// Finds a camera that sees nothing at shutter open, or that is inside a wall.
pub fn inspect_view(
    accel: &dyn Accel,
    scene: &Scene,
    camera: &Camera,
    resolution: UVec2,
    whole: SceneErrorMaker,
) -> Option<Finding> {
    let rays: Vec<Ray> = camera_rays(camera, resolution).collect();
    let finding = |code, message: String, help: &str| {
        let error = whole(message).help(help);
        Some(Finding::new(Severity::Warning, code, error))
    };
    if rays.iter().all(|ray| accel.intersect(ray).is_none()) {
        let message = format!("the camera sees nothing: none of {} rays meets a surface", rays.len());
        return finding(
            "empty-view",
            message,
            "turn the camera, or remove [camera], so that the program frames the scene",
        );
    }

    // Test if back faces are near the camera in all directions
    let origin = rays.first()?.origin;
    let within = WALL_SHARE * scene.bounds().radius();
    let is_back = |direction: Vec3| {
        let hit = accel.intersect(&Ray::new(origin, direction));
        hit.is_some_and(|hit| hit.t < within && scene.surface_point(&hit, 0.0).ng.dot(direction) > 0.0)
    };
    if cells().all(|cell| is_back(uniform_sphere(cell))) {
        let message = "the camera is inside a body: on all sides it sees the backs of near surfaces";
        return finding("camera-inside", message.into(), "move the camera");
    }
    None
}

/// If at least this fraction of the visible surfaces show their backs, a warning says that the
/// camera is behind surfaces.
const BEHIND: f32 = 0.8;
/// Number of camera rays along a side of the image, to find small things.
const FINE_RAYS: u32 = 96;
/// Maximum distance of a point from the plane of a flat surface, as a fraction of the scene's
/// radius.
const ON_PLANE: f32 = 1e-4;
/// Minimum cosine of the angle between normals of one flat surface.
const SAME_WAY: f32 = 0.9999;

/// Warns of a camera that is behind surfaces or nearer to a surface than `near`. Also warns if the
/// picture shows only one flat surface and the scene has others.
pub fn inspect_place(
    accel: &dyn Accel,
    scene: &Scene,
    camera: &Camera,
    (resolution, near): (UVec2, Option<f32>),
    whole: SceneErrorMaker,
) -> Option<Finding> {
    let finding = |code, message: String| {
        let help = "`embrasure views SCENE -o views.png` shows cameras to choose from; --stand X,Z stands on the floor";
        let error = whole(message).help(help);
        Some(Finding::new(Severity::Warning, code, error))
    };
    let rays: Vec<Ray> = camera_rays(camera, resolution).collect();
    let origin = rays.first()?.origin;
    let seen: Vec<CameraHit> = rays.iter().filter_map(|ray| CameraHit::by(accel, scene, ray)).collect();
    let is_opaque = |seen: &&CameraHit| !seen.is_clear;
    let opaque = seen.iter().filter(is_opaque).count();
    let backs = seen.iter().filter(is_opaque).filter(|seen| seen.is_back).count();
    if opaque > 0 && backs as f32 >= BEHIND * seen.len() as f32 {
        let share = 100 * backs / seen.len();
        return finding(
            "camera-behind",
            format!(
                "the camera is outside of a room or inside of a body: {share} % of the surfaces that it sees show their backs"
            ),
        );
    }
    if let Some(near) = near {
        let around = cells().map(|cell| Ray::new(origin, uniform_sphere(cell)));
        let distances = around.filter_map(|ray| accel.intersect(&ray)).map(|hit| hit.t);
        let nearest = distances.fold(f32::INFINITY, f32::min);
        if nearest < near {
            return finding(
                "camera-near",
                format!(
                    "the camera is {} units from a surface, which is less than 5 cm ({} units)",
                    two_digits(nearest),
                    two_digits(near)
                ),
            );
        }
    }
    let first = seen
        .first()
        .filter(|first| seen.len() == rays.len() && first.is_plain)?;
    let margin = ON_PLANE * scene.bounds().radius();
    let is_on = |p: Vec3| (p - first.point).dot(first.normal).abs() <= margin;
    let is_like = |other: &CameraHit| {
        let is_same_way = other.normal.dot(first.normal).abs() >= SAME_WAY;
        other.material == first.material && is_same_way && is_on(other.point)
    };
    let bounds = scene.bounds();
    let corner = |i: u32| {
        let pick = |axis: usize| {
            if i >> axis & 1 == 0 {
                bounds.min[axis]
            } else {
                bounds.max[axis]
            }
        };
        Vec3::new(pick(0), pick(1), pick(2))
    };
    let has_others = !(0..8).all(|i| is_on(corner(i)));
    // A coarse grid of rays can miss small things.
    let is_alone = || {
        let mut fine = fine_camera_rays(camera, resolution);
        fine.all(|ray| CameraHit::by(accel, scene, &ray).is_some_and(|seen| is_like(&seen)))
    };
    if has_others && seen.iter().all(is_like) && is_alone() {
        return finding(
            "single-surface",
            "the picture shows one flat surface and nothing else".into(),
        );
    }
    None
}

/// Text of `x` > 0 with two significant digits.
pub(super) fn two_digits(x: f32) -> String {
    let decimals = (1.0 - x.log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{x:.decimals$}")
}

/// A surface that a camera ray hits.
struct CameraHit {
    point: Vec3,
    normal: Vec3,
    material: u32,
    is_back: bool,
    /// True if the surface's BSDF has no texture.
    is_plain: bool,
    /// True if most light is transmitted. The backs of glass are visible by intent.
    is_clear: bool,
}

impl CameraHit {
    fn by(accel: &dyn Accel, scene: &Scene, ray: &Ray) -> Option<Self> {
        let hit = accel.intersect(ray)?;
        let normal = scene.surface_point(&hit, 0.0).ng;
        let material = scene.material(&hit);
        let is_clear = material.transmission.luminance() > 0.5 || scene.opacity(&hit) < 0.5;
        Some(Self {
            point: ray.at(hit.t),
            normal,
            material: scene.shape(hit.geom).material.0,
            is_back: normal.dot(ray.direction) > 0.0,
            is_plain: !material.maps.varies_bsdf(),
            is_clear,
        })
    }
}
