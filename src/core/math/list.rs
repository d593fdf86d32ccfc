/// Numbers as people write them, between brackets: `[1, 0.5, NaN]`.
pub fn list(values: &[f32]) -> String {
    let values: Vec<String> = values.iter().map(f32::to_string).collect();
    format!("[{}]", values.join(", "))
}
