//! Named parts: their names for `--aov`, their layers, and their expressions.

use super::error::LightPathError;
use super::positions::Positions;
use super::syntax::parse;
use crate::math::excerpt;

/// Names and expressions of the named parts.
const NAMED: [(&str, &str); 9] = [
    ("emission", "CL"),
    ("direct", "C.L"),
    ("indirect", "C.{2,}L"),
    ("diffuse_direct", "C<.D>L"),
    ("diffuse_indirect", "C<.D>.+L"),
    ("specular_direct", "C<R[GS]>L"),
    ("specular_indirect", "C<R[GS]>.+L"),
    ("transmission_direct", "C<T[GS]>L"),
    ("transmission_indirect", "C<T[GS]>.+L"),
];

/// Layer of the light with more bounces than the highest layer `bounce.N`.
const REST: &str = "bounce.rest";
/// Default maximum number of bounces that `bounces` separates.
const USUAL_BOUNCES: u32 = 5;
/// Maximum number of bounces that `bounces` can separate.
const MAX_BOUNCES: u32 = 20;
/// Maximum length of the name of an expression, in characters.
const MAX_NAME: usize = 23;

/// A part of the image: the light of all paths that an expression matches.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PathPart {
    layer: String,
    expression: String,
    /// True if the user wrote the expression.
    is_own: bool,
}

impl PathPart {
    /// Prefix of the name of a part that the user defines by an expression.
    const OWN: &str = "lpe:";

    /// Names of all parts that `--aov` accepts, for the help text.
    pub fn names() -> impl Iterator<Item = &'static str> {
        let named = NAMED.iter().map(|(name, _)| *name);
        named.chain(["bounces", "bounces:N", "bounce.N", "lpe:NAME=EXPRESSION"])
    }

    /// Returns true if `name` is the name of a part or begins with the prefix of such a name.
    /// [`PathPart::parse`] checks the number or the expression after the prefix.
    pub fn is_name(name: &str) -> bool {
        let is_bounces = name == "bounces" || name.starts_with("bounces:") || name.starts_with("bounce.");
        is_bounces || name.starts_with(Self::OWN) || NAMED.iter().any(|(known, _)| *known == name)
    }

    /// Parses a name of one or several parts: `direct`, `bounces:4`, `lpe:NAME=EXPRESSION`.
    ///
    /// # Errors
    ///
    /// An unknown name, a number above the maximum, or an invalid expression.
    pub fn parse(name: &str) -> Result<Vec<Self>, LightPathError> {
        if let Some((known, expression)) = NAMED.iter().find(|(known, _)| *known == name) {
            return Ok(vec![Self::new(*known, *expression)]);
        }
        if let Some(own) = name.strip_prefix(Self::OWN) {
            return Ok(vec![Self::own(own)?]);
        }
        if let Some(bounce) = name.strip_prefix("bounce.") {
            if name == REST {
                let help = "use bounces or bounces:N, which include this channel";
                return Err(LightPathError::new(
                    "the channel of all further bounces needs the bounces before it",
                    help,
                ));
            }
            return Ok(vec![Self::bounce(bounces(bounce)?)]);
        }
        let last = match name.strip_prefix("bounces") {
            Some("") => USUAL_BOUNCES,
            Some(count) => bounces(count.strip_prefix(':').unwrap_or_default())?,
            None => {
                let names: Vec<&str> = Self::names().collect();
                return Err(LightPathError::new(
                    "there is no such part of the light",
                    format!("choose among {}", names.join(", ")),
                ));
            }
        };
        let rest = Self::new(REST, format!("C.{{{},}}L", last + 1));
        Ok((0..=last).map(Self::bounce).chain([rest]).collect())
    }

    /// Adds `parts` to `all`, without duplicates.
    ///
    /// # Errors
    ///
    /// If two different parts have the same layer.
    pub fn add(all: &mut Vec<Self>, parts: Vec<Self>) -> Result<(), LightPathError> {
        let of_layer = |part: &Self| all.iter().find(|known| known.layer == part.layer);
        let clash = parts
            .iter()
            .find_map(|part| Some((part, of_layer(part).filter(|known| *known != part)?)));
        if let Some((part, known)) = clash {
            return Err(LightPathError::new(
                format!(
                    "{} is defined twice, as {} and as {}",
                    part.layer, known.expression, part.expression
                ),
                "give each expression a name of its own, and write bounces once",
            ));
        }
        let new: Vec<Self> = parts.into_iter().filter(|part| of_layer(part).is_none()).collect();
        all.extend(new);
        Ok(())
    }

    /// Name of the layer of the part's channels.
    pub fn layer(&self) -> &str {
        &self.layer
    }

    /// The expression.
    pub fn expression(&self) -> &str {
        &self.expression
    }

    /// Full name of the part: its layer, or `lpe:NAME=EXPRESSION` for an expression of the user.
    pub fn describe(&self) -> String {
        match self.layer.strip_prefix("lpe_").filter(|_| self.is_own) {
            Some(name) => format!("{}{name}={}", Self::OWN, self.expression),
            // The expression of `bounce.rest` depends on the number of separated bounces.
            None if self.layer == REST => format!("{REST}={}", self.expression),
            None => self.layer.clone(),
        }
    }

    pub(super) fn positions(&self) -> Result<Positions, LightPathError> {
        let within = |error: LightPathError| LightPathError {
            message: format!("{}: {}", self.expression, error.message),
            ..error
        };
        Positions::new(&parse(&self.expression).map_err(within)?).map_err(within)
    }

    fn new(layer: impl Into<String>, expression: impl Into<String>) -> Self {
        Self {
            layer: layer.into(),
            expression: expression.into(),
            is_own: false,
        }
    }

    /// Part with the light that was scattered `count` times.
    fn bounce(count: u32) -> Self {
        match count {
            0 => Self::new("bounce.0", "CL"),
            _ => Self::new(format!("bounce.{count}"), format!("C.{{{count}}}L")),
        }
    }

    /// Parses `NAME=EXPRESSION`, a part with an expression of the user.
    fn own(text: &str) -> Result<Self, LightPathError> {
        let Some((name, expression)) = text.split_once('=') else {
            let help = "write lpe:NAME=EXPRESSION, such as lpe:caustics=LS+DE";
            return Err(LightPathError::new("an expression needs a name", help));
        };
        let is_letter = |c: char| c.is_ascii_alphanumeric() || c == '_';
        if name.is_empty() || name.len() > MAX_NAME || !name.chars().all(is_letter) {
            let help = format!("use 1 to {MAX_NAME} letters, digits and _");
            return Err(LightPathError::new(
                format!("`{}` is not a layer name", excerpt(name).escape_default()),
                help,
            ));
        }
        let part = Self {
            layer: format!("lpe_{name}"),
            expression: expression.chars().filter(|c| !c.is_whitespace()).collect(),
            is_own: true,
        };
        // Parse the text with its spaces, so that errors contain positions in the text of the user.
        Positions::new(&parse(expression)?)?;
        Ok(part)
    }
}

/// Parses a number of bounces.
fn bounces(text: &str) -> Result<u32, LightPathError> {
    let count = text.parse().ok().filter(|&count| count <= MAX_BOUNCES);
    count.ok_or_else(|| {
        LightPathError::new(
            format!("`{}` is not a number of bounces", excerpt(text).escape_default()),
            format!("use 0 to {MAX_BOUNCES}"),
        )
    })
}
