use super::Lobe;

/// Sum of up to three lobes: diffuse, glossy or mirror-like, and transmitting.
/// [`BsdfView`](super::BsdfView) samples and evaluates mixes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mix {
    /// Lobes, smooth lobes first.
    pub(super) lobes: [Option<Lobe>; 3],
}

impl Mix {
    /// Mix of a diffuse, a glossy or mirror-like and a transmitting lobe, in this order.
    pub fn new(mut lobes: [Option<Lobe>; 3]) -> Self {
        lobes.sort_by_key(|lobe| lobe.as_ref().is_some_and(Lobe::is_delta));
        Self { lobes }
    }
}
