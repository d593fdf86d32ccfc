//! Compares two pictures, like `embrasure compare --json`.

use crate::errors;
use crate::film::Film;
use crate::job::pooled;
use embrasure::Error;
use pyo3::prelude::*;
use std::path::Path;

/// Returns the errors of `image` compared to `reference`, as JSON.
#[pyfunction]
pub fn compare(py: Python, reference: &Film, image: &Film, significance: f64) -> PyResult<String> {
    let compared = py.detach(|| {
        pooled(|| {
            let names = ["reference", "image"];
            let picture = |film: &Film, name| {
                let words = format!("the {name} has no channels R, G and B\n  help: compare films with these channels");
                film.rendering().ok_or(Error::Refused(words))
            };
            let pictures = (picture(reference, names[0])?, picture(image, names[1])?);
            embrasure::cli::compared(names.map(Path::new).into(), pictures, significance)
        })
    });
    let json = compared.map_err(|error| errors::of_session(py, error))?;
    Ok(json.to_string())
}
