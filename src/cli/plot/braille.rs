//! Dot graphics in a terminal: each Braille pattern character is a cell of 2 × 4 dots (Unicode,
//! block U+2800).

/// Bits of the dots of a cell, by column and row.
const DOTS: [[u8; 4]; 2] = [[0x01, 0x02, 0x04, 0x40], [0x08, 0x10, 0x20, 0x80]];

/// A picture of dots with the origin at the top left.
pub(in crate::cli) struct Braille {
    columns: usize,
    cells: Vec<u8>,
}

impl Braille {
    /// An empty picture of `columns` × `rows` characters.
    pub fn new(columns: usize, rows: usize) -> Self {
        Self {
            columns,
            cells: vec![0; columns * rows],
        }
    }

    /// Sets a dot. Dots outside the picture are ignored.
    pub fn dot(&mut self, x: i64, y: i64) {
        let (Ok(x), Ok(y)) = (usize::try_from(x), usize::try_from(y)) else {
            return;
        };
        if x >= 2 * self.columns {
            return;
        }
        if let Some(cell) = self.cells.get_mut(y / 4 * self.columns + x / 2) {
            *cell |= DOTS[x % 2][y % 4];
        }
    }

    /// Sets the dots of a line.
    pub fn line(&mut self, from: [f64; 2], to: [f64; 2]) {
        let [dx, dy] = [to[0] - from[0], to[1] - from[1]];
        // Limit the number of steps: a much longer line leaves the picture.
        let steps = (dx.abs().max(dy.abs()).ceil()).clamp(1.0, 4096.0) as u32;
        for step in 0..=steps {
            let t = f64::from(step) / f64::from(steps);
            self.dot((from[0] + t * dx).round() as i64, (from[1] + t * dy).round() as i64);
        }
    }

    /// Rows as text.
    pub fn rows(&self) -> impl Iterator<Item = String> {
        let character = |cell: &u8| char::from_u32(0x2800 + u32::from(*cell)).unwrap_or(' ');
        self.cells
            .chunks(self.columns.max(1))
            .map(move |row| row.iter().map(character).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dots_are_where_they_are_set() {
        let mut picture = Braille::new(2, 2);
        picture.line([0.0, 0.0], [0.0, 3.0]);
        picture.line([2.0, 4.0], [3.0, 4.0]);
        // Dots outside the picture are ignored
        for [x, y] in [[-1, 0], [4, 0], [0, 8], [0, -1]] {
            picture.dot(x, y);
        }
        assert_eq!(picture.rows().collect::<Vec<_>>(), ["⡇⠀", "⠀⠉"]);
    }
}
