/// Returns `text` in ASCII. Other characters are escaped as in JSON, such as `\u6728`. A character
/// beyond U+FFFF becomes two surrogates.
///
/// EXR files have no encoding for their text, and readers assume ASCII, Latin-1 or UTF-8. JSON text
/// keeps its meaning, because JSON parsers decode the escapes.
pub(super) fn ascii(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        if c.is_ascii() {
            escaped.push(c);
        } else {
            let units = c
                .encode_utf16(&mut [0; 2])
                .iter()
                .map(|unit| format!("\\u{unit:04x}"))
                .collect::<String>();
            escaped.push_str(&units);
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn escaped_json_keeps_its_value() {
        for (name, text) in [
            ("plain \\ \"quoted\"", r#""plain \\ \"quoted\"""#),
            ("Küche", r#""K\u00fcche""#),
            ("木", r#""\u6728""#),
            ("a🦀b", r#""a\ud83e\udd80b""#),
        ] {
            let json = ascii(&serde_json::to_string(name).unwrap());
            assert_eq!(json, text);
            assert_eq!(serde_json::from_str::<String>(&json).unwrap(), name);
        }
    }
}
