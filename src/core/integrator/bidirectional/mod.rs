//! Bidirectional integrators: camera paths connected to light paths (Veach 1997, ch. 10; Lafortune
//! and Willems 1993).
//!
//! `subpath` traces subpaths from the camera and from lights. `connection` connects both subpaths
//! by all strategies (s, t), with s vertices from the light and t from the camera, and weights the
//! strategies. `light_tracing` uses all strategies with t = 1, and `bdpt` uses all strategies.
//! `photon/vcm.rs` and `metropolis/pssmlt.rs` use the same `Connector`.
//!
//! A light path may contribute to any pixel, so these integrators implement `IterationIntegrator`.
//! Each sample index stands for one iteration. An iteration is an estimate of the whole image that
//! depends only on the seed and the index. The film adds an iteration as one sample of every pixel.
//! So variance, checkpoints, resume, merging, crops and noise levels need no special case. A crop
//! traces the light paths of the whole image, because any light path may contribute to pixels of
//! the crop.
//!
//! For s = 1, the light is selected for the position of the camera vertex, as in `path`. A light
//! path starts at a light that is selected by power (`light_sampling/emission_selection.rs`). The
//! MIS weights take into account that these two densities differ. All strategies share the two
//! subpaths of a sample. Camera and light subpaths use alternate blocks of dimensions.
//!
//! `--aov strategies` sums the light of each strategy, weighted and unweighted, in the same way as
//! light groups. `tests/it/transport/bidirectional.rs` renders the unweighted image of each of the
//! 20 strategies for paths of up to five segments. Each of these images must equal the image of all
//! paths of the same length. This test finds any wrong density.

pub(crate) mod bdpt;
pub(crate) mod connection;
pub(crate) mod light_tracing;
pub(crate) mod subpath;
