//! Ray queries over a scene, on arrays.

use crate::errors;
use crate::job::{guarded, on_thread};
use crate::scene::{Description, Rows};
use embrasure::accel::Accel;
use embrasure::cli::Request;
use embrasure::geometry::{Hit, InstanceId, Mesh};
use embrasure::math::Ray;
use embrasure::scene::Scene;
use embrasure::{Error, SceneFile, Session};
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use rayon::prelude::*;
use std::sync::Arc;

/// Number of rays that are traced between two checks for signals.
const BATCH: usize = 1 << 20;

/// Number of rays that one task traces.
const TASK: usize = 1 << 12;

/// Index in results that means no triangle, mesh or instance.
const NONE: i32 = -1;

/// One array for each property of hits: t, prim, geom, inst, barycentrics, normal.
type Hits<'py> = (
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray1<i32>>,
    Bound<'py, PyArray1<i32>>,
    Bound<'py, PyArray1<i32>>,
    Bound<'py, PyArray2<f32>>,
    Bound<'py, PyArray2<f32>>,
);

/// A loaded scene with its acceleration structure.
#[pyclass(frozen, module = "embrasure._native")]
pub struct Rays {
    session: Arc<Session>,
    /// Id of the process that owns the threads of the session.
    process: u32,
    /// One entry for each mesh of the scene. Triangles without area are not in the scene. If a mesh
    /// from arrays has such triangles, its entry has the index in the array for each triangle of
    /// the scene. All other entries are `None`.
    kept: Vec<Option<Vec<u32>>>,
}

#[pymethods]
impl Rays {
    /// Reads the scene and builds its acceleration structure.
    #[new]
    fn new(py: Python, scene: &Description, flags: Vec<String>) -> PyResult<Self> {
        let request = Request::new(&scene.0, &flags).map_err(|error| errors::of_session(py, error))?;
        on_thread(py, move || Self::load(&request))
    }

    /// Numbers of triangles, meshes and instances.
    #[getter]
    fn counts(&self) -> (u64, usize, usize) {
        let scene = self.session.scene();
        (scene.triangle_count(), scene.meshes().len(), scene.instances().len())
    }

    /// Minimum and maximum corner of the box around all vertices.
    #[getter]
    fn bounds(&self) -> ([f32; 3], [f32; 3]) {
        let bounds = self.session.scene().bounds();
        (bounds.min.to_array(), bounds.max.to_array())
    }

    /// Names of the objects.
    #[getter]
    fn objects(&self) -> Vec<String> {
        self.session.scene().objects().to_vec()
    }

    /// Finds the closest hits of rays in the open interval from `t_min` to `t_max`. `t_max` has one
    /// value for all rays, or one value for each ray.
    fn intersect<'py>(
        &self,
        py: Python<'py>,
        origins: PyReadonlyArray2<f32>,
        directions: PyReadonlyArray2<f32>,
        t_min: f32,
        t_max: PyReadonlyArray1<f32>,
    ) -> PyResult<Hits<'py>> {
        let rays = RayArrays::new(&origins, &directions, t_min, &t_max)?;
        let count = rays.len();
        // Allocate with zeros: the system then provides each page at its first write, in the thread
        // that writes it
        let mut t = vec![0.0f32; count];
        let [mut prim, mut geom, mut inst] = [(); 3].map(|()| vec![0i32; count]);
        let [mut weights, mut normals] = [(); 2].map(|()| vec![[0.0f32; 3]; count]);
        self.in_batches(
            py,
            |accel, start, end| {
                let scene = self.session.scene();
                let ids = prim[start..end].par_chunks_mut(TASK);
                let ids = ids.zip(geom[start..end].par_chunks_mut(TASK));
                let ids = ids.zip(inst[start..end].par_chunks_mut(TASK));
                let places = t[start..end].par_chunks_mut(TASK);
                let places = places.zip(weights[start..end].par_chunks_mut(TASK));
                let places = places.zip(normals[start..end].par_chunks_mut(TASK));
                ids.zip(places).enumerate().for_each(|(task, (ids, places))| {
                    let (((prim, geom), inst), ((t, weights), normals)) = (ids, places);
                    for i in 0..t.len() {
                        let Some(hit) = accel.intersect(&rays.ray(start + task * TASK + i)) else {
                            (t[i], prim[i], geom[i], inst[i]) = (f32::INFINITY, NONE, NONE, NONE);
                            continue;
                        };
                        t[i] = hit.t;
                        (prim[i], geom[i]) = (self.triangle(&hit), hit.geom.0 as i32);
                        inst[i] = if hit.inst == InstanceId::NONE {
                            NONE
                        } else {
                            hit.inst.0 as i32
                        };
                        weights[i] = [1.0 - hit.b1 - hit.b2, hit.b1, hit.b2];
                        normals[i] = normal(scene, &hit);
                    }
                });
            },
            count,
        )?;
        let triples = |values: Vec<[f32; 3]>| PyArray1::from_vec(py, values.into_flattened()).reshape([count, 3]);
        Ok((
            PyArray1::from_vec(py, t),
            PyArray1::from_vec(py, prim),
            PyArray1::from_vec(py, geom),
            PyArray1::from_vec(py, inst),
            triples(weights)?,
            triples(normals)?,
        ))
    }

    /// Returns true for each ray that hits a surface.
    fn occluded<'py>(
        &self,
        py: Python<'py>,
        origins: PyReadonlyArray2<f32>,
        directions: PyReadonlyArray2<f32>,
        t_min: f32,
        t_max: PyReadonlyArray1<f32>,
    ) -> PyResult<Bound<'py, PyArray1<bool>>> {
        let rays = RayArrays::new(&origins, &directions, t_min, &t_max)?;
        let mut occluded = vec![false; rays.len()];
        let count = rays.len();
        self.in_batches(
            py,
            |accel, start, end| {
                let tasks = occluded[start..end].par_chunks_mut(TASK).enumerate();
                tasks.for_each(|(task, occluded)| {
                    for (i, occluded) in occluded.iter_mut().enumerate() {
                        *occluded = accel.occluded(&rays.ray(start + task * TASK + i));
                    }
                });
            },
            count,
        )?;
        Ok(PyArray1::from_vec(py, occluded))
    }
}

impl Rays {
    fn load(request: &Request) -> Result<Self, Error> {
        let mut session = Session::load(&request.scene, request.settings.clone(), &())?;
        session.keep_accel()?;
        let kept = kept_triangles(&request.scene, session.scene());
        Ok(Self {
            session: Arc::new(session),
            process: std::process::id(),
            kept,
        })
    }

    /// Index of the triangle that was hit, in the arrays of its mesh.
    fn triangle(&self, hit: &Hit) -> i32 {
        let kept = self.kept.get(hit.geom.0 as usize).and_then(Option::as_ref);
        let index = kept.and_then(|kept| kept.get(hit.prim.0 as usize));
        *index.unwrap_or(&hit.prim.0) as i32
    }

    /// Divides `count` rays into consecutive ranges, and calls `work` with each range in the
    /// threads of the session. Checks for signals between ranges.
    fn in_batches(
        &self,
        py: Python,
        mut work: impl FnMut(&dyn Accel, usize, usize) + Send,
        count: usize,
    ) -> PyResult<()> {
        let renderer = py
            .detach(|| self.session.renderer())
            .map_err(|error| errors::of_session(py, error))?;
        let accel = renderer.queries();
        for start in (0..count).step_by(BATCH) {
            py.check_signals()?;
            let done = py.detach(|| {
                guarded(|| {
                    self.session.install(|| work(accel, start, (start + BATCH).min(count)));
                    Ok(())
                })
            });
            done.map_err(|error| errors::of_session(py, error))?;
        }
        Ok(())
    }
}

impl Drop for Rays {
    /// Do not drop the session in a forked process. At the fork, a thread of the parent may have
    /// held a lock of Embree or of the pool, and no thread of this process would release the lock.
    fn drop(&mut self) {
        if self.process != std::process::id() {
            std::mem::forget(self.session.clone());
        }
    }
}

/// Rays whose origins, directions and intervals are in arrays.
struct RayArrays<'a> {
    origins: Rows<'a, f32, 3>,
    directions: Rows<'a, f32, 3>,
    t_min: f32,
    t_max: &'a [f32],
}

impl<'a> RayArrays<'a> {
    fn new(
        origins: &'a PyReadonlyArray2<f32>,
        directions: &'a PyReadonlyArray2<f32>,
        t_min: f32,
        t_max: &'a PyReadonlyArray1<f32>,
    ) -> PyResult<Self> {
        let (origins, directions) = (Rows::new("origins", origins)?, Rows::new("directions", directions)?);
        let t_max = t_max.as_slice()?;
        if directions.len() != origins.len() || (t_max.len() != 1 && t_max.len() != origins.len()) {
            let words = "origins, directions and t_max: arrays of the same length are expected";
            return Err(PyValueError::new_err(words));
        }
        Ok(Self {
            origins,
            directions,
            t_min,
            t_max,
        })
    }

    fn len(&self) -> usize {
        self.origins.len()
    }

    fn ray(&self, i: usize) -> Ray {
        Ray {
            t_min: self.t_min,
            t_max: if let [one] = self.t_max { *one } else { self.t_max[i] },
            ..Ray::new(self.origins.row(i).into(), self.directions.row(i).into())
        }
    }
}

/// Unit geometric normal of the triangle that was hit, according to its winding.
fn normal(scene: &Scene, hit: &Hit) -> [f32; 3] {
    let [a, b, c] = scene.corners(hit, 0.0);
    (b - a).cross(c - a).normalize_or_zero().to_array()
}

/// One entry for each mesh of `scene`. If the mesh has fewer triangles than its array, the entry
/// has the index in the array for each triangle. All other entries are `None`.
fn kept_triangles(file: &SceneFile, scene: &Scene) -> Vec<Option<Vec<u32>>> {
    let mut kept = vec![None; scene.meshes().len()];
    let mut geom = 0;
    for object in &file.made {
        // Meshes in which all triangles have no area are not in the scene: skip them
        let is_same = |mesh: &Mesh| mesh.positions == object.mesh.positions;
        let Some(found) = scene.meshes()[geom..].iter().position(is_same) else {
            continue;
        };
        let (mesh, all) = (&scene.meshes()[geom + found], &object.mesh.triangles);
        if mesh.triangles.len() < all.len() {
            // Equal triangles are either all kept or all left out, so we can use the first equal
            // triangle
            let mut indices = (0u32..).zip(all);
            let next = |triangle: &[u32; 3]| indices.find(|(_, other)| *other == triangle);
            kept[geom + found] = Some(mesh.triangles.iter().filter_map(next).map(|(i, _)| i).collect());
        }
        geom += found + 1;
    }
    kept
}
