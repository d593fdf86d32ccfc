//! The BSDF of a material, on arrays of directions.

use crate::errors;
use crate::job::on_thread;
use crate::scene::{Description, Rows};
use embrasure::Error;
use embrasure::bsdf::TransportMode;
use embrasure::cli::Request;
use embrasure::math::{Vec2, Vec3};
use embrasure::scene::SceneBuilder;
use embrasure::scene_file::load_scene;
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Arrays of the properties of sampled directions: one array for each property.
type Samples<'py> = (
    Bound<'py, PyArray2<f32>>,
    Bound<'py, PyArray2<f32>>,
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyArray2<f32>>,
    Bound<'py, PyArray1<bool>>,
);

/// Arrays of BSDF values and of densities.
type ValuesAndDensities<'py> = (Bound<'py, PyArray2<f32>>, Bound<'py, PyArray1<f32>>);

/// Scattering at a surface, in its local frame.
#[pyclass(frozen, module = "embrasure._native")]
pub struct Bsdf(embrasure::bsdf::Bsdf);

#[pymethods]
impl Bsdf {
    /// Makes the BSDF of the material `name` of a scene. Faces of the scene must use the material.
    /// `flags` may change materials.
    #[new]
    fn new(py: Python, scene: &Description, flags: Vec<String>, name: &str) -> PyResult<Self> {
        let request = Request::new(&scene.0, &flags).map_err(|error| errors::of_session(py, error))?;
        let name = name.to_owned();
        on_thread(py, move || {
            let scene = load_scene(&request.scene, SceneBuilder::new())?.scene;
            let materials = scene.materials();
            let found = materials.iter().find(|material| material.name == name);
            found.map(|material| Self(material.bsdf())).ok_or_else(|| {
                let names: Vec<&str> = materials.iter().map(|material| material.name.as_str()).collect();
                let words = format!(
                    "no face uses the material {name}\n  help: use one of {}",
                    names.join(", ")
                );
                Error::Refused(words)
            })
        })
    }

    /// Name and parameters of each lobe.
    #[getter]
    fn lobes(&self) -> Vec<(String, String)> {
        let words = |lobe: &embrasure::bsdf::Lobe| (lobe.name().to_string(), lobe.parameters());
        self.0.lobes().map(words).collect()
    }

    /// Fraction of light that is scattered under uniform illumination.
    #[getter]
    fn albedo(&self) -> (f32, f32, f32) {
        self.0.albedo().to_array().into()
    }

    /// Returns true if all lobes are delta lobes.
    #[getter]
    fn is_delta(&self) -> bool {
        self.0.is_delta()
    }

    /// Pickling is not supported: raises an error with help.
    fn __reduce__(&self) -> PyResult<()> {
        Err(errors::no_pickle("Bsdf", "make it in the other process"))
    }

    /// Returns BSDF values and densities for pairs of directions.
    fn eval_pdf<'py>(
        &self,
        py: Python<'py>,
        wo: PyReadonlyArray2<f32>,
        wi: PyReadonlyArray2<f32>,
    ) -> PyResult<ValuesAndDensities<'py>> {
        let (wo, wi) = (Rows::<f32, 3>::new("wo", &wo)?, Rows::<f32, 3>::new("wi", &wi)?);
        if wo.len() != wi.len() {
            return Err(PyValueError::new_err(
                "wo and wi: arrays of the same length are expected",
            ));
        }
        let (values, densities): (Vec<_>, Vec<_>) = py.detach(|| {
            let pairs = wo.iter().zip(wi.iter());
            let pairs = pairs.map(|(wo, wi)| self.0.eval_pdf(wo.into(), wi.into()));
            pairs.map(|(f, pdf)| (f.to_array(), pdf)).unzip()
        });
        Ok((colors(py, &values)?, PyArray1::from_vec(py, densities)))
    }

    /// For each `wo`, samples a direction `wi` with three numbers of `u`. Returns the directions,
    /// BSDF values, densities and weights, and true for delta lobes. All are 0 if nothing is
    /// scattered.
    fn sample<'py>(
        &self,
        py: Python<'py>,
        wo: PyReadonlyArray2<f32>,
        u: PyReadonlyArray2<f32>,
    ) -> PyResult<Samples<'py>> {
        let (wo, u) = (Rows::<f32, 3>::new("wo", &wo)?, Rows::<f32, 3>::new("u", &u)?);
        if wo.len() != u.len() {
            return Err(PyValueError::new_err(
                "wo and u: arrays of the same length are expected",
            ));
        }
        let samples: Vec<_> = py.detach(|| {
            let draw = |(wo, [u_lobe, u, v]): ([f32; 3], [f32; 3])| {
                self.0
                    .sample(Vec3::from(wo), u_lobe, Vec2::new(u, v), TransportMode::Radiance)
            };
            wo.iter().zip(u.iter()).map(draw).collect()
        });
        let triple = |of: fn(&embrasure::bsdf::BsdfSample) -> [f32; 3]| -> Vec<[f32; 3]> {
            samples.iter().map(|s| s.as_ref().map_or([0.0; 3], of)).collect()
        };
        let densities = samples.iter().map(|s| s.as_ref().map_or(0.0, |s| s.pdf));
        let deltas = samples.iter().map(|s| s.as_ref().is_some_and(|s| s.is_delta()));
        Ok((
            colors(py, &triple(|s| s.wi.to_array()))?,
            colors(py, &triple(|s| s.f.to_array()))?,
            PyArray1::from_vec(py, densities.collect()),
            colors(py, &triple(|s| s.weight.to_array()))?,
            PyArray1::from_vec(py, deltas.collect()),
        ))
    }
}

fn colors<'py>(py: Python<'py>, values: &[[f32; 3]]) -> PyResult<Bound<'py, PyArray2<f32>>> {
    PyArray1::from_slice(py, values.as_flattened()).reshape([values.len(), 3])
}
