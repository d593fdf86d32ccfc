//! Texts in the header of an EXR file.

use super::ascii::ascii;
use ::exr::prelude as exr;

/// Converts `text` to a text for an EXR header, in ASCII with escapes. The conversions of the exr
/// crate (1.74) are not used: they panic on characters beyond Latin-1, and write all other
/// characters in Latin-1.
pub(super) fn exr_text(text: &str) -> exr::Text {
    ascii(text).as_str().into()
}

/// Text of the attribute `name`. `None` if the attribute is missing or is not a text.
pub(super) fn text_attribute(attributes: &exr::LayerAttributes, name: &str) -> Option<String> {
    match attributes.other.get(&exr::Text::from(name))? {
        exr::AttributeValue::Text(text) => Some(text.to_string()),
        _ => None,
    }
}
