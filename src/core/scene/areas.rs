//! The parts of a picture: which pixels the rendering has, and which the planes.

use super::{Layout, Scene};

/// A rectangle of a picture: its first column and row, and its width and height, pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Area {
    pub corner: [u32; 2],
    pub size: [u32; 2],
}

impl Area {
    /// The first column and row beyond the area, to the right and below.
    pub fn end(&self) -> [usize; 2] {
        std::array::from_fn(|a| (self.corner[a] + self.size[a]) as usize)
    }

    pub fn holds(&self, pixel: [usize; 2]) -> bool {
        let end = self.end();
        (0..2).all(|a| pixel[a] >= self.corner[a] as usize && pixel[a] < end[a])
    }
}

/// The axis along which a column or a row of planes lies beside the rendering: 0 where the picture is at least as wide as high.
fn beside_axis([width, height]: [u32; 2]) -> usize {
    usize::from(width < height)
}

impl Layout {
    /// True if the layout shows the three orthogonal planes beside a rendering.
    pub fn has_planes(self) -> bool {
        matches!(self, Layout::Four | Layout::Beside)
    }

    /// The part of a picture of `size` pixels that shows the rendering; in a pair, the part with the surface.
    pub(super) fn rendering(self, size: [u32; 2]) -> Area {
        let [width, height] = size;
        match self {
            Layout::Single => Area { corner: [0, 0], size },
            Layout::Four => Area { corner: [width / 2, height / 2], size: size.map(|n| n.div_ceil(2)) },
            Layout::Pair => Area { corner: [width / 2, 0], size: [width.div_ceil(2), height] },
            Layout::Beside => {
                let (axis, planes) = (beside_axis(size), self.tiles(size));
                let mut rendering = Area { corner: [0, 0], size };
                rendering.size[axis] -= planes.size[axis];
                rendering
            }
        }
    }

    /// The part of a picture of this size over which the grid of planes lies. That of a 4-up picture has the rendering in its last cell.
    fn tiles(self, size: [u32; 2]) -> Area {
        let mut tiles = Area { corner: [0, 0], size };
        if self == Layout::Beside {
            // Three squares one above the other are a third as wide as high: in a picture of 16:9 they are as large at three eighths as at any larger share.
            let axis = beside_axis(size);
            tiles.size[axis] = (u64::from(size[axis]) * 3 / 8) as u32;
            tiles.corner[axis] = size[axis] - tiles.size[axis];
        }
        tiles
    }
}

impl Scene {
    /// The part of the picture that shows the rendering; in a pair, the part with the surface.
    pub(crate) fn rendering_area(&self) -> Area {
        self.settings.layout.rendering(self.picture_size())
    }

    /// The part of the picture that the grid of planes covers; the whole picture in a mode of planes.
    pub(crate) fn tile_area(&self) -> Area {
        self.settings.layout.tiles(self.picture_size())
    }

    /// Number of columns and rows of the planes beside a rendering (layout beside).
    pub(super) fn grid_beside(&self) -> [u32; 2] {
        if beside_axis(self.picture_size()) == 0 { [1, 3] } else { [3, 1] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every pixel of a picture belongs to the rendering or to the planes, and to one of them only; in a pair, to the surface or the volume.
    #[test]
    fn the_parts_of_a_picture_cover_it_once() {
        for size in [[1, 1], [2, 1], [3, 8], [8, 3], [640, 480], [1081, 1920], [300, 300]] {
            for layout in [Layout::Single, Layout::Four, Layout::Pair, Layout::Beside] {
                let (rendering, tiles) = (layout.rendering(size), layout.tiles(size));
                assert!(rendering.size.iter().all(|n| *n > 0), "{layout:?} {size:?}");
                assert_eq!(tiles.end(), size.map(|n| n as usize));
                for pixel in (0..size[1] as usize).flat_map(|y| (0..size[0] as usize).map(move |x| [x, y])) {
                    let owners = (rendering.holds(pixel), tiles.holds(pixel));
                    let is_right = if layout == Layout::Beside { owners.0 != owners.1 } else { owners.1 };
                    assert!(is_right, "{layout:?} {size:?} {pixel:?}: {owners:?}");
                }
            }
        }
    }
}
