//! Backends of ray queries.

mod backends;
mod calibrated;
mod camera_attributes;
mod projections;
