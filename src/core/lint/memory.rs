//! The forecast of a render's memory.
//!
//! The forecast adds the parts that stay and the largest of the parts that do not: building, sampling, and denoising and writing pictures. Light that
//! methods keep, such as photons, is an estimate: paths times the vertices that paths have in plain rooms (`method/memory.rs`). docs/benchmarks.md,
//! "Forecasts of memory", compares forecasts with measured peaks.

use crate::film::{Film, Rect};
use crate::scene::Scene;
use crate::texture::Texture;

// Measured on Linux (glibc 2.41, Embree 4.4) with rooms and meshes of 3·10⁴ to 10⁶ triangles, by `accel.bytes()` and `peak_rss_bytes` of
// `--stats` at different sizes of the image.
/// Bytes a triangle takes in Embree's structure: 64 to 70.
const EMBREE_BYTES_PER_TRIANGLE: u64 = 70;
/// Bytes of a triangle in Embree's structure of a compact scene: 34.5 of a height field of 10⁷ triangles.
const EMBREE_COMPACT_BYTES_PER_TRIANGLE: u64 = 36;
/// Bytes of a triangle in the structure of obvhs: 76 to 79.
const OBVHS_BYTES_PER_TRIANGLE: u64 = 79;
/// Bytes a triangle takes besides while a structure is built.
const BUILDING_BYTES_PER_TRIANGLE: u64 = 32;
/// Bytes a pixel takes besides the film while pictures are made of it and written.
const WRITING_BYTES_PER_PIXEL: u64 = 124;
/// Bytes of the program itself, its libraries and threads.
const PROCESS_BYTES: u64 = 22 << 20;
/// A text of more bytes leaves memory when it was read; what is smaller the allocator keeps (malloc's largest dynamic threshold for
/// mapping, `mallopt(3)`).
const MAX_KEPT_BYTES: u64 = 32 << 20;

/// What an acceleration structure will take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AccelMemory {
    /// The backend's name.
    pub backend: &'static str,
    /// Bytes of the finished structure.
    pub bytes: u64,
}

/// Bytes that a render will take, part by part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Forecast {
    /// The program itself, its libraries and threads.
    pub process: u64,
    /// Arrays of the meshes.
    pub meshes: u64,
    /// What triangles share for shading, lights and environments.
    pub facets_and_lights: u64,
    /// Textures with their levels.
    pub textures: u64,
    /// Remainder of reading files.
    pub reading: u64,
    /// Memory that the allocator keeps of the acceleration structure for guessing the camera. Embree's goes back to the system.
    pub guessing: u64,
    /// Acceleration structures, by backend, of which a render has one.
    pub accel: [AccelMemory; 3],
    /// Additional bytes to build one.
    pub building: u64,
    /// What the method has ready before the first sample, such as photons: an estimate.
    pub prepared: u64,
    /// Sums of the pixels.
    pub film: u64,
    /// Further channels of the pixels: `--aov`, alpha, the error map, parts of the light.
    pub channels: u64,
    /// Additional bytes to take samples, such as paths that carry light: an estimate.
    pub sampling: u64,
    /// Additional bytes to denoise the picture.
    pub denoising: u64,
    /// Additional bytes to write the pictures.
    pub writing: u64,
}

impl Forecast {
    /// Memory of a render of `scene`, whose largest OBJ file has so many bytes, to the pixels of `crop`, by a method that needs nothing beside them.
    pub fn new(scene: &Scene, crop: Rect, largest_file: u64) -> Self {
        let triangles = scene.triangle_count();
        let meshes: usize = scene.meshes().iter().map(|mesh| mesh.bytes()).sum();
        let textures: usize = scene.textures().iter().map(Texture::bytes).sum();
        let (meshes, textures) = (meshes as u64, textures as u64);
        let accel = |backend, per_triangle: u64| AccelMemory {
            backend,
            bytes: per_triangle * triangles,
        };
        Self {
            process: PROCESS_BYTES,
            meshes,
            facets_and_lights: scene.bytes().saturating_sub(meshes + textures),
            textures,
            reading: if largest_file > MAX_KEPT_BYTES { 0 } else { largest_file },
            guessing: 0,
            accel: [
                accel(
                    "embree",
                    if scene.is_compact() {
                        EMBREE_COMPACT_BYTES_PER_TRIANGLE
                    } else {
                        EMBREE_BYTES_PER_TRIANGLE
                    },
                ),
                accel("obvhs", OBVHS_BYTES_PER_TRIANGLE),
                accel("brute", 0),
            ],
            // A compact structure takes less while it is built than the reading of its files did.
            building: if scene.is_compact() {
                0
            } else {
                BUILDING_BYTES_PER_TRIANGLE * triangles
            },
            prepared: 0,
            film: Film::bytes(crop),
            channels: 0,
            sampling: 0,
            denoising: 0,
            writing: WRITING_BYTES_PER_PIXEL.saturating_mul(crop.area()),
        }
    }

    /// The forecast of a render whose camera was guessed by rays of `backend`.
    pub fn after_guess(self, backend: &str) -> Self {
        Self {
            guessing: match backend {
                "obvhs" => self.accel(backend) + self.building,
                _ => 0,
            },
            ..self
        }
    }

    /// Bytes that the pixels of `crop` take: sums, and pictures while they are written.
    pub fn of_pixels(crop: Rect) -> u64 {
        let writing = WRITING_BYTES_PER_PIXEL.saturating_mul(crop.area());
        Film::bytes(crop).saturating_add(writing)
    }

    /// Bytes of the scene's own arrays.
    pub fn scene(&self) -> u64 {
        self.meshes + self.facets_and_lights + self.textures
    }

    /// Bytes of the structure of a backend.
    pub fn accel(&self, backend: &str) -> u64 {
        let found = self.accel.iter().find(|accel| accel.backend == backend);
        found.map_or(0, |accel| accel.bytes)
    }

    /// The most that there is at a time with a backend: while its structure is built, while samples are taken, or while the picture is denoised and
    /// written.
    pub fn peak(&self, backend: &str) -> u64 {
        let stays = self.process + self.scene() + self.reading + self.guessing + self.accel(backend);
        let rendered = self
            .prepared
            .saturating_add(self.film)
            .saturating_add(self.channels)
            .saturating_add(self.sampling.max(self.writing.saturating_add(self.denoising)));
        stays.saturating_add(self.building.max(rendered))
    }
}
