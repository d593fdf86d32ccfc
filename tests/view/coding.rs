//! Unpacks images like the page (`page/coding.js`). The code is independent of the page: it follows
//! the description in `src/core/io/packed.rs`.

use flate2::read::DeflateDecoder;
use serde_json::Value;
use std::io::Read;

/// Unpacked 16-bit floats of an image with the header `header`.
pub fn pixels(header: &Value, bytes: &[u8]) -> Vec<u8> {
    let Some(packed) = header.get("packed") else {
        return bytes.to_vec();
    };
    let number = |value: &Value| value.as_u64().unwrap() as usize;
    let (width, rounding) = (number(&header["width"]), number(&packed["rounding"]));
    let count = number(&packed["values"]) / 3;
    let mut planes = Vec::new();
    DeflateDecoder::new(bytes).read_to_end(&mut planes).unwrap();
    assert_eq!(planes.len(), 6 * count);
    let mut channels = vec![vec![0_i16; count]; 3];
    for (c, channel) in channels.iter_mut().enumerate() {
        for i in 0..count {
            let folded = u16::from_le_bytes([planes[2 * c * count + i], planes[(2 * c + 1) * count + i]]);
            let difference = (folded >> 1) as i16 ^ -((folded & 1) as i16);
            let expected = match (i % width > 0, i >= width) {
                (true, true) => (i32::from(channel[i - 1]) + i32::from(channel[i - width])) >> 1,
                (true, false) => channel[i - 1].into(),
                (false, true) => channel[i - width].into(),
                (false, false) => 0,
            };
            channel[i] = (expected as i16).wrapping_add(difference);
        }
    }
    let pixel = |i: usize| {
        let [g, r, b] = [0, 1, 2].map(|c: usize| channels[c][i]);
        [r.wrapping_add(g), g, b.wrapping_add(g)].map(|code| (code as u16) << rounding)
    };
    (0..count).flat_map(pixel).flat_map(u16::to_le_bytes).collect()
}
