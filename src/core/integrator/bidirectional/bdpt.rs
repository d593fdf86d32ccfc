use super::connection::Connector;
use crate::accel::Accel;
use crate::film::LightPaths;
use crate::integrator::bidirectional::connection::{Contribution, Subpaths};
use crate::integrator::{
    Heuristic, IterationIntegrator, LightSource, RaySink, Roulette, SplatSink, World, path_classes,
};
use crate::sampler::{SampleKey, Sampler};

/// Bidirectional path tracing: each sample traces a camera path and a light path, and connects them
/// by all strategies. Multiple importance sampling weights the strategies (Veach 1997, ch. 10;
/// Lafortune and Willems 1993).
#[derive(Debug)]
pub struct BidirectionalIntegrator<'a, A> {
    /// World with the scene and the camera.
    pub world: World<'a, A>,
    /// MIS heuristic of the strategies.
    pub heuristic: Heuristic,
    /// Maximum number of scattering events. `None`: the maximum of a path, 64.
    pub max_depth: Option<u32>,
    /// Russian roulette of the subpaths.
    pub roulette: Roulette,
}

impl<A: Accel> IterationIntegrator for BidirectionalIntegrator<'_, A> {
    type PreparationPart = ();
    type Preparation = ();

    fn preparations(&self) -> u32 {
        0
    }

    fn prepare<S: Sampler>(&self, _: u32, _: u32, _: &mut S, _: &mut impl RaySink) {}

    fn join(&self, _: u32, _: Vec<()>) {}

    fn strategies(&self) -> usize {
        match self.max_depth {
            Some(depth) if self.world.strategies => strategies(depth).count(),
            _ => 0,
        }
    }

    fn repeats(&self) -> bool {
        self.world.camera.repeats()
    }

    fn sends_light(&self) -> bool {
        true
    }

    fn sample<S: Sampler>(&self, _: &(), key: SampleKey, sampler: &mut S, out: &mut impl SplatSink) {
        let connector = Connector::new(&self.world, self.heuristic, self.roulette, self.max_depth);
        // Trace both subpaths
        let ray = self.world.camera_ray(key, None, sampler, out);
        let mut paths = connector.subpaths(ray, sampler, out);
        if let Some(first) = paths.first_seen(&self.world, out) {
            out.first_surface(first);
        }

        // Connect both subpaths by all strategies
        let mut found = Vec::new();
        connector.all(&mut paths, sampler, out, |contribution| found.push(contribution));
        for c in found {
            if self.world.strategies {
                let (s, t) = c.strategy;
                out.strategy(strategy_index(s, t), c.film, c.radiance * c.weight, c.radiance);
            }
            if let Some(classifier) = self.world.paths {
                self.split_by_class(&c, &paths, classifier, out);
            }
            c.add_to(self.world.scene, out);
        }
    }
}

impl<A: Accel> BidirectionalIntegrator<'_, A> {
    /// Splits `contribution`, which connects the subpaths `paths`, into classes of light paths, and
    /// passes the classes to `out`.
    fn split_by_class(
        &self,
        contribution: &Contribution,
        paths: &Subpaths,
        classifier: &LightPaths,
        out: &mut impl SplatSink,
    ) {
        let radiance = contribution.radiance * contribution.weight;
        if radiance.is_black() || !radiance.is_valid() {
            return;
        }
        let source = LightSource::of(contribution.light, self.world.scene);
        let classes = path_classes(radiance, source.kind, contribution.events(paths), classifier);
        for (class, light) in classes.into_iter().enumerate().filter(|(_, light)| !light.is_black()) {
            out.path_class(class, contribution.film, light);
        }
    }
}

/// All strategies (s, t) for paths of up to `max_depth` scattering events. They are ordered by the
/// number of vertices, then by the number of camera vertices.
pub fn strategies(max_depth: u32) -> impl Iterator<Item = (usize, usize)> {
    (2..=max_depth as usize + 2).flat_map(|n| (1..=n).map(move |t| (n - t, t)))
}

/// Index of (s, t) in [`strategies`].
fn strategy_index(s: usize, t: usize) -> usize {
    let n = s + t;
    n * (n - 1) / 2 - 1 + t - 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strategy_index_is_position_in_strategies() {
        let all: Vec<_> = strategies(5).collect();
        assert_eq!(all.len(), 2 + 3 + 4 + 5 + 6 + 7);
        for (place, &(s, t)) in all.iter().enumerate() {
            assert_eq!(strategy_index(s, t), place, "({s}, {t})");
        }
    }
}
