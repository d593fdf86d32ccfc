//! Fills the irradiance cache before the first sample of a render.
//!
//! A cache that is filled while pixels are rendered depends on which pixel comes first. Here the cache is filled from positions that depend on the
//! whole picture alone, and then frozen: threads, crops, parts of a render and interruptions change no bit.
//!
//! Passes look through the centre of every 32nd, 16th, … pixel, then through random points, for first matte surfaces that no record covers. Records
//! are made 64 at a time in parallel. Those of a batch do not see each other; they are inserted in order, unless an earlier one of the batch has made
//! them needless. Some 2 to 10 % are made in vain.
//!
//! A `Renderer` that is stopped while it fills the cache keeps what it has. A checkpoint holds none of it: filling the cache again gives the same
//! records.

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

/// The irradiance cache of a picture: filled before the first sample is taken, and the same from then on.
///
/// Its records depend on the scene, on the whole picture's size and camera, and on the seed, but neither on threads nor on the crop, the
/// samples or where a render was stopped: so the bits of the picture do not either.
#[derive(Debug)]
pub struct Irradiance {
    resolution: UVec2,
    seed: u64,
    /// Progress, while it is incomplete.
    filling: Mutex<Option<Filling>>,
    full: OnceLock<IrradianceCache>,
}

impl Irradiance {
    /// Empty cache, for a picture of `resolution` pixels.
    pub fn new(resolution: UVec2, seed: u64) -> Self {
        Self {
            resolution,
            seed,
            filling: Mutex::new(None),
            full: OnceLock::new(),
        }
    }

    /// Records that the cache of a picture of `resolution` pixels has at most, about.
    pub fn max_records(resolution: UVec2) -> u64 {
        let pixels = u64::from(resolution.x) * u64::from(resolution.y);
        (pixels / PIXELS_OF_A_RECORD).max(FEW_RECORDS)
    }

    /// The cache, if it is filled.
    pub fn cache(&self) -> Option<&IrradianceCache> {
        self.full.get()
    }

    /// Fills the cache, if it is not filled, with records of `maker`, each of which may be wrong by the share `error`. Where `observer` stops
    /// that, what is done stays, and the next call goes on with it.
    ///
    /// In a scene that moves while the shutter is open it stays empty: a record holds for its time alone.
    pub fn fill<A: Accel>(
        &self,
        maker: &RecordMaker<A>,
        error: f32,
        observer: &impl Observer,
    ) -> (Outcome, Statistics) {
        if self.full.get().is_some() {
            return (Outcome::Complete, Statistics::default());
        }
        // Taken out, not locked, while it goes on: a thread that waits for others may be lent to a second render. That one begins anew and has
        // the same records.
        let filling = || self.filling.lock().unwrap_or_else(PoisonError::into_inner);
        let begun = filling().take();
        let mut begun = begun.unwrap_or_else(|| Filling::new(maker, error, self.resolution, self.seed));
        let (outcome, statistics) = begun.advance(maker, observer);
        match outcome {
            Outcome::Stopped => *filling() = Some(begun),
            // The first result is that of all callers.
            Outcome::Complete => drop(self.full.set(begun.cache)),
        }
        (outcome, statistics)
    }
}

/// Distances between the pixels that passes look through; each pass has those that the ones before have left out.
const STEPS: [u32; 6] = [32, 16, 8, 4, 2, 1];

/// Passes in which every pixel looks through a random point, from a random point of the lens: other ways through glass, and what pixel centres miss.
const RANDOM_PASSES: u32 = 2;

/// Pixels that look before their finds are gone through.
const CHUNK: u64 = 4096;

/// Records that are made at a time, without a look at each other. A constant: they must not depend on threads.
const BATCH: usize = 64;

/// Pixels of the picture for each record, at least: where places are too different for that, as among leaves, paths are the quicker way.
const PIXELS_OF_A_RECORD: u64 = 8;

/// So many records are too few to be worth a limit.
const FEW_RECORDS: u64 = 1 << 14;

/// A cache that is being filled.
#[derive(Debug)]
struct Filling {
    cache: IrradianceCache,
    seed: u64,
    max_records: u64,
    /// Remaining points.
    passes: VecDeque<Pass>,
    /// Where records may be needed.
    found: VecDeque<RecordSite>,
    /// Records under way.
    batch: Vec<Making>,
}

/// A look through some pixels.
#[derive(Debug)]
struct Pass {
    /// Number of the pass, which names its random numbers.
    number: u32,
    /// Whether it looks through random points, and not through the centres.
    is_random: bool,
    /// First column and row, and from one to the next.
    first: u32,
    step: u32,
    /// Columns.
    columns: u64,
    /// Number of pixels, and of those that have looked.
    count: u64,
    next: u64,
    /// From one pixel to the next: no common factor with their number, so that all are met, far from each other.
    stride: u64,
}

/// A record that is being made.
#[derive(Debug)]
struct Making {
    place: RecordSite,
    record: Option<Option<Record>>,
}

impl Filling {
    /// With nothing done.
    fn new<A: Accel>(maker: &RecordMaker<A>, error: f32, resolution: UVec2, seed: u64) -> Self {
        let world = &maker.path.world;
        Self {
            cache: IrradianceCache::new(error, world.scene.bounds()),
            passes: if world.stands_still() {
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

    /// Goes on until all passes are through, or `observer` wants to stop.
    fn advance<A: Accel>(&mut self, maker: &RecordMaker<A>, observer: &impl Observer) -> (Outcome, Statistics) {
        let mut statistics = Statistics::default();
        loop {
            // Records, in parallel; then each is put in, in order, unless one before it has made it needless.
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
            for Making { place, record } in self.batch.drain(..) {
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

            // The next places that still need one
            while let Some(place) = self.found.pop_front() {
                if !self.cache.covers(place.p(), place.n(), maker.layer(&place)) {
                    self.batch.push(Making { place, record: None });
                }
                if self.batch.len() == BATCH {
                    break;
                }
            }
            if !self.batch.is_empty() {
                continue;
            }

            // More places, in parallel
            if observer.should_stop() {
                return (Outcome::Stopped, statistics);
            }
            let Some(pass) = self.passes.front_mut() else {
                return (Outcome::Complete, statistics);
            };
            let chunk = pass.next..pass.count.min(pass.next + CHUNK);
            pass.next = chunk.end;
            let (pass, cache) = (&*pass, &self.cache);
            let look = |index: u64| {
                let mut rays = Counter::new(observer);
                let place = pass.look(index, maker, seed, &mut rays);
                let place = place.filter(|place| !cache.covers(place.p(), place.n(), maker.layer(place)));
                (place, rays.0.counts)
            };
            let looks: Vec<(Option<RecordSite>, RayCounts)> = chunk.into_par_iter().map(look).collect();
            for (place, rays) in looks {
                self.found.extend(place);
                statistics.rays = statistics.rays.plus(rays);
            }
            if pass.next == pass.count {
                self.passes.pop_front();
            }
        }
    }
}

impl Making {
    /// Makes the record, unless it is there or `observer` wants to stop.
    fn make<A: Accel>(&mut self, maker: &RecordMaker<A>, seed: u64, observer: &impl Observer) -> Statistics {
        let mut statistics = Statistics::default();
        if self.record.is_none() && !observer.should_stop() {
            let mut rays = Counter::new(observer);
            // Passes that look through one pixel have numbers of their own.
            let pass = u64::from(self.place.key().sample);
            let mut sampler = Sobol::new(mix(!seed ^ pass));
            let (record, dropped) = maker.make(&self.place, &mut sampler, &mut rays);
            // One that is not whole is made again.
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

/// All passes over a picture.
fn passes(resolution: UVec2) -> VecDeque<Pass> {
    let centres = STEPS.into_iter().map(|step| (step, false));
    let random = (0..RANDOM_PASSES).map(|_| (1, true));
    let passes = (0..).zip(centres.chain(random));
    let pass = |(number, (step, is_random)): (u32, (u32, bool))| {
        // In the middle of its squares, where no other pass but the last looks
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
    /// What the pixel `index` of the pass finds.
    fn look<A: Accel>(&self, index: u64, maker: &RecordMaker<A>, seed: u64, rays: &mut Counter) -> Option<RecordSite> {
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

/// About `count` over the golden ratio, and with no factor in common with it: its multiples are spread evenly (Knuth 1973, §6.4).
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

/// Counts rays, and keeps nothing else.
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
