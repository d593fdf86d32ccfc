//! Backends of ray queries.

mod backends;
mod projections;
