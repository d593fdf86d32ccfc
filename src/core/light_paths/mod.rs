//! Separation of the light into parts by path: bounces, direct and indirect light, and light path
//! expressions (Heckbert 1990, "Adaptive Radiosity Textures for Bidirectional Ray Tracing").
//!
//! Every part is defined by an expression over the events of a path. `parts` lists the named parts,
//! `syntax` parses expressions, and `positions` converts an expression to a position automaton
//! (Glushkov 1961). `classes` combines the automata of all parts into one deterministic automaton.
//! The states of this automaton are the classes of paths.
//!
//! The automaton reads a path from the light to the camera, even if the expression is written from
//! the camera to the light. Light that arrives at a vertex then has the same class for all pixels
//! that use the vertex. The reuse of paths between pixels needs this. A material with several kinds
//! of lobes divides the light of a class at a scattering event: each kind of lobe leads to its own
//! next class, which gets the light that lobes of this kind scatter.
//!
//! Classes do not overlap, and the sum over all classes is exactly the image
//! (`film/path_terms.rs`). The light of a part is a sum over classes.

mod classes;
mod error;
mod parts;
mod positions;
mod syntax;

pub use error::LightPathError;
pub use parts::PathPart;

use crate::bsdf::EventKind;

/// Maximum number of classes of paths. `bounces` together with the direct and indirect parts of all
/// kinds of lobes needs 21 classes.
pub const MAX_CLASSES: usize = 64;

/// Maximum number of parts.
pub const MAX_PATH_PARTS: usize = 40;

/// Kinds of light sources that expressions distinguish.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PathLight {
    /// Environments and other lights at infinity, and a background.
    Background,
    /// Emitting surfaces.
    Surface,
    /// Point and spot lights.
    Point,
}

/// The light parts of an image, and the automaton that separates them.
#[derive(Clone, Debug)]
pub struct LightPaths {
    layers: Vec<String>,
    /// Next class, for each class and kind of scattering event.
    next: Vec<[u8; 6]>,
    /// For each class, the bit set of the parts to which light of this class belongs when it
    /// reaches the camera.
    parts: Vec<u64>,
}

impl LightPaths {
    /// Builds the automaton of all `parts`.
    ///
    /// # Errors
    ///
    /// If there are more parts than [`MAX_PATH_PARTS`], or more classes than [`MAX_CLASSES`].
    pub fn new(parts: &[PathPart]) -> Result<Self, LightPathError> {
        if parts.len() > MAX_PATH_PARTS {
            return Err(LightPathError::new(
                format!("{} light path channels are too many", parts.len()),
                format!("ask for at most {MAX_PATH_PARTS}, for example with fewer bounces"),
            ));
        }
        let expressions = parts.iter().map(PathPart::positions).collect::<Result<Vec<_>, _>>()?;
        let (next, of_classes) = classes::classes(&expressions)?;
        Ok(Self {
            layers: parts.iter().map(|part| part.layer().to_string()).collect(),
            next,
            parts: of_classes,
        })
    }

    /// Number of classes.
    pub fn classes(&self) -> usize {
        self.next.len()
    }

    /// Name of the image layer (group of channels) of each part.
    pub fn layers(&self) -> &[String] {
        &self.layers
    }

    /// Class of light of the kind `light` before its first scattering event.
    pub fn class_of(light: PathLight) -> usize {
        light as usize
    }

    /// Class of the light in `class` after the scattering event `event`.
    pub fn scattered(&self, class: usize, event: EventKind) -> usize {
        self.next.get(class).map_or(0, |next| next[event as usize] as usize)
    }

    /// Returns true if light in `class` that reaches the camera is in the part `part`.
    pub fn is_in(&self, class: usize, part: usize) -> bool {
        self.parts.get(class).is_some_and(|parts| parts >> part & 1 == 1)
    }
}

#[cfg(test)]
mod tests;
