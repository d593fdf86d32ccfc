//! Several pictures in one PNG, each with lines of text.

use super::{FileError, png};
use crate::color::srgb;
use crate::files::Output;
use crate::film::RgbImage;
use embedded_graphics::mono_font::MonoTextStyle;
use embedded_graphics::mono_font::iso_8859_1::{FONT_6X13_BOLD, FONT_8X13};
use embedded_graphics::pixelcolor::Rgb888;
use embedded_graphics::prelude::*;
use embedded_graphics::primitives::{Circle, PrimitiveStyle, Triangle};
use embedded_graphics::text::{Alignment, Baseline, Text, TextStyleBuilder};
use std::convert::Infallible;

/// A picture of a sheet, with its label.
#[derive(Clone, Debug)]
pub struct Panel {
    /// Title and numbers, one per line. Lines wider than the pictures are wrapped.
    pub label: Vec<String>,
    /// The picture. All pictures of a sheet have the same size.
    pub image: RgbImage,
}

/// Maximum length in pixels of the longer edge of a picture on the sheet. Larger pictures are
/// scaled down by averaging.
const LARGEST: usize = 320;
const MARGIN: usize = 12;
const LINE: usize = 15;
const BACKGROUND: Rgb888 = Rgb888::new(24, 24, 26);
const TEXT: Rgb888 = Rgb888::new(225, 225, 220);
const MARK: Rgb888 = Rgb888::new(200, 50, 30);
/// Sizes of a mark in pixels: length of its wedge, which shows the direction, and diameter of its
/// disk.
const WEDGE: f32 = 26.0;
const DISK: u32 = 19;

/// Writes `panels` in rows of `columns` panels to a PNG in sRGB.
pub fn write_contact_sheet(output: &Output, panels: &[Panel], columns: usize) -> Result<(), FileError> {
    Sheet::draw(panels, columns.max(1)).write(output)
}

/// Writes `plan` with its numbered `marks`, and `panels` in rows of `columns` panels below.
pub fn write_sheet_with_plan(
    output: &Output,
    plan: (&Panel, &[Mark]),
    panels: &[Panel],
    columns: usize,
) -> Result<(), FileError> {
    let below = Sheet::draw(panels, columns.max(1));
    Sheet::with_plan(plan, &below).write(output)
}

/// Edge length, in pixels, of the plan that [`write_sheet_with_plan`] draws above `columns` columns
/// of panels. The panels are `width` pixels wide.
pub fn edge_of_plan(width: usize, columns: usize) -> usize {
    (columns.min(2) * (cell_width(width) + MARGIN)).saturating_sub(MARGIN)
}

/// A numbered place on a plan, with a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mark {
    /// Number on the disk.
    pub number: usize,
    /// Position in pixels from the left and from the top.
    pub at: [f32; 2],
    /// Direction of the mark in the picture: x to the right, y down. The length is at most 1.
    pub direction: [f32; 2],
}

/// Pixels of a sheet, to draw on.
struct Sheet {
    width: usize,
    height: usize,
    bytes: Vec<u8>,
}

impl Sheet {
    fn empty(width: usize, height: usize) -> Self {
        let background = [BACKGROUND.r(), BACKGROUND.g(), BACKGROUND.b()];
        Self {
            width,
            height,
            bytes: background.repeat(width * height),
        }
    }

    fn write(&self, output: &Output) -> Result<(), FileError> {
        let size = [self.width as u32, self.height as u32];
        output.write(|writer| png::encode(writer, size, &self.bytes, &[]))
    }

    fn with_plan((plan, marks): (&Panel, &[Mark]), below: &Self) -> Self {
        let width = below.width.max(plan.image.width + 2 * MARGIN);
        let fits = (width - 2 * MARGIN) / FONT_8X13.character_size.width as usize;
        let lines: Vec<String> = plan.label.iter().flat_map(|line| wrapped(line, fits)).collect();
        let top = 2 * MARGIN + plan.image.height + LINE * lines.len();
        let mut sheet = Self::empty(width, top + below.height);
        sheet.picture(&plan.image, MARGIN, MARGIN);
        marks.iter().for_each(|mark| sheet.mark(mark, [MARGIN as f32; 2]));
        for (k, line) in lines.iter().enumerate() {
            sheet.text(line, MARGIN, MARGIN + plan.image.height + 4 + k * LINE);
        }
        for (row, bytes) in below.bytes.chunks(3 * below.width.max(1)).enumerate() {
            let start = 3 * (top + row) * width;
            sheet.bytes[start..start + bytes.len()].copy_from_slice(bytes);
        }
        sheet
    }

    /// Draws a mark: a wedge along the direction of the mark, and a disk with its number. `corner`
    /// is the top left corner of the marked picture on the sheet.
    fn mark(&mut self, mark: &Mark, corner: [f32; 2]) {
        let place = |along: f32, across: f32| {
            let [x, y] = mark.direction;
            let p = [x * along - y * across, y * along + x * across];
            let at = |i: usize| (mark.at[i] + corner[i] + p[i]).round() as i32;
            Point::new(at(0), at(1))
        };
        let fill = PrimitiveStyle::with_fill(MARK);
        let wedge = Triangle::new(place(0.0, 0.0), place(WEDGE, -0.4 * WEDGE), place(WEDGE, 0.4 * WEDGE));
        let disk = Circle::with_center(place(0.0, 0.0), DISK);
        let style = MonoTextStyle::new(&FONT_6X13_BOLD, TEXT);
        let centered = TextStyleBuilder::new()
            .alignment(Alignment::Center)
            .baseline(Baseline::Middle)
            .build();
        let number = mark.number.to_string();
        let text = Text::with_text_style(&number, place(0.0, 0.0), style, centered);
        // Drawing into memory cannot fail.
        let Ok(()) = wedge.into_styled(fill).draw(self);
        let Ok(()) = disk.into_styled(fill).draw(self);
        let Ok(_) = text.draw(self);
    }

    fn draw(panels: &[Panel], columns: usize) -> Self {
        let shown: Vec<RgbImage> = panels.iter().map(|p| reduced(&p.image)).collect();
        let cell_width = cell_width(shown.iter().map(|i| i.width).max().unwrap_or(0));
        let fits = cell_width / FONT_8X13.character_size.width as usize;
        let labels: Vec<Vec<String>> = panels
            .iter()
            .map(|panel| panel.label.iter().flat_map(|line| wrapped(line, fits)).collect())
            .collect();
        let lines = labels.iter().map(Vec::len).max().unwrap_or(0);
        let cell_height = shown.iter().map(|i| i.height).max().unwrap_or(0) + LINE * lines + 4;
        let columns = columns.min(panels.len().max(1));
        let rows = panels.len().div_ceil(columns);
        let (width, height) = (
            MARGIN + columns * (cell_width + MARGIN),
            MARGIN + rows * (cell_height + MARGIN),
        );
        let mut sheet = Self::empty(width, height);
        for (i, (label, image)) in labels.iter().zip(&shown).enumerate() {
            let x = MARGIN + (i % columns) * (cell_width + MARGIN);
            let y = MARGIN + (i / columns) * (cell_height + MARGIN);
            sheet.picture(image, x, y);
            for (k, line) in label.iter().enumerate() {
                sheet.text(line, x, y + image.height + 4 + k * LINE);
            }
        }
        sheet
    }

    fn picture(&mut self, image: &RgbImage, x: usize, y: usize) {
        for (row, pixels) in image.pixels.chunks(image.width.max(1)).enumerate() {
            let start = 3 * ((y + row) * self.width + x);
            let bytes = pixels.iter().flat_map(|p| p.map(srgb::encode_u8));
            self.bytes[start..start + 3 * pixels.len()]
                .iter_mut()
                .zip(bytes)
                .for_each(|(to, from)| *to = from);
        }
    }

    fn text(&mut self, line: &str, x: usize, y: usize) {
        let style = MonoTextStyle::new(&FONT_8X13, TEXT);
        let place = Point::new(x as i32, y as i32);
        // Drawing into memory cannot fail.
        let Ok(_) = Text::with_baseline(line, place, style, Baseline::Top).draw(self);
    }
}

/// Width, in pixels, of a cell for pictures of the width `picture`. The narrowest cell is wide
/// enough for a few words.
fn cell_width(picture: usize) -> usize {
    picture.clamp(220, LARGEST)
}

/// Wraps `line` between words, with at most `fits` characters per line. Longer words are cut.
fn wrapped(line: &str, fits: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    let letters = |text: &str| text.chars().count();
    for word in line.split(' ') {
        let letters_of_word: Vec<char> = word.chars().collect();
        for (i, part) in letters_of_word.chunks(fits.max(1)).enumerate() {
            let part: String = part.iter().collect();
            match lines.last_mut() {
                Some(last) if i == 0 && letters(last) + 1 + letters(&part) <= fits => *last += &format!(" {part}"),
                _ => lines.push(part),
            }
        }
    }
    lines
}

impl OriginDimensions for Sheet {
    fn size(&self) -> Size {
        Size::new(self.width as u32, self.height as u32)
    }
}

impl DrawTarget for Sheet {
    type Color = Rgb888;
    type Error = Infallible;

    fn draw_iter<I: IntoIterator<Item = Pixel<Rgb888>>>(&mut self, pixels: I) -> Result<(), Infallible> {
        for Pixel(at, color) in pixels {
            if self.bounding_box().contains(at) {
                let i = 3 * (at.y as usize * self.width + at.x as usize);
                self.bytes[i..i + 3].copy_from_slice(&[color.r(), color.g(), color.b()]);
            }
        }
        Ok(())
    }
}

/// Averages blocks of pixels, so that the larger edge has at most [`LARGEST`] pixels.
fn reduced(image: &RgbImage) -> RgbImage {
    let factor = image.width.max(image.height).div_ceil(LARGEST).max(1);
    image.averaged(factor, |v| v.clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn panel(width: usize, height: usize, label: &str) -> Panel {
        Panel {
            label: vec![label.into(), "äé — ☃".into()],
            image: RgbImage {
                width,
                height,
                pixels: vec![[1.0, 0.0, 0.0]; width * height],
            },
        }
    }

    #[test]
    fn panels_are_in_a_grid_above_their_labels() {
        let panels = vec![panel(640, 320, "a label that is too long for a single line, so it is wrapped"); 3];
        let sheet = Sheet::draw(&panels, 2);
        assert_eq!(sheet.width, MARGIN + 2 * (320 + MARGIN));
        assert_eq!(sheet.height, MARGIN + 2 * (160 + 3 * LINE + 4 + MARGIN));
        let at = |x: usize, y: usize| &sheet.bytes[3 * (y * sheet.width + x)..][..3];
        assert_eq!(at(MARGIN, MARGIN), [255, 0, 0]);
        assert_eq!(at(0, 0), [24, 24, 26]);
        // There is text below the first picture. The fourth cell is empty and has no text.
        let lit = |x: usize, y: usize| (x..x + 320).any(|x| (y..y + 15).any(|y| at(x, y) == [225, 225, 220]));
        assert!(lit(MARGIN, MARGIN + 164) && !lit(2 * MARGIN + 320, 2 * MARGIN + 209 + 164));
    }

    #[test]
    fn plan_with_marks_is_above_the_panels() {
        let panels = vec![panel(240, 240, "a"); 4];
        assert_eq!(edge_of_plan(240, 4), 2 * 240 + MARGIN);
        let mark = Mark {
            number: 3,
            at: [100.0, 50.0],
            direction: [1.0, 0.0],
        };
        let below = Sheet::draw(&panels, 4);
        let sheet = Sheet::with_plan((&panel(492, 200, "plan"), &[mark]), &below);
        assert_eq!(
            (sheet.width, sheet.height),
            (below.width, below.height + 2 * MARGIN + 200 + 2 * LINE)
        );
        let at = |x: usize, y: usize| &sheet.bytes[3 * (y * sheet.width + x)..][..3];
        let red = [MARK.r(), MARK.g(), MARK.b()];
        // The wedge points to the right of the disk.
        assert_eq!(at(MARGIN + 100 + 20, MARGIN + 50), red);
        assert_ne!(at(MARGIN + 100 - 20, MARGIN + 50), red);
        // The first picture is below the plan.
        assert_eq!(at(MARGIN + 5, 2 * MARGIN + 200 + 2 * LINE + MARGIN + 5), [255, 0, 0]);
    }

    #[test]
    fn labels_are_wrapped_between_words() {
        assert_eq!(
            wrapped("best: + shared paths, 256 samples", 27),
            ["best: + shared paths, 256", "samples"]
        );
        assert_eq!(wrapped("abcdefgh ij", 3), ["abc", "def", "gh", "ij"]);
        assert_eq!(wrapped("äöü äöü", 7), ["äöü äöü"]);
        assert!(wrapped("", 5).is_empty());
    }

    #[test]
    fn empty_and_narrow_sheets_are_drawn() {
        assert!(Sheet::draw(&[], 3).width > 0);
        assert!(Sheet::draw(&[panel(1, 1, "")], 4).width >= 220);
        assert!(Sheet::draw(&[panel(7, 1000, "tall")], 1).height > 250);
    }
}
