//! The state of a path from the camera between two vertices.

use super::strategy::PrevVertex;
use crate::color::Spectrum;
use crate::math::Ray;

/// State of a path between two vertices.
pub(crate) struct PathState {
    pub ray: Ray,
    /// Throughput.
    pub beta: Spectrum,
    /// Factor of `beta` in Russian roulette: the squared indices of refraction that `beta` has been divided by, and the throughput before the
    /// start of the path.
    pub roulette_scale: Spectrum,
    /// Whether glass has dispersed the light: it is of one wavelength since then.
    pub is_dispersed: bool,
    /// The scattering that `ray` comes from; `None` at the camera.
    pub prev: Option<PrevVertex>,
}

impl PathState {
    /// State before the first vertex.
    #[inline(always)]
    pub fn new(ray: Ray) -> Self {
        Self {
            ray,
            beta: Spectrum::ONE,
            roulette_scale: Spectrum::ONE,
            is_dispersed: false,
            prev: None,
        }
    }

    /// Whether `ray` leaves a mirror, or the like.
    pub fn is_delta(&self) -> bool {
        self.prev.is_some_and(|prev| prev.is_delta)
    }
}
