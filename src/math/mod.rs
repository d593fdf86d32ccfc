//! Vectors, frames, rays, bounds and the floating-point error bounds that ray tracing rests on.

mod bounds;
pub mod float;
mod frame;
mod ray;
mod transform;

pub use bounds::Bounds3;
pub use frame::Frame;
pub use glam::{Affine3A, Mat4, UVec2, Vec2, Vec3, Vec4};
pub use ray::Ray;
pub use transform::{affine_from_rows, affine_from_trs};
