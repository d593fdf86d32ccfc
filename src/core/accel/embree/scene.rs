use super::device::{Device, EmbreeError};
use super::handles::{SceneHandle, attach_instance, attach_mesh};
use crate::geometry::{GeomId, Hit, InstanceId, Mesh, Placement, crossing};
use crate::math::{Ray, Vec3};
use crate::scene::{Instance, Scene};
use embree4_sys::*;
use std::ops::Range;
use std::sync::Arc;

/// A committed Embree scene of all meshes and instances, with robust intersections and a high-quality build. Embree reads vertices
/// and indices where the scene has them, so the scene is borrowed, or its meshes are kept.
///
/// Geometries of Embree's scene have the ids of the meshes that stand in the world, and after those come the instances. Those of
/// a prototype's scene count from its first mesh on.
#[derive(Debug)]
pub struct EmbreeAccel<'a> {
    // Before the device: fields are dropped in order, and a scene goes before its device.
    scene: SceneHandle,
    device: Device,
    /// Number of meshes that stand in the world.
    standing: u32,
    /// The first mesh of each instance.
    first_meshes: Vec<u32>,
    /// What Embree reads.
    meshes: Meshes<'a>,
}

/// The arrays that Embree reads.
#[derive(Debug)]
enum Meshes<'a> {
    /// Those of a scene that is borrowed.
    Of(&'a Scene),
    /// Those of a scene that outlives the borrow: all meshes, and where the instances are.
    Kept(Arc<Vec<Mesh>>, Vec<Placement>),
}

impl Meshes<'_> {
    /// The corners of the triangle that was hit, where they are at `time`.
    fn corners(&self, hit: &Hit, time: f32) -> [Vec3; 3] {
        match self {
            Self::Of(scene) => scene.corners(hit, time),
            Self::Kept(meshes, placements) => {
                let corners = meshes[hit.geom.0 as usize].corners_at(hit.prim, time);
                match placements.get(hit.inst.0 as usize).map(|placement| placement.at(time)) {
                    Some(placement) => corners.map(|p| placement.transform_point3a(p)),
                    None => corners,
                }
            }
        }
    }
}

impl EmbreeAccel<'static> {
    /// Builds over the meshes of `scene`, with `threads` threads, and keeps these meshes: the scene may be changed in all else meanwhile.
    pub(crate) fn kept(scene: &Scene, threads: usize) -> Result<Self, EmbreeError> {
        let placements = scene.instances().iter().map(|i| i.placement.clone()).collect();
        let meshes = scene.shared_meshes();
        Self::over(Device::new(threads)?, scene, Meshes::Kept(meshes, placements))
    }
}

impl<'a> EmbreeAccel<'a> {
    /// Builds over the meshes of `scene`, with `threads` threads.
    pub fn new(scene: &'a Scene, threads: usize) -> Result<Self, EmbreeError> {
        Self::on(Device::new(threads)?, scene)
    }

    /// Builds over the meshes of `scene`, on `device`.
    pub fn on(device: Device, scene: &'a Scene) -> Result<Self, EmbreeError> {
        Self::over(device, scene, Meshes::Of(scene))
    }

    /// Builds over `meshes`, which are those of `scene`.
    fn over(device: Device, scene: &Scene, meshes: Meshes<'a>) -> Result<Self, EmbreeError> {
        let attach_all = |handle: &SceneHandle, meshes: Range<u32>| {
            for (id, geom) in meshes.enumerate() {
                // SAFETY: `meshes` are those of `scene`, borrowed for 'a or counted, which no Embree scene made here outlives: `Self`
                // holds the only handle to the one that refers to all others, and `meshes`. A shared borrow keeps them as they are, and
                // so does the count: a scene changes meshes through `Arc::make_mut` alone, which copies what is shared.
                unsafe { attach_mesh(&device, handle, id as u32, scene.mesh(GeomId(geom)))? };
            }
            Ok(())
        };
        // Prototypes are scenes of their own, which the instances then refer to.
        let mut prototypes = Vec::with_capacity(scene.prototypes().len());
        for meshes in scene.prototypes() {
            let prototype = SceneHandle::new(&device, scene.is_compact())?;
            attach_all(&prototype, meshes.clone())?;
            prototype.commit(&device)?;
            prototypes.push(prototype);
        }
        let handle = SceneHandle::new(&device, scene.is_compact())?;
        attach_all(&handle, scene.standing())?;
        let standing = scene.standing().end;
        for (id, instance) in (standing..).zip(scene.instances()) {
            let prototype = &prototypes[instance.prototype as usize];
            attach_instance(&device, &handle, id, prototype, &instance.placement)?;
        }
        handle.commit(&device)?;
        let first_mesh = |i: &Instance| scene.prototypes()[i.prototype as usize].start;
        Ok(Self {
            scene: handle,
            device,
            standing,
            first_meshes: scene.instances().iter().map(first_mesh).collect(),
            meshes,
        })
    }

    /// Mesh and instance of a hit by the ids that Embree gives them.
    #[inline(always)]
    pub(super) fn ids(&self, geom: u32, inst: u32) -> (GeomId, InstanceId) {
        if inst == RTC_INVALID_GEOMETRY_ID {
            return (GeomId(geom), InstanceId::NONE);
        }
        let inst = inst - self.standing;
        (GeomId(self.first_meshes[inst as usize] + geom), InstanceId(inst))
    }

    /// Barycentrics of `hit` that can be believed. Where the triangle is tiny as its ray sees it, of 10⁻¹⁸ square units, Embree's are both 0
    /// (`min_rcp_input` in its sources).
    #[inline(always)]
    pub(super) fn barycentrics(&self, ray: &Ray, hit: &Hit) -> [f32; 2] {
        if hit.b1 == 0.0 && hit.b2 == 0.0 {
            self.of_tiny_triangle(ray, hit)
        } else {
            [hit.b1, hit.b2]
        }
    }

    #[cold]
    #[inline(never)]
    fn of_tiny_triangle(&self, ray: &Ray, hit: &Hit) -> [f32; 2] {
        let corners = self.meshes.corners(hit, ray.time).map(|p| p.as_dvec3());
        let Some((_, b1, b2)) = crossing(ray, corners) else {
            return [hit.b1, hit.b2];
        };
        let b1 = b1.clamp(0.0, 1.0);
        let b2 = b2.clamp(0.0, 1.0 - b1);
        [b1 as f32, b2 as f32]
    }

    /// The committed scene.
    #[inline(always)]
    pub(super) fn handle(&self) -> RTCScene {
        self.scene.raw()
    }

    /// The device of that scene.
    pub(super) fn device(&self) -> &Device {
        &self.device
    }
}
