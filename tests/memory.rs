//! Scenes that are built and dropped leak no memory. This is a separate program because it measures
//! the memory of the whole process.
#![cfg(all(target_os = "linux", any(feature = "embree", feature = "obvhs")))]

mod support;

use embrasure::accel::Accel;
use embrasure::geometry::PrimId;
use embrasure::math::{Ray, Vec3};
use embrasure::scene::{Scene, SceneBuilder};
use support::*;

/// Resident memory of the process in bytes.
fn resident() -> u64 {
    let statm = std::fs::read_to_string("/proc/self/statm").unwrap();
    let pages: u64 = statm.split_whitespace().nth(1).unwrap().parse().unwrap();
    pages * 4096
}

fn build_and_drop() {
    let scene: Scene = {
        let mut builder = SceneBuilder::new();
        add(&mut builder, sphere(1.0, Vec3::ZERO, 3), material(0.5, 0.0));
        add(&mut builder, room(), material(0.5, 1.0));
        builder.build().unwrap().0
    };
    let accel = backend(&scene);
    let target = scene.meshes()[0].surface_point(PrimId(7), 0.3, 0.3).p;
    assert!(accel.intersect(&Ray::new(Vec3::ZERO, target)).is_some());
}

#[test]
fn memory_after_1000_scenes_is_unchanged() {
    // Let caches and thread pools grow to their full size first.
    (0..100).for_each(|_| build_and_drop());
    let before = resident();
    (0..1000).for_each(|_| build_and_drop());
    let grown = resident().saturating_sub(before);
    println!("grown by {grown} bytes");
    // A scene has some 100 KB. A leak of 5 % of each scene would fail, with room for the data of
    // AddressSanitizer (2 MB).
    assert!(grown < 5_000_000, "{grown} bytes more after 1000 scenes");
}
