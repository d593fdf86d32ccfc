//! Backends of ray queries.

mod backends;
mod calibrated;
mod camera_attributes;
mod cuts;
mod drawings;
mod projections;
