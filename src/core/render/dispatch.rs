//! Integrators behind dynamic dispatch, with one call for a group of samples: passes over tiles are compiled once, and an integrator as often as
//! this module says.

use super::pixel_sample::PixelSample;
use crate::integrator::{Integrator, Sink};
use crate::sampler::{SampleKey, Sampler};

/// A sink behind dynamic dispatch.
pub type DynSink<'s> = &'s mut (dyn Sink + 's);

/// An integrator as passes over tiles call it.
pub trait SampleIntegrator<S>: Sync {
    /// Pixels of a tile whose samples are traced together ([`Integrator::pixels_at_once`]).
    fn pixels_at_once(&self) -> usize;

    /// Traces samples of a picture ([`Integrator::samples`]).
    fn samples(&self, keys: &[SampleKey], sampler: &mut S, out: &mut [PixelSample]);

    /// Traces samples into any sinks.
    fn samples_into(&self, keys: &[SampleKey], sampler: &mut S, out: &mut [DynSink]);
}

/// An integrator that is compiled for sinks behind dynamic dispatch alone.
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

/// An integrator that is compiled for the picture's own samples too: `fast`, the same as `any` but for how it reaches the backend.
#[derive(Debug)]
pub struct Monomorphic<I, J> {
    /// Traces samples of pictures whose light has no parts.
    pub fast: I,
    /// Traces all others.
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
