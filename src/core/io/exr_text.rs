//! Texts in the header of an EXR file.

use super::ascii::ascii;
use ::exr::prelude as exr;

/// `text` as EXR files have it. Conversions of the exr crate (1.74) panic over letters beyond Latin-1, and write the others in that encoding.
pub(super) fn exr_text(text: &str) -> exr::Text {
    ascii(text).as_str().into()
}

/// The text of the attribute `name`; `None` where there is none, or one that is not text.
pub(super) fn text_attribute(attributes: &exr::LayerAttributes, name: &str) -> Option<String> {
    match attributes.other.get(&exr::Text::from(name))? {
        exr::AttributeValue::Text(text) => Some(text.to_string()),
        _ => None,
    }
}
