//! Integrators behind dynamic dispatch, with one call for a group of samples. Passes over tiles are
//! compiled once. This module decides how often an integrator is compiled.

use super::pixel_sample::PixelSample;
use crate::integrator::{Integrator, Sink};
use crate::sampler::{SampleKey, Sampler};

/// A sink behind dynamic dispatch.
pub type DynSink<'s> = &'s mut (dyn Sink + 's);

/// An integrator, as called by passes over tiles.
pub trait SampleIntegrator<S>: Sync {
    /// Pixels of a tile whose samples are traced together ([`Integrator::pixels_at_once`]).
    fn pixels_at_once(&self) -> usize;

    /// Traces samples of an image ([`Integrator::samples`]).
    fn samples(&self, keys: &[SampleKey], sampler: &mut S, out: &mut [PixelSample]);

    /// Traces samples into any sinks.
    fn samples_into(&self, keys: &[SampleKey], sampler: &mut S, out: &mut [DynSink]);
}

/// An integrator that is compiled only for sinks behind dynamic dispatch.
impl<I: Integrator, S: Sampler> SampleIntegrator<S> for I {
    fn pixels_at_once(&self) -> usize {
        Integrator::pixels_at_once(self)
    }

    fn samples(&self, keys: &[SampleKey], sampler: &mut S, out: &mut [PixelSample]) {
        let mut sinks: Vec<DynSink> = out.iter_mut().map(|sample| sample as DynSink).collect();
        Integrator::samples(self, keys, sampler, &mut sinks);
    }

    fn samples_into(&self, keys: &[SampleKey], sampler: &mut S, out: &mut [DynSink]) {
        Integrator::samples(self, keys, sampler, out);
    }
}

/// An integrator that is compiled for [`PixelSample`] too. `fast` equals `any`, except for its
/// access to the backend.
#[derive(Debug)]
pub struct Monomorphic<I, J> {
    /// Traces samples of images without parts of the light.
    pub fast: I,
    /// Traces all other samples.
    pub any: J,
}

impl<I: Integrator, J: Integrator, S: Sampler> SampleIntegrator<S> for Monomorphic<I, J> {
    fn pixels_at_once(&self) -> usize {
        Integrator::pixels_at_once(&self.fast)
    }

    fn samples(&self, keys: &[SampleKey], sampler: &mut S, out: &mut [PixelSample]) {
        Integrator::samples(&self.fast, keys, sampler, out);
    }

    fn samples_into(&self, keys: &[SampleKey], sampler: &mut S, out: &mut [DynSink]) {
        Integrator::samples(&self.any, keys, sampler, out);
    }
}
