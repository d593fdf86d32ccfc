//! Choice of a light: for incident light at a point, and for the start of a light path. No ray is
//! traced here.
//!
//! [`LightSelection`] (incident light) and [`EmissionSelection`] (start of a light path) return the
//! probability of the choice. Densities of a single light (`light`) do not include it.
//!
//! If the scene has more than two lights, a light is chosen by place: by an estimate of its
//! irradiance at the receiving point (`light_grid`). With fewer lights, the choice is by power. In
//! a room with windows, directions of the sky are also chosen by place. For this, rays measure the
//! visibility of the sky before the first sample (`visibility_grid`). The density of a direction
//! then depends on the receiving point and its normal ([`LightSampleContext`]). `PrevVertex` stores
//! this context for MIS. A context contains only data that are known both when a light is sampled
//! and when the BSDF is sampled. If a surface transmits light by lobes other than delta lobes, the
//! normal is zero.

mod cell_grid;
mod emission_selection;
mod lamps;
mod light_grid;
mod selection;
mod sky_bins;
mod tree;
mod visibility_grid;

pub use emission_selection::EmissionSelection;
pub use lamps::Lamps;
pub use selection::{LightChoice, LightSelection, SelectionMode};
pub use visibility_grid::{RAYS_A_CLUSTER, VisibilityGrid, VisibilityTarget};

use crate::math::Vec3;

/// Data of a receiving point on which the choice of a light depends.
#[derive(Clone, Copy, Debug)]
pub struct LightSampleContext {
    /// Position, world space.
    pub p: Vec3,
    /// Unit normal, on the side that receives light; zero if both sides receive light.
    pub n: Vec3,
}

impl LightSampleContext {
    /// A point that receives light from all directions.
    pub fn any_side(p: Vec3) -> Self {
        Self { p, n: Vec3::ZERO }
    }
}
