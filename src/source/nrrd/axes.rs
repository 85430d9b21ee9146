//! What the axes of a NRRD are: space, time or colours, by their kinds, directions, labels and units; and where its voxels are.

use super::super::data_files::StoredOrder;
use super::super::layout::{Remarks, extent, warned};
use super::super::plus::spread;
use super::super::units::{millimetres, seconds};
use super::header::{Header, Vector};
use crate::files::{InputError, quoted};
use crate::probe::World;
use glam::DVec3;
use std::collections::{BTreeMap, BTreeSet};

/// The axes of the voxels and their origin, mm.
type Placed = ([DVec3; 3], DVec3);

/// Kinds whose numbers are colours.
const COLOURS: [&str; 4] = ["rgb-color", "rgba-color", "3-color", "4-color"];
/// Kinds that ITK and others give to colours, as well as to vectors.
const VECTORS: [&str; 5] = ["vector", "covariant-vector", "2-vector", "3-vector", "4-vector"];
/// Labels of time.
const TIME_LABELS: [&str; 6] = ["t", "time", "times", "frame", "frames", "timestamp"];

/// What an axis is.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Role {
    Space,
    Time,
    Colour,
    /// One sample, of whatever kind.
    Single,
    /// Kind `list`: frames in time, or slices.
    List,
    /// Its kind is not stated, or is contradicted.
    Unsaid,
}

/// What the header states of an axis.
struct Axis {
    size: usize,
    kind: String,
    label: String,
    unit: String,
    spacing: Option<f64>,
    /// `axis mins`, and whether the first sample lies there: with `node`; otherwise half a spacing further on.
    least: Option<f64>,
    is_node: bool,
    /// None if the file has no directions, Some(None) if this axis has none.
    direction: Option<Option<Vector>>,
    has_values: bool,
}

impl Axis {
    fn all(header: &Header) -> Result<Vec<Axis>, InputError> {
        let count = match header.need("dimension")?.parse::<usize>() {
            Ok(count @ 2..=5) => count,
            Ok(other) => return header.fault("dimension", format!("is {other}, must be 2 to 5")),
            Err(_) => return header.fault("dimension", "is not a whole number"),
        };
        let words: Vec<&str> = header.need("sizes")?.split_whitespace().collect();
        if words.len() != count {
            return header.fault("sizes", format!("has {} entries, but dimension is {count}", words.len()));
        }
        let empty = || vec![String::new(); count];
        let kinds = header.words("kinds", count)?.unwrap_or_else(empty);
        let labels = header.words("labels", count)?.unwrap_or_else(empty);
        let units = header.words("units", count)?.unwrap_or_else(empty);
        let [spacings, least, most] = [
            header.numbers("spacings", count)?,
            header.numbers("axis mins", count)?,
            header.numbers("axis maxs", count)?,
        ];
        let centerings = header.words("centerings", count)?.unwrap_or_else(empty);
        let mut directions = header.vectors("space directions")?;
        if directions.as_ref().is_some_and(|all| all.len() != count) {
            return header.fault("space directions", format!("is not one vector, or none, for each of {count} axes"));
        }
        let mut axes = Vec::new();
        for (n, word) in words.into_iter().enumerate() {
            let Ok(value) = word.parse() else {
                return header.fault("sizes", format!("{} is not a whole number", quoted(word)));
            };
            let size = extent(header.path, "sizes", "an entry ", value)?;
            let is_node = centerings[n].eq_ignore_ascii_case("node");
            let steps = if is_node { size.max(2) - 1 } else { size };
            axes.push(Axis {
                size,
                least: least[n],
                is_node,
                kind: kinds[n].to_ascii_lowercase(),
                label: labels[n].to_ascii_lowercase(),
                unit: units[n].clone(),
                spacing: spacings[n].or(least[n].zip(most[n]).map(|(least, most)| (most - least) / steps as f64)),
                direction: directions.as_mut().and_then(|all| all.get_mut(n)).map(Option::take),
                has_values: header.value(&format!("axis {n} index values")).is_some(),
            });
        }
        Ok(axes)
    }

    fn is_in_space(&self) -> bool {
        matches!(self.direction, Some(Some(_)))
    }

    /// True if the file has directions and this axis has none.
    fn is_none(&self) -> bool {
        matches!(self.direction, Some(None))
    }

    fn is_time_by_unit(&self) -> bool {
        seconds(&self.unit).is_some()
    }

    /// What the kind says.
    fn role(&self, header: &Header) -> Result<Role, InputError> {
        let is_doubtful = self.is_none() || self.is_time_by_unit();
        Ok(match self.kind.as_str() {
            "time" => Role::Time,
            "list" => Role::List,
            "domain" | "space" if !is_doubtful => Role::Space,
            "" | "none" | "???" | "domain" | "space" => Role::Unsaid,
            kind if COLOURS.contains(&kind) || VECTORS.contains(&kind) => Role::Colour,
            _ if self.size == 1 => Role::Single,
            other => {
                let fault = format!("{} is not read: axes of space, time, lists and RGB colours are", quoted(other));
                return header.fault("kinds", fault);
            }
        })
    }

    /// The last component of the direction and the first ones, of a space with time.
    fn of_space_and_time(&self) -> Option<(f64, [f64; 3])> {
        match self.direction.as_ref()?.as_deref()? {
            [x, y, z, t] => Some((*t, [*x, *y, *z])),
            _ => None,
        }
    }
}

/// Which axes of an NRRD file are colour, space and time, and their sizes.
pub(super) struct Axes {
    all: Vec<Axis>,
    /// Places among all: of the axes in space, 2 or 3, and of time.
    space: Vec<usize>,
    time: Option<usize>,
    pub channels: usize,
    pub size: [usize; 3],
    pub volumes: usize,
    /// How samples are reordered; `None` if the stored axes are colour, space and time in this order already, fastest first.
    pub reorder: Option<StoredOrder>,
}

impl Axes {
    pub(super) fn of(header: &Header, remarks: &mut Remarks) -> Result<Axes, InputError> {
        let all = Axis::all(header)?;
        let roles = roles(header, &all, remarks)?;
        let places = |role: Role| (0..all.len()).filter(|n| roles[*n] == role).collect::<Vec<_>>();
        let [space, time, colour] = [Role::Space, Role::Time, Role::Colour].map(places);
        if time.len() > 1 || colour.len() > 1 {
            let what = if time.len() > 1 { "time or lists" } else { "colours" };
            return header.fault("kinds", format!("has more than one axis of {what}"));
        }
        if !(2..=3).contains(&space.len()) {
            return header.fault("dimension", format!("leaves {} axes in space, must leave 2 or 3", space.len()));
        }
        let channels = colour.first().map_or(1, |n| all[*n].size);
        if ![1, 3, 4].contains(&channels) {
            return header.fault("sizes", format!("has {channels} numbers for each voxel, must be 1, 3 or 4"));
        }
        if let Some(kind) = colour.first().map(|n| &all[*n].kind).filter(|kind| VECTORS.contains(&kind.as_str())) {
            remarks.push(("colours".into(), format!("the {channels} numbers of kind {kind} are taken as colours")));
        }
        let mut size = [1; 3];
        space.iter().zip(&mut size).for_each(|(n, size)| *size = all[*n].size);
        let volumes = time.first().map_or(1, |n| all[*n].size);
        let order: Vec<usize> = colour.into_iter().chain(space.clone()).chain(time.clone()).collect();
        // Axes of one sample may stand anywhere.
        let long: Vec<usize> = order.iter().copied().filter(|n| all[*n].size > 1).collect();
        let sizes = all.iter().map(|axis| axis.size).collect();
        let reorder = (!long.is_sorted()).then_some(StoredOrder { sizes, order: long });
        Ok(Axes { all, space, time: time.first().copied(), channels, size, volumes, reorder })
    }

    /// Map from the voxels to the world.
    ///
    /// # Errors
    /// One line that names the file and the field: the axes or the origin are impossible.
    pub(super) fn world(&self, header: &Header, remarks: &mut Remarks) -> Result<World, InputError> {
        let sign = sign(header)?;
        let (named, (axes, origin)) = match self.all.iter().any(Axis::is_in_space) {
            true => ("space directions", self.directed(header, sign, remarks)?),
            false => ("spacings", self.spaced(header, sign, remarks)?),
        };
        World::new(axes, origin).map_err(|why| InputError::new(header.path, named, why))
    }

    /// Axes by their directions, and the origin, mm.
    fn directed(&self, header: &Header, sign: DVec3, remarks: &mut Remarks) -> Result<Placed, InputError> {
        let (field, mut axes) = ("space directions", [DVec3::ZERO; 3]);
        let lengths: BTreeSet<usize> =
            self.all.iter().filter_map(|axis| axis.direction.as_ref()?.as_ref().map(Vec::len)).collect();
        let Some(dimension) = lengths.first().filter(|_| lengths.len() == 1).copied() else {
            return header.fault(field, "has vectors of different lengths");
        };
        if header.get("space dimension").is_some_and(|stated| stated.parse() != Ok(dimension)) {
            return header.fault(field, format!("has vectors of {dimension} numbers, which is not space dimension"));
        }
        let scale = self.scale(header, dimension, remarks)?;
        for (axis, n) in axes.iter_mut().zip(&self.space) {
            let Some(Some(vector)) = &self.all[*n].direction else {
                return header.fault(field, "is none for an axis in space");
            };
            if vector.get(3).is_some_and(|time| *time != 0.0) {
                return header.fault(field, "mixes space and time");
            }
            *axis = place(vector) * sign * scale.of_axis(*n);
        }
        self.contradicted(header, &scale, remarks);
        if self.space.len() == 2 {
            axes[2] = axes[0].cross(axes[1]).normalize_or_zero();
        }
        if let Some((n, axis)) = self.time.and_then(|n| Some((n, self.all.get(n)?))) {
            match axis.of_space_and_time() {
                Some((_, [0.0, 0.0, 0.0])) => {}
                Some(_) => return header.fault(field, "mixes space and time"),
                None if axis.is_in_space() => {
                    let text = format!("axis {n} is read as time; its direction in space is not used");
                    remarks.push(warned(header.path, "axes", text));
                }
                None => {}
            }
        }
        match header.vectors("space origin")?.as_deref() {
            None => Ok((axes, DVec3::ZERO)),
            Some([Some(origin)]) if origin.len() == dimension => match scale.of_origin() {
                _ if place(origin) == DVec3::ZERO => Ok((axes, DVec3::ZERO)),
                Some(scale) => Ok((axes, place(origin) * sign * scale)),
                None => header.fault("units", "differ from axis to axis, so that those of space origin are not known"),
            },
            Some(_) => header.fault("space origin", format!("is not one vector of {dimension} numbers")),
        }
    }

    /// Warns of spacings and units of axes that say something else than the directions, which count.
    fn contradicted(&self, header: &Header, scale: &Scale, remarks: &mut Remarks) {
        let is_near = |a: f64, b: f64| (a - b).abs() <= 1e-4 * b.abs();
        let directed =
            self.space.iter().filter_map(|n| Some((*n, &self.all[*n], self.all[*n].direction.as_ref()?.as_ref()?)));
        let mut named = BTreeSet::new();
        for (n, axis, vector) in directed {
            let unit = millimetres(&axis.unit).filter(|_| is_said(&axis.unit));
            named.extend(
                axis.spacing
                    .filter(|spacing| !is_near(*spacing, place(vector).length()))
                    .map(|_| "spacings or axis mins"),
            );
            named.extend(unit.filter(|unit| !is_near(*unit, scale.of_axis(n).x)).map(|_| "units"));
        }
        for field in named {
            let text = format!("{field} differ from space directions and their units, which count");
            remarks.push(warned(header.path, "not used", text));
        }
    }

    /// Axes along the world by their spacings, and the origin, mm.
    fn spaced(&self, header: &Header, sign: DVec3, remarks: &mut Remarks) -> Result<Placed, InputError> {
        let mut axes = [DVec3::X, DVec3::Y, DVec3::Z];
        let stated = header.get("space dimension").and_then(|text| text.parse().ok());
        let scale =
            self.scale(header, stated.unwrap_or(if header.has("space") { 3 } else { self.space.len() }), remarks)?;
        let (mut starts, mut not_stated) = (Vec::new(), Vec::new());
        for (c, n) in self.space.iter().copied().enumerate() {
            let axis = &self.all[n];
            let spacing = match axis.spacing {
                Some(spacing) if spacing > 0.0 => spacing,
                Some(other) => return header.fault("spacings", format!("is {other} for an axis, must be above 0")),
                None => {
                    not_stated.extend((axis.size > 1).then(|| n.to_string()));
                    1.0
                }
            };
            let factor = scale.of_axis(n)[c];
            axes[c] *= spacing * factor;
            // The place of the first sample: the middle of its cell, unless samples are at the ends of the axis.
            starts.push(axis.least.map(|least| (least + if axis.is_node { 0.0 } else { spacing / 2.0 }) * factor));
        }
        if !not_stated.is_empty() {
            let text = format!("not stated of axis {}, taken as 1 {}", not_stated.join(", "), scale.name());
            remarks.push(("spacing".into(), text));
        }
        match header.vectors("space origin")?.as_deref() {
            Some([Some(origin)]) => Ok((axes, place(origin) * sign * scale.of_axis(self.space[0]))),
            Some(_) => header.fault("space origin", "is not one vector"),
            None => {
                let starts: Option<Vec<f64>> = starts.into_iter().collect();
                Ok((axes, starts.map_or(DVec3::ZERO, |starts| place(&starts))))
            }
        }
    }

    /// The units of lengths: of the coordinates of the space, else of the axes.
    fn scale(&self, header: &Header, dimension: usize, remarks: &mut Remarks) -> Result<Scale, InputError> {
        let mut scale = Scale { of_space: None, of_axes: vec![1.0; self.all.len()], space: self.space.clone() };
        let mut unknown = BTreeSet::new();
        let mut of = |word: &str| {
            millimetres(word).unwrap_or_else(|| {
                unknown.insert(word.to_string());
                1.0
            })
        };
        if let Some(words) = self.space_units(header, dimension)? {
            let mut factors = [1.0; 3];
            factors.iter_mut().zip(&words).for_each(|(factor, word)| *factor = of(word));
            scale.of_space = Some(DVec3::from(factors));
        } else {
            for n in &self.space {
                let unit = &self.all[*n].unit;
                scale.of_axes[*n] = if is_said(unit) { of(unit) } else { 1.0 };
            }
            let missing = self.space.iter().filter(|n| !is_said(&self.all[**n].unit)).count();
            if missing == self.space.len() {
                remarks.push(("units".into(), "not stated, taken as mm".into()));
            } else if missing > 0 {
                remarks.push(warned(header.path, "units", "the unit of an axis is not stated, taken as mm".into()));
            }
        }
        for word in unknown {
            let text = match word.is_empty() {
                true => "the unit of a coordinate is not stated, taken as mm".into(),
                false => format!("the unit {} is not known, taken as mm", quoted(&word)),
            };
            remarks.push(warned(header.path, "units", text));
        }
        Ok(scale)
    }

    /// The units of the coordinates of the space, those of time left out; None if no unit is stated.
    fn space_units(&self, header: &Header, dimension: usize) -> Result<Option<Vec<String>>, InputError> {
        let field = "space units";
        let words = match header.words(field, 1) {
            Ok(Some(one)) => vec![one[0].clone(); dimension],
            Ok(None) => return Ok(None),
            Err(_) => header.words(field, dimension)?.unwrap_or_default(),
        };
        let words: Vec<String> =
            words.into_iter().take(3).map(|word| if is_said(&word) { word } else { String::new() }).collect();
        Ok(words.iter().any(|word| !word.is_empty()).then_some(words))
    }

    /// Time stamp of each frame, s, by its index in the file. Empty, with a remark, if the times are in no known unit of time.
    pub(super) fn times(&self, header: &Header, remarks: &mut Remarks) -> Result<BTreeMap<usize, f64>, InputError> {
        let (slices, frames) = (self.size[2], self.size[2] * self.volumes);
        let beside = self.values_beside_colours(header);
        let is_other = |(n, axis): &(usize, &Axis)| axis.has_values && Some(*n) != self.time && Some(*n) != beside;
        for (n, _) in self.all.iter().enumerate().filter(is_other) {
            let text = format!("axis {n} index values are not used: the axis is not read as time");
            remarks.push(warned(header.path, "times", text));
        }
        let Some(n) = self.time else { return Ok(BTreeMap::new()) };
        let axis = &self.all[n];
        let values = match (axis.has_values, beside) {
            (true, _) => self.index_values(header, n, remarks),
            (false, Some(other)) => {
                let text = format!("axis {other} index values are taken as those of axis {n}, which is time");
                remarks.push(warned(header.path, "times", text));
                self.index_values(header, other, remarks)
            }
            (false, None) => self.steps(header, n)?,
        };
        let Some(values) = values else { return Ok(BTreeMap::new()) };
        let unit = match header.words("space units", 4) {
            Ok(Some(words)) if !is_said(&axis.unit) && axis.of_space_and_time().is_some() => words[3].clone(),
            _ => axis.unit.clone(),
        };
        let Some(factor) = seconds(&unit) else {
            remarks.push(self.no_times(header, n, &unit));
            return Ok(BTreeMap::new());
        };
        let times = values.into_iter().enumerate().map(|(volume, value)| (volume, value * factor)).collect();
        Ok(spread(&times, slices, frames))
    }

    /// The axis before time whose index values are one for each volume: 3D Slicer counts axes without that of colours.
    fn values_beside_colours(&self, header: &Header) -> Option<usize> {
        let before = self.time?.checked_sub(1).filter(|_| self.channels > 1)?;
        let has_values = |n: usize| self.all.get(n).is_some_and(|axis| axis.has_values);
        let text = header.value(&format!("axis {before} index values"))?;
        let count = text.split(is_between).filter(|word| !word.is_empty()).count();
        (has_values(before) && !self.time.is_some_and(has_values) && count == self.volumes).then_some(before)
    }

    /// Why numbers along an axis are no times. That steps have no unit is usual, and no warning.
    fn no_times(&self, header: &Header, n: usize, unit: &str) -> (String, String) {
        let title = if self.all[n].has_values { "times" } else { "time steps" };
        if !is_said(unit) && !self.all[n].has_values {
            return (title.into(), format!("of axis {n} have no unit: not used"));
        }
        let why = match is_said(unit) {
            true => format!("the unit {}, which is none of time", quoted(unit)),
            false => "no unit".into(),
        };
        warned(header.path, title, format!("{title} of axis {n} have {why}: not used"))
    }

    /// `axis N index values` as 3D Slicer writes them; None if they are no numbers for each volume.
    fn index_values(&self, header: &Header, n: usize, remarks: &mut Remarks) -> Option<Vec<f64>> {
        let text = header.value(&format!("axis {n} index values"))?;
        let is_text =
            header.value(&format!("axis {n} index type")).is_some_and(|word| word.eq_ignore_ascii_case("text"));
        let words = text.split(is_between).filter(|word| !word.is_empty());
        let numbers: Option<Vec<f64>> = words.map(|word| word.parse().ok()).collect();
        let fault = match numbers {
            _ if is_text => "are text".to_string(),
            Some(numbers) if numbers.len() != self.volumes => {
                format!("are {}, but the axis has {}", numbers.len(), self.volumes)
            }
            Some(numbers) if numbers.iter().all(|value| value.is_finite()) => return Some(numbers),
            _ => "are not all finite numbers".to_string(),
        };
        let text = format!("axis {n} index values {fault}: there are no time stamps");
        remarks.push(warned(header.path, "times", text));
        None
    }

    /// Times by the step of an axis and its start; None if no step is stated.
    fn steps(&self, header: &Header, n: usize) -> Result<Option<Vec<f64>>, InputError> {
        let axis = &self.all[n];
        let (step, start) = match axis.of_space_and_time() {
            Some((step, _)) => {
                let origin = header.vectors("space origin")?.and_then(|all| all.into_iter().next().flatten());
                (Some(step), origin.and_then(|origin| origin.get(3).copied()))
            }
            None => (axis.spacing, axis.least),
        };
        let Some(step) = step.filter(|step| *step != 0.0) else { return Ok(None) };
        Ok(Some((0..self.volumes).map(|volume| start.unwrap_or(0.0) + step * volume as f64).collect()))
    }
}

/// Whether a character stands between index values.
fn is_between(c: char) -> bool {
    c.is_whitespace() || c == ','
}

/// Factors from the units of a file to mm.
struct Scale {
    /// Of the coordinates of the space.
    of_space: Option<DVec3>,
    /// Of each axis.
    of_axes: Vec<f64>,
    /// The axes in space.
    space: Vec<usize>,
}

impl Scale {
    /// For the vector of an axis.
    fn of_axis(&self, n: usize) -> DVec3 {
        self.of_space.unwrap_or_else(|| DVec3::splat(self.of_axes.get(n).copied().unwrap_or(1.0)))
    }

    /// For the origin; None if it is not clear.
    fn of_origin(&self) -> Option<DVec3> {
        let first = self.of_axis(*self.space.first()?);
        self.space.iter().all(|n| self.of_axis(*n) == first).then_some(first)
    }

    /// The unit of a length that is not stated.
    fn name(&self) -> &'static str {
        let is_mm = self.of_space.is_none_or(|factors| factors == DVec3::ONE);
        if is_mm && self.of_axes.iter().all(|factor| *factor == 1.0) { "mm" } else { "of the unit of the file" }
    }
}

/// What all axes are. What is not stated and is guessed is a warning.
fn roles(header: &Header, all: &[Axis], remarks: &mut Remarks) -> Result<Vec<Role>, InputError> {
    let mut roles = all.iter().map(|axis| axis.role(header)).collect::<Result<Vec<Role>, InputError>>()?;
    let is_candidate = |n: usize| match roles[n] {
        Role::Unsaid => !is_spaceless(all, n),
        role => role == Role::Space,
    };
    let in_space = (0..all.len()).filter(|n| is_candidate(*n)).count();
    for n in 0..all.len() {
        roles[n] = match roles[n] {
            Role::List if in_space == 2 && is_slices(header, all, n) => {
                remarks.push(("axes".into(), format!("axis {n} is a list beside two axes in space: taken as slices")));
                Role::Space
            }
            Role::List if header.has_segments() && all[n].size > 1 => {
                let fault = format!("make axis {n} layers of segments that overlap: only one layer is read");
                return header.fault("kinds", fault);
            }
            Role::List => Role::Time,
            Role::Unsaid => unsaid(header, all, &roles, n, remarks)?,
            role => role,
        };
    }
    fourth_is_time(header, all, &mut roles, remarks);
    Ok(roles)
}

/// Whether an axis has no direction, or, as the first or the last of a file with spacings, none of them.
fn is_spaceless(all: &[Axis], n: usize) -> bool {
    let has_spacings = all.iter().filter(|axis| axis.spacing.is_some()).count() >= 2;
    let has_none = all[n].direction.is_none() && all[n].spacing.is_none() && has_spacings;
    all.len() > 2 && (all[n].is_none() || (has_none && (n == 0 || n + 1 == all.len())))
}

/// Whether a list beside two axes in space is slices: PLUS writes "domain domain list" into its volumes, too.
fn is_slices(header: &Header, all: &[Axis], n: usize) -> bool {
    let axis = &all[n];
    let is_time = axis.is_none() || axis.has_values || axis.is_time_by_unit() || header.frames.is_sequence;
    n > 0 && !is_time
}

/// What an axis is whose kind does not say it.
fn unsaid(header: &Header, all: &[Axis], roles: &[Role], n: usize, remarks: &mut Remarks) -> Result<Role, InputError> {
    let (axis, has_time) = (&all[n], roles.contains(&Role::Time));
    let is_named = axis.has_values || TIME_LABELS.contains(&axis.label.as_str());
    if !has_time && all.len() > 2 && (axis.is_time_by_unit() || (is_named && !axis.is_in_space())) {
        return Ok(Role::Time);
    }
    if !is_spaceless(all, n) {
        return Ok(Role::Space);
    }
    let is_colour = n == 0 && [3, 4].contains(&axis.size) && !roles.contains(&Role::Colour);
    let (role, what) = match axis.size {
        1 => return Ok(Role::Single),
        _ if is_colour => (Role::Colour, "colours"),
        _ if n + 1 == all.len() && !has_time => (Role::Time, "volumes one after another"),
        size => {
            let fault = format!("axis {n}, of {size} numbers, is neither in space nor time nor a colour");
            return header.fault("kinds", fault);
        }
    };
    let text = format!("axis {n}, of {} numbers, has no kind: taken as {what}", axis.size);
    remarks.push(warned(header.path, "axes", text));
    Ok(role)
}

/// Of four axes in space one is time: the one along the fourth coordinate, else the last.
fn fourth_is_time(header: &Header, all: &[Axis], roles: &mut [Role], remarks: &mut Remarks) {
    let space: Vec<usize> = (0..all.len()).filter(|n| roles[*n] == Role::Space).collect();
    let ([_, _, _, last], false) = (&space[..], roles.contains(&Role::Time)) else { return };
    let along = space.iter().find(|n| all[**n].of_space_and_time().is_some_and(|(step, _)| step != 0.0));
    roles[*along.unwrap_or(last)] = Role::Time;
    if along.is_none() {
        let text = format!("axis {last} is the fourth without a kind of its own: taken as volumes one after another");
        remarks.push(warned(header.path, "axes", text));
    }
}

/// Whether a unit is stated.
fn is_said(unit: &str) -> bool {
    !matches!(unit, "" | "???" | "none")
}

/// The first three numbers; those that are not there are 0.
fn place(numbers: &[f64]) -> DVec3 {
    let at = |n: usize| numbers.get(n).copied().unwrap_or(0.0);
    DVec3::new(at(0), at(1), at(2))
}

/// From the coordinates of the space to LPS. A space may have time as its fourth coordinate.
fn sign(header: &Header) -> Result<DVec3, InputError> {
    let Some(stated) = header.get("space") else { return Ok(DVec3::ONE) };
    let space = stated.to_ascii_lowercase();
    match space.strip_suffix("-time").unwrap_or(&space) {
        "left-posterior-superior" | "lps" | "lpst" | "scanner-xyz" | "3d-right-handed" => Ok(DVec3::ONE),
        "right-anterior-superior" | "ras" | "rast" => Ok(DVec3::new(-1.0, -1.0, 1.0)),
        "left-anterior-superior" | "las" | "last" => Ok(DVec3::new(1.0, -1.0, 1.0)),
        "3d-left-handed" => Ok(DVec3::new(1.0, 1.0, -1.0)),
        other => header.fault("space", format!("{} is not read, only 3D spaces are", quoted(other))),
    }
}
