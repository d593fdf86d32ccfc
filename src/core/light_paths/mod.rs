//! Parts of the light by the paths that it has taken: bounces, direct and indirect light, and light path expressions (Heckbert 1990, "Adaptive Radiosity
//! Textures for Bidirectional Ray Tracing").
//!
//! Every part is an expression over the events of a path (`parts` has those of the parts with a name). `syntax` reads it, `positions` makes a position
//! automaton of it (Glushkov 1961), and `classes` joins those of all parts to one deterministic automaton, whose states are the classes of paths.
//!
//! The automaton reads a path from its light to the camera, whichever way an expression is written. Light that arrives at a vertex thus has one class for
//! all viewers of the vertex, which path reuse needs. Scattering moves light from its class to the classes behind the event, to each by its share.
//!
//! Classes do not overlap, and their sums add up to the picture exactly (`film/path_terms.rs`). Parts are sums over classes.

mod classes;
mod error;
mod parts;
mod positions;
mod syntax;

pub use error::LightPathError;
pub use parts::PathPart;

use crate::bsdf::EventKind;

/// Maximum number of classes of paths. `bounces` with direct and indirect light of all kinds of lobes has 21.
pub const MAX_CLASSES: usize = 64;

/// Maximum number of parts.
pub const MAX_PATH_PARTS: usize = 40;

/// Source of the light, as expressions distinguish it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PathLight {
    /// Environments and other lights at infinity, and a background.
    Background,
    /// Surfaces that emit.
    Surface,
    /// Points and spots.
    Point,
}

/// The parts of a picture that are distinguished by paths, and the automaton that does it.
#[derive(Clone, Debug)]
pub struct LightPaths {
    layers: Vec<String>,
    /// Class behind each kind of event, by class.
    next: Vec<[u8; 6]>,
    /// Parts that a class is in, where its paths end at the camera: a bit each.
    parts: Vec<u64>,
}

impl LightPaths {
    /// The automaton of all `parts`.
    ///
    /// # Errors
    ///
    /// More parts than [`MAX_PATH_PARTS`], or more classes than [`MAX_CLASSES`].
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

    /// Layers of the parts.
    pub fn layers(&self) -> &[String] {
        &self.layers
    }

    /// Class of light from `light` that has met nothing yet.
    pub fn class_of(light: PathLight) -> usize {
        light as usize
    }

    /// Class of the light in `class` when it has been scattered.
    pub fn scattered(&self, class: usize, event: EventKind) -> usize {
        self.next.get(class).map_or(0, |next| next[event as usize] as usize)
    }

    /// Whether light in `class` that reaches the camera is in the part.
    pub fn is_in(&self, class: usize, part: usize) -> bool {
        self.parts.get(class).is_some_and(|parts| parts >> part & 1 == 1)
    }
}

#[cfg(test)]
mod tests;
