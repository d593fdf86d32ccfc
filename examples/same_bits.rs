//! Compares all channels of two EXR files bit by bit, for example a farm's picture with a single
//! render:
//!
//! ```text
//! cargo run --release --example same_bits -- one.exr other.exr
//! ```
//!
//! The exit code is 1 if a channel or a bit differs, and 2 if a file cannot be read.

use exr::prelude::{FlatSamples, read_all_flat_layers_from_file};
use std::collections::BTreeMap;
use std::process::ExitCode;

/// Position and size of a channel in pixels, and its values as bits.
type Channel = ([i32; 2], [usize; 2], Vec<u32>);

/// All channels, by layer and name.
fn channels(file: &str) -> Result<BTreeMap<String, Channel>, String> {
    let image = read_all_flat_layers_from_file(file).map_err(|e| format!("{file}: {e}"))?;
    let mut channels = BTreeMap::new();
    for (i, layer) in image.layer_data.into_iter().enumerate() {
        let place = layer.attributes.layer_position;
        for channel in layer.channel_data.list {
            let bits = match channel.sample_data {
                FlatSamples::F32(values) => values.into_iter().map(f32::to_bits).collect(),
                FlatSamples::F16(values) => values.into_iter().map(|v| v.to_bits().into()).collect(),
                FlatSamples::U32(values) => values,
            };
            let name = format!("layer {i}, channel {}", channel.name);
            channels.insert(name, ([place.x(), place.y()], [layer.size.x(), layer.size.y()], bits));
        }
    }
    Ok(channels)
}

/// Compares the channels of two files. Returns the number of equal values, or a text with the first
/// difference.
fn compare(one: &BTreeMap<String, Channel>, other: &BTreeMap<String, Channel>) -> Result<usize, String> {
    if !one.keys().eq(other.keys()) {
        return Err(format!("channels: {:?} and {:?}", one.keys(), other.keys()));
    }
    let mut values = 0;
    for ((name, (place, size, a)), (other_place, other_size, b)) in one.iter().zip(other.values()) {
        if (place, size) != (other_place, other_size) {
            return Err(format!(
                "{name}: {size:?} at {place:?} and {other_size:?} at {other_place:?}"
            ));
        }
        if let Some(i) = a.iter().zip(b).position(|(a, b)| a != b) {
            let [x, y] = [i % size[0], i / size[0]];
            return Err(format!("{name}, column {x}, row {y}: bits {:#x} and {:#x}", a[i], b[i]));
        }
        values += a.len();
    }
    Ok(values)
}

fn main() -> ExitCode {
    let files: Vec<String> = std::env::args().skip(1).collect();
    let [one, other] = &files[..] else {
        eprintln!("usage: same_bits ONE.exr OTHER.exr");
        return ExitCode::from(2);
    };
    let (one, other) = match (channels(one), channels(other)) {
        (Ok(one), Ok(other)) => (one, other),
        (Err(e), _) | (_, Err(e)) => {
            eprintln!("error: {e}");
            return ExitCode::from(2);
        }
    };
    match compare(&one, &other) {
        Ok(values) => println!("{values} values in {} channels: the same bits", one.len()),
        Err(difference) => {
            println!("different: {difference}");
            return ExitCode::FAILURE;
        }
    }
    ExitCode::SUCCESS
}
