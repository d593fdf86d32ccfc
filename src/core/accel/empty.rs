//! Backend for scenes without surfaces: no ray hits anything.

use super::{Accel, BackendInfo};
use crate::geometry::Hit;
use crate::math::Ray;

/// A backend without surfaces.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Empty;

impl Accel for Empty {
    fn intersect(&self, _: &Ray) -> Option<Hit> {
        None
    }

    fn occluded(&self, _: &Ray) -> bool {
        false
    }

    fn info(&self) -> BackendInfo {
        BackendInfo {
            name: "empty",
            version: String::new(),
            isa: "",
        }
    }

    fn bytes(&self) -> u64 {
        0
    }
}
