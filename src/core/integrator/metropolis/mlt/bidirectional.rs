use super::Proposal;
use super::numbers::Numbers;
use super::path::{CameraSample, Path};
use super::space::PathSpace;
use crate::accel::Accel;
use crate::integrator::RaySink;

/// Bidirectional mutation: deletes a part of the path, and replaces it by new vertices that are
/// sampled from the camera's side and from the light's side (Veach 1997, §11.4.2.1).
///
/// A mutation and its reverse mutation make some choices with equal probability, such as the kept
/// vertices. These probabilities cancel in the acceptance probability.
#[derive(Debug)]
pub(super) struct Bidirectional<'s, 'w, 'a, A> {
    pub space: &'s PathSpace<'w, 'a, A>,
    pub lengths: &'s Lengths,
}

/// Distribution of the number of vertices of a new path: a probability for each number. It is about
/// proportional to the light of paths with this number of vertices.
#[derive(Clone, Debug, Default)]
pub(super) struct Lengths(Vec<f64>);

impl Lengths {
    /// Fraction of the probability that is distributed evenly over all numbers of vertices, so that
    /// each number is possible.
    const EVEN: f64 = 0.1;

    /// Distribution over `min` to `max` vertices. `light[n]` is the light that was found by paths
    /// of `n` vertices.
    pub fn new(light: &[f64], min: usize, max: usize) -> Self {
        let total: f64 = light.iter().sum();
        let even = 1.0 / (max + 1).saturating_sub(min) as f64;
        let of = |n: usize| {
            let share = light.get(n).map_or(0.0, |light| light / total);
            match total > 0.0 {
                _ if n < min => 0.0,
                true => (1.0 - Self::EVEN) * share + Self::EVEN * even,
                false => even,
            }
        };
        Self((0..=max).map(of).collect())
    }

    fn of(&self, n: usize) -> f64 {
        self.0.get(n).copied().unwrap_or(0.0)
    }
}

/// Part of a path that a mutation deletes or makes: `count` vertices that follow the first `kept`
/// vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Cut {
    pub kept: usize,
    pub count: usize,
}

impl Cut {
    /// All cuts of a path of `n` vertices that keep at least one vertex.
    fn all(n: usize) -> impl Iterator<Item = Self> + Clone {
        let cut = move |kept| (0..=n - kept).map(move |count| Self { kept, count });
        (0..=n).flat_map(cut).filter(move |cut| cut.count < n)
    }

    /// Relative probability of deleting this part of `path`. It is lower for a part with many
    /// edges, which are seldom replaced with success (p_d1). It is 0 if a neighbouring vertex
    /// cannot be connected, or if the part is empty and at an end of the path (p_d2).
    fn weight(self, path: &Path) -> f64 {
        let n = path.len();
        let Self { kept, count } = self;
        let is_at_end = kept == 0 || kept + count == n;
        let ends = [kept.checked_sub(1), Some(kept + count).filter(|&i| i < n)];
        let continues_by_delta = |i: &usize| path.vertices[*i].is_delta;
        if (is_at_end && count == 0) || ends.iter().flatten().any(continues_by_delta) {
            return 0.0;
        }
        // The match is over the number of deleted edges
        match count + 1 {
            1 => 0.25,
            2 => 0.5,
            edges => 1.0 / (1u128 << edges) as f64,
        }
    }
}

/// Distribution of the number of new vertices that replace `deleted` vertices (p_a1). It allows
/// `min` to `max` new vertices. The most probable number is `deleted`.
#[derive(Clone, Copy, Debug)]
struct VertexCounts {
    deleted: usize,
    min: usize,
    max: usize,
}

impl VertexCounts {
    fn weight(self, count: usize) -> f64 {
        match count.abs_diff(self.deleted) {
            _ if count < self.min || count > self.max => 0.0,
            0 => 0.5,
            1 => 0.15,
            difference => 0.2 / (1u128 << difference) as f64,
        }
    }

    fn weights(self) -> impl Iterator<Item = f64> + Clone {
        (0..=self.max).map(move |count| self.weight(count))
    }

    fn probability(self, count: usize) -> f64 {
        self.weight(count) / self.weights().sum::<f64>()
    }
}

impl<'a, A: Accel> Bidirectional<'_, '_, 'a, A> {
    /// Replaces a random part of `x`. `chosen` returns the probability of choosing this kind of
    /// mutation for a path.
    pub fn mutate(
        &self,
        x: &Path<'a>,
        chosen: impl Fn(&Path<'a>) -> f64,
        numbers: &mut Numbers,
        out: &mut impl RaySink,
    ) -> Option<Proposal<'a>> {
        let cut = Cut::all(x.len()).nth(numbers.choose(Cut::all(x.len()).map(|cut| cut.weight(x)))?)?;
        let count = numbers.choose(self.added(x, cut).weights())?;
        let t = split(cut.kept, count, numbers);
        let y = self.exchange(x, cut, (count, t), x.camera, numbers, out)?;
        let back = Cut { count, ..cut };
        let forth = chosen(x) * self.transition(x, &y, cut, back);
        let back = chosen(&y) * self.transition(&y, x, back, cut);
        Some(Proposal::of(y, back / forth))
    }

    /// Replaces all vertices of `x`. The new path does not depend on `x`. `chosen` returns the
    /// probability of choosing this kind of mutation for a path.
    pub fn replace(
        &self,
        x: &Path<'a>,
        chosen: impl Fn(&Path<'a>) -> f64,
        numbers: &mut Numbers,
        out: &mut impl RaySink,
    ) -> Option<Proposal<'a>> {
        let n = numbers.choose(self.lengths.0.iter().copied())?;
        let t = split(0, n, numbers);
        let time = self.space.world.time_at(|| numbers.next());
        let all = Cut {
            kept: 0,
            count: x.len(),
        };
        let y = self.exchange(x, all, (n, t), CameraSample { time, ..x.camera }, numbers, out)?;
        let forth = chosen(x) * self.density(&y);
        let back = chosen(&y) * self.density(x);
        Some(Proposal::of(y, back / forth))
    }

    /// Replaces the part `cut` of `x` by `count` new vertices. Connects the new path after its
    /// first `t` vertices.
    fn exchange(
        &self,
        x: &Path<'a>,
        cut: Cut,
        (count, t): (usize, usize),
        mut sample: CameraSample,
        numbers: &mut Numbers,
        out: &mut impl RaySink,
    ) -> Option<Path<'a>> {
        // If the lens vertex is deleted, sample the lens point anew.
        if cut.kept == 0 {
            sample.lens = numbers.next_2d();
        }
        let n = x.len() - cut.count + count;
        let [mut camera, mut light] = [Vec::with_capacity(n), Vec::with_capacity(n)];
        camera.extend_from_slice(&x.vertices[..cut.kept]);
        light.extend(x.vertices[cut.kept + cut.count..].iter().rev().cloned());
        let to_light = t == cut.kept + count && light.is_empty();
        self.space
            .extend_from_camera(&mut camera, t - cut.kept, to_light, sample, numbers, out)?;
        self.space
            .extend_from_light(&mut light, cut.kept + count - t, sample.time, numbers, out)?;
        let fresh = cut.kept..cut.kept + count;
        self.space.join(camera, light.into_iter(), fresh, sample, out)
    }

    /// Distribution of the number of vertices that replace the part `cut` of `x`.
    fn added(&self, x: &Path, cut: Cut) -> VertexCounts {
        let others = x.len() - cut.count;
        let is_at_end = cut.kept == 0 || cut.kept + cut.count == x.len();
        VertexCounts {
            deleted: cut.count,
            // At least one new vertex is required if the cut is at an end of the path, or deletes
            // no vertex.
            min: usize::from(is_at_end || cut.count == 0).max(self.space.min_vertices.saturating_sub(others)),
            max: self.space.max_vertices.saturating_sub(others),
        }
    }

    /// Density of the step from `x` to `y`, divided by the contribution of `y`: Q(x → y) = T(x → y)
    /// / f(y). The step replaces the part `cut` of `x` by the part `made` of `y`.
    pub fn transition(&self, x: &Path<'a>, y: &Path<'a>, cut: Cut, made: Cut) -> f64 {
        let total: f64 = Cut::all(x.len()).map(|cut| cut.weight(x)).sum();
        let p_delete = cut.weight(x) / total;
        let p_add = self.added(x, cut).probability(made.count);
        p_delete * p_add * self.made(y, made)
    }

    /// Density of making all vertices of `y` anew, divided by the contribution of `y`.
    fn density(&self, y: &Path<'a>) -> f64 {
        let all = Cut {
            kept: 0,
            count: y.len(),
        };
        self.lengths.of(y.len()) * self.made(y, all)
    }

    /// Density of making the part `made` of `y`, divided by the contribution of `y`. It is the mean
    /// over all splits of the new vertices between both ends.
    fn made(&self, y: &Path<'a>, made: Cut) -> f64 {
        self.space.inverse_contribution(y, made.kept, made.count) / splits(made.kept, made.count) as f64
    }
}

/// Number of ways to split `count` new vertices between the camera's side, which already has `kept`
/// vertices, and the light's side.
fn splits(kept: usize, count: usize) -> usize {
    kept + count + 1 - kept.max(1)
}

/// Samples a split uniformly. Returns the number of camera vertices, including the `kept` vertices.
fn split(kept: usize, count: usize, numbers: &mut Numbers) -> usize {
    let splits = splits(kept, count);
    kept.max(1) + ((numbers.next() * splits as f32) as usize).min(splits - 1)
}
