//! Integrators behind dynamic dispatch, with one call for a group of samples: passes over tiles are compiled once, and an integrator as often as
//! this module says.

use super::pixel_sample::PixelSample;
use crate::color::Spectrum;
use crate::integrator::{ByGroup, ByPath, Gathered, Integrator, Sink};
use crate::sampler::{SampleKey, Sampler};

/// A sink behind dynamic dispatch.
pub type DynSink<'s, R> = &'s mut (dyn Sink<Radiance = R> + 's);

/// An integrator as passes over tiles call it.
pub trait SampleIntegrator<S>: Sync {
    /// Pixels of a tile whose samples are traced together ([`Integrator::pixels_at_once`]).
    fn pixels_at_once(&self) -> usize;

    /// Traces samples ([`Integrator::samples`]).
    fn samples(&self, keys: &[SampleKey], sampler: &mut S, out: &mut [PixelSample<Spectrum>]);

    /// Traces samples and tells groups of lights apart.
    fn samples_by_group(&self, keys: &[SampleKey], sampler: &mut S, out: &mut [PixelSample<ByGroup>]);

    /// Traces samples and separates light paths.
    fn samples_by_path(&self, keys: &[SampleKey], sampler: &mut S, out: &mut [PixelSample<ByPath>]);

    /// Traces samples into any sinks.
    fn samples_into(&self, keys: &[SampleKey], sampler: &mut S, out: &mut [DynSink<Spectrum>]);
}

/// An integrator that is compiled for sinks behind dynamic dispatch alone.
impl<I: Integrator, S: Sampler> SampleIntegrator<S> for I {
    fn pixels_at_once(&self) -> usize {
        Integrator::pixels_at_once(self)
    }

    fn samples(&self, keys: &[SampleKey], sampler: &mut S, out: &mut [PixelSample<Spectrum>]) {
        trace(self, keys, sampler, out);
    }

    fn samples_by_group(&self, keys: &[SampleKey], sampler: &mut S, out: &mut [PixelSample<ByGroup>]) {
        trace(self, keys, sampler, out);
    }

    fn samples_by_path(&self, keys: &[SampleKey], sampler: &mut S, out: &mut [PixelSample<ByPath>]) {
        trace(self, keys, sampler, out);
    }

    fn samples_into(&self, keys: &[SampleKey], sampler: &mut S, out: &mut [DynSink<Spectrum>]) {
        Integrator::samples(self, keys, sampler, out);
    }
}

/// Traces samples by dynamic dispatch for what they find.
fn trace<R: Gathered, S: Sampler>(
    integrator: &impl Integrator,
    keys: &[SampleKey],
    sampler: &mut S,
    out: &mut [PixelSample<R>],
) {
    let mut sinks: Vec<DynSink<R>> = out.iter_mut().map(|sample| sample as DynSink<R>).collect();
    integrator.samples(keys, sampler, &mut sinks);
}

/// An integrator that is compiled for the picture's own samples too: `fast`, the same as `any` but for how it reaches the backend.
#[derive(Debug)]
pub struct Monomorphic<I, J> {
    /// Traces samples of pictures without light groups.
    pub fast: I,
    /// Traces all others.
    pub any: J,
}

impl<I: Integrator, J: Integrator, S: Sampler> SampleIntegrator<S> for Monomorphic<I, J> {
    fn pixels_at_once(&self) -> usize {
        Integrator::pixels_at_once(&self.fast)
    }

    fn samples(&self, keys: &[SampleKey], sampler: &mut S, out: &mut [PixelSample<Spectrum>]) {
        Integrator::samples(&self.fast, keys, sampler, out);
    }

    fn samples_by_group(&self, keys: &[SampleKey], sampler: &mut S, out: &mut [PixelSample<ByGroup>]) {
        trace(&self.any, keys, sampler, out);
    }

    fn samples_by_path(&self, keys: &[SampleKey], sampler: &mut S, out: &mut [PixelSample<ByPath>]) {
        trace(&self.any, keys, sampler, out);
    }

    fn samples_into(&self, keys: &[SampleKey], sampler: &mut S, out: &mut [DynSink<Spectrum>]) {
        Integrator::samples(&self.any, keys, sampler, out);
    }
}
