//! Statistics of a render: rays, dropped samples and mutations. The statistics are sums of
//! integers, so they do not depend on the order of threads.

use crate::integrator::{ChainCounts, RayKind, RaySink};
use crate::sampler::SampleKey;
use std::borrow::Cow;
use std::collections::BTreeMap;

/// Numbers of rays traced, by purpose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayCounts {
    /// Number of rays from the camera.
    pub camera: u64,
    /// Number of rays that leave a surface after scattering, or leave a light.
    pub bounce: u64,
    /// Number of shadow rays towards a light.
    pub shadow: u64,
    /// Number of walks through surfaces with opacity below 1 that ended after 10,000 surfaces. The
    /// rays of these walks are included in the other counts.
    pub cut: u64,
}

impl RaySink for RayCounts {
    fn ray(&mut self, kind: RayKind) {
        self.count(kind);
    }

    fn cut_walk(&mut self) {
        self.cut += 1;
    }
}

impl RayCounts {
    /// Counts one ray with the purpose `kind`.
    pub fn count(&mut self, kind: RayKind) {
        match kind {
            RayKind::Camera => self.camera += 1,
            RayKind::Bounce => self.bounce += 1,
            RayKind::Shadow => self.shadow += 1,
        }
    }

    /// Number of rays of all purposes, without `cut`.
    pub fn total(self) -> u64 {
        self.camera + self.bounce + self.shadow
    }

    /// Sum of `self` and `other`, for each purpose.
    pub fn plus(self, other: Self) -> Self {
        Self {
            camera: self.camera + other.camera,
            bounce: self.bounce + other.bounce,
            shadow: self.shadow + other.shadow,
            cut: self.cut + other.cut,
        }
    }
}

/// A sample whose radiance was NaN, infinite or negative. It counts as black.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DroppedSample {
    /// Key of the sample, for replay.
    pub key: SampleKey,
    /// Invalid radiance of the sample.
    pub radiance: [f32; 3],
}

/// Number of mutations of one kind that Markov chains proposed, and number of accepted mutations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MutationCounts {
    /// Number of proposed mutations.
    pub proposed: u64,
    /// Number of proposals that became the chain's next state.
    pub accepted: u64,
}

/// Statistics of a render.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Statistics {
    /// Numbers of rays traced, by purpose.
    pub rays: RayCounts,
    /// Number of samples traced, over all pixels.
    pub samples: u64,
    /// Number of samples that were dropped as invalid.
    pub dropped: u64,
    /// The first few dropped samples in the order of their keys.
    pub first_dropped: Vec<DroppedSample>,
    /// Counts of mutations of Markov chains, by the name of the kind of mutation.
    pub mutations: BTreeMap<Cow<'static, str>, MutationCounts>,
    /// Number of Markov chains, and how they moved between pixels.
    pub chains: ChainCounts,
}

impl Statistics {
    /// Maximum number of dropped samples that are kept for replay.
    const KEPT: usize = 10;

    /// Counts an invalid sample, and keeps it if it is among the first.
    pub fn drop_sample(&mut self, sample: DroppedSample) {
        self.dropped += 1;
        self.keep(sample);
    }

    /// Counts `proposed` mutations of the kind `kind`, of which `accepted` were accepted.
    pub fn mutation(&mut self, kind: impl Into<Cow<'static, str>>, proposed: u64, accepted: u64) {
        let counts = self.mutations.entry(kind.into()).or_default();
        counts.proposed += proposed;
        counts.accepted += accepted;
    }

    /// Subtracts the sample counts of `before`: these samples were traced before and only repeated.
    /// Adds the rays of `before`, because they were traced again.
    pub fn after(mut self, before: &Self) -> Self {
        self.rays = self.rays.plus(before.rays);
        self.samples = self.samples.saturating_sub(before.samples);
        self.dropped = self.dropped.saturating_sub(before.dropped);
        self
    }

    fn keep(&mut self, sample: DroppedSample) {
        if self.first_dropped.iter().any(|d| d.key == sample.key) {
            return;
        }
        let at = self.first_dropped.partition_point(|d| d.key <= sample.key);
        self.first_dropped.insert(at, sample);
        self.first_dropped.truncate(Self::KEPT);
    }

    /// Sum of both statistics. The sum does not depend on the order.
    pub fn merge(mut self, other: Self) -> Self {
        self.rays = self.rays.plus(other.rays);
        self.samples += other.samples;
        self.dropped += other.dropped;
        for sample in other.first_dropped {
            self.keep(sample);
        }
        for (kind, counts) in other.mutations {
            self.mutation(kind, counts.proposed, counts.accepted);
        }
        self.chains = self.chains.plus(other.chains);
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_dropped_samples_do_not_depend_on_merge_order() {
        let one = |sample| {
            let mut s = Statistics::default();
            s.drop_sample(DroppedSample {
                key: SampleKey::new(0, 0, sample),
                radiance: [-1.0; 3],
            });
            s
        };
        let forwards = (0..30).map(one).reduce(Statistics::merge).unwrap();
        let backwards = (0..30).rev().map(one).reduce(Statistics::merge).unwrap();
        assert_eq!(forwards, backwards);
        assert_eq!((forwards.dropped, forwards.first_dropped.len()), (30, 10));
        assert_eq!(forwards.first_dropped[9].key.sample, 9);
    }

    #[test]
    fn mutation_sums_do_not_depend_on_merge_order() {
        let one = |(kind, accepted)| {
            let mut s = Statistics::default();
            s.mutation(kind, 10, accepted);
            s
        };
        let parts = [("small", 7), ("large", 1), ("small", 5)];
        let forwards = parts.into_iter().map(one).reduce(Statistics::merge).unwrap();
        let backwards = parts.into_iter().rev().map(one).reduce(Statistics::merge).unwrap();
        assert_eq!(forwards, backwards);
        let counts = |proposed, accepted| MutationCounts { proposed, accepted };
        let expected = [("large".into(), counts(10, 1)), ("small".into(), counts(20, 12))];
        assert_eq!(forwards.mutations, BTreeMap::from(expected));
    }
}
