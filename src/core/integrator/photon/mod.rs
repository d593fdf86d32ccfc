//! Density estimation: photon mapping, progressive photon mapping, and vertex connection and
//! merging.
//!
//! `photons` traces paths from lights and stores a photon at each vertex that can scatter light to
//! a viewer. `density` converts the photons near a point to radiance. `grid` and `tree` find these
//! photons, within the radii of `integrator/search_radius.rs`. `sppm`, `photon_map` and `vcm` are
//! the integrators.
//!
//! Each path of light from a lamp to the camera is estimated in exactly one way. Direct light is
//! estimated as in `path`, by light sampling and by one scattered ray, weighted by MIS. So `sppm`
//! stores photons only after their first scattering event. A camera path ends at the first surface
//! that scatters widely (`Lobe::is_wide`). The path continues through delta lobes and at surfaces
//! that scatter narrowly, where few photons would have large weights. At a surface with a wide and
//! a delta lobe, photons estimate the wide lobe and the path follows the delta lobe. `Bsdf::eval`
//! is 0 for delta lobes, so the two parts do not overlap.
//!
//! - A photon stores its number of scattering events, so that `--max-depth` has the same meaning as
//!   for `path`.
//! - The power of a photon on a surface of opacity below 1 is divided by this opacity
//!   (`Surface::over_opacity`). The reason is that the photon and the camera path both stop at the
//!   surface with this probability, although both hits are one vertex of the path.
//! - All photons and pixels of an iteration have the same time.
//!
//! Density estimation is biased, because its result is a mean over a disk. The bias is proportional
//! to `r²` times the curvature of the irradiance. At the edge of a surface, part of the disk is
//! empty. A photon counts if its surface has nearly the normal of the point (`MIN_COSINE`) and if
//! it lies within a ball around the point. docs/notebook/2026-11.md, "Photons", has errors and
//! biases.

pub(crate) mod density;
pub(crate) mod grid;
pub(crate) mod photon_map;
pub(crate) mod photons;
pub(crate) mod sppm;
pub(crate) mod tree;
pub(crate) mod vcm;
