//! Rectangles of pixels.

/// A rectangle of pixels; columns count to the right and rows downwards, from
/// the top left of the full image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// First column.
    pub x: u32,
    /// First row.
    pub y: u32,
    /// Number of columns.
    pub width: u32,
    /// Number of rows.
    pub height: u32,
}

impl Window {
    /// All of an image of the given width and height in pixels.
    pub const fn full(resolution: [u32; 2]) -> Self {
        Self {
            x: 0,
            y: 0,
            width: resolution[0],
            height: resolution[1],
        }
    }

    /// Number of pixels.
    pub const fn area(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// The pixels, row by row.
    pub fn pixels(&self) -> impl Iterator<Item = [u32; 2]> + use<> {
        let Self {
            x,
            y,
            width,
            height,
        } = *self;
        (y..y + height).flat_map(move |row| (x..x + width).map(move |column| [column, row]))
    }

    /// The pixels in both windows, if there are any.
    pub fn intersect(&self, other: Self) -> Option<Self> {
        let overlap = |a: u32, a_size: u32, b: u32, b_size: u32| {
            let start = a.max(b);
            let end = (a + a_size).min(b + b_size);
            (end > start).then(|| (start, end - start))
        };
        let (x, width) = overlap(self.x, self.width, other.x, other.width)?;
        let (y, height) = overlap(self.y, self.height, other.y, other.height)?;
        Some(Self {
            x,
            y,
            width,
            height,
        })
    }

    /// Where `pixel` comes in the order of [`Self::pixels`].
    pub(crate) fn index(&self, pixel: [u32; 2]) -> usize {
        debug_assert!(self.x <= pixel[0] && pixel[0] - self.x < self.width);
        debug_assert!(self.y <= pixel[1] && pixel[1] - self.y < self.height);
        (pixel[1] - self.y) as usize * self.width as usize + (pixel[0] - self.x) as usize
    }
}
