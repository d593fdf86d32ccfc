//! Fills the irradiance cache before the first sample of a render.
//!
//! A cache that is filled while pixels are rendered depends on the order of the pixels. This cache
//! is filled before the first sample, from positions that depend only on the whole image, and does
//! not change afterwards. The cache is therefore the same for every number of threads, every crop
//! and every part of a render, and after every interruption.
//!
//! Passes trace camera rays through the centre of every 32nd, 16th, … pixel, then through random
//! points, and collect the first matte surfaces that no record covers. Records are made in batches
//! of 64. The records of a batch are made in parallel and do not depend on each other. Then they
//! are inserted into the cache in order. A record is discarded if an earlier record of the batch
//! covers its position, which wastes some 2 to 10 % of the records.
//!
//! A `Renderer` that is stopped while it fills the cache keeps the records. A checkpoint does not
//! store the records, because filling the cache again makes the same records.

use super::cancellation::CountedRays;
use super::observer::{Observer, Outcome};
use super::statistics::{RayCounts, Statistics};
use crate::accel::Accel;
use crate::film::FirstSurface;
use crate::integrator::{FoundLight, IrradianceCache, RayKind, RaySink, Record, RecordMaker, RecordSite, Sink};
use crate::math::hash::{GOLDEN_GAMMA, mix};
use crate::math::{UVec2, Vec2};
use crate::sampler::{Dimension, SampleKey, Sampler, Sobol};
use rayon::prelude::*;
use std::collections::VecDeque;
use std::sync::{Mutex, OnceLock, PoisonError};

/// The irradiance cache of an image. It is filled before the first sample, and constant from then
/// on.
///
/// The records depend on the scene, on the size and the camera of the whole image, and on the seed.
/// They do not depend on the number of threads, the crop, the samples or interruptions. So the
/// image is bit-identical for any of these.
#[derive(Debug)]
pub struct Irradiance {
    resolution: UVec2,
    seed: u64,
    /// State of the unfinished cache, if filling was interrupted.
    filling: Mutex<Option<PartialCache>>,
    full: OnceLock<IrradianceCache>,
}

impl Irradiance {
    /// Empty cache for an image of `resolution` pixels.
    pub fn new(resolution: UVec2, seed: u64) -> Self {
        Self {
            resolution,
            seed,
            filling: Mutex::new(None),
            full: OnceLock::new(),
        }
    }

    /// Approximate maximum number of records for an image of `resolution` pixels.
    pub fn max_records(resolution: UVec2) -> u64 {
        let pixels = u64::from(resolution.x) * u64::from(resolution.y);
        (pixels / PIXELS_OF_A_RECORD).max(FEW_RECORDS)
    }

    /// Returns the cache, or `None` if filling is not complete.
    pub fn cache(&self) -> Option<&IrradianceCache> {
        self.full.get()
    }

    /// Fills the cache with records that `maker` makes, unless it is full. `error` is the maximum
    /// relative error at which a record is used. If `observer` stops, the state is kept, and the
    /// next call continues.
    ///
    /// The cache stays empty if the scene moves while the shutter is open, because a record is
    /// valid only for one time.
    pub fn fill<A: Accel>(
        &self,
        maker: &RecordMaker<A>,
        error: f32,
        observer: &impl Observer,
    ) -> (Outcome, Statistics) {
        if self.full.get().is_some() {
            return (Outcome::Complete, Statistics::default());
        }
        // Move the state out instead of holding the lock, because a thread that waits for other
        // threads may start a second render meanwhile. That render begins with an empty state, and
        // makes the same records.
        let filling = || self.filling.lock().unwrap_or_else(PoisonError::into_inner);
        let begun = filling().take();
        let mut begun = begun.unwrap_or_else(|| PartialCache::new(maker, error, self.resolution, self.seed));
        let (outcome, statistics) = begun.advance(maker, observer);
        match outcome {
            Outcome::Stopped => *filling() = Some(begun),
            // If two calls fill the cache, all callers use the first result.
            Outcome::Complete => drop(self.full.set(begun.cache)),
        }
        (outcome, statistics)
    }
}

/// Distances between the pixels of the first passes, in pixels. Each pass skips the pixels of
/// earlier passes, except the last pass, which visits all pixels.
const STEPS: [u32; 6] = [32, 16, 8, 4, 2, 1];

/// Number of passes with a random point in every pixel and on the lens. These passes find other
/// paths through glass, and surfaces between pixel centres.
const RANDOM_PASSES: u32 = 2;

/// Number of pixels that are traced before records are made for their surfaces.
const CHUNK: u64 = 4096;

/// Number of records of a batch, which are made independently of each other. It is constant,
/// because records must not depend on threads.
const BATCH: usize = 64;

/// Minimum number of pixels per record. If a scene needs more records, such as one with many
/// leaves, path tracing is faster.
const PIXELS_OF_A_RECORD: u64 = 8;

/// Number of records that are allowed for every image, even the smallest.
const FEW_RECORDS: u64 = 1 << 14;

/// State of a cache while it is being filled.
#[derive(Debug)]
struct PartialCache {
    cache: IrradianceCache,
    seed: u64,
    max_records: u64,
    /// Passes that are not complete.
    passes: VecDeque<Pass>,
    /// Sites that may need a record.
    found: VecDeque<RecordSite>,
    /// Records of the current batch.
    batch: Vec<RecordInProgress>,
}

/// A pass over some of the pixels of the image.
#[derive(Debug)]
struct Pass {
    /// Number of the pass. It selects the random numbers of the pass.
    number: u32,
    /// True if the pass uses random points, false if pixel centres.
    is_random: bool,
    /// First column and row of the pass, and distance from one column or row to the next.
    first: u32,
    step: u32,
    /// Number of columns.
    columns: u64,
    /// Number of pixels of the pass, and number of pixels traced so far.
    count: u64,
    next: u64,
    /// Step from the index of one traced pixel to the index of the next. It has no common factor
    /// with `count`, so that the pass visits all pixels. Consecutive pixels are far apart.
    stride: u64,
}

/// A record of the current batch. `record` is `None` until the record is computed, and `Some(None)`
/// if no record can be made.
#[derive(Debug)]
struct RecordInProgress {
    place: RecordSite,
    record: Option<Option<Record>>,
}

impl PartialCache {
    /// State of an empty cache, before the first pass.
    fn new<A: Accel>(maker: &RecordMaker<A>, error: f32, resolution: UVec2, seed: u64) -> Self {
        let world = &maker.path.world;
        Self {
            cache: IrradianceCache::new(error, world.scene.bounds()),
            passes: if world.is_still() {
                passes(resolution)
            } else {
                VecDeque::new()
            },
            seed,
            max_records: Irradiance::max_records(resolution),
            found: VecDeque::new(),
            batch: Vec::new(),
        }
    }

    /// Fills the cache until all passes are complete or `observer` stops.
    fn advance<A: Accel>(&mut self, maker: &RecordMaker<A>, observer: &impl Observer) -> (Outcome, Statistics) {
        let mut statistics = Statistics::default();
        loop {
            // Make the records of the batch in parallel. Then insert them in order, except records
            // that an earlier record covers.
            let seed = self.seed;
            let made = self
                .batch
                .par_iter_mut()
                .with_max_len(1)
                .map(|making| making.make(maker, seed, observer));
            statistics = statistics.merge(made.reduce(Statistics::default, Statistics::merge));
            if self.batch.iter().any(|making| making.record.is_none()) {
                return (Outcome::Stopped, statistics);
            }
            for RecordInProgress { place, record } in self.batch.drain(..) {
                let layer = maker.layer(&place);
                if let Some(record) = record
                    .flatten()
                    .filter(|_| !self.cache.covers(place.p(), place.n(), layer))
                {
                    self.cache.insert(record, layer);
                }
            }
            observer.prepared(self.cache.len() as u64);
            if self.cache.len() as u64 >= self.max_records {
                return (Outcome::Complete, statistics);
            }

            // Collect the next sites that no record covers.
            while let Some(place) = self.found.pop_front() {
                if !self.cache.covers(place.p(), place.n(), maker.layer(&place)) {
                    self.batch.push(RecordInProgress { place, record: None });
                }
                if self.batch.len() == BATCH {
                    break;
                }
            }
            if !self.batch.is_empty() {
                continue;
            }

            // Find more sites, in parallel.
            if observer.should_stop() {
                return (Outcome::Stopped, statistics);
            }
            let Some(pass) = self.passes.front_mut() else {
                return (Outcome::Complete, statistics);
            };
            let chunk = pass.next..pass.count.min(pass.next + CHUNK);
            pass.next = chunk.end;
            let (pass, cache) = (&*pass, &self.cache);
            let site = |index: u64| {
                let mut rays = Counter::new(observer);
                let place = pass.site(index, maker, seed, &mut rays);
                let place = place.filter(|place| !cache.covers(place.p(), place.n(), maker.layer(place)));
                (place, rays.0.counts)
            };
            let sites: Vec<(Option<RecordSite>, RayCounts)> = chunk.into_par_iter().map(site).collect();
            for (place, rays) in sites {
                self.found.extend(place);
                statistics.rays = statistics.rays.plus(rays);
            }
            if pass.next == pass.count {
                self.passes.pop_front();
            }
        }
    }
}

impl RecordInProgress {
    /// Makes the record, unless it is already made or `observer` stops.
    fn make<A: Accel>(&mut self, maker: &RecordMaker<A>, seed: u64, observer: &impl Observer) -> Statistics {
        let mut statistics = Statistics::default();
        if self.record.is_none() && !observer.should_stop() {
            let mut rays = Counter::new(observer);
            // Use separate random numbers for each pass through the same pixel
            let pass = u64::from(self.place.key().sample);
            let mut sampler = Sobol::new(mix(!seed ^ pass));
            let (record, dropped) = maker.make(&self.place, &mut sampler, &mut rays);
            // Discard an incomplete record. It is made again later.
            if rays.0.cancellation.is_cancelled() {
                return statistics;
            }
            self.record = Some(record);
            statistics.rays = rays.0.counts;
            statistics.dropped = dropped;
        }
        statistics
    }
}

/// All passes over an image of `resolution` pixels.
fn passes(resolution: UVec2) -> VecDeque<Pass> {
    let centres = STEPS.into_iter().map(|step| (step, false));
    let random = (0..RANDOM_PASSES).map(|_| (1, true));
    let passes = (0..).zip(centres.chain(random));
    let pass = |(number, (step, is_random)): (u32, (u32, bool))| {
        // Start in the middle of a square, so that only passes over all pixels visit a pixel again.
        let first = step / 2;
        let along = |pixels: u32| u64::from(pixels.saturating_sub(first).div_ceil(step));
        let (columns, rows) = (along(resolution.x), along(resolution.y));
        let count = columns * rows;
        Pass {
            number,
            is_random,
            first,
            step,
            columns,
            count,
            next: 0,
            stride: stride(count),
        }
    };
    passes.map(pass).filter(|pass| pass.count > 0).collect()
}

impl Pass {
    /// Finds the site of a record through the pixel with index `index` of the pass, if there is a
    /// site.
    fn site<A: Accel>(&self, index: u64, maker: &RecordMaker<A>, seed: u64, rays: &mut Counter) -> Option<RecordSite> {
        let place = (index as u128 * self.stride as u128 % self.count as u128) as u64;
        let at = |n: u64| self.first + self.step * n as u32;
        let (x, y) = (at(place % self.columns), at(place / self.columns));
        let key = SampleKey::new(x, y, self.number);
        let mut sampler = Sobol::new(mix(seed ^ GOLDEN_GAMMA));
        sampler.start(key);
        let within = if self.is_random {
            sampler.get_2d(Dimension::PIXEL)
        } else {
            Vec2::splat(0.5)
        };
        maker.find(key, key.pixel().as_vec2() + within, &mut sampler, rays)
    }
}

/// Number near `count` divided by the golden ratio, without a common factor with `count`. Multiples
/// of this number, modulo `count`, are evenly distributed (Knuth 1973, §6.4).
fn stride(count: u64) -> u64 {
    let divisor = |mut a: u64, mut b: u64| {
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    let golden = (count as f64 * 0.618_033_988_749_895) as u64;
    (golden.max(1)..)
        .find(|&stride| divisor(stride, count) == 1)
        .unwrap_or(1)
}

/// Sink that only counts rays.
struct Counter<'a>(CountedRays<'a>);

impl<'a> Counter<'a> {
    fn new(observer: &'a impl Observer) -> Self {
        Self(CountedRays::new(observer))
    }
}

impl Sink for Counter<'_> {
    fn weight(&mut self, _: f32) {}

    fn light(&mut self, _: FoundLight) {}

    fn first_surface(&mut self, _: FirstSurface) {}
}

impl RaySink for Counter<'_> {
    fn ray(&mut self, kind: RayKind) {
        self.0.ray(kind);
    }

    fn is_cancelled(&self) -> bool {
        self.0.is_cancelled()
    }

    fn cut_walk(&mut self) {
        self.0.cut_walk();
    }
}
