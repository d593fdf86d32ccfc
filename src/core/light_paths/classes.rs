//! Classes of paths: the states of one deterministic automaton for all expressions. The automaton
//! is made by the subset construction and minimised by Moore's algorithm.

use super::MAX_CLASSES;
use super::error::LightPathError;
use super::positions::{Positions, Set};
use super::syntax::{BACKGROUND, POINT, SURFACE};
use std::collections::HashMap;

/// Number of kinds of scattering events: the variants of [`EventKind`](crate::bsdf::EventKind).
const KINDS: usize = 6;
/// Symbols of the kinds of light, in the order of [`PathLight`](super::PathLight). Class i is the
/// class of unscattered light of kind i.
const LIGHTS: [u16; 3] = [BACKGROUND, SURFACE, POINT];
/// Maximum number of states before minimisation.
const MAX_STATES: usize = 1 << 12;

/// For each class, the next class for each kind of scattering event. Then for each class, the bit
/// set of the parts to which light of this class belongs.
pub(super) type Classes = (Vec<[u8; KINDS]>, Vec<u64>);

/// Computes the classes of paths that `expressions` distinguish.
pub(super) fn classes(expressions: &[Positions]) -> Result<Classes, LightPathError> {
    let states = States::new(expressions).ok_or_else(too_many)?;
    let class_of = states.minimised();
    let count = class_of.iter().max().map_or(0, |last| last + 1);
    if count > MAX_CLASSES {
        return Err(too_many());
    }
    let (mut next, mut parts) = (vec![[0; KINDS]; count], vec![0; count]);
    for (state, &class) in class_of.iter().enumerate() {
        next[class] = states.next[state].map(|state| class_of[state] as u8);
        parts[class] = states.parts[state];
    }
    Ok((next, parts))
}

fn too_many() -> LightPathError {
    LightPathError::new(
        format!("these channels distinguish more than {MAX_CLASSES} classes of paths"),
        "ask for fewer bounces or fewer expressions in one render",
    )
}

/// Deterministic automaton of all expressions: the product of their subset automata.
struct States {
    next: Vec<[usize; KINDS]>,
    parts: Vec<u64>,
}

impl States {
    /// Builds the states. `None` if there are more than [`MAX_STATES`] states.
    fn new(expressions: &[Positions]) -> Option<Self> {
        // Make one start state for each kind of light, even if two start states are equal. Class i
        // is then the class of light kind i, as `LightPaths::class_of` assumes.
        let start = |&light: &u16| -> Vec<Set> { expressions.iter().map(|e| e.matching(e.first, light)).collect() };
        let mut sets: Vec<Vec<Set>> = LIGHTS.iter().map(start).collect();
        let mut known: HashMap<Vec<Set>, usize> = sets.iter().cloned().zip(0..).collect();
        let mut states = Self {
            next: Vec::new(),
            parts: Vec::new(),
        };
        let mut state = 0;
        while let Some(set) = sets.get(state).cloned() {
            let accepts = expressions.iter().zip(&set).map(|(e, set)| e.accepts(*set));
            states.parts.push(
                accepts
                    .enumerate()
                    .fold(0, |bits, (i, is_in)| bits | u64::from(is_in) << i),
            );
            let mut next = [0; KINDS];
            for (kind, next) in next.iter_mut().enumerate() {
                let after = expressions.iter().zip(&set);
                let after: Vec<Set> = after.map(|(e, set)| e.matching(e.following(*set), 1 << kind)).collect();
                *next = *known.entry(after).or_insert_with_key(|after| {
                    sets.push(after.clone());
                    sets.len() - 1
                });
            }
            states.next.push(next);
            if sets.len() > MAX_STATES {
                return None;
            }
            state += 1;
        }
        Some(states)
    }

    /// Class of each state. Two states have the same class if no sequence of events distinguishes
    /// them. Classes are numbered in the order of their first states.
    fn minimised(&self) -> Vec<usize> {
        // Each start state keeps a separate class.
        let of_state = |state: usize| (state.min(LIGHTS.len()), self.parts[state]);
        let mut classes = numbered((0..self.parts.len()).map(of_state));
        loop {
            let refined = |state: usize| (classes[state], self.next[state].map(|next| classes[next]));
            let finer = numbered((0..classes.len()).map(refined));
            if finer == classes {
                return classes;
            }
            classes = finer;
        }
    }
}

/// Numbers the keys in the order of their first occurrence. Equal keys get the same number.
fn numbered<K: std::hash::Hash + Eq>(keys: impl Iterator<Item = K>) -> Vec<usize> {
    let mut numbers = HashMap::new();
    keys.map(|key| {
        let count = numbers.len();
        *numbers.entry(key).or_insert(count)
    })
    .collect()
}
