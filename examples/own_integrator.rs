//! Renders a scene file with an integrator of this example, which shows the visibility of the sky:
//!
//! ```text
//! cargo run --release --example own_integrator -- scenes/cornell-box.toml out/sky.png
//! ```

use embrasure::accel::Accel;
use embrasure::integrator::{SampleTracer, Sink, World};
use embrasure::material::BsdfSlot;
use embrasure::prelude::*;
use embrasure::sampler::{Bounce, Dimension, SampleKey, Sampler};
use embrasure::sampling::warp::cosine_hemisphere;
use std::error::Error;

/// Cosine-weighted fraction of the hemisphere in which the sky is visible, times the albedo of the
/// surface.
struct SkyVisibility;

impl SampleTracer for SkyVisibility {
    fn sample<S: Sampler>(&self, world: &World<&dyn Accel>, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
        // Find the first surface. This also fills the channels of albedo, normals and depth
        let slot = BsdfSlot::new();
        let Some(vertex) = world.first_vertex(key, sampler, &slot, out) else {
            return;
        };

        // Sample a cosine-distributed direction on the viewer's side. Dimensions have names, so
        // that a new dimension does not shift the others
        let mut wi = cosine_hemisphere(sampler.get_2d(Dimension::bounce(0, Bounce::Direction)));
        wi.z = wi.z.copysign(vertex.wo.z);
        let open = world.transmittance(&world.ray_along(&vertex, wi), out).color();
        out.radiance(open * vertex.bsdf.albedo());
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [scene, path] = args.as_slice() else {
        return Err("two arguments are expected: a scene file, and the PNG file to write".into());
    };
    let file = SceneFile::load(scene)?;
    let session = Session::load(&file, Settings::of(&file), &())?;
    let renderer = session.renderer()?;
    let mut state = renderer.start();
    renderer.render_with(&mut state, &SkyVisibility, &());
    renderer.develop(&state).save_png(path, &session.settings().tone)?;
    Ok(())
}
