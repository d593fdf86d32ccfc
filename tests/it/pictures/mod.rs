//! Channels, denoising, comparison and development of pictures.

mod aovs;
mod compare;
mod denoise;
mod develop;
mod exr_files;
mod light_paths;
mod lines;
