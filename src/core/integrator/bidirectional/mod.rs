//! Bidirectional methods: paths from the camera joined to paths from lights (Veach 1997, ch. 10; Lafortune and Willems 1993).
//!
//! `subpath` makes a subpath from either end. `connection` joins the two in all ways, the strategies (s, t) with s vertices from the light and t from
//! the camera, and weights them. `light_tracing` is all strategies with t = 1, and `bdpt` is all strategies.
//! `photon/vcm.rs` and `metropolis/pssmlt.rs` use the same `Connector`.
//!
//! Light paths light any pixel, so these methods implement `IterationIntegrator`: a sample index is an iteration, an estimate of the whole picture that
//! depends on the seed and the index alone. The film takes an iteration as one sample of every pixel. Whatever holds of samples therefore holds of
//! iterations: variance, checkpoints, resume, merging, crops and noise levels need no special case. A crop traces the light paths of the whole
//! picture, because these fall into the crop.
//!
//! Lights are sampled for s = 1 as in `path`, by place. The weights know that this density differs from the density of a light path's start, which is
//! chosen by power (`light/emission_selection.rs`). All strategies share the two subpaths of a sample; camera and light take turns in blocks of
//! dimensions.
//!
//! `--aov strategies` sums the light of each strategy, weighted and unweighted, in the same sums as light groups. `tests/it/transport/bidirectional.rs` asks
//! each of the 20 strategies for paths of up to five segments for the picture of its length, by itself: a wrong density anywhere shows there.

pub(crate) mod bdpt;
pub(crate) mod connection;
pub(crate) mod light_tracing;
pub(crate) mod subpath;
