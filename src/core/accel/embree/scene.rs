use super::device::{Device, EmbreeError};
use super::free_memory::return_free_memory;
use super::handles::{SceneHandle, attach_instance, attach_mesh};
use crate::geometry::{GeomId, Hit, InstanceId, Mesh, Placement, crossing};
use crate::math::{Ray, Vec3};
use crate::scene::{Instance, Scene};
use embree4_sys::*;
use std::ops::Range;
use std::sync::Arc;

/// A committed Embree scene of all meshes and instances, with robust intersections and a
/// high-quality build. Embree reads vertices and indices from the arrays of the scene, so the scene
/// is borrowed, or its meshes are shared.
///
/// In the Embree scene, the ids of the meshes in world space come first, followed by the ids of the
/// instances. Each prototype has a separate Embree scene, in which ids count from the prototype's
/// first mesh.
#[derive(Debug)]
pub struct EmbreeAccel<'a> {
    // This field must stand before `device`, because fields are dropped in order, and a scene must
    // be dropped before its device.
    scene: SceneHandle,
    device: Device,
    /// Number of meshes in world space.
    world_mesh_count: u32,
    /// For each instance, the index of the first mesh of its prototype.
    first_meshes: Vec<u32>,
    /// Meshes whose arrays Embree reads.
    meshes: Meshes<'a>,
}

/// Meshes whose arrays Embree reads.
#[derive(Debug)]
enum Meshes<'a> {
    /// Meshes of a borrowed scene.
    Of(&'a Scene),
    /// Reference-counted meshes, and the placements of the instances. They stay valid after the
    /// borrow of the scene has ended.
    Kept(Arc<Vec<Mesh>>, Vec<Placement>),
}

impl Meshes<'_> {
    /// World-space corners at `time` of the triangle of `hit`.
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
    /// Builds the Embree scene over the meshes of `scene` with `threads` threads, and shares
    /// ownership of these meshes. The other parts of `scene` may then change while the result is in
    /// use.
    pub(crate) fn kept(scene: &Scene, threads: usize) -> Result<Self, EmbreeError> {
        let placements = scene.instances().iter().map(|i| i.placement.clone()).collect();
        let meshes = scene.shared_meshes();
        Self::over(Device::new(threads)?, scene, Meshes::Kept(meshes, placements))
    }
}

impl<'a> EmbreeAccel<'a> {
    /// Builds the Embree scene over the meshes of `scene` with `threads` threads.
    pub fn new(scene: &'a Scene, threads: usize) -> Result<Self, EmbreeError> {
        Self::on(Device::new(threads)?, scene)
    }

    /// Builds the Embree scene over the meshes of `scene`, on `device`.
    pub fn on(device: Device, scene: &'a Scene) -> Result<Self, EmbreeError> {
        Self::over(device, scene, Meshes::Of(scene))
    }

    /// Builds the Embree scene over `meshes`, the meshes of `scene`.
    fn over(device: Device, scene: &Scene, meshes: Meshes<'a>) -> Result<Self, EmbreeError> {
        return_free_memory();
        let attach_all = |handle: &SceneHandle, meshes: Range<u32>| {
            for (id, geom) in meshes.enumerate() {
                // SAFETY: `meshes` holds the meshes of `scene`, either borrowed for 'a or
                // reference-counted. No Embree scene made here outlives them: `Self` holds
                // `meshes`, and the only handle to the Embree scene that refers to all other Embree
                // scenes. A shared borrow keeps the meshes unchanged. A reference count does too: a
                // scene changes meshes through `Arc::make_mut` only, which copies shared meshes.
                unsafe { attach_mesh(&device, handle, id as u32, scene.mesh(GeomId(geom)))? };
            }
            Ok(())
        };
        // Prototypes are separate Embree scenes, to which instances refer.
        let mut prototypes = Vec::with_capacity(scene.prototypes().len());
        for meshes in scene.prototypes() {
            let prototype = SceneHandle::new(&device, scene.is_compact())?;
            attach_all(&prototype, meshes.clone())?;
            prototype.commit(&device)?;
            prototypes.push(prototype);
        }
        let handle = SceneHandle::new(&device, scene.is_compact())?;
        attach_all(&handle, scene.world_meshes())?;
        let world_mesh_count = scene.world_meshes().end;
        for (id, instance) in (world_mesh_count..).zip(scene.instances()) {
            let prototype = &prototypes[instance.prototype as usize];
            attach_instance(&device, &handle, id, prototype, &instance.placement)?;
        }
        handle.commit(&device)?;
        let first_mesh = |i: &Instance| scene.prototypes()[i.prototype as usize].start;
        Ok(Self {
            scene: handle,
            device,
            world_mesh_count,
            first_meshes: scene.instances().iter().map(first_mesh).collect(),
            meshes,
        })
    }

    /// Returns the ids of the mesh and of the instance in the scene. `geom` and `inst` are Embree's
    /// ids of a hit.
    #[inline(always)]
    pub(super) fn ids(&self, geom: u32, inst: u32) -> (GeomId, InstanceId) {
        if inst == RTC_INVALID_GEOMETRY_ID {
            return (GeomId(geom), InstanceId::NONE);
        }
        let inst = inst - self.world_mesh_count;
        (GeomId(self.first_meshes[inst as usize] + geom), InstanceId(inst))
    }

    /// Barycentrics of `hit`. If the projected triangle is tiny (10⁻¹⁸ square units), Embree
    /// returns 0 for both barycentrics (`min_rcp_input` in its sources). They are then computed
    /// again in f64.
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

    /// Device of the scene.
    pub(super) fn device(&self) -> &Device {
        &self.device
    }
}
