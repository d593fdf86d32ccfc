use super::*;
use crate::film::FilterKind;
use crate::sampler::SamplerKind;
use std::sync::atomic::{AtomicU64, Ordering};

/// Integrator that counts its samples.
struct CountingIntegrator(AtomicU64);

impl IterationIntegrator for &CountingIntegrator {
    type PreparationPart = ();
    type Preparation = ();

    fn preparations(&self) -> u32 {
        0
    }

    fn prepare<S: Sampler>(&self, _: u32, _: u32, _: &mut S, _: &mut impl RaySink) {}

    fn join(&self, _: u32, _: Vec<()>) {}

    fn sends_light(&self) -> bool {
        false
    }

    fn sample<S: Sampler>(&self, _: &(), key: SampleKey, sampler: &mut S, out: &mut impl SplatSink) {
        self.0.fetch_add(1, Ordering::Relaxed);
        sampler.start(key);
        out.radiance(Spectrum::splat(sampler.get_1d(crate::sampler::Dimension::PIXEL)));
    }
}

/// Observer that stops the render after `stop` samples, or pauses it after `pause` samples.
struct StoppingObserver<'a> {
    counting: &'a CountingIntegrator,
    stop: u64,
    pause: u64,
}

impl Observer for StoppingObserver<'_> {
    fn progress(&self, _: u64) {}

    fn should_stop(&self) -> bool {
        self.counting.0.load(Ordering::Relaxed) >= self.stop
    }

    fn should_pause(&self) -> bool {
        self.counting.0.load(Ordering::Relaxed) >= self.pause
    }
}

/// Renders iterations of 32 × 32 pixels until `film` has two iterations.
fn iterations(film: &mut Film, stop: u64, pause: u64) -> (Outcome, u64) {
    let counting = CountingIntegrator(AtomicU64::new(0));
    let observer = StoppingObserver {
        counting: &counting,
        stop,
        pause,
    };
    let numbers = (&SamplerKind::Independent.with_seed(1, 2), &Filter::BOX);
    let (outcome, _) = render_iterations(&&counting, numbers, film, StopCondition::at(2), &observer);
    (outcome, counting.0.into_inner())
}

/// A stop takes effect within work items, and discards the iteration. A pause waits for the end of
/// the iteration, even if it is requested many times.
#[test]
fn iterations_are_not_lost_by_pauses() {
    let new = || Film::new(UVec2::splat(32), Rect::full(UVec2::splat(32)));
    let mut stopped = new();
    let (outcome, samples) = iterations(&mut stopped, 100, u64::MAX);
    assert_eq!((outcome, stopped.samples()), (Outcome::Stopped, 0));
    // Each thread may complete its pixels before the next call of the observer.
    assert!(
        samples <= 100 + (PIXELS_BETWEEN_CHECKS * rayon::current_num_threads()) as u64,
        "{samples}"
    );

    let (mut whole, mut paused) = (new(), new());
    assert_eq!(iterations(&mut whole, u64::MAX, u64::MAX), (Outcome::Complete, 2048));
    assert_eq!(iterations(&mut paused, u64::MAX, 0), (Outcome::Stopped, 1024));
    assert_eq!(iterations(&mut paused, u64::MAX, 0), (Outcome::Complete, 1024));
    let light = |film: &Film| film.pixels().map(|(_, sums)| sums.mean(0)).collect::<Vec<_>>();
    assert_eq!(light(&paused), light(&whole));
}

/// Fewer work items are kept if their light takes much memory, but at least one work item per
/// thread.
#[test]
fn large_work_items_are_few() {
    let crop = Rect::full(UVec2::splat(512));
    let wide = Filter::new(FilterKind::Mitchell, 2.0);
    let usual = light_bytes(false, &Filter::BOX, crop);
    let large = light_bytes(true, &wide, crop);
    assert_eq!(work_items_at_once(usual, 2), WORK_ITEMS_AT_ONCE);
    let few = work_items_at_once(large, 2);
    assert!((2..WORK_ITEMS_AT_ONCE).contains(&few), "{few}");
    assert!(
        few * large * SAMPLES_OF_A_WORK_ITEM * LIGHTS_OF_A_SAMPLE <= BYTES_AT_ONCE,
        "{few}"
    );
    // Separate light groups take memory, so fewer work items are kept.
    assert!(few < work_items_at_once(light_bytes(false, &wide, crop), 2), "{few}");
    assert_eq!(work_items_at_once(large, 64), 64);
    // The filter reaches only pixels inside the image.
    let endless = light_bytes(true, &Filter::new(FilterKind::Gaussian, 1e30), crop);
    assert!(endless < 1 << 30, "{endless}");
}
