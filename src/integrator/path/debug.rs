use crate::accel::Accel;
use crate::color::Spectrum;
use crate::geometry::Hit;
use crate::integrator::{Integrator, Sink, World};
use crate::material::BsdfSlot;
use crate::sampler::{SampleKey, Sampler};

/// Shows a property of the first surface as a colour.
#[derive(Debug)]
pub struct DebugIntegrator<'a, A> {
    /// The scene and the camera.
    pub world: World<'a, A>,
    /// Property to show.
    pub view: DebugView,
}

/// Property that [`DebugIntegrator`] shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DebugView {
    /// Shading normal in world space, (−1, −1, −1) black and (1, 1, 1) white; its back shows the same colour.
    #[default]
    Normals,
    /// Barycentric coordinates of the triangle's second and third corner as red and green.
    Uv,
    /// A colour for each triangle of each mesh.
    Ids,
}

impl<A: Accel> Integrator for DebugIntegrator<'_, A> {
    fn sample<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
        let slot = BsdfSlot::new();
        let Some((hit, vertex)) = self.world.look(key, sampler, &slot, out) else {
            return;
        };
        let color = match self.view {
            DebugView::Normals => Spectrum::from((0.5 * vertex.point.ns + 0.5).to_array()),
            DebugView::Uv => Spectrum::rgb(hit.b1, hit.b2, 0.0),
            DebugView::Ids => id_color(&hit),
        };
        out.radiance(color.into());
    }
}

/// A bright colour that neighbouring ids do not share: three bytes of a multiplicative hash.
fn id_color(hit: &Hit) -> Spectrum {
    let id = hit.geom.0.wrapping_mul(0x9e37_79b9) ^ hit.prim.0.wrapping_add(1).wrapping_mul(0x85eb_ca6b);
    let mixed = (id ^ (id >> 15)).wrapping_mul(0x2c1b_3c6d);
    let byte = |shift: u32| 0.2 + 0.8 * ((mixed >> shift) & 255) as f32 / 255.0;
    Spectrum::rgb(byte(24), byte(16), byte(8))
}
