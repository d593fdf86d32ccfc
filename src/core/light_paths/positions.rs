//! Position automata of expressions (Glushkov 1961, "The Abstract Theory of Automata"). A position
//! is one occurrence of a symbol, after repetitions are written out. Each position is a state.

use super::error::LightPathError;
use super::syntax::{CAMERA, LIGHTS, Node, Symbols};

/// A set of positions, one bit each.
pub(super) type Set = u128;

/// Automaton of one expression. It reads a path from the light to the camera.
#[derive(Clone, Debug)]
pub(super) struct Positions {
    symbols: Vec<Symbols>,
    /// Positions of lights, at which a path can start.
    pub first: Set,
    /// For each position, the positions that can follow it.
    next: Vec<Set>,
    /// Positions of the camera symbol, which ends every path.
    camera: Set,
}

impl Positions {
    /// Builds the automaton of `node`. The expression must lead from the camera to a light, or from
    /// a light to the camera.
    pub fn new(node: &Node) -> Result<Self, LightPathError> {
        let mut builder = Builder::default();
        let all = builder.add(node)?;
        let Builder { symbols, follow } = builder;
        let of = |sort: Symbols| {
            let is_of = |&i: &usize| symbols[i] & !sort == 0;
            (0..symbols.len()).filter(is_of).fold(0, |set, i| set | 1 << i)
        };
        let (camera, lights) = (of(CAMERA), of(LIGHTS));
        let is_from_camera = all.first & !camera == 0;
        let is_from_light = all.last & !camera == 0;
        let ends = if is_from_camera { all.last } else { all.first };
        if all.is_nullable || !(is_from_camera || is_from_light) || ends & !lights != 0 {
            return Err(LightPathError::new(
                "the expression has to lead from the camera to a light, or from a light to the camera",
                "write C…L as in C<RD>L, or L…E as in LS+DE",
            ));
        }
        // Positions that precede position `i`. The automaton reads paths from the light. If the
        // expression starts at the camera, the preceding positions are therefore the next positions
        // of the automaton.
        let before = |i: usize| {
            let precedes = |&j: &usize| follow[j] >> i & 1 == 1;
            (0..symbols.len()).filter(precedes).fold(0, |set, j| set | 1 << j)
        };
        let (next, preceding): (Vec<Set>, Vec<Set>) = {
            let before: Vec<Set> = (0..symbols.len()).map(before).collect();
            if is_from_camera {
                (before, follow)
            } else {
                (follow, before)
            }
        };
        let lies_between = |i: usize| next[i] != 0 && camera >> i & 1 == 1 || preceding[i] != 0 && lights >> i & 1 == 1;
        if (0..symbols.len()).any(lies_between) {
            return Err(LightPathError::new(
                "a light or the camera stands between scattering events",
                "name the camera and the light once, at the ends: C…L or L…E",
            ));
        }
        Ok(Self {
            symbols,
            first: ends,
            next,
            camera,
        })
    }

    /// Elements of `positions` that match at least one of `symbols`.
    pub fn matching(&self, positions: Set, symbols: Symbols) -> Set {
        let matches = |&i: &usize| positions >> i & 1 == 1 && self.symbols[i] & symbols != 0;
        (0..self.symbols.len()).filter(matches).fold(0, |set, i| set | 1 << i)
    }

    /// Positions that can follow any of `positions`.
    pub fn following(&self, positions: Set) -> Set {
        let members = (0..self.symbols.len()).filter(|i| positions >> i & 1 == 1);
        members.fold(0, |set, i| set | self.next[i])
    }

    /// Returns true if a path can end at the camera after one of `positions`.
    pub fn accepts(&self, positions: Set) -> bool {
        self.following(positions) & self.camera != 0
    }
}

/// Possible first and last positions of a part of an expression.
#[derive(Clone, Copy)]
struct Fragment {
    is_nullable: bool,
    first: Set,
    last: Set,
}

#[derive(Default)]
struct Builder {
    symbols: Vec<Symbols>,
    follow: Vec<Set>,
}

impl Builder {
    fn add(&mut self, node: &Node) -> Result<Fragment, LightPathError> {
        match node {
            Node::Symbol(symbols) => {
                let index = self.symbols.len();
                if index == Set::BITS as usize {
                    return Err(LightPathError::new(
                        format!("the expression is longer than {} events", Set::BITS),
                        "use smaller counts",
                    ));
                }
                self.symbols.push(*symbols);
                self.follow.push(0);
                Ok(Fragment {
                    is_nullable: false,
                    first: 1 << index,
                    last: 1 << index,
                })
            }
            Node::Sequence(nodes) => {
                let mut all = None;
                for node in nodes {
                    let fragment = self.add(node)?;
                    all = Some(self.joined(all, fragment));
                }
                Ok(all.unwrap_or(EMPTY))
            }
            Node::Either(nodes) => nodes.iter().try_fold(
                Fragment {
                    is_nullable: false,
                    ..EMPTY
                },
                |all, node| {
                    let fragment = self.add(node)?;
                    Ok(Fragment {
                        is_nullable: all.is_nullable || fragment.is_nullable,
                        first: all.first | fragment.first,
                        last: all.last | fragment.last,
                    })
                },
            ),
            Node::Repeated { node, min, max } => {
                // Add a copy of `node` for each repetition. Without a maximum, the last copy is a
                // loop.
                let copies = max.unwrap_or((*min).max(1));
                let mut all = None;
                for i in 0..copies {
                    let mut fragment = self.add(node)?;
                    if max.is_none() && i + 1 == copies {
                        self.link(fragment.last, fragment.first);
                    }
                    fragment.is_nullable |= i >= *min;
                    all = Some(self.joined(all, fragment));
                }
                Ok(all.unwrap_or(EMPTY))
            }
        }
    }

    /// Concatenation of two fragments.
    fn joined(&mut self, before: Option<Fragment>, after: Fragment) -> Fragment {
        let Some(before) = before else { return after };
        self.link(before.last, after.first);
        Fragment {
            is_nullable: before.is_nullable && after.is_nullable,
            first: before.first | if before.is_nullable { after.first } else { 0 },
            last: after.last | if after.is_nullable { before.last } else { 0 },
        }
    }

    fn link(&mut self, from: Set, to: Set) {
        for (i, follow) in self.follow.iter_mut().enumerate() {
            if from >> i & 1 == 1 {
                *follow |= to;
            }
        }
    }
}

/// The empty expression.
const EMPTY: Fragment = Fragment {
    is_nullable: true,
    first: 0,
    last: 0,
};
