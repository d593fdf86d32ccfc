//! Integrators behind dynamic dispatch. One dynamic call traces a group of samples. The loops over
//! tiles are compiled only once, for all integrators. This module decides for which types of sinks
//! an integrator is compiled.

use super::pixel_sample::PixelSample;
use crate::integrator::{Integrator, Sink};
use crate::sampler::{SampleKey, Sampler};

/// A sink behind dynamic dispatch.
pub type DynSink<'s> = &'s mut (dyn Sink + 's);

/// An integrator behind dynamic dispatch, as the loops over tiles call it.
pub trait SampleIntegrator<S>: Sync {
    /// Number of pixels of a tile whose samples are traced together
    /// ([`Integrator::pixels_at_once`]).
    fn pixels_at_once(&self) -> usize;

    /// Traces the samples `keys` into sinks that do not separate the light into parts
    /// ([`Integrator::samples`]).
    fn samples(&self, keys: &[SampleKey], sampler: &mut S, out: &mut [PixelSample]);

    /// Traces the samples `keys` into sinks of any type.
    fn samples_into(&self, keys: &[SampleKey], sampler: &mut S, out: &mut [DynSink]);
}

/// Integrators that are compiled only for sinks behind dynamic dispatch.
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

/// An integrator that is compiled for [`PixelSample`] and for sinks behind dynamic dispatch. `fast`
/// and `any` compute the same samples, but `fast` calls the backend without dynamic dispatch.
#[derive(Debug)]
pub struct Monomorphic<I, J> {
    /// Integrator for images that do not separate the light into parts.
    pub fast: I,
    /// Integrator for all other images.
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
