//! Scene descriptions: a scene file or a scene made in code, with changed keys, and with meshes
//! from arrays.

use crate::errors;
use embrasure::SceneFile;
use embrasure::cli::Request;
use embrasure::math::{Vec2, Vec3};
use embrasure::scene_file::MadeObject;
use numpy::{PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::path::PathBuf;
use std::sync::Arc;

/// A mesh whose triangles come from arrays.
#[pyclass(frozen, module = "embrasure._native")]
pub struct Mesh(Arc<embrasure::geometry::Mesh>);

#[pymethods]
impl Mesh {
    #[new]
    #[pyo3(signature = (vertices, faces, normals=None, uv=None))]
    fn new(
        vertices: PyReadonlyArray2<f32>,
        faces: PyReadonlyArray2<u32>,
        normals: Option<PyReadonlyArray2<f32>>,
        uv: Option<PyReadonlyArray2<f32>>,
    ) -> PyResult<Self> {
        let positions = rows("vertices", &vertices)?.into_iter().map(Vec3::from_array).collect();
        let normals = normals.map(|normals| rows("normals", &normals)).transpose()?;
        let uvs = uv.map(|uv| rows("uv", &uv)).transpose()?;
        Ok(Self(Arc::new(embrasure::geometry::Mesh {
            positions,
            triangles: rows("faces", &faces)?,
            normals: normals.unwrap_or_default().into_iter().map(Vec3::from_array).collect(),
            uvs: uvs.unwrap_or_default().into_iter().map(Vec2::from_array).collect(),
            ..Default::default()
        })))
    }

    /// Pickling is not supported: raises an error with help.
    fn __reduce__(&self) -> PyResult<()> {
        Err(errors::no_pickle(
            "Scene",
            "load() its file, or make it anew, in the other process",
        ))
    }
}

/// Rows of an array with `N` columns. `name` is the name of the array in errors.
fn rows<T: numpy::Element + Copy, const N: usize>(name: &str, array: &PyReadonlyArray2<T>) -> PyResult<Vec<[T; N]>> {
    Ok(Rows::new(name, array)?.iter().collect())
}

/// Rows of an array with `N` columns, which is stored in row-major order.
#[derive(Clone, Copy)]
pub struct Rows<'a, T, const N: usize>(&'a [T]);

impl<'a, T: numpy::Element + Copy, const N: usize> Rows<'a, T, N> {
    /// Rows of `array`. `name` is the name of the array in errors.
    pub fn new(name: &str, array: &'a PyReadonlyArray2<T>) -> PyResult<Self> {
        let columns = array.shape()[1];
        if columns != N {
            let words = format!("{name}: rows of {N} numbers are expected, not of {columns}");
            return Err(PyValueError::new_err(words));
        }
        let in_order = || format!("{name}: an array in row-major order is expected, as numpy.ascontiguousarray makes");
        let numbers = array.as_slice();
        numbers.map(Self).map_err(|_| PyValueError::new_err(in_order()))
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.0.len() / N
    }

    /// Row `i`, which must be in range.
    pub fn row(&self, i: usize) -> [T; N] {
        let start = i * N;
        std::array::from_fn(|column| self.0[start + column])
    }

    /// All rows.
    pub fn iter(self) -> impl Iterator<Item = [T; N]> + use<'a, T, N> {
        (0..self.len()).map(move |i| self.row(i))
    }
}

/// A scene description before its files are read.
#[pyclass(frozen, module = "embrasure._native")]
pub struct Description(pub SceneFile);

#[pymethods]
impl Description {
    /// Reads a scene file, or makes the scene of an OBJ file, with changed keys.
    #[staticmethod]
    fn load(py: Python, path: PathBuf, keys: Vec<String>) -> PyResult<Self> {
        let file = Request::scene_file(&path, &keys);
        file.map(Self).map_err(|error| errors::of_file(py, &error))
    }

    /// Makes a scene without objects.
    #[staticmethod]
    fn in_code(py: Python) -> PyResult<Self> {
        SceneFile::in_code(&[])
            .map(Self)
            .map_err(|error| errors::of_file(py, &error))
    }

    /// Copy of this scene with the keys `keys` and the meshes `meshes`. `meshes` has the name of
    /// each mesh, the mesh, and the name of its material.
    #[pyo3(signature = (keys, meshes))]
    fn with_parts(
        &self,
        py: Python,
        keys: Vec<String>,
        meshes: Vec<(String, Py<Mesh>, Option<String>)>,
    ) -> PyResult<Self> {
        let mut file = self.0.with_keys(&keys).map_err(|error| errors::of_file(py, &error))?;
        let made = meshes.into_iter().map(|(name, mesh, material)| MadeObject {
            name,
            mesh: mesh.get().0.clone(),
            material,
        });
        file.made = made.collect();
        Ok(Self(file))
    }

    /// Checks flags for a render.
    fn check(&self, py: Python, flags: Vec<String>) -> PyResult<()> {
        let checked = Request::new(&self.0, &flags).and_then(|request| request.settings.check());
        checked.map_err(|error| errors::of_session(py, error))
    }

    /// Number of lights in the description.
    #[getter]
    fn light_count(&self) -> usize {
        self.0.light.len()
    }

    /// Pickling is not supported: raises an error with help.
    fn __reduce__(&self) -> PyResult<()> {
        Err(errors::no_pickle(
            "Scene",
            "load() its file, or make it anew, in the other process",
        ))
    }
}
