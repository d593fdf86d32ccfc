//! Tests that start the program, and signal, kill or starve it at chosen moments. This is a
//! separate test program, so that renders of other tests do not use the processors during time
//! measurements.

#[path = "../support/mod.rs"]
mod support;

mod long_renders;
mod outputs;
mod packages;
mod replaced;
mod shells;
mod tev;
