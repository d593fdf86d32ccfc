use super::{
    DIRECT, DIRECTIONS, Estimator, HEURISTICS, IntegratorKind, METROPOLIS_DIRECT, METROPOLIS_TARGETS, REUSES,
    SELECTIONS, TRIANGLE_SAMPLINGS, VIEWS,
};
use crate::io::{MaxDepth, name_of};

impl Estimator {
    /// Everything that decides the pixels, as `key=value` pairs.
    pub(crate) fn settings(&self) -> String {
        let depth = MaxDepth(self.max_depth());
        let strategy = self.strategy;
        let mut text = format!("integrator={}", self.name());
        match self.kind {
            IntegratorKind::Path
            | IntegratorKind::Direct
            | IntegratorKind::Distributed
            | IntegratorKind::PhotonMap
            | IntegratorKind::ProgressivePhotons
            | IntegratorKind::IrradianceCache => {
                text += &format!(
                    " directions={} direct={} mis={}",
                    name_of(DIRECTIONS, strategy.directions),
                    name_of(DIRECT, strategy.direct),
                    name_of(HEURISTICS, strategy.heuristic)
                );
            }
            IntegratorKind::AmbientOcclusion => text += &format!(" ao_distance={:?}", self.ao_distance),
            IntegratorKind::Debug => text += &format!(" view={}", name_of(VIEWS, self.view)),
            IntegratorKind::Bidirectional | IntegratorKind::PrimarySpace | IntegratorKind::VertexMerging => {
                text += &format!(" mis={}", name_of(HEURISTICS, strategy.heuristic));
            }
            IntegratorKind::Naive | IntegratorKind::Whitted | IntegratorKind::Light | IntegratorKind::PathSpace => {}
        }
        let samples_lights = match self.kind {
            IntegratorKind::Path
            | IntegratorKind::Direct
            | IntegratorKind::Distributed
            | IntegratorKind::PhotonMap
            | IntegratorKind::ProgressivePhotons
            | IntegratorKind::IrradianceCache => strategy.samples_lights(),
            IntegratorKind::Whitted
            | IntegratorKind::Light
            | IntegratorKind::Bidirectional
            | IntegratorKind::PrimarySpace
            | IntegratorKind::VertexMerging
            | IntegratorKind::PathSpace => true,
            IntegratorKind::Naive | IntegratorKind::AmbientOcclusion | IntegratorKind::Debug => false,
        };
        if samples_lights {
            text += &format!(
                " light_selection={} triangle_sampling={}",
                name_of(SELECTIONS, self.light_selection),
                name_of(TRIANGLE_SAMPLINGS, self.triangle_sampling)
            );
        }
        match self.kind {
            IntegratorKind::Path => {
                let (roulette, reuse) = (self.roulette.depth, name_of(REUSES, self.reuse));
                let lights = self.light_samples();
                text + &format!(" max_depth={depth} roulette_depth={roulette} reuse={reuse} light_samples={lights}")
            }
            IntegratorKind::Naive | IntegratorKind::Light | IntegratorKind::Bidirectional => {
                text + &format!(" max_depth={depth} roulette_depth={}", self.roulette.depth)
            }
            IntegratorKind::ProgressivePhotons | IntegratorKind::VertexMerging => {
                text + &format!(
                    " max_depth={depth} roulette_depth={} photons={} photon_radius={} photon_alpha={}",
                    self.roulette.depth,
                    self.photons.map_or("pixels".into(), |n| n.to_string()),
                    self.photon_radius
                        .map_or(format!("{}px", self.radius_pixels()), |r| r.to_string()),
                    self.photon_alpha
                )
            }
            IntegratorKind::PhotonMap => {
                text + &format!(
                    " max_depth={depth} roulette_depth={} photons={} photon_count={} photon_radius={} gather_rays={}",
                    self.roulette.depth,
                    self.mapped_photons(),
                    self.photon_count,
                    self.photon_radius.map_or("scene".into(), |r| r.to_string()),
                    self.gather_rays
                )
            }
            IntegratorKind::IrradianceCache => {
                let (roulette, lights) = (self.roulette.depth, self.light_samples());
                let (error, rays) = (self.cache_error, self.cache_rays);
                text + &format!(
                    " max_depth={depth} roulette_depth={roulette} light_samples={lights} cache_error={error} cache_rays={rays}"
                )
            }
            IntegratorKind::Distributed => text + &format!(" max_depth={depth} branching={}", self.branching),
            IntegratorKind::PrimarySpace => {
                let lights = self.light_samples();
                text + &format!(" max_depth={depth} light_samples={lights} {}", self.chains())
            }
            IntegratorKind::PathSpace => {
                let (lights, roulette) = (self.light_samples(), self.roulette.depth);
                let chains = self.starts_of_chains();
                text + &format!(" max_depth={depth} roulette_depth={roulette} light_samples={lights} {chains}")
            }
            IntegratorKind::Whitted => text + &format!(" max_depth={depth}"),
            IntegratorKind::Direct => text + &format!(" light_samples={}", self.light_samples()),
            IntegratorKind::AmbientOcclusion | IntegratorKind::Debug => text,
        }
    }

    /// Which Markov chains there are, likewise.
    fn starts_of_chains(&self) -> String {
        let number = |n: Option<u32>| n.map_or("auto".into(), |n| n.to_string());
        let metropolis = &self.metropolis;
        format!(
            "metropolis_direct={} metropolis_target={} chains={} bootstrap={}",
            name_of(METROPOLIS_DIRECT, metropolis.direct),
            name_of(METROPOLIS_TARGETS, metropolis.target),
            number(metropolis.chains),
            number(metropolis.bootstrap),
        )
    }

    /// How they go, too.
    fn chains(&self) -> String {
        let metropolis = &self.metropolis;
        format!(
            "{} large_step_probability={:?} mutation_size={:?}",
            self.starts_of_chains(),
            metropolis.large_step_probability,
            metropolis.mutation_size
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::CommonErrors;

    /// Who reads a file knows an integrator by its name alone.
    #[test]
    fn settings_tell_which_errors_pixels_have_in_common() {
        let common = |estimator: Estimator| CommonErrors::of_settings(&estimator.settings());
        for &(name, kind) in IntegratorKind::NAMES {
            let expected = match kind {
                IntegratorKind::Naive
                | IntegratorKind::Whitted
                | IntegratorKind::Distributed
                | IntegratorKind::Direct
                | IntegratorKind::AmbientOcclusion
                | IntegratorKind::Debug => CommonErrors::None,
                IntegratorKind::Path
                | IntegratorKind::Light
                | IntegratorKind::Bidirectional
                | IntegratorKind::VertexMerging => CommonErrors::Tile,
                IntegratorKind::PrimarySpace | IntegratorKind::PathSpace | IntegratorKind::ProgressivePhotons => {
                    CommonErrors::Sample
                }
                IntegratorKind::PhotonMap | IntegratorKind::IrradianceCache => CommonErrors::Picture,
            };
            let estimator = Estimator {
                kind,
                ..Estimator::default()
            };
            assert_eq!(common(estimator), expected, "{name}");
        }
        let alone = Estimator {
            reuse: false,
            ..Estimator::default()
        };
        let wide = Estimator {
            kind: IntegratorKind::VertexMerging,
            photon_radius: Some(0.1),
            ..Estimator::default()
        };
        assert_eq!(
            (common(alone), common(wide)),
            (CommonErrors::None, CommonErrors::Sample)
        );
    }
}
