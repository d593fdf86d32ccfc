//! Points of the samplers.

use crate::errors::SettingError;
use embrasure::files::{MemoryLimit, in_words};
use embrasure::sampler::{Bounce, Dimension, SampleKey, Sampler, SamplerKind};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::exceptions::PyMemoryError;
use pyo3::prelude::*;

/// Number of values between two checks for signals.
const BATCH: u32 = 1 << 22;

/// Decision `index` of a path. Each decision uses two numbers. The order of decisions is: pixel,
/// lens, then at each vertex the choice of a light, the point on the light, and the direction.
fn decision(index: u32) -> Dimension {
    const AT_A_VERTEX: [Bounce; 3] = [Bounce::Decisions, Bounce::LightPoint, Bounce::Direction];
    match index {
        0 => Dimension::PIXEL,
        1 => Dimension::LENS,
        _ => Dimension::bounce((index - 2) / 3, AT_A_VERTEX[(index as usize - 2) % 3]),
    }
}

/// An empty vector with capacity for `count` × `dims` numbers, or an error if the free memory is
/// too small. The allocator alone may accept more, and the system would then kill Python when the
/// numbers are written.
fn reserved(count: u32, dims: u32) -> PyResult<Vec<f32>> {
    let numbers = (count as usize).saturating_mul(dims as usize);
    let bytes = (numbers as u64).saturating_mul(size_of::<f32>() as u64);
    let left = MemoryLimit::left_by_system();
    let mut values = Vec::new();
    if left.is_none_or(|left| bytes <= left) && values.try_reserve_exact(numbers).is_ok() {
        return Ok(values);
    }
    let left = left.map_or(String::new(), |left| format!(", {} are free", in_words(left)));
    Err(PyMemoryError::new_err(format!(
        "points: {count} × {dims} numbers do not fit into memory: they take {}{left}",
        in_words(bytes)
    )))
}

/// Numbers from the sampler `name` for the samples 0 to `count` − 1 of a pixel. Each sample has
/// `dims` numbers.
#[pyfunction]
pub fn points<'py>(
    py: Python<'py>,
    name: &str,
    count: u32,
    dims: u32,
    seed: u64,
    pixel: (u32, u32),
) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let found = SamplerKind::NAMES.iter().find(|(known, _)| *known == name);
    let Some((_, kind)) = found else {
        let names: Vec<&str> = SamplerKind::NAMES.iter().map(|(name, _)| *name).collect();
        let words = format!(
            "sampler {name}: no such sampler\n  help: choose among {}",
            names.join(", ")
        );
        return Err(SettingError::new_err(words));
    };
    let mut values = reserved(count, dims)?;
    let mut sampler = kind.with_seed(seed, count.max(1));
    let samples = (BATCH / dims.max(1)).max(1);
    for start in (0..count).step_by(samples as usize) {
        py.detach(|| {
            for sample in start..count.min(start.saturating_add(samples)) {
                sampler.start(SampleKey::new(pixel.0, pixel.1, sample));
                let numbers = (0..dims.div_ceil(2)).flat_map(|index| sampler.get_2d(decision(index)).to_array());
                values.extend(numbers.take(dims as usize));
            }
        });
        py.check_signals()?;
    }
    PyArray1::from_vec(py, values).reshape([count as usize, dims as usize])
}
