//! Tests of `embrasure view`: its server (`protocol`), and its page in a browser (`browser`). This
//! is a separate test program because it starts browsers, and `make test-view` should not wait for
//! the compilation of other tests.

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
