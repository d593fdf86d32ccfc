use crate::accel::brute;
#[cfg(feature = "embree")]
use crate::accel::embree;

/// A ray-tracing backend that is built in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Backend {
    /// Intel Embree.
    #[cfg(feature = "embree")]
    Embree,
    /// Every triangle against every ray.
    Brute,
}

impl Backend {
    /// All backends built in, the default first.
    pub const ALL: &[Self] = &[
        #[cfg(feature = "embree")]
        Self::Embree,
        Self::Brute,
    ];

    /// The name users type.
    pub fn name(self) -> &'static str {
        match self {
            #[cfg(feature = "embree")]
            Self::Embree => embree::NAME,
            Self::Brute => brute::NAME,
        }
    }
}

/// What `--version` prints.
pub(super) fn version_text() -> String {
    let mut text = format!("embrasure {}", env!("CARGO_PKG_VERSION"));
    #[cfg(feature = "embree")]
    match embree::Device::new(1) {
        Ok(device) => text += &format!("\nbackend embree {} ({})", device.version(), device.isa()),
        Err(error) => text += &format!("\nbackend embree: {error}"),
    }
    text += "\nbackend brute (every triangle against every ray, for checks)";
    text
}
