//! Tests of `embrasure view`: its server as a program meets it (`protocol`), and its page in a browser (`browser`). They are a test program of their own, since they
//! start browsers, and `make test-view` is not to wait for other tests to be compiled.

#[path = "../support/mod.rs"]
mod support;

mod browser;
mod chromium;
mod coding;
mod compare;
#[cfg(unix)]
mod desktop;
mod first_minute;
mod lights;
mod link;
mod protocol;
mod saving;
mod slow_link;
mod viewer;

use viewer::{Frame, PATIENCE, Page, Viewer, halves_of};
