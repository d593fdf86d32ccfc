use super::IntegratorKind::{
    self, AmbientOcclusion, Bidirectional, Debug, Direct, Distributed, IrradianceCache, Light, Naive, Path, PathSpace,
    PhotonMap, PrimarySpace, ProgressivePhotons, VertexMerging, Whitted,
};
use super::{
    DIRECT, DIRECTIONS, Estimator, HEURISTICS, METROPOLIS_DIRECT, METROPOLIS_TARGETS, REUSES, SELECTIONS,
    TRIANGLE_SAMPLINGS, VIEWS,
};
use crate::description::MaxDepth;
use crate::io::name_of;

/// A switch of the estimator.
pub(crate) struct Switch {
    /// The name that the command line has for it; scene files and settings write `_` for `-`.
    pub name: &'static str,
    /// The methods that read it: pictures of all others are the same whatever it says.
    readers: &'static [IntegratorKind],
    /// What it says, as text.
    value: fn(&Estimator) -> String,
}

/// Those that find direct light in several ways, at surfaces whose directions may be drawn in several ways.
const BY_STRATEGY: &[IntegratorKind] = &[
    Path,
    Distributed,
    Direct,
    ProgressivePhotons,
    PhotonMap,
    IrradianceCache,
];
/// Those that weigh several ways of finding light.
const BY_WEIGHTS: &[IntegratorKind] = &[
    Path,
    Distributed,
    Direct,
    Bidirectional,
    PrimarySpace,
    ProgressivePhotons,
    PhotonMap,
    VertexMerging,
    IrradianceCache,
];
/// Those that sample lights for a place that looks at them.
const BY_LIGHTS: &[IntegratorKind] = &[
    Path,
    Whitted,
    Distributed,
    Direct,
    Light,
    Bidirectional,
    PrimarySpace,
    ProgressivePhotons,
    PhotonMap,
    VertexMerging,
    PathSpace,
    IrradianceCache,
];
/// Those whose paths are as long as one likes.
const BY_DEPTH: &[IntegratorKind] = &[
    Path,
    Naive,
    Whitted,
    Distributed,
    Light,
    Bidirectional,
    PrimarySpace,
    ProgressivePhotons,
    PhotonMap,
    VertexMerging,
    PathSpace,
    IrradianceCache,
];
/// Those whose paths end at random.
const BY_ROULETTE: &[IntegratorKind] = &[
    Path,
    Naive,
    Light,
    Bidirectional,
    ProgressivePhotons,
    PhotonMap,
    VertexMerging,
    PathSpace,
    IrradianceCache,
];
/// Those that follow Markov chains.
const BY_CHAINS: &[IntegratorKind] = &[PrimarySpace, PathSpace];

/// All switches, in the order in which settings name them: the one place that knows which method reads which.
pub(crate) const SWITCHES: &[Switch] = &[
    Switch {
        name: "directions",
        readers: BY_STRATEGY,
        value: |e| name_of(DIRECTIONS, e.strategy.directions).into(),
    },
    Switch {
        name: "direct",
        readers: BY_STRATEGY,
        value: |e| name_of(DIRECT, e.strategy.direct).into(),
    },
    Switch {
        name: "mis",
        readers: BY_WEIGHTS,
        value: |e| name_of(HEURISTICS, e.strategy.heuristic).into(),
    },
    Switch {
        name: "light-selection",
        readers: BY_LIGHTS,
        value: |e| name_of(SELECTIONS, e.light_selection).into(),
    },
    Switch {
        name: "triangle-sampling",
        readers: BY_LIGHTS,
        value: |e| name_of(TRIANGLE_SAMPLINGS, e.triangle_sampling).into(),
    },
    Switch {
        name: "ao-distance",
        readers: &[AmbientOcclusion],
        value: |e| format!("{:?}", e.ao_distance),
    },
    Switch {
        name: "view",
        readers: &[Debug],
        value: |e| name_of(VIEWS, e.view).into(),
    },
    Switch {
        name: "max-depth",
        readers: BY_DEPTH,
        value: |e| MaxDepth(e.max_depth()).to_string(),
    },
    Switch {
        name: "roulette-depth",
        readers: BY_ROULETTE,
        value: |e| e.roulette.depth.to_string(),
    },
    Switch {
        name: "reuse",
        readers: &[Path],
        value: |e| name_of(REUSES, e.reuse).into(),
    },
    Switch {
        name: "light-samples",
        readers: &[Path, Direct, PrimarySpace, PathSpace, IrradianceCache],
        value: |e| e.light_samples().to_string(),
    },
    Switch {
        name: "branching",
        readers: &[Distributed],
        value: |e| e.branching.to_string(),
    },
    Switch {
        name: "metropolis-direct",
        readers: BY_CHAINS,
        value: |e| name_of(METROPOLIS_DIRECT, e.metropolis.direct).into(),
    },
    Switch {
        name: "metropolis-target",
        readers: BY_CHAINS,
        value: |e| name_of(METROPOLIS_TARGETS, e.metropolis.target).into(),
    },
    Switch {
        name: "chains",
        readers: BY_CHAINS,
        value: |e| e.metropolis.chains.map_or("auto".into(), |n| n.to_string()),
    },
    Switch {
        name: "bootstrap",
        readers: BY_CHAINS,
        value: |e| e.metropolis.bootstrap.map_or("auto".into(), |n| n.to_string()),
    },
    Switch {
        name: "large-step-probability",
        readers: &[PrimarySpace],
        value: |e| format!("{:?}", e.metropolis.large_step_probability),
    },
    Switch {
        name: "mutation-size",
        readers: &[PrimarySpace],
        value: |e| format!("{:?}", e.metropolis.mutation_size),
    },
    Switch {
        name: "photons",
        readers: &[ProgressivePhotons, PhotonMap, VertexMerging],
        value: |e| match e.kind {
            PhotonMap => e.mapped_photons().to_string(),
            _ => e.photons.map_or("pixels".into(), |n| n.to_string()),
        },
    },
    Switch {
        name: "photon-radius",
        readers: &[ProgressivePhotons, PhotonMap, VertexMerging],
        value: |e| match (e.photon_radius, e.kind) {
            (Some(radius), _) => radius.to_string(),
            (None, PhotonMap) => "scene".into(),
            (None, _) => format!("{}px", e.radius_pixels()),
        },
    },
    Switch {
        name: "photon-alpha",
        readers: &[ProgressivePhotons, VertexMerging],
        value: |e| e.photon_alpha.to_string(),
    },
    Switch {
        name: "photon-count",
        readers: &[PhotonMap],
        value: |e| e.photon_count.to_string(),
    },
    Switch {
        name: "gather-rays",
        readers: &[PhotonMap],
        value: |e| e.gather_rays.to_string(),
    },
    Switch {
        name: "cache-error",
        readers: &[IrradianceCache],
        value: |e| e.cache_error.to_string(),
    },
    Switch {
        name: "cache-rays",
        readers: &[IrradianceCache],
        value: |e| e.cache_rays.to_string(),
    },
];

impl Estimator {
    /// Switches that the method reads.
    pub(super) fn switches(&self) -> impl Iterator<Item = &'static Switch> {
        let kind = self.kind;
        SWITCHES.iter().filter(move |switch| switch.readers.contains(&kind))
    }

    /// Whether the method reads the switch that the command line calls `name`.
    pub(crate) fn reads(&self, name: &str) -> bool {
        self.switches().any(|switch| switch.name == name)
    }

    /// Everything that decides the pixels, as `key=value` pairs.
    pub(crate) fn settings(&self) -> String {
        let pair = |switch: &Switch| format!(" {}={}", switch.name.replace('-', "_"), (switch.value)(self));
        let switches: String = self.switches().map(pair).collect();
        format!("integrator={}{switches}", self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrator::{DebugView, DirectLight, Directions, Heuristic, MetropolisDirect, MetropolisTarget};
    use crate::light::{SelectionMode, TriangleSampling};
    use std::collections::BTreeSet;

    /// Says something else for a switch.
    fn toggle(e: &mut Estimator, name: &str) {
        match name {
            "directions" => e.strategy.directions = Directions::Uniform,
            "direct" => e.strategy.direct = DirectLight::Light,
            "mis" => e.strategy.heuristic = Heuristic::Balance,
            "light-selection" => e.light_selection = SelectionMode::All,
            "triangle-sampling" => e.triangle_sampling = TriangleSampling::SolidAngle,
            "ao-distance" => e.ao_distance = Some(0.5),
            "view" => e.view = DebugView::Ids,
            "max-depth" => e.max_depth = Some(MaxDepth(Some(7))),
            "roulette-depth" => e.roulette.depth = 9,
            "reuse" => (e.reuse, e.light_samples) = (false, Some(e.light_samples())),
            "light-samples" => e.light_samples = Some(5),
            "branching" => e.branching = 3,
            "metropolis-direct" => e.metropolis.direct = MetropolisDirect::Metropolis,
            "metropolis-target" => e.metropolis.target = MetropolisTarget::Luminance,
            "chains" => e.metropolis.chains = Some(7),
            "bootstrap" => e.metropolis.bootstrap = Some(7),
            "large-step-probability" => e.metropolis.large_step_probability = 0.5,
            "mutation-size" => e.metropolis.mutation_size = 0.25,
            "photons" => e.photons = Some(77),
            "photon-radius" => e.photon_radius = Some(0.25),
            "photon-alpha" => e.photon_alpha = 0.5,
            "photon-count" => e.photon_count = 7,
            "gather-rays" => e.gather_rays = 7,
            "cache-error" => e.cache_error = 0.5,
            "cache-rays" => e.cache_rays = 77,
            other => panic!("{other}: no such switch"),
        }
    }

    /// Settings tell of a switch if the method reads it, and of no other.
    #[test]
    fn settings_tell_what_is_read() {
        for &(method, kind) in IntegratorKind::NAMES {
            let usual = Estimator {
                kind,
                ..Estimator::default()
            };
            for Switch { name, .. } in SWITCHES {
                let mut toggled = usual;
                toggle(&mut toggled, name);
                assert_ne!(toggled, usual, "{name}");
                let is_told = toggled.settings() != usual.settings();
                assert_eq!(is_told, usual.reads(name), "{method}: {name}");
            }
        }
    }

    /// docs/conventions.md has a table of methods, and in its second column their switches.
    #[test]
    fn the_table_of_the_documentation_is_this_one() {
        let text = include_str!("../../../docs/conventions.md");
        let (_, text) = text.split_once("\n## Integrators\n").unwrap();
        let rows = text.lines().filter(|line| line.starts_with("| `"));
        let rows: Vec<Vec<&str>> = rows.map(|row| row.split(" | ").collect()).collect();
        for &(method, kind) in IntegratorKind::NAMES {
            let row = rows.iter().find(|row| row[0] == format!("| `{method}`"));
            let documented: BTreeSet<String> = row.unwrap_or_else(|| panic!("{method}"))[1]
                .split('`')
                .skip(1)
                .step_by(2)
                .map(|key| key.replace('_', "-"))
                .collect();
            let estimator = Estimator {
                kind,
                ..Estimator::default()
            };
            let read: BTreeSet<String> = estimator.switches().map(|switch| switch.name.into()).collect();
            assert_eq!(documented, read, "{method}");
        }
    }
}
