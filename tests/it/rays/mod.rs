//! Backends of ray queries.

mod backends;
mod calibrated;
mod camera_attributes;
mod camera_files;
mod cuts;
mod drawings;
mod projections;
mod views;
