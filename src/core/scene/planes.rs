//! Planes through the volume, resolved to the tiles of a picture: which pixel shows which point in space.

use super::areas::Area;
use super::curve::Line;
use super::{Curve, Layout, MAX_POINTS, Mode, PlaneName, Scene, Slab, View, depth_offset, insonified_box};
use glam::{DMat3, DVec2, DVec3};

/// Maximum number of tiles of planes in a picture, such as `planes.columns` times `planes.rows` in tomography.
pub const MAX_TILES: u32 = 64;
/// Maximum number of samples through a slab (a thick plane).
pub(crate) const MAX_SLAB: f64 = 4096.0;
/// Two points of the line of a curved plane coincide if they are closer than this share of the line's extent.
pub(super) const SAME_POINT: f64 = 1e-6;
/// Where the line of a curved plane is drawn, a point that is closer to the last one than this share of the planes' box is none. It is more than
/// [`SAME_POINT`] of any line that fits into ten boxes.
const NEXT_POINT: f64 = 1e-5;
/// A place is on a curved plane if it is no farther from it than this share of its line's length: half a millimetre of 64 mm.
const ON_SECTION: f64 = 1.0 / 128.0;
/// Distance between the places of a way along a curved plane, as a share of its line's length: 0.25 mm of 64. Chords of a circle of a tenth of the length
/// are shorter than its arcs by 6e-5.
const WAY_STEP: f64 = 1.0 / 256.0;
/// Size of a tile in the table for shaders, in vectors of four floats.
pub(crate) const TILE_VECTORS: u32 = 9;

/// A plane through the volume: `at` is a point on it, mm in space. `right` and `down` are unit vectors in the plane, along the axes of its tile;
/// `normal` is its unit normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    pub at: DVec3,
    pub right: DVec3,
    pub down: DVec3,
    pub normal: DVec3,
}

/// A tile of the picture and the plane that it shows.
#[derive(Clone, Debug, PartialEq)]
pub struct Tile {
    /// The plane that it shows. Its point `at` is in the middle of the tile.
    pub plane: Plane,
    /// Upper left corner of the tile in the picture (`corner`) and its width and height, pixels.
    pub corner: [u32; 2],
    pub size: [u32; 2],
    /// Scale of the tile, mm per pixel.
    pub pixel: f64,
    /// The line that a curved plane follows; None for a plane. `plane` then goes through the middle of the line, with `right` along its chord.
    pub section: Option<Section>,
    pub frame: Frame,
    /// The planes whose cross-lines are drawn on this tile, with their colours.
    pub(crate) crossed_by: Vec<(Plane, [f64; 3])>,
}

/// A curved plane: it contains a line that lies in a reference plane, and is perpendicular to that plane.
#[derive(Clone, Debug, PartialEq)]
pub struct Section {
    pub line: Line,
    /// The place in space, mm, of the point (0, 0) of the line's coordinates. Along the normal of the reference plane it lies where the middle of the
    /// tile does.
    pub origin: DVec3,
    /// Unit vectors in space along which the line's coordinates increase: right and down on the reference plane.
    pub axes: [DVec3; 2],
}

/// A column of pixels of a curved plane: the place at half the tile's height, mm in space, and the unit normal of the plane there.
pub type Column = (DVec3, DVec3);

/// How the border of a tile is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Frame {
    None,
    /// As a line of this colour on the tile's outermost pixels.
    Around([f64; 3]),
    /// As a line of this colour towards the tiles above and on the left.
    Between([f64; 3]),
}

/// The tiles of a picture, in a grid of columns and rows of cells. Cells after the last tile are empty.
#[derive(Clone, Debug, PartialEq)]
pub struct Tiling {
    pub columns: u32,
    pub rows: u32,
    /// Scale of all planes, mm per pixel. A curved plane whose line is too long for its tile has a larger one ([`Tile::pixel`]).
    pub pixel: f64,
    pub tiles: Vec<Tile>,
}

/// Colour of a plane's border and cross-lines. The colours are distinguishable with any colour vision, and none is grey.
pub fn colour(plane: PlaneName) -> [f64; 3] {
    match plane {
        PlaneName::A => [1.0, 0.8, 0.1],
        PlaneName::B => [1.0, 0.35, 0.75],
        PlaneName::C => [0.2, 0.8, 1.0],
    }
}

/// Colour of a curved plane's border and of its line.
pub const CURVE_COLOUR: [f64; 3] = [0.9, 1.0, 0.85];

/// Colour between the tiles of tomography.
const BETWEEN: [f64; 3] = [0.35, 0.35, 0.35];

/// Pixel at which cell `n` (from 0) of `count` cells begins along an axis of `edge` pixels. Cell sizes differ by at most one pixel; of two cells the
/// last is the larger one, like the rendering in a 4-up picture.
pub fn cell(edge: u32, n: u32, count: u32) -> u32 {
    (u64::from(edge) * u64::from(n) / u64::from(count.max(1))) as u32
}

impl Scene {
    /// True if there are planes beside a rendering that are cut from the section volume, which has the whole sector whatever region is rendered.
    /// False if there are no such planes, or if they are cut from the rendered volume.
    pub fn has_sections(&self) -> bool {
        self.settings.layout.has_planes() && !self.is_flat() && self.section_smooth.is_some()
    }

    /// Corners of the box that planes show, mm in space.
    fn planes_box(&self) -> (DVec3, DVec3) {
        if self.has_sections() { insonified_box(&self.geometry) } else { (self.low, self.high) }
    }

    /// The box and the grey window that planes show.
    pub(crate) fn planes_view(&self) -> View {
        let (low, high) = self.planes_box();
        View { window: self.settings.planes.window, low, high }
    }

    /// The clip planes that cut planes: (n, w), which remove the points p with dot(n, p) > w, mm. None cuts the section volume.
    pub(crate) fn planes_clips(&self) -> impl Iterator<Item = (DVec3, f64)> {
        let is_cut = !self.has_sections();
        self.clips().filter(move |_| is_cut)
    }

    /// Number of columns and rows of tiles in the picture's grid.
    pub(crate) fn tile_grid(&self) -> [u32; 2] {
        match (self.settings.layout, self.settings.mode) {
            (Layout::Single, Mode::Plane) if self.has_curve() => self.grid_of_two(),
            (Layout::Beside, _) => self.grid_beside(),
            (Layout::Four, _) | (_, Mode::Orthogonal) => [2, 2],
            (_, Mode::Tomography) => [self.settings.planes.columns, self.settings.planes.rows],
            _ => [1, 1],
        }
    }

    /// A plane and the curved plane on it are beside each other or one above the other, whichever shows them larger. The line has no say: it may be dragged.
    fn grid_of_two(&self) -> [u32; 2] {
        // Not the turned ones: the tiles stay where they are while the planes turn.
        let (right, down, normal) = axes(self.settings.planes.plane);
        let (low, high) = self.planes_box();
        let [across, down, through] = [right, down, normal].map(|axis| axis.abs().dot(high - low));
        let ([width, height], down) = (self.picture_size().map(f64::from), down.max(through));
        let (beside, above) = ((2.0 * across / width).max(down / height), (across / width).max(2.0 * down / height));
        if beside <= above { [2, 1] } else { [1, 2] }
    }

    /// Number of tiles that show a plane.
    pub(crate) fn tile_count(&self) -> u32 {
        let [columns, rows] = self.tile_grid();
        if self.shows_three() { 3 + u32::from(self.has_curve()) } else { columns.saturating_mul(rows) }
    }

    /// True if the three orthogonal planes are shown.
    pub fn shows_three(&self) -> bool {
        self.settings.layout.has_planes() || self.settings.mode == Mode::Orthogonal
    }

    /// True if lines are drawn over the planes: cross-lines and borders, or lines between the tiles of tomography.
    pub fn draws_lines(&self) -> bool {
        let several = self.shows_three() || self.settings.mode == Mode::Tomography || self.has_curve();
        several && self.settings.planes.lines
    }

    /// True if the pass that cuts planes also converts them to 8 bits, because no other pass of stage 4 reads them.
    pub fn tones_planes(&self) -> bool {
        self.is_flat() && self.only_tones()
    }

    /// Number of samples through the slab, both faces included, at most one slice pixel apart; 1 for a thin plane.
    pub(crate) fn slab_samples(&self) -> f64 {
        let thickness = self.settings.planes.thickness;
        let pixel = self.grid.pitch[0].min(self.grid.pitch[1]);
        if thickness > 0.0 { (thickness / pixel).ceil() + 1.0 } else { 1.0 }
    }

    /// One of the three orthogonal planes, through their common point.
    pub fn plane(&self, name: PlaneName) -> Plane {
        let settings = &self.settings.planes;
        let at = match settings.position {
            Some([lateral, depth, elevation]) => DVec3::new(lateral, depth + depth_offset(&self.geometry), elevation),
            None => (self.low + self.high) / 2.0,
        };
        let (turned, (right, down, normal)) = (self.turn(), axes(name));
        Plane { at, right: turned * right, down: turned * down, normal: turned * normal }
    }

    /// The rotation of the planes.
    fn turn(&self) -> DMat3 {
        let settings = &self.settings.planes;
        DMat3::from_rotation_y(-settings.azimuth.to_radians())
            * DMat3::from_rotation_x(settings.tilt.to_radians())
            * DMat3::from_rotation_z(-settings.roll.to_radians())
    }

    /// Least distance, mm, from a point to the next one while the line of a curved plane is drawn.
    pub fn least_apart(&self) -> f64 {
        let (low, high) = self.planes_box();
        NEXT_POINT * (high - low).length()
    }

    /// The settings of the curved plane. None if there is none, or if the layout and the mode do not show it.
    pub fn curve(&self) -> Option<&Curve> {
        let planes = &self.settings.planes;
        planes.curve.as_ref().filter(|curve| match (self.settings.layout, self.settings.mode) {
            (Layout::Single, Mode::Orthogonal) => true,
            (Layout::Single, Mode::Plane) => curve.plane == planes.plane,
            _ => false,
        })
    }

    /// True if the last tile is a curved plane.
    pub fn has_curve(&self) -> bool {
        self.curve().is_some()
    }

    /// Which of the three orthogonal planes a tile shows. None for a curved plane and for the slices of tomography.
    pub fn plane_of_tile(&self, tile: usize) -> Option<PlaneName> {
        match self.settings.mode {
            _ if self.shows_three() => [PlaneName::A, PlaneName::B, PlaneName::C].get(tile).copied(),
            Mode::Plane if tile == 0 => Some(self.settings.planes.plane),
            _ => None,
        }
    }

    /// Where a plane has its point (0, 0), at the level of the middle of the insonified region: what is turned turns about that middle, so that
    /// a line stays in its place on a tile.
    fn plane_origin(&self, name: PlaneName) -> DVec3 {
        let (low, high) = insonified_box(&self.geometry);
        let middle = (low + high) / 2.0;
        let (turned, (right, down, _)) = (self.turn(), axes(name));
        let from_face = middle - DVec3::Y * depth_offset(&self.geometry);
        middle - turned * (right * from_face.dot(right) + down * from_face.dot(down))
    }

    /// The place in space, mm, of a point given by its coordinates on a plane, mm right and down: lateral and depth on A, elevation and depth on B,
    /// lateral and -elevation on C. They count from lateral 0, the probe's face and elevation 0. Where planes are turned, the coordinates turn about
    /// the middle of the insonified region.
    pub fn place_on_plane(&self, name: PlaneName, [across, along]: [f64; 2]) -> DVec3 {
        let (plane, origin) = (self.plane(name), self.plane_origin(name));
        let place = origin + plane.right * across + plane.down * along;
        place + plane.normal * (plane.at - place).dot(plane.normal)
    }

    /// The opposite of [`Scene::place_on_plane`]: the coordinates on a plane, mm right and down, of a place in space, mm, projected onto it.
    pub fn point_on_plane(&self, name: PlaneName, place: DVec3) -> [f64; 2] {
        let (plane, from) = (self.plane(name), place - self.plane_origin(name));
        [from.dot(plane.right), from.dot(plane.down)]
    }

    /// The curved plane and the plane that it stands on. Its directions are such that a straight line to the right on A shows what C shows, and one on C what A
    /// shows.
    fn section(&self, middle: DVec3) -> Option<(Plane, Section, Plane)> {
        let curve = self.curve()?;
        let base = self.plane(curve.plane);
        let line = Line::through(&curve.points);
        let origin = self.plane_origin(curve.plane);
        let origin = origin + base.normal * (middle - origin).dot(base.normal);
        let down = if curve.plane == PlaneName::A { -base.normal } else { base.normal };
        let section = Section { line, origin, axes: [base.right, base.down] };
        let (at, _) = section.at(section.line.length() / 2.0);
        let chord = section.line.at(section.line.length()).0 - section.line.at(0.0).0;
        let right = section.in_space(chord.normalize_or(DVec2::X));
        Some((Plane { at, right, down, normal: right.cross(down) }, section, base))
    }

    /// The tiles that the planes of this scene's picture consist of, and what each shows.
    pub fn tiling(&self) -> Tiling {
        let [columns, rows] = self.tile_grid();
        let Area { corner: [left, top], size: [width, height] } = self.tile_area();
        let three = [PlaneName::A, PlaneName::B, PlaneName::C];
        let planes: Vec<Plane> = match self.shows_three() {
            true => three.map(|name| self.plane(name)).to_vec(),
            false if self.has_curve() => vec![self.plane(self.settings.planes.plane)],
            false if self.has_reference() => {
                let slices = self.stepped(columns * rows - 1);
                std::iter::once(self.plane(self.reference_name())).chain(slices).collect()
            }
            false => self.stepped(columns * rows),
        };
        let (low, high) = self.planes_box();
        let half = (high - low) / 2.0;
        let extent = |axis: DVec3| 2.0 * axis.abs().dot(half);
        let fit = |p: &Plane| {
            let across = extent(p.right) * f64::from(columns) / f64::from(width);
            across.max(extent(p.down) * f64::from(rows) / f64::from(height))
        };
        let zoom = self.settings.planes.zoom;
        let pixel = planes.iter().map(fit).fold(0.0, f64::max) / zoom;
        let middle = (low + high) / 2.0;
        let place = |n: u32| {
            let (column, row) = (n % columns, n / columns);
            let corner = [left + cell(width, column, columns), top + cell(height, row, rows)];
            let end = [left + cell(width, column + 1, columns), top + cell(height, row + 1, rows)];
            (corner, [end[0] - corner[0], end[1] - corner[1]])
        };
        let section = self.section(middle);
        let tile = |(n, plane): (u32, &Plane)| {
            let (corner, size) = place(n);
            let at = middle - plane.normal * (middle - plane.at).dot(plane.normal);
            let (frame, crossed_by) = match (self.draws_lines(), self.shows_three()) {
                (false, _) => (Frame::None, Vec::new()),
                (true, false) if section.is_some() => (Frame::Around(colour(self.settings.planes.plane)), Vec::new()),
                (true, false) => (Frame::Between(BETWEEN), Vec::new()),
                (true, true) => {
                    let others = three.iter().zip(&planes).filter(|(_, other)| *other != plane);
                    let crossed_by = others.map(|(name, other)| (*other, colour(*name))).collect();
                    (Frame::Around(colour(three[n as usize])), crossed_by)
                }
            };
            Tile { plane: Plane { at, ..*plane }, corner, size, pixel, section: None, frame, crossed_by }
        };
        let mut tiles: Vec<Tile> = (0..).zip(&planes).map(tile).collect();
        tiles.extend(section.zip(self.curve()).map(|((plane, section, base), curve)| {
            let (corner, size) = place(planes.len() as u32);
            let across = section.line.length() * f64::from(columns) / f64::from(width);
            let along = extent(plane.down) * f64::from(rows) / f64::from(height);
            let (frame, crossed_by) = match self.draws_lines() {
                true => (Frame::Around(CURVE_COLOUR), vec![(base, colour(curve.plane))]),
                false => (Frame::None, Vec::new()),
            };
            let pixel = pixel.max(across.max(along) / zoom);
            Tile { plane, corner, size, pixel, section: Some(section), frame, crossed_by }
        }));
        Tiling { columns, rows, pixel, tiles }
    }

    /// Where the line of the settings' curved plane lies on the tile of the plane that it is drawn on, even if the curved plane itself is not shown.
    /// None if there is no curved plane or no such tile.
    pub fn curve_line(&self, tiling: &Tiling) -> Option<CurveLine> {
        self.line_on_tile(tiling, self.settings.planes.curve.as_ref()?)
    }

    /// Where the line of the curved plane `curve`, which need not be that of the settings, lies on the tile of the plane that it is drawn on. None if
    /// there is no such tile.
    pub fn line_on_tile(&self, tiling: &Tiling, curve: &Curve) -> Option<CurveLine> {
        let is_its = |n: &usize| self.plane_of_tile(*n) == Some(curve.plane);
        let number = (0..tiling.tiles.len()).find(is_its).filter(|_| self.cuts_planes())?;
        let tile = &tiling.tiles[number];
        let at = |point: [f64; 2]| tiling.project(tile, self.place_on_plane(curve.plane, point)).0;
        let outline = Line::through(&curve.points).outline();
        Some(CurveLine {
            tile: number,
            line: outline.into_iter().map(|point| at(point.into())).collect(),
            points: curve.points.iter().map(|point| at(*point)).collect(),
        })
    }

    /// Places in space, mm, along the way between two places of the curved plane that its tile shows as a straight line. The curved plane is
    /// straightened without stretching, so that the way is as long as on the tile. None if no curved plane is shown, a place is not on it, or its
    /// line passes a place twice.
    pub fn way_on_section(&self, from: DVec3, to: DVec3) -> Option<Vec<DVec3>> {
        let tiling = self.tiling();
        let tile = tiling.tiles.last().filter(|tile| tile.section.is_some())?;
        let section = tile.section.as_ref()?;
        let ends = [from, to].map(|place| section.coordinates(tile.plane.down, place));
        // Where the line passes twice, nothing says which passage is meant.
        let length = section.line.length();
        if ends.iter().any(|(_, off)| *off > ON_SECTION * length)
            || [from, to].iter().any(|place| section.is_passed_twice(*place))
        {
            return None;
        }
        let [(from, _), (to, _)] = ends;
        let count = ((from.distance(to) / (WAY_STEP * length)).ceil() as usize).clamp(1, MAX_POINTS - 1);
        let between = |n: usize| from + (to - from) * (n as f64 / count as f64);
        Some((0..=count).map(between).map(|at| section.at(at.x).0 + tile.plane.down * at.y).collect())
    }

    /// True if the first tile of tomography is the plane across its slices (`planes.reference`).
    pub fn has_reference(&self) -> bool {
        let [columns, rows] = self.tile_grid();
        let is_asked = self.settings.planes.reference && self.settings.mode == Mode::Tomography;
        is_asked && !self.shows_three() && columns.saturating_mul(rows) > 1
    }

    /// The plane across the slices of tomography.
    fn reference_name(&self) -> PlaneName {
        if self.settings.planes.plane == PlaneName::A { PlaneName::B } else { PlaneName::A }
    }

    /// `count` parallel planes centred on the position.
    fn stepped(&self, count: u32) -> Vec<Plane> {
        let settings = &self.settings.planes;
        let plane = self.plane(settings.plane);
        let through = plane.normal.abs().dot(self.high - self.low);
        let spacing = settings.spacing.unwrap_or(through / f64::from(count));
        let offset = |n: u32| (f64::from(n) - f64::from(count - 1) / 2.0) * spacing;
        (0..count).map(|n| Plane { at: plane.at + plane.normal * offset(n), ..plane }).collect()
    }
}

/// The line of a curved plane on a tile of the picture: the index of the tile in [`Tiling::tiles`], and points to draw the line through, pixels of
/// the picture.
#[derive(Clone, Debug, PartialEq)]
pub struct CurveLine {
    pub tile: usize,
    pub line: Vec<[f64; 2]>,
    /// The points of the settings that the line was made from, pixels of the picture.
    pub points: Vec<[f64; 2]>,
}

impl CurveLine {
    /// The end of the line and the point before it, pixels, for an arrow that shows its direction: on the curved plane the line runs to the right.
    /// None for a line of fewer than two points.
    pub fn head(&self) -> Option<[[f64; 2]; 2]> {
        match self.line[..] {
            [.., before, end] => Some([end, before]),
            _ => None,
        }
    }
}

/// Right, down and normal of a plane that is not turned.
fn axes(name: PlaneName) -> (DVec3, DVec3, DVec3) {
    match name {
        PlaneName::A => (DVec3::X, DVec3::Y, DVec3::Z),
        PlaneName::B => (DVec3::Z, DVec3::Y, DVec3::X),
        PlaneName::C => (DVec3::X, -DVec3::Z, DVec3::Y),
    }
}

impl Section {
    fn in_space(&self, direction: DVec2) -> DVec3 {
        self.axes[0] * direction.x + self.axes[1] * direction.y
    }

    /// The direction in space, a unit vector, from which all of the line deviates by at most 45 degrees; zero if the line bends more.
    pub fn heading(&self) -> DVec3 {
        self.line.heading().map_or(DVec3::ZERO, |heading| self.in_space(heading))
    }

    /// The place at a distance along the line, mm in space, at the level of the middle of the tile, and the unit direction of the line there.
    pub fn at(&self, along: f64) -> (DVec3, DVec3) {
        let (at, direction) = self.line.at(along);
        (self.origin + self.in_space(at), self.in_space(direction))
    }

    /// True if two passages of the line are within reach of a place: at a crossing, and at the ends of a line that is closed.
    fn is_passed_twice(&self, place: DVec3) -> bool {
        self.line.passes_twice(self.in_plane(place), ON_SECTION * self.line.length())
    }

    fn in_plane(&self, place: DVec3) -> DVec2 {
        let from = place - self.origin;
        DVec2::new(from.dot(self.axes[0]), from.dot(self.axes[1]))
    }

    /// Where a place is on the curved plane: the distance along the line and that from the middle of the tile down, and how far it is from the curved
    /// plane; mm.
    fn coordinates(&self, down: DVec3, place: DVec3) -> (DVec2, f64) {
        let (along, off) = self.line.nearest(self.in_plane(place));
        (DVec2::new(along, (place - self.origin).dot(down)), off)
    }
}

impl Tile {
    /// The middle of the tile, pixels of the picture.
    fn middle(&self) -> [f64; 2] {
        std::array::from_fn(|a| f64::from(self.corner[a]) + f64::from(self.size[a]) / 2.0)
    }

    /// True if a position on the picture, pixels, lies on the tile.
    pub fn has(&self, pixel: [f64; 2]) -> bool {
        (0..2).all(|a| (0.0..f64::from(self.size[a])).contains(&(pixel[a] - f64::from(self.corner[a]))))
    }

    /// The columns of a curved plane's tile, from the left; None beyond the ends of its line. Empty for a plane.
    pub fn columns(&self) -> Vec<Option<Column>> {
        let Some(section) = &self.section else { return Vec::new() };
        let length = section.line.length();
        // A line shorter than a column has one or two nevertheless.
        let beyond = if length < self.pixel { self.pixel / 2.0 } else { 0.0 };
        let from_middle = |x: u32| (f64::from(x) + 0.5 - f64::from(self.size[0]) / 2.0) * self.pixel;
        let column = |x: u32| {
            let along = length / 2.0 + from_middle(x);
            let (place, direction) =
                Some(along).filter(|along| (-beyond..=length + beyond).contains(along)).map(|s| section.at(s))?;
            Some((place, direction.cross(self.plane.down)))
        };
        (0..self.size[0]).map(column).collect()
    }
}

impl Tiling {
    /// The lines at which the planes of the other tiles cut the plane of the first one: two ends each, pixels of the picture. They reach beyond the
    /// tile. The first tile must be perpendicular to the others ([`Scene::has_reference`]).
    pub fn slice_lines(&self) -> Vec<[[f64; 2]; 2]> {
        let Some((reference, slices)) = self.tiles.split_first() else { return Vec::new() };
        let middle = reference.middle();
        let reach = f64::from(reference.size[0] + reference.size[1]);
        let line = |slice: &Tile| {
            let normal = slice.plane.normal;
            let [x, y] = [normal.dot(reference.plane.right), normal.dot(reference.plane.down)];
            let away = normal.dot(slice.plane.at - reference.plane.at) / self.pixel;
            let end = |side: f64| [middle[0] + x * away - y * side * reach, middle[1] + y * away + x * side * reach];
            [end(-1.0), end(1.0)]
        };
        slices.iter().map(line).collect()
    }

    /// The tile that contains a pixel. None in an empty cell of the grid.
    pub fn tile_at(&self, x: usize, y: usize) -> Option<&Tile> {
        self.tiles.iter().find(|tile| tile.has([x, y].map(|n| n as f64)))
    }

    /// The place in space, mm, that a pixel's centre shows on the tile's plane; for a curved plane, on the plane through its chord.
    pub fn place(&self, tile: &Tile, x: usize, y: usize) -> DVec3 {
        let middle = tile.middle();
        let from_middle = |at: usize, axis: usize| (at as f64 + 0.5 - middle[axis]) * tile.pixel;
        tile.plane.at + tile.plane.right * from_middle(x, 0) + tile.plane.down * from_middle(y, 1)
    }

    /// The place in space, mm, that a position on the picture, pixels, shows on a tile's plane, also outside the tile. For a curved plane, positions to
    /// the left or right of its line have the places of the line's end.
    pub fn point(&self, tile: &Tile, at: [f64; 2]) -> DVec3 {
        let [x, y]: [f64; 2] =
            std::array::from_fn(|a| at[a] - f64::from(tile.corner[a]) - f64::from(tile.size[a]) / 2.0);
        match &tile.section {
            Some(section) => {
                section.at(section.line.length() / 2.0 + x * tile.pixel).0 + tile.plane.down * (y * tile.pixel)
            }
            None => tile.plane.at + (tile.plane.right * x + tile.plane.down * y) * tile.pixel,
        }
    }

    /// Where a point in space lies on a tile: its position on the picture, pixels, and its distance from the tile's plane, mm. The distance is
    /// positive on the side that the plane's normal points to, else negative; from a curved plane it is never negative.
    pub fn project(&self, tile: &Tile, point: DVec3) -> ([f64; 2], f64) {
        let from = point - tile.plane.at;
        let (along, off) = match &tile.section {
            Some(section) => {
                let (at, off) = section.coordinates(tile.plane.down, point);
                ([at.x - section.line.length() / 2.0, at.y], off)
            }
            None => ([from.dot(tile.plane.right), from.dot(tile.plane.down)], from.dot(tile.plane.normal)),
        };
        let middle = tile.middle();
        (std::array::from_fn(|a| middle[a] + along[a] / tile.pixel), off)
    }

    /// The upper left corner of a tile, and the vectors of one pixel right, of one pixel down and through the slab of `thickness` mm; mm in space.
    pub fn vectors(&self, tile: &Tile, thickness: f64) -> [DVec3; 4] {
        let Plane { at, right, down, normal } = tile.plane;
        let (dx, dy) = (right * tile.pixel, down * tile.pixel);
        let [width, height] = tile.size.map(f64::from);
        [at - dx * (width / 2.0) - dy * (height / 2.0), dx, dy, normal * thickness]
    }

    /// The columns of the curved plane for shaders, eight floats each: the place at the tile's upper edge and 1 (0 beyond the ends of the line), then
    /// the vector through the slab of `thickness` mm and 0.
    pub(crate) fn column_table(&self, thickness: f64) -> Vec<f64> {
        let Some(tile) = self.tiles.last() else { return Vec::new() };
        let up = tile.plane.down * (tile.pixel * f64::from(tile.size[1]) / 2.0);
        let entry = |column: Option<Column>| match column {
            Some((place, across)) => {
                let (top, slab) = (place - up, across * thickness);
                [top.x, top.y, top.z, 1.0, slab.x, slab.y, slab.z, 0.0]
            }
            None => [0.0; 8],
        };
        tile.columns().into_iter().flat_map(entry).collect()
    }

    /// The tiles for shaders, `TILE_VECTORS` vectors each: the upper left corner in space and the vectors of one pixel right, one down and through
    /// the slab; the border's colour and kind; two cross-lines (a, b, c, present) and their colours. a x + b y + c is the distance from the line in
    /// pixels, with (x, y) relative to the tile's corner.
    pub fn table(&self, thickness: f64) -> Vec<f64> {
        let mut table = Vec::with_capacity(self.tiles.len() * 4 * TILE_VECTORS as usize);
        for tile in &self.tiles {
            let vectors @ [corner, dx, dy, _] = self.vectors(tile, thickness);
            vectors.iter().for_each(|v| table.extend([v.x, v.y, v.z, 0.0]));
            let ([r, g, b], kind) = match tile.frame {
                Frame::None => ([0.0; 3], 0.0),
                Frame::Around(colour) => (colour, 1.0),
                Frame::Between(colour) => (colour, 2.0),
            };
            table.extend([r, g, b, kind]);
            let line = |n: usize| {
                let Some((other, colour)) = tile.crossed_by.get(n) else { return ([0.0; 4], [0.0; 3]) };
                let (a, b) = (other.normal.dot(dx), other.normal.dot(dy));
                let c = other.normal.dot(corner - other.at);
                let per_pixel = a.hypot(b);
                ([a / per_pixel, b / per_pixel, c / per_pixel, 1.0], *colour)
            };
            let lines = [line(0), line(1)];
            lines.iter().for_each(|(line, _)| table.extend(line));
            lines.iter().for_each(|(_, [r, g, b])| table.extend([*r, *g, *b, 0.0]));
        }
        table
    }
}

impl Slab {
    /// The value of the shaders' specialization constant SLAB.
    pub fn number(self) -> i32 {
        self as i32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::load::Layers;
    use crate::scene::test_block::block;

    fn scene(lines: &[&str]) -> Scene {
        block(&[&["picture.size=[200,160]"], lines].concat(), [41, 31, 21])
    }

    /// Prevents a distance on the straightened section that is none of the volume, and a mark that lands beside its place.
    #[test]
    fn a_place_on_a_curved_plane_is_where_it_is_shown() {
        for plane in ["a", "b", "c"] {
            let curve = format!("planes.curve={{plane='{plane}',points=[[-9,4],[-3,9],[2,6],[9,12]]}}");
            let scene = scene(&["mode='orthogonal'", "planes.azimuth=20", "planes.roll=-12", &curve]);
            let tiling = scene.tiling();
            let tile = tiling.tiles.last().filter(|tile| tile.section.is_some()).expect("a section");
            let middle = tile.middle();
            let at = [[0.0, 0.0], [-12.0, 9.0], [12.0, -9.0]].map(|[x, y]| [middle[0] + x, middle[1] + y]);
            let places = at.map(|at| tiling.point(tile, at));
            for (at, place) in at.iter().zip(&places) {
                let (back, off) = tiling.project(tile, *place);
                assert!(
                    (back[0] - at[0]).hypot(back[1] - at[1]) < 1e-3 && off.abs() < 1e-6,
                    "{plane}: {at:?} {back:?}"
                );
            }
            let (_, across) = tile.columns()[tile.size[0] as usize / 2].expect("the middle of the line");
            let away = tiling.project(tile, places[0] + across * 2.0).1;
            assert!(away > 1.8, "{plane}: 2 mm beside it are {away}");
            // The way between two places has the length that the tile shows.
            let way = scene.way_on_section(places[1], places[2]).expect("both are on it");
            let length: f64 = way.windows(2).map(|ends| ends[0].distance(ends[1])).sum();
            let wanted = (at[2][0] - at[1][0]).hypot(at[2][1] - at[1][1]) * tile.pixel;
            assert!((length - wanted).abs() < 0.01, "{plane}: {length} of {wanted}");
            assert!(scene.way_on_section(places[1], places[2] + tile.plane.normal * 4.0).is_none());
        }
    }

    /// The line stays on the screen where it was drawn when the planes turn, and in the volume when they are stepped.
    #[test]
    fn a_line_turns_with_its_plane_and_stays_when_that_is_stepped() {
        let curve = "planes.curve={plane='a',points=[[-9,4],[-3,9],[9,12]]}";
        let line = |more: &[&str]| {
            let scene = scene(&[&["mode='orthogonal'", curve], more].concat());
            let tiling = scene.tiling();
            let line = scene.curve_line(&tiling).expect("a line");
            (line.points, tiling.point(tiling.tiles.last().expect("tiles"), [150.0, 120.0]), tiling.pixel)
        };
        let (points, place, pixel) = line(&[]);
        let (stepped, same, _) = line(&["planes.position=[3,18,5]"]);
        assert_eq!(points, stepped);
        assert!(place.distance(same) < 1e-9, "{place} {same}");
        let (turned, _, other) = line(&["planes.tilt=25", "planes.azimuth=-30"]);
        for (a, b) in points.iter().zip(&turned) {
            // From the middle of the first tile, which has another scale.
            let middle = [50.0, 40.0];
            let off = [0, 1].map(|n| (a[n] - middle[n]) * pixel - (b[n] - middle[n]) * other);
            assert!(off[0].abs() < 1.0 && off[1].abs() < 1.0, "{a:?} {b:?}");
        }
        // Coordinates are those of the region while nothing is turned.
        let plain = scene(&["mode='plane'", curve]);
        assert!(
            plain.place_on_plane(PlaneName::A, [-9.0, 4.0]).distance(DVec3::new(
                -9.0,
                4.0,
                plain.plane(PlaneName::A).at.z
            )) < 1e-9
        );
        assert_eq!(plain.point_on_plane(PlaneName::C, DVec3::new(3.0, 9.0, 2.0)), [3.0, -2.0]);
    }

    /// Prevents planes that shrink when a line is drawn on them, and a section that does not fit its tile.
    #[test]
    fn a_long_line_makes_the_scale_of_its_tile_smaller_and_no_others() {
        let tilings = ["[[-5,15],[5,15]]", "[[-18,2],[0,28],[18,2],[0,15],[-18,28]]"]
            .map(|points| scene(&["mode='orthogonal'", &format!("planes.curve={{points={points}}}")]).tiling());
        assert_eq!(tilings[0].pixel, tilings[1].pixel);
        assert_eq!(tilings[0].pixel, scene(&["mode='orthogonal'"]).tiling().pixel);
        let [short, long] = tilings.map(|tiling| tiling.tiles.last().cloned().expect("tiles"));
        assert_eq!(short.columns().iter().flatten().count(), (10.0 / short.pixel).round() as usize);
        assert!(long.pixel > short.pixel);
        let shown = long.columns();
        assert!(shown.iter().flatten().count() >= shown.len() - 1, "all of the tile's width");
    }

    #[test]
    fn the_plane_and_its_section_are_placed_where_they_are_larger() {
        for (size, grid) in [("[200,90]", [2, 1]), ("[100,200]", [1, 2])] {
            let size = format!("picture.size={size}");
            let tiling = scene(&["mode='plane'", "planes.curve={points=[[-5,15],[5,15]]}", &size]).tiling();
            assert_eq!(([tiling.columns, tiling.rows], tiling.tiles.len()), (grid, 2), "{size}");
            assert!(tiling.tiles[0].section.is_none() && tiling.tiles[1].section.is_some());
        }
    }

    #[test]
    fn a_line_that_is_none_is_refused_in_one_line() {
        let fault = |points: String| {
            let mut layers = Layers::default();
            let set = format!("planes.curve={{plane='b',points={points}}}");
            layers.set(&set).expect(&set);
            layers.finish().expect(&set).check().expect_err(&set).to_string()
        };
        let many = format!("[{}]", (0..65).map(|n| format!("[{n},0]")).collect::<Vec<_>>().join(","));
        for (points, says) in [
            ("[]".to_string(), "has 0 points, a line has 2 to 64"),
            ("[[1,2]]".into(), "has 1 points, a line has 2 to 64"),
            (many, "has 65 points, a line has 2 to 64"),
            ("[[1,2],[3,4],[3,4],[5,6]]".into(), "points 2 and 3 coincide: leave one of them out"),
            ("[[1,2],[nan,4]]".into(), "is NaN, must lie in -1e9..=1e9 mm"),
            ("[[1,2],[inf,4]]".into(), "is inf, must lie in -1e9..=1e9 mm"),
        ] {
            let fault = fault(points);
            assert!(fault.contains("planes.curve.points") && fault.contains(says) && !fault.contains('\n'), "{fault}");
        }
    }
}
