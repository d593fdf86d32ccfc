//! Patterns for names of materials and parts. The crate `glob` is not used, because it reads `[` as
//! the start of a class, and names of materials contain brackets.

/// A pattern for names: `*` matches any characters, `?` one character, and `\` escapes the next
/// character.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Glob(Vec<Token>);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Token {
    Any,
    One,
    Char(char),
}

impl Glob {
    /// Parses a pattern. A `\` at the end is literal.
    pub fn new(pattern: &str) -> Self {
        let mut parts = Vec::new();
        let mut chars = pattern.chars();
        while let Some(c) = chars.next() {
            parts.push(match c {
                '*' => Token::Any,
                '?' => Token::One,
                '\\' => Token::Char(chars.next().unwrap_or(c)),
                c => Token::Char(c),
            });
        }
        Self(parts)
    }

    /// Pattern that matches only `name`.
    pub fn exact(name: &str) -> Self {
        Self(name.chars().map(Token::Char).collect())
    }

    /// Returns true if the pattern matches the whole `name`.
    pub fn matches(&self, name: &str) -> bool {
        let name: Vec<char> = name.chars().collect();
        let (mut part, mut at) = (0, 0);
        // Index in the pattern of the last `*`, and end in `name` of the text that this `*`
        // matches. If the rest of the pattern does not match, the text grows by one character.
        let mut star: Option<(usize, usize)> = None;
        while at < name.len() {
            match self.0.get(part) {
                Some(Token::Any) => {
                    star = Some((part, at));
                    part += 1;
                }
                Some(Token::One) => (part, at) = (part + 1, at + 1),
                Some(Token::Char(c)) if *c == name[at] => (part, at) = (part + 1, at + 1),
                _ => match &mut star {
                    Some((first, reach)) => {
                        *reach += 1;
                        (part, at) = (*first + 1, *reach);
                    }
                    None => return false,
                },
            }
        }
        self.0[part..].iter().all(|part| *part == Token::Any)
    }

    /// Returns true if the pattern has no wildcards. It then matches only [`Glob::literal`].
    pub fn is_exact(&self) -> bool {
        self.0.iter().all(|part| matches!(part, Token::Char(_)))
    }

    /// Characters of the pattern without the wildcards. With these, similar names can be searched.
    pub fn literal(&self) -> String {
        let chars = self.0.iter().filter_map(|part| match part {
            Token::Char(c) => Some(*c),
            Token::Any | Token::One => None,
        });
        chars.collect()
    }

    /// Text of the pattern. In a table, several entries may need the same pattern, but their keys
    /// must differ. `copy` therefore selects one of several texts that mean the same pattern. These
    /// texts differ in the literal characters that are escaped by `\`.
    pub fn text(&self, copy: usize) -> String {
        let mut left = copy;
        let mut text = String::new();
        for part in &self.0 {
            match part {
                Token::Any => text.push('*'),
                Token::One => text.push('?'),
                Token::Char(c) => {
                    let needs_escape = matches!(c, '*' | '?' | '\\');
                    if needs_escape || left % 2 == 1 {
                        text.push('\\');
                    }
                    if !needs_escape {
                        left /= 2;
                    }
                    text.push(*c);
                }
            }
        }
        // If the pattern has too few literal characters for `copy`, repeat `*`, which matches the
        // same names.
        if left > 0 {
            text.push_str(&"*".repeat(if self.0.contains(&Token::Any) { left } else { 0 }));
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_match_whole_names() {
        for (pattern, yes, no) in [
            ("Floor", &["Floor"][..], &["Floor1", "floor", ""][..]),
            ("Floor*", &["Floor", "Floor.001"], &["AFloor"]),
            ("*", &["", "a", "Küche"], &[]),
            ("?", &["a", "ü"], &["", "ab"]),
            ("*a*b", &["ab", "xaxxb", "aabab"], &["aba", "b"]),
            ("a\\*", &["a*"], &["ab", "a"]),
            ("\\A?c", &["Abc"], &["bc"]),
            ("a\\", &["a\\"], &["a"]),
            ("", &[""], &["a"]),
        ] {
            let glob = Glob::new(pattern);
            assert!(yes.iter().all(|name| glob.matches(name)), "{pattern}");
            assert!(!no.iter().any(|name| glob.matches(name)), "{pattern}");
        }
        assert!(Glob::exact("a*").matches("a*") && !Glob::exact("a*").matches("ab"));
        // The time for a long name is at most proportional to the length of the name times the
        // length of the pattern.
        assert!(!Glob::new(&"*a".repeat(100)).matches(&"b".repeat(10_000)));
    }

    #[test]
    fn copies_of_a_pattern_differ_and_match_the_same_names() {
        for pattern in ["Floor*", "a", "x\\*y?"] {
            let glob = Glob::new(pattern);
            let copies = if pattern == "a" { 2 } else { 4 };
            let texts: Vec<String> = (0..copies).map(|copy| glob.text(copy)).collect();
            for (i, text) in texts.iter().enumerate() {
                assert_eq!(Glob::new(text), glob, "{text}");
                assert!(!texts[..i].contains(text), "{text}");
            }
        }
        assert_eq!(Glob::exact("a*b").text(0), "a\\*b");
        assert_ne!(Glob::new("*").text(1), Glob::new("*").text(0));
    }
}
