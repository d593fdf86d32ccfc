//! Backends of ray queries.

mod backends;
