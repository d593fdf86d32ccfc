//! Parts of the light by their paths: bounces, direct and indirect light, and light path
//! expressions (Heckbert 1990, "Adaptive Radiosity Textures for Bidirectional Ray Tracing").
//!
//! Every part is an expression over the events of a path (`parts` has the named parts). `syntax`
//! parses it, and `positions` converts it to a position automaton (Glushkov 1961). `classes`
//! combines all parts to one deterministic automaton, whose states are the classes of paths.
//!
//! The automaton reads a path from its light to the camera, for both notations of an expression. So
//! light that arrives at a vertex has one class for all viewers of the vertex, which path reuse
//! needs. Scattering moves light from its class to the classes after the event, to each by its
//! share.
//!
//! Classes do not overlap, and their sums add up to the image exactly (`film/path_terms.rs`). Parts
//! are sums over classes.

mod classes;
mod error;
mod parts;
mod positions;
mod syntax;

pub use error::LightPathError;
pub use parts::PathPart;

use crate::bsdf::EventKind;

/// Maximum number of classes of paths. `bounces` with direct and indirect light of all kinds of
/// lobes has 21.
pub const MAX_CLASSES: usize = 64;

/// Maximum number of parts.
pub const MAX_PATH_PARTS: usize = 40;

/// Source of the light, as expressions distinguish it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PathLight {
    /// Environments and other lights at infinity, and a background.
    Background,
    /// Emitting surfaces.
    Surface,
    /// Point and spot lights.
    Point,
}

/// Parts of the image that are separated by paths, and the automaton that separates them.
#[derive(Clone, Debug)]
pub struct LightPaths {
    layers: Vec<String>,
    /// Class after each kind of event, for each class.
    next: Vec<[u8; 6]>,
    /// Bit set of the parts of each class, for paths that end at the camera.
    parts: Vec<u64>,
}

impl LightPaths {
    /// Automaton of all `parts`.
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

    /// Layer of each part.
    pub fn layers(&self) -> &[String] {
        &self.layers
    }

    /// Class of light from `light` before its first scattering event.
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
