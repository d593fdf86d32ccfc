//! Backends of ray queries.

mod backends;
mod calibrated;
mod projections;
