//! Rendering loops: passes over tiles and iterations, which fix the order of samples, and
//! statistics.
//!
//! This module does not print, read a clock, start a thread or open a file. Work runs in the rayon
//! pool of the caller. An [`Observer`] receives the progress and may stop the render.
//!
//! `tiles` renders passes over tiles, and `iterations` renders whole iterations. `schedule` divides
//! sample indices into passes, `noise_level` stops at a noise level, and `groups` chooses the
//! pixels that share paths. `irradiance`, `photons`, `importance_image` and `visibility` prepare
//! data for all samples of an image.

mod cancellation;
mod dispatch;
mod groups;
mod importance_image;
mod irradiance;
mod iterations;
mod light_parts;
mod noise_level;
mod observer;
mod photons;
mod pixel_sample;
mod schedule;
mod statistics;
mod stop_condition;
mod tiles;
mod visibility;
mod work_items;

pub use dispatch::{DynSink, Monomorphic, SampleIntegrator};
pub use groups::companions;
pub use importance_image::importance_image;
pub use irradiance::Irradiance;
pub use iterations::{SampleRecord, record_iteration, render_iterations};
pub use noise_level::render_samples;
pub use observer::{Observer, Outcome};
pub use photons::photon_maps;
pub use pixel_sample::PixelSample;
pub use schedule::{last_cut, passes};
pub use statistics::{DroppedSample, MutationCounts, RayCounts, Statistics};
pub use stop_condition::StopCondition;
pub use tiles::render;
pub use visibility::learn_visibility;
