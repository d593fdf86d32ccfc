//! Size of a view as a setting in files. A picture of several views is a grid of views of equal
//! size.

use crate::math::UVec2;

/// Key of the view size in the settings of a file.
const KEY: &str = "view";
/// Maximum number of views of a picture: the faces of a cube map.
const MAX_VIEWS: u32 = 6;

/// Text with the size of a view, to append to the settings of a file; empty if the picture of
/// `resolution` pixels has one view.
pub fn view_size_text(resolution: UVec2, view: UVec2) -> String {
    if view == resolution {
        String::new()
    } else {
        format!(" {KEY}={}x{}", view.x, view.y)
    }
}

/// Size of one view in pixels, from the settings `settings` of an image file. The whole picture has
/// `resolution` pixels.
pub fn view_size_of(settings: &str, resolution: UVec2) -> UVec2 {
    let mut pairs = settings.split(' ').filter_map(|pair| pair.split_once('='));
    let size = pairs.find(|(key, _)| *key == KEY).and_then(|(_, text)| {
        let (width, height) = text.split_once('x')?;
        Some(UVec2::new(width.parse().ok()?, height.parse().ok()?))
    });
    let is_grid = |view: &UVec2| {
        let fits = view.cmpgt(UVec2::ZERO).all() && view.cmple(resolution).all();
        let grid = resolution / view.max(UVec2::ONE);
        let count = u64::from(grid.x) * u64::from(grid.y);
        fits && grid * *view == resolution && count <= u64::from(MAX_VIEWS)
    };
    size.filter(is_grid).unwrap_or(resolution)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_of_views_are_read_again() {
        let size = UVec2::new(60, 10);
        let text = format!("path depth=4{}", view_size_text(size, UVec2::splat(10)));
        assert_eq!(view_size_of(&text, size), UVec2::splat(10));
        assert_eq!(view_size_text(size, size), "");
        for text in [
            "path",
            "path view=60x10",
            "path view=0x10",
            "path view=7x10",
            "path view=1x1",
            "path view=x",
            "path view=4294967295x4294967295",
        ] {
            assert_eq!(view_size_of(text, size), size, "{text}");
        }
    }
}
