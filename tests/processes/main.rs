//! Tests that start the program, and signal, kill or starve it at chosen moments. They are a test program of their own, so that no render of another
//! test takes the processors while they measure time.

#[path = "../support/mod.rs"]
mod support;

mod long_renders;
mod outputs;
mod packages;
mod replaced;
mod shells;
mod tev;
