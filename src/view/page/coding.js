// Decodes pictures for slow links. The encoder is src/core/io/packed.rs.

// Returns the bits of the 16-bit floats of a packed picture. The encoder has rounded off the last
// `rounding` bits.
export async function unpack(bytes, width, { rounding, values }) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
  const planes = new Uint8Array(await new Response(stream).arrayBuffer());
  const count = values / 3;
  // Green channel, then differences of red and blue to green, as signed numbers that wrap around
  const channels = [0, 1, 2].map((c) => {
    const low = planes.subarray(2 * c * count, (2 * c + 1) * count);
    const high = planes.subarray((2 * c + 1) * count, (2 * c + 2) * count);
    const numbers = new Int16Array(count);
    const difference = (i) => {
      const folded = low[i] | (high[i] << 8);
      return (folded >> 1) ^ -(folded & 1);
    };
    for (let i = 0; i < count; i += 1) {
      const hasLeft = i % width > 0;
      const expected =
        i < width ? (hasLeft ? numbers[i - 1] : 0) : hasLeft ? (numbers[i - 1] + numbers[i - width]) >> 1 : numbers[i - width];
      numbers[i] = expected + difference(i);
    }
    return numbers;
  });
  const halves = new Uint16Array(values);
  const [g, r, b] = channels;
  for (let i = 0, j = 0; i < count; i += 1, j += 3) {
    halves[j] = (r[i] + g[i]) << rounding;
    halves[j + 1] = g[i] << rounding;
    halves[j + 2] = (b[i] + g[i]) << rounding;
  }
  return halves;
}
