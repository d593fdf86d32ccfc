//! Reference loop in Rust to measure the overhead of `em.intersect` (python/tests/measure.py). It
//! finds the closest hits of the rays in a file.
//!
//! ```text
//! trace_rays SCENE RAYS       RAYS has six float32 for each ray, origin and direction
//! ```
//!
//! Prints the time of the loop in seconds, the number of hits, and the sum of their distances.

use embrasure::geometry::Hit;
use embrasure::math::{Ray, Vec3};
use embrasure::{SceneFile, Session, Settings};
use rayon::prelude::*;
use std::error::Error;
use std::fs;
use std::path::Path;
use std::time::Instant;

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [scene, rays] = args.as_slice() else {
        return Err("two arguments are expected: a scene file and a file of rays".into());
    };
    let file = SceneFile::load(Path::new(scene))?;
    let session = Session::load(&file, Settings::of(&file), &())?;
    let renderer = session.renderer()?;
    let accel = renderer.queries();
    let bytes = fs::read(rays)?;
    let number = |bytes: &[u8]| f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
    let numbers: Vec<f32> = bytes.chunks_exact(4).map(number).collect();
    let ray = |row: &[f32]| Ray::new(Vec3::from_slice(row), Vec3::from_slice(&row[3..]));
    let rays: Vec<Ray> = numbers.chunks_exact(6).map(ray).collect();

    for _ in 0..3 {
        let start = Instant::now();
        let hits: Vec<Option<Hit>> = session.install(|| rays.par_iter().map(|ray| accel.intersect(ray)).collect());
        let seconds = start.elapsed().as_secs_f64();
        let sum: f64 = hits.iter().flatten().map(|hit| f64::from(hit.t)).sum();
        println!("{seconds:.4} {} {sum:.6e}", hits.iter().flatten().count());
    }
    Ok(())
}
