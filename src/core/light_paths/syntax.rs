//! Light path expressions as text: a recursive-descent parser.

use super::error::LightPathError;

/// A set of symbols, one bit each.
pub(super) type Symbols = u16;

/// Sets of scattering events, with the bits in the order of [`EventKind`](crate::bsdf::EventKind).
const REFLECTED: Symbols = 0b000_111;
const TRANSMITTED: Symbols = 0b111_000;
const DIFFUSE: Symbols = 0b001_001;
const GLOSSY: Symbols = 0b010_010;
const SPECULAR: Symbols = 0b100_100;
/// All scattering events.
pub(super) const EVENTS: Symbols = REFLECTED | TRANSMITTED;
/// Symbols of the lights, in the order of [`PathLight`](super::PathLight).
pub(super) const BACKGROUND: Symbols = 1 << 6;
pub(super) const SURFACE: Symbols = 1 << 7;
pub(super) const POINT: Symbols = 1 << 8;
pub(super) const LIGHTS: Symbols = BACKGROUND | SURFACE | POINT;
/// Symbol of the camera.
pub(super) const CAMERA: Symbols = 1 << 9;

/// Maximum length of an expression, in characters. It limits the recursion of the parser.
const MAX_LENGTH: usize = 200;
/// Maximum count of a repetition.
const MAX_COUNT: u32 = 100;

/// Hint of errors about unknown symbols.
const KNOWN: &str = "symbols are C or E (camera), L, O, B (lights), D, G, S (scattering), R, T (reflection, transmission) and . (any scattering)";

/// A regular expression over symbols.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Node {
    /// Matches any symbol of the set.
    Symbol(Symbols),
    /// Matches a sequence: each node matches after the node before.
    Sequence(Vec<Node>),
    /// Matches any one of the nodes.
    Either(Vec<Node>),
    /// Matches `node` repeated `min` to `max` times; without `max`, `min` times or more.
    Repeated {
        node: Box<Node>,
        min: u32,
        max: Option<u32>,
    },
}

/// Parses an expression.
pub(super) fn parse(text: &str) -> Result<Node, LightPathError> {
    let symbols: Vec<(usize, char)> = text.chars().enumerate().filter(|(_, c)| !c.is_whitespace()).collect();
    if symbols.len() > MAX_LENGTH {
        let message = format!("the expression has {} characters", symbols.len());
        return Err(LightPathError::new(message, format!("use at most {MAX_LENGTH}")));
    }
    let mut parser = Parser {
        length: text.chars().count(),
        rest: &symbols,
    };
    let node = parser.either()?;
    match parser.rest.first() {
        None => Ok(node),
        Some(_) => Err(parser.unexpected("close only parentheses that are open")),
    }
}

struct Parser<'a> {
    length: usize,
    /// Remaining characters, each with its position in the text.
    rest: &'a [(usize, char)],
}

impl Parser<'_> {
    fn peek(&self) -> Option<char> {
        self.rest.first().map(|&(_, c)| c)
    }

    fn take(&mut self) -> Option<char> {
        let (&(_, c), rest) = self.rest.split_first()?;
        self.rest = rest;
        Some(c)
    }

    /// Consumes `wanted` if it is the next character.
    fn takes(&mut self, wanted: char) -> bool {
        let is_next = self.peek() == Some(wanted);
        if is_next {
            self.take();
        }
        is_next
    }

    /// Returns the error that the next character is unexpected. `help` is a hint on how to correct
    /// the expression.
    fn unexpected(&self, help: impl Into<String>) -> LightPathError {
        let message = match self.rest.first() {
            Some(&(place, c)) => format!("unexpected `{}` at character {}", c.escape_default(), place + 1),
            None => format!("the expression ends too early, after character {}", self.length),
        };
        LightPathError::new(message, help)
    }

    fn either(&mut self) -> Result<Node, LightPathError> {
        let mut nodes = vec![self.sequence()?];
        while self.takes('|') {
            nodes.push(self.sequence()?);
        }
        Ok(match nodes.len() {
            1 => nodes.swap_remove(0),
            _ => Node::Either(nodes),
        })
    }

    fn sequence(&mut self) -> Result<Node, LightPathError> {
        let mut nodes = vec![self.repeated()?];
        while self.peek().is_some_and(|c| !matches!(c, '|' | ')')) {
            nodes.push(self.repeated()?);
        }
        Ok(match nodes.len() {
            1 => nodes.swap_remove(0),
            _ => Node::Sequence(nodes),
        })
    }

    fn repeated(&mut self) -> Result<Node, LightPathError> {
        let mut node = self.single()?;
        loop {
            let (min, max) = match self.peek() {
                Some('*') => (0, None),
                Some('+') => (1, None),
                Some('?') => (0, Some(1)),
                Some('{') => {
                    self.take();
                    let counts = self.counts()?;
                    node = repeat(node, counts);
                    continue;
                }
                _ => return Ok(node),
            };
            self.take();
            node = repeat(node, (min, max));
        }
    }

    /// Parses `n}`, `n,}` or `n,m}`.
    fn counts(&mut self) -> Result<(u32, Option<u32>), LightPathError> {
        let min = self.count()?;
        let max = match self.takes(',') {
            true if self.peek() == Some('}') => None,
            true => Some(self.count()?),
            false => Some(min),
        };
        if max.is_some_and(|max| max == 0 || max < min) || !self.takes('}') {
            return Err(self.unexpected("write counts as {n}, {n,} or {n,m}, with m at least n and above 0"));
        }
        Ok((min, max))
    }

    fn count(&mut self) -> Result<u32, LightPathError> {
        let mut count = None;
        while let Some(digit) = self.peek().and_then(|c| c.to_digit(10)) {
            let next = count.unwrap_or(0) * 10 + digit;
            if next > MAX_COUNT {
                return Err(self.unexpected(format!("the maximum count is {MAX_COUNT}")));
            }
            count = Some(next);
            self.take();
        }
        count.ok_or_else(|| self.unexpected("write a count as {n}, {n,} or {n,m}"))
    }

    fn single(&mut self) -> Result<Node, LightPathError> {
        if self.takes('(') {
            let node = self.either()?;
            return if self.takes(')') {
                Ok(node)
            } else {
                Err(self.unexpected("close the parenthesis by )"))
            };
        }
        Ok(Node::Symbol(match self.peek() {
            Some('<') => self.event()?,
            _ => self.set()?,
        }))
    }

    /// Parses an event such as `<RD>`: the symbols that are in all sets between the brackets.
    fn event(&mut self) -> Result<Symbols, LightPathError> {
        self.take();
        let mut events = EVENTS;
        while self.peek() != Some('>') {
            let before = self.rest;
            let set = self.set()?;
            if set & !EVENTS != 0 || events & set == 0 {
                self.rest = before;
                return Err(self.unexpected("write an event as <RD>: R, T or . and then D, G, S or ."));
            }
            events &= set;
        }
        self.take();
        Ok(events)
    }

    /// Parses a set of symbols: a letter, `[DG]` or `[^S]`.
    fn set(&mut self) -> Result<Symbols, LightPathError> {
        if !self.takes('[') {
            return self.letter();
        }
        let is_complement = self.takes('^');
        let mut symbols = 0;
        while symbols == 0 || self.peek() != Some(']') {
            let before = self.rest;
            symbols |= match self.peek() {
                Some('<') => self.event()?,
                _ => self.letter()?,
            };
            if sort(symbols).is_none() {
                self.rest = before;
                return Err(self.unexpected("a set has either scattering events or lights, not both"));
            }
        }
        self.take();
        let all = sort(symbols).unwrap_or(symbols);
        match is_complement {
            false => Ok(symbols),
            true if all == symbols => {
                Err(self.unexpected("the set before this character is empty: remove a symbol from [^…]"))
            }
            true => Ok(all & !symbols),
        }
    }

    fn letter(&mut self) -> Result<Symbols, LightPathError> {
        let symbols = match self.peek() {
            Some('C' | 'E') => CAMERA,
            Some('L') => LIGHTS,
            Some('O') => SURFACE,
            Some('B') => BACKGROUND,
            Some('D') => DIFFUSE,
            Some('G') => GLOSSY,
            Some('S') => SPECULAR,
            Some('R') => REFLECTED,
            Some('T') => TRANSMITTED,
            Some('.') => EVENTS,
            _ => return Err(self.unexpected(KNOWN)),
        };
        self.take();
        Ok(symbols)
    }
}

fn repeat(node: Node, (min, max): (u32, Option<u32>)) -> Node {
    Node::Repeated {
        node: Box::new(node),
        min,
        max,
    }
}

/// All symbols of the same sort as `symbols`: scattering events, lights, or the camera. `None` if
/// `symbols` has several sorts.
fn sort(symbols: Symbols) -> Option<Symbols> {
    [EVENTS, LIGHTS, CAMERA].into_iter().find(|sort| symbols & !sort == 0)
}
