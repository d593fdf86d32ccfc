//! Density estimation: photon mapping, progressive photon mapping, and vertex connection and merging.
//!
//! `photons` sends paths from lights and keeps a photon at each vertex that can scatter light to a viewer. `density` turns the photons near a point
//! into radiance. `grid` and `tree` find these photons, within the radii of `integrator/search_radius.rs`. `sppm`, `photon_map` and `vcm` are the methods.
//!
//! Light is counted once. Direct light is estimated as along any path, by light sampling and by one ray, weighted by MIS; `sppm` therefore keeps
//! photons from their first scattering on. A camera path ends at the first surface that scatters widely (`Lobe::is_wide`). It goes on through delta
//! lobes and past surfaces that scatter narrowly, where few photons would have large weights. At a surface with a wide and a delta lobe, photons
//! stand for the wide lobe and the path follows the delta lobe: `Bsdf::eval` is 0 for delta lobes, so the two parts do not overlap.
//!
//! - A photon counts its scattering events, so that `--max-depth` means what it means for `path`.
//! - A photon that met a surface of opacity below 1 by chance has a weight over that opacity (`Surface::over_opacity`): the camera path meets the
//!   surface by the same chance, and both meetings are one vertex of the path.
//! - Photons and pixels of an iteration have one time.
//!
//! Density estimation is biased: it takes the mean over a disk. The bias is proportional to `r²` times the curvature of the irradiance. At the edge
//! of a surface the part of the disk beside the surface is missing. A photon counts if its surface has nearly the normal of the point (`MIN_COSINE`)
//! and if it lies within a ball. docs/benchmarks.md, "Photons", has errors and biases.

pub(crate) mod density;
pub(crate) mod grid;
pub(crate) mod photon_map;
pub(crate) mod photons;
pub(crate) mod sppm;
pub(crate) mod tree;
pub(crate) mod vcm;
