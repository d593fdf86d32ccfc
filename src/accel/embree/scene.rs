use super::device::{Device, EmbreeError};
use crate::accel::{Accel, BackendInfo, Dispatch};
use crate::geometry::{GeomId, Hit, InstanceId, Mesh, Placement, PrimId, crossing};
use crate::math::{Ray, Vec3, Vec4};
use crate::scene::{Instance, Scene};
use embree4_sys::*;
use std::ops::Range;
use std::ptr;

/// A committed Embree scene of all meshes and instances, with robust intersections and a high-quality build. Embree reads vertices
/// and indices where the scene has them, so the scene is borrowed.
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
    meshes: &'a Scene,
}

/// An owned reference to an Embree scene.
#[derive(Debug)]
pub(super) struct SceneHandle(RTCScene);

// SAFETY: after its commit a scene is only read. Embree's documentation of rtcCommitScene and rtcIntersect1 says that
// queries on a committed scene may run in parallel from many threads; reference counts are atomic.
unsafe impl Send for SceneHandle {}
// SAFETY: as above.
unsafe impl Sync for SceneHandle {}

impl SceneHandle {
    /// An empty scene.
    pub(super) fn new(device: &Device, is_compact: bool) -> Result<Self, EmbreeError> {
        // SAFETY: the device is live; null is checked below.
        let handle = Self(unsafe { rtcNewScene(device.handle()) });
        device.check("creating a scene")?;
        let flags = match is_compact {
            false => RTCSceneFlags::RTC_SCENE_FLAG_ROBUST,
            true => RTCSceneFlags::RTC_SCENE_FLAG_ROBUST | RTCSceneFlags::RTC_SCENE_FLAG_COMPACT,
        };
        // SAFETY: the scene is live, not yet committed, and known to this thread alone.
        unsafe {
            rtcSetSceneFlags(handle.0, flags);
            rtcSetSceneBuildQuality(handle.0, RTCBuildQuality::RTC_BUILD_QUALITY_HIGH);
        }
        device.check("configuring a scene")?;
        Ok(handle)
    }

    /// Builds the hierarchy over what has been attached.
    pub(super) fn commit(&self, device: &Device) -> Result<(), EmbreeError> {
        // SAFETY: the scene is live, and no other thread knows it yet.
        unsafe { rtcCommitScene(self.0) };
        device.check("building the acceleration structure")
    }

    /// For queries, once it is committed.
    pub(super) fn raw(&self) -> RTCScene {
        self.0
    }
}

impl Drop for SceneHandle {
    fn drop(&mut self) {
        // SAFETY: gives back the one reference that rtcNewScene gave; the handle is not used again.
        unsafe { rtcReleaseScene(self.0) }
    }
}

/// An owned reference to an Embree geometry.
struct GeometryHandle(RTCGeometry);

impl Drop for GeometryHandle {
    fn drop(&mut self) {
        // SAFETY: gives back the one reference that rtcNewGeometry gave; a scene it is attached to holds its own.
        unsafe { rtcReleaseGeometry(self.0) }
    }
}

impl<'a> EmbreeAccel<'a> {
    /// Builds over the meshes of `scene`, with `threads` threads.
    pub fn new(scene: &'a Scene, threads: usize) -> Result<Self, EmbreeError> {
        Self::on(Device::new(threads)?, scene)
    }

    /// Builds over the meshes of `scene`, on `device`.
    pub fn on(device: Device, scene: &'a Scene) -> Result<Self, EmbreeError> {
        let attach_all = |handle: &SceneHandle, meshes: Range<u32>| {
            for (id, geom) in meshes.enumerate() {
                // SAFETY: the meshes are borrowed for 'a, which no Embree scene made here outlives: `Self` holds the only handle
                // to the one that refers to all others, and the meshes' borrow. A shared borrow also keeps them as they are.
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
            meshes: scene,
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

    /// The hit with barycentrics that can be believed. Where the triangle is tiny as its ray sees it, of 10⁻¹⁸ square units, Embree's are both 0
    /// (`min_rcp_input` in its sources).
    #[inline(always)]
    pub(super) fn with_barycentrics(&self, ray: &Ray, hit: Hit) -> Hit {
        match hit.b1 == 0.0 && hit.b2 == 0.0 {
            true => self.of_tiny_triangle(ray, hit),
            false => hit,
        }
    }

    #[cold]
    #[inline(never)]
    fn of_tiny_triangle(&self, ray: &Ray, hit: Hit) -> Hit {
        let corners = self.meshes.corners(&hit, ray.time).map(|p| p.as_dvec3());
        let Some((_, b1, b2)) = crossing(ray, corners) else {
            return hit;
        };
        let b1 = b1.clamp(0.0, 1.0);
        let b2 = b2.clamp(0.0, 1.0 - b1);
        Hit {
            b1: b1 as f32,
            b2: b2 as f32,
            ..hit
        }
    }

    /// The committed scene.
    pub(super) fn handle(&self) -> RTCScene {
        self.scene.0
    }
}

/// Makes a geometry of `mesh` and attaches it to `scene`.
///
/// # Safety
/// The arrays of `mesh` stay where and as they are for as long as `scene` exists, and `id` is free in it.
pub(super) unsafe fn attach_mesh(
    device: &Device,
    scene: &SceneHandle,
    id: u32,
    mesh: &Mesh,
) -> Result<(), EmbreeError> {
    // SAFETY: the device is live; failure is reported through the error that is checked next.
    let geometry = unsafe { rtcNewGeometry(device.handle(), RTCGeometryType::RTC_GEOMETRY_TYPE_TRIANGLE) };
    let geometry = GeometryHandle(geometry);
    device.check("creating a geometry")?;
    let (vertex, index) = (
        RTCBufferType::RTC_BUFFER_TYPE_VERTEX,
        RTCBufferType::RTC_BUFFER_TYPE_INDEX,
    );
    let (float3, uint3) = (RTCFormat::RTC_FORMAT_FLOAT3, RTCFormat::RTC_FORMAT_UINT3);
    // SAFETY: Vec3 begins with three floats and has 16 bytes, [u32; 3] is three integers; the caller keeps the arrays.
    unsafe {
        if mesh.deforms() {
            // Vertex buffers have a slot for each time step, to be there before they are set.
            rtcSetGeometryTimeStepCount(geometry.0, 2);
            share_buffer::<Vec3>(device, &geometry, (vertex, 1), float3, &mesh.positions_close)?;
        }
        share_buffer::<Vec3>(device, &geometry, (vertex, 0), float3, &mesh.positions)?;
        share_buffer::<[u32; 3]>(device, &geometry, (index, 0), uint3, &mesh.triangles)?;
    }
    attach(device, scene, id, &geometry)
}

/// Attaches an instance of `prototype`, which has been committed, to `scene`, where `id` is free.
pub(super) fn attach_instance(
    device: &Device,
    scene: &SceneHandle,
    id: u32,
    prototype: &SceneHandle,
    placement: &Placement,
) -> Result<(), EmbreeError> {
    // SAFETY: the device is live; failure is reported through the error that is checked next.
    let geometry = unsafe { rtcNewGeometry(device.handle(), RTCGeometryType::RTC_GEOMETRY_TYPE_INSTANCE) };
    let geometry = GeometryHandle(geometry);
    device.check("creating an instance")?;
    let steps = placement.steps();
    // SAFETY: both are live, and of the same device; Embree's rtcSetGeometryInstancedScene keeps a reference to the scene.
    // The builder allows no more steps than Embree, so that they fit 32 bits.
    unsafe {
        rtcSetGeometryInstancedScene(geometry.0, prototype.0);
        rtcSetGeometryTimeStepCount(geometry.0, steps.len() as u32);
    }
    for (step, placement) in (0..).zip(steps) {
        let columns = placement.to_cols_array();
        let format = RTCFormat::RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR;
        // SAFETY: the geometry is live and has this step. The pointer is to twelve floats, column by column, as the format
        // says; Embree copies them.
        unsafe { rtcSetGeometryTransform(geometry.0, step, format, columns.as_ptr().cast()) };
    }
    device.check("placing an instance")?;
    attach(device, scene, id, &geometry)
}

/// Commits `geometry` and attaches it to `scene`, where `id` is free.
fn attach(device: &Device, scene: &SceneHandle, id: u32, geometry: &GeometryHandle) -> Result<(), EmbreeError> {
    // SAFETY: geometry and scene are live and known to this thread alone. Embree reports an id that is not free as an error.
    unsafe {
        rtcCommitGeometry(geometry.0);
        rtcAttachGeometryByID(scene.0, geometry.0, id);
    }
    device.check("attaching a geometry")
}

/// Lets `geometry` read `items` where they are, as its buffer of a kind and in a slot of it.
///
/// # Safety
/// `T` begins with what `format` says, and takes 16 bytes where Embree loads it as a vertex. `items` stays where and as it is
/// for as long as the geometry is part of a scene.
unsafe fn share_buffer<T>(
    device: &Device,
    geometry: &GeometryHandle,
    (kind, slot): (RTCBufferType, u32),
    format: RTCFormat,
    items: &[T],
) -> Result<(), EmbreeError> {
    // SAFETY: the geometry is live. Embree asks for a pointer and a stride that are multiples of 4, for items that stay
    // while they are in use, and for a last vertex that can be loaded by 16 bytes; it only reads.
    unsafe {
        rtcSetSharedGeometryBuffer(
            geometry.0,
            kind,
            slot,
            format,
            items.as_ptr().cast(),
            0,
            size_of::<T>(),
            items.len(),
        );
    }
    device.check("sharing a buffer")
}

// What attach takes for granted.
const _: () = assert!(size_of::<Vec3>() == 16 && size_of::<[u32; 3]>() == 12);

/// The words of an `RTCRay`, sixteen bytes at a time.
///
/// Embree loads a ray in 16-byte words. Stored in such words, it is forwarded from the store buffer; field by field it
/// would have to reach the cache first, at every query.
#[repr(C, align(16))]
struct RayWords {
    origin_tnear: Vec4,
    direction_time: Vec4,
    tfar_mask_id_flags: Vec4,
}

const _: () = assert!(size_of::<RayWords>() == size_of::<RTCRay>());

/// Embree's interval for the ray's open one. Embree's holds its ends: they move in by one float. A surface on which a ray starts, at t = 0, is not in the interval
/// either.
#[inline(always)]
pub(super) fn interval(ray: &Ray) -> (f32, f32) {
    const ABOVE_ZERO: f32 = f32::from_bits(f32::MIN_POSITIVE.to_bits() - 1);
    // Of positive floats the next one has the next bits; that before infinity is the largest.
    let near = f32::from_bits(ray.t_min.max(ABOVE_ZERO).to_bits() + 1);
    let far = f32::from_bits(ray.t_max.max(f32::MIN_POSITIVE).to_bits() - 1);
    (near, far)
}

/// An Embree ray for `ray`: all masks, no id and no flags.
#[inline(always)]
fn to_embree(ray: &Ray) -> RTCRay {
    let (near, far) = interval(ray);
    let words = RayWords {
        origin_tnear: ray.origin.extend(near),
        direction_time: ray.direction.extend(ray.time),
        tfar_mask_id_flags: Vec4::new(far, f32::from_bits(u32::MAX), 0.0, 0.0),
    };
    // SAFETY: both types are twelve 4-byte words in the order that embree4-sys asserts for RTCRay, of the same size and
    // alignment, and every bit pattern is a value of their fields.
    unsafe { std::mem::transmute::<RayWords, RTCRay>(words) }
}

impl Dispatch for EmbreeAccel<'_> {
    const IS_DYNAMIC: bool = false;
}

impl Accel for EmbreeAccel<'_> {
    fn intersect(&self, ray: &Ray) -> Option<Hit> {
        // SAFETY: RTCHit is a C structure of numbers, and all zeros is a value of it. Zeroing covers fields that only
        // some builds of Embree have.
        let mut hit: RTCHit = unsafe { std::mem::zeroed() };
        hit.geomID = RTC_INVALID_GEOMETRY_ID;
        let mut query = RTCRayHit {
            ray: to_embree(ray),
            hit,
        };
        // SAFETY: the scene is live and committed. `query` is of the layout the headers give, aligned to 16 bytes by its
        // type, and this thread's own. Null arguments mean the defaults.
        unsafe { rtcIntersect1(self.scene.0, &mut query, ptr::null_mut()) };
        if query.hit.geomID == RTC_INVALID_GEOMETRY_ID {
            return None;
        }
        let (geom, inst) = self.ids(query.hit.geomID, query.hit.instID[0]);
        let hit = Hit {
            t: query.ray.tfar,
            b1: query.hit.u,
            b2: query.hit.v,
            prim: PrimId(query.hit.primID),
            geom,
            inst,
        };
        Some(self.with_barycentrics(ray, hit))
    }

    fn intersect_coherent(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        super::packet::intersect_coherent(self, rays, hits);
    }

    fn occluded_coherent(&self, rays: &[Ray], occluded: &mut [bool]) {
        super::packet::occluded_coherent(self, rays, occluded);
    }

    fn occluded(&self, ray: &Ray) -> bool {
        let mut query = to_embree(ray);
        // SAFETY: as for rtcIntersect1, with an RTCRay.
        unsafe { rtcOccluded1(self.scene.0, &mut query, ptr::null_mut()) };
        // Embree sets tfar to minus infinity where something was hit.
        query.tfar == f32::NEG_INFINITY
    }

    fn info(&self) -> BackendInfo {
        BackendInfo {
            name: super::NAME,
            version: self.device.version(),
            isa: self.device.isa(),
        }
    }

    fn bytes(&self) -> u64 {
        self.device.bytes()
    }
}
