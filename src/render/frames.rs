use super::pieces::in_pieces;
use super::statistics::{DroppedSample, RayCounts, Statistics};
use super::tiles::{Observer, Outcome};
use crate::color::Spectrum;
use crate::film::{BLOCK, Film, Filter, FirstSurface, Frame, Rect, Tile};
use crate::integrator::{ByGroup, FrameIntegrator, Gathered, RayKind, RaySink, Sink, SplatSink};
use crate::math::{UVec2, Vec2};
use crate::sampler::{SampleKey, Sampler};
use rayon::prelude::*;

/// Pieces of work whose light is kept until all before them have been added: a bound on memory, which decides no bit.
const PIECES_AT_ONCE: usize = 128;

/// Adds frames to `film`, from those that it has to the one before the index `end`, or until its error is estimated to be `level` at most.
///
/// The result is the same to the bit for any number of threads: what a piece of a frame finds depends on its place alone, and pieces are added in
/// their order. A frame that is not whole when the observer asks to stop is thrown away. The error is judged where blocks of samples end,
/// as in [`render_to_noise`](super::render_to_noise), but for the whole picture alone: light goes where it will.
pub fn render_frames<I: FrameIntegrator, S: Sampler>(
    integrator: &I,
    (sampler, filter): (&S, &Filter),
    film: &mut Film,
    (end, level): (u32, Option<f64>),
    observer: &impl Observer,
) -> (Outcome, Statistics) {
    let mut statistics = Statistics::default();
    let start = film.tiles().iter().map(Tile::next_sample).min().unwrap_or(end);
    for index in start..end {
        let taken = index - film.first_sample();
        if let Some(level) = level.filter(|_| taken >= 2 * BLOCK && taken % BLOCK == 0) {
            if film.error() <= level * level {
                break;
            }
        }
        // A film that does not tell lights apart pays nothing for it.
        let done = match film.parts().saturating_sub(2 * integrator.strategies()) {
            0 => frame::<Spectrum, _, _>(integrator, (sampler, filter), film, index, observer),
            _ => frame::<ByGroup, _, _>(integrator, (sampler, filter), film, index, observer),
        };
        let Some((frame, done)) = done else {
            return (Outcome::Stopped, statistics);
        };
        film.add_frame(&frame);
        statistics = statistics.merge(done);
        observer.passed(film);
    }
    (Outcome::Complete, statistics)
}

/// A piece of a frame.
#[derive(Clone, Copy)]
enum Work {
    /// The samples of a block of pixels.
    Pixels(Rect),
    Chain(u32),
}

/// The frame with that index; `None` where the observer asked to stop.
fn frame<R: Gathered, I: FrameIntegrator, S: Sampler>(
    integrator: &I,
    (sampler, filter): (&S, &Filter),
    film: &Film,
    index: u32,
    observer: &impl Observer,
) -> Option<(Frame, Statistics)> {
    // What all of the rest looks at
    let prepare = |part, sampler: &mut S, rays: &mut RayCounts| integrator.prepare(index, part, sampler, rays);
    let (parts, rays) = in_pieces(integrator.preparations(), sampler, observer, prepare)?;
    let mut statistics = Statistics {
        rays,
        ..Statistics::default()
    };
    let prepared = integrator.join(index, parts);

    // All pieces, some at a time
    let seen = match integrator.sends_light() {
        true => Film::cells(film.resolution(), Rect::full(film.resolution())),
        false => Film::cells(film.resolution(), film.crop()),
    };
    let cells = seen.into_iter().map(Work::Pixels);
    let work: Vec<Work> = cells.chain((0..integrator.chains()).map(Work::Chain)).collect();
    let place = Place {
        filter,
        groups: film.parts().saturating_sub(2 * integrator.strategies()),
        resolution: film.resolution(),
        crop: film.crop(),
    };
    let mut frame = Frame::of(film);
    let mut done = 0;
    for batch in work.chunks(PIECES_AT_ONCE) {
        let pieces = batch.par_iter().map(|work| {
            let piece = Piece::<R>::new(place);
            (!observer.should_stop()).then(|| piece.of(integrator, &prepared, (*work, index), sampler))
        });
        let pieces: Vec<Piece<R>> = pieces.collect::<Option<_>>()?;
        for piece in pieces {
            statistics = statistics.merge(piece.add_to(&mut frame));
        }
        // The share of the work, in samples
        let before = done;
        done += batch.len() as u64;
        let share = |pieces: u64| film.crop().area() * pieces / work.len() as u64;
        observer.progress(share(done) - share(before));
    }
    statistics.samples = film.crop().area();
    Some((frame, statistics))
}

/// Where light falls.
#[derive(Clone, Copy)]
struct Place<'a> {
    filter: &'a Filter,
    /// Groups of lights that are told apart: the first parts of the light, before strategies, weighed and alone.
    groups: usize,
    resolution: UVec2,
    crop: Rect,
}

/// What a piece of work has found.
struct Piece<'a, R> {
    place: Place<'a>,
    light: Vec<(UVec2, R)>,
    /// What parts of the light that are strategies get.
    strategies: Vec<(UVec2, usize, Spectrum)>,
    surfaces: Vec<(UVec2, FirstSurface)>,
    statistics: Statistics,
    /// The sample in work, and what counts in its own pixel.
    key: SampleKey,
    weight: f32,
    radiance: R,
}

impl<'a, R: Gathered> Piece<'a, R> {
    fn new(place: Place<'a>) -> Self {
        Self {
            place,
            light: Vec::new(),
            strategies: Vec::new(),
            surfaces: Vec::new(),
            statistics: Statistics::default(),
            key: SampleKey::new(0, 0, 0),
            weight: 1.0,
            radiance: R::default(),
        }
    }

    /// Does the work.
    fn of<I: FrameIntegrator>(
        mut self,
        integrator: &I,
        prepared: &I::Prepared,
        (work, index): (Work, u32),
        sampler: &impl Sampler,
    ) -> Self {
        let mut sampler = sampler.clone();
        match work {
            Work::Pixels(cell) => {
                for pixel in cell.pixels() {
                    self.key = SampleKey::new(pixel.x, pixel.y, index);
                    self.weight = 1.0;
                    integrator.sample(prepared, self.key, &mut sampler, &mut self);
                    let radiance = std::mem::take(&mut self.radiance) * self.weight;
                    self.fall_on(pixel, radiance);
                }
            }
            Work::Chain(chain) => {
                self.key = SampleKey::new(chain, u32::MAX, index);
                integrator.chain(prepared, index, chain, &mut sampler, &mut self);
            }
        }
        self
    }

    /// Light that counts so much in `pixel`; what is no light is dropped.
    fn fall_on(&mut self, pixel: UVec2, radiance: R) {
        let sum = radiance.sum();
        // A filter may be negative, but finite; integrators' light is judged where it comes.
        if !sum.to_array().iter().all(|v| v.is_finite()) {
            self.drop(sum);
        } else if self.place.crop.contains(pixel) && !sum.is_black() {
            self.light.push((pixel, radiance));
        }
    }

    fn drop(&mut self, radiance: Spectrum) {
        self.statistics.drop_sample(DroppedSample {
            key: self.key,
            radiance: radiance.to_array(),
        });
    }

    /// Adds its light to `frame`, and says what it counted.
    fn add_to(self, frame: &mut Frame) -> Statistics {
        for (pixel, radiance) in self.light {
            let groups = radiance.by_group();
            frame.add(pixel, radiance.sum(), &groups[..groups.len().min(self.place.groups)]);
        }
        for (pixel, part, radiance) in self.strategies {
            frame.add_to_part(pixel, part, radiance);
        }
        for (pixel, surface) in self.surfaces {
            frame.see(pixel, surface);
        }
        self.statistics
    }
}

impl<R> RaySink for Piece<'_, R> {
    fn ray(&mut self, kind: RayKind) {
        self.statistics.rays.count(kind);
    }
}

impl<R: Gathered> Sink for Piece<'_, R> {
    type Radiance = R;

    fn weight(&mut self, weight: f32) {
        self.weight = weight;
    }

    fn radiance(&mut self, radiance: R) {
        match radiance.sum().is_valid() {
            true => self.radiance += radiance,
            false => self.drop(radiance.sum()),
        }
    }

    fn first_surface(&mut self, surface: FirstSurface) {
        if self.place.crop.contains(self.key.pixel()) {
            self.surfaces.push((self.key.pixel(), surface));
        }
    }
}

impl<R: Gathered> SplatSink for Piece<'_, R> {
    fn splat(&mut self, film: Vec2, radiance: R) {
        if !radiance.sum().is_valid() {
            self.drop(radiance.sum());
            return;
        }
        for (pixel, weight) in self.place.seen_by(film) {
            self.fall_on(pixel, radiance * weight);
        }
    }

    fn strategy(&mut self, index: usize, film: Option<Vec2>, weighed: Spectrum, alone: Spectrum) {
        let first = self.place.groups + 2 * index;
        let mut add = |pixel: UVec2, weight: f32| {
            for (part, radiance) in [(first, weighed), (first + 1, alone)] {
                let radiance = radiance * weight;
                if self.place.crop.contains(pixel) && radiance.to_array().iter().all(|v| v.is_finite()) {
                    self.strategies.push((pixel, part, radiance));
                }
            }
        };
        match film {
            Some(film) => self.place.seen_by(film).for_each(|(pixel, weight)| add(pixel, weight)),
            None => add(self.key.pixel(), self.weight),
        }
    }
    fn mutation(&mut self, kind: &'static str, proposed: u64, accepted: u64) {
        self.statistics.mutation(kind, proposed, accepted);
    }
}

impl<'a> Place<'a> {
    /// All pixels that see the place `film`, each with its filter's value there.
    fn seen_by(self, film: Vec2) -> impl Iterator<Item = (UVec2, f32)> + 'a {
        // Those whose middle is within the filter's radius
        let reach = self.filter.radius();
        let size = self.resolution.as_vec2();
        let first = (film - (reach + 0.5)).ceil().max(Vec2::ZERO).as_ivec2();
        let last = (film + (reach - 0.5)).floor().min(size - 1.0).as_ivec2();
        let pixels =
            (first.y..=last.y).flat_map(move |y| (first.x..=last.x).map(move |x| UVec2::new(x as u32, y as u32)));
        pixels.filter_map(move |pixel| {
            let weight = self.filter.eval(film - (pixel.as_vec2() + 0.5));
            (weight != 0.0).then_some((pixel, weight))
        })
    }
}

impl RaySink for RayCounts {
    fn ray(&mut self, kind: RayKind) {
        self.count(kind);
    }
}
