//! Helpers to build the JSON Schema of scene files.

use crate::options::{Parameter, Range};
use serde_json::{Map, Value, json};

/// Reference to the definition of colour strings within the schema.
pub(super) const COLOR_TEXT: &str = "#/definitions/colour";

/// Schema of a number in `range`.
pub(super) fn number(range: Range<f32>) -> Value {
    let mut number = json!({ "type": "number" });
    for (keyword, value) in range.schema() {
        number[keyword] = value;
    }
    number
}

/// Schema of a list of `count` values with the schema `items`.
pub(super) fn list(count: usize, items: Value) -> Value {
    json!({ "type": "array", "items": items, "minItems": count, "maxItems": count })
}

/// Schema of a value for which one of the schemas `choices` is valid.
pub(super) fn either(choices: &[Value]) -> Value {
    json!({ "anyOf": choices })
}

/// Schema of a table that has only the properties `properties`. The properties `required` must be
/// given.
pub(super) fn closed(description: Option<&str>, properties: Map<String, Value>, required: &[&str]) -> Value {
    let mut table = json!({
        "type": "object",
        "additionalProperties": false,
        "properties": properties,
    });
    if let Some(description) = description {
        table["description"] = json!(description);
    }
    if !required.is_empty() {
        table["required"] = json!(required);
    }
    table
}

/// Schema of a parameter with its help. The schema includes the default, if the default is a value
/// and not a description.
pub(super) fn described(parameter: &Parameter) -> Value {
    let mut schema = parameter.schema();
    let mut words = parameter.help().to_string();
    let detail = parameter.detail();
    if !detail.is_empty() {
        words += &format!(". {detail}");
    }
    let default = parameter.default();
    let value = serde_json::from_str(&default).unwrap_or(json!(default));
    if value.is_number() || value.is_boolean() || has_name(&schema, &default) {
        schema["default"] = value;
    } else if !["", "required"].contains(&default.as_str()) {
        words = format!("{}. Default: {default}", words.trim_end_matches('.'));
    }
    schema["description"] = json!(words);
    schema
}

/// Returns true if `schema` is a list of names that contains `name`, or if an alternative in
/// `schema` is such a list.
fn has_name(schema: &Value, name: &str) -> bool {
    let items = |keyword: &str| schema[keyword].as_array().into_iter().flatten();
    items("enum").any(|known| known == name) || items("anyOf").any(|choice| has_name(choice, name))
}
