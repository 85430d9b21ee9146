//! Named transforms between coordinate frames, as the PLUS toolkit has them: `ProbeToTracker` takes a place in the frame of the probe to that
//! of the tracker, mm. Some are constant (a calibration), others differ from picture to picture (poses). A chain of them leads from one
//! frame to another.

use crate::files::quoted;
use glam::{DMat4, DVec4};
use std::collections::{BTreeMap, VecDeque};
use std::str::FromStr;

/// Advice for users in messages: how to give the calibration of tracked pictures.
pub(super) const HOW: &str = "give the calibration: --plus-config FILE.xml, or --calibration ImageToProbe=16 numbers";
/// Most names of transforms in a file.
const MAX_NAMES: usize = 256;

/// The name of a transform: the coordinate frames that it maps from and to, such as `ImageToProbe`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct TransformName {
    pub from: String,
    pub to: String,
}

impl FromStr for TransformName {
    type Err = String;

    /// `ProbeToTracker`: both begin with a capital.
    fn from_str(text: &str) -> Result<TransformName, String> {
        let is_capital = |at: usize| text[at..].starts_with(|c: char| c.is_ascii_uppercase());
        let found = text.match_indices("To").map(|(at, _)| at).find(|at| *at > 0 && is_capital(at + 2));
        let is_plain = text.len() <= 200 && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_' || c == '-');
        match found.filter(|_| is_plain && is_capital(0)) {
            Some(at) => Ok(TransformName { from: text[..at].into(), to: text[at + 2..].into() }),
            None => Err(format!("{} is no name of a transform, as ProbeToTracker", quoted(text))),
        }
    }
}

impl std::fmt::Display for TransformName {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{}To{}", self.from, self.to)
    }
}

/// A constant transform, such as the calibration of a probe. Its matrix maps positions in the frame `from` of its name to the frame `to`. Positions
/// are in mm, in the frame of pictures in pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    pub name: TransformName,
    pub matrix: DMat4,
}

impl FromStr for Calibration {
    type Err = String;

    /// `ImageToProbe=` and 16 numbers, or 12 without the last row, row by row, with spaces or commas between them.
    fn from_str(text: &str) -> Result<Calibration, String> {
        let (name, numbers) = text.split_once('=').ok_or("must read NAME=16 NUMBERS, as ImageToProbe=0.1 0 0 ...")?;
        Ok(Calibration { name: name.trim().parse()?, matrix: matrix(numbers)? })
    }
}

/// Parses a matrix of 16 numbers, or of 12 without the last row, row by row.
///
/// # Errors
/// One line: another number of them, one that is not finite, a last row that is not 0 0 0 1, or a matrix that has no inverse.
pub(super) fn matrix(text: &str) -> Result<DMat4, String> {
    let words: Vec<&str> =
        text.split(|c: char| c.is_whitespace() || c == ',').filter(|word| !word.is_empty()).collect();
    let number = |word: &&str| match word.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => Err(format!("{} is not a finite number", quoted(word))),
    };
    let mut numbers = words.iter().map(number).collect::<Result<Vec<_>, _>>()?;
    if numbers.len() == 12 {
        numbers.extend([0.0, 0.0, 0.0, 1.0]);
    }
    let Ok(rows) = <[f64; 16]>::try_from(numbers) else {
        return Err(format!("has {} numbers, must have 16", words.len()));
    };
    let matrix = DMat4::from_cols_array(&rows).transpose();
    if matrix.row(3) != DVec4::W {
        return Err("has another last row than 0 0 0 1".into());
    }
    if !matrix.inverse().is_finite() || matrix.determinant() == 0.0 {
        return Err("has no inverse".into());
    }
    Ok(matrix)
}

/// The transforms that differ from picture to picture, by name and by the index of the picture, from 0. Invalid ones have no entry.
#[derive(Clone, Debug, Default)]
pub(super) struct Poses {
    pub by_name: BTreeMap<TransformName, BTreeMap<usize, DMat4>>,
}

impl Poses {
    /// Sets the transform of this name for a picture. A name beyond the first 256 is ignored.
    pub fn add(&mut self, name: TransformName, picture: usize, matrix: DMat4) {
        if self.by_name.len() < MAX_NAMES || self.by_name.contains_key(&name) {
            self.by_name.entry(name).or_default().insert(picture, matrix);
        }
    }

    /// Removes a picture's transform, because its status is not OK.
    pub fn remove(&mut self, name: &TransformName, picture: usize) {
        if let Some(pictures) = self.by_name.get_mut(name) {
            pictures.remove(&picture);
        }
    }

    /// A row of the description of a recording, title and text: by which transforms the pictures are tracked, and how to make a volume of them. None if
    /// they are not tracked.
    pub fn remark(&self) -> Option<(String, String)> {
        let is_there = !self.by_name.is_empty();
        is_there.then(|| ("tracking".into(), format!("{}; for a freehand volume {HOW}", self.names())))
    }

    /// The names of the transforms, separated by commas.
    pub fn names(&self) -> String {
        self.by_name.keys().map(TransformName::to_string).collect::<Vec<_>>().join(", ")
    }
}

/// A chain of transforms from one coordinate frame to another.
pub(super) struct Chain<'a> {
    links: Vec<(Link<'a>, bool)>,
}

/// A transform of a chain, and whether it is taken backwards.
#[derive(Clone, Copy)]
enum Link<'a> {
    Fixed(&'a Calibration),
    Pose(&'a BTreeMap<usize, DMat4>),
}

impl<'a> Chain<'a> {
    /// The shortest chain of `poses` and constant transforms (`fixed`) from one coordinate frame to another. Any transform can be taken backwards. A
    /// pose takes precedence over a constant transform of the same name. None if there is no chain.
    pub fn find(poses: &'a Poses, fixed: &'a [Calibration], from: &str, to: &str) -> Option<Chain<'a>> {
        let mut edges: Vec<(&TransformName, Link)> =
            poses.by_name.iter().map(|(name, matrices)| (name, Link::Pose(matrices))).collect();
        for calibration in fixed {
            if !edges.iter().any(|(name, _)| **name == calibration.name) {
                edges.push((&calibration.name, Link::Fixed(calibration)));
            }
        }
        // Each frame with the edge by which it was reached.
        let mut reached: BTreeMap<&str, Option<(usize, bool)>> = BTreeMap::from([(from, None)]);
        let mut waiting = VecDeque::from([from]);
        while let Some(frame) = waiting.pop_front() {
            for (n, (name, _)) in edges.iter().enumerate() {
                for (start, end, backwards) in [(&name.from, &name.to, false), (&name.to, &name.from, true)] {
                    if start == frame && !reached.contains_key(end.as_str()) {
                        reached.insert(end, Some((n, backwards)));
                        waiting.push_back(end);
                    }
                }
            }
        }
        let mut links = Vec::new();
        let mut at = to;
        while let Some((n, backwards)) = *reached.get(at)? {
            links.push((edges[n].1, backwards));
            at = if backwards { &edges[n].0.to } else { &edges[n].0.from };
        }
        links.reverse();
        Some(Chain { links })
    }

    /// The map along the whole chain for the picture with this index; None if one of its poses is missing, or if the map is not finite.
    pub fn of(&self, picture: usize) -> Option<DMat4> {
        let mut all = DMat4::IDENTITY;
        for (link, backwards) in &self.links {
            let matrix = match link {
                Link::Fixed(calibration) => calibration.matrix,
                Link::Pose(matrices) => *matrices.get(&picture)?,
            };
            all = if *backwards { matrix.inverse() } else { matrix } * all;
        }
        all.is_finite().then_some(all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    fn name(text: &str) -> TransformName {
        text.parse().unwrap()
    }

    #[test]
    fn names_are_split_where_a_capital_follows() {
        for (text, from, to) in [
            ("ProbeToTracker", "Probe", "Tracker"),
            ("ToolToTo", "Tool", "To"),
            ("StylusTipToStylus", "StylusTip", "Stylus"),
        ] {
            assert_eq!(name(text), TransformName { from: from.into(), to: to.into() });
            assert_eq!(name(text).to_string(), text);
        }
        for wrong in ["", "To", "Tomato", "ProbeTo", "ToTracker", "probeToTracker", "Probe\u{1b}ToTracker"] {
            assert!(wrong.parse::<TransformName>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_matrix_is_read_row_by_row() {
        let read = matrix("1 0 0 5, 0 1 0 6 0 0 1 7").unwrap();
        assert_eq!(read.transform_point3(DVec3::ZERO), DVec3::new(5.0, 6.0, 7.0));
        assert_eq!(matrix("1 0 0 5 0 1 0 6 0 0 1 7 0 0 0 1").unwrap(), read);
        for (wrong, named) in [
            ("1 2 3", "has 3 numbers"),
            ("1 0 0 nan 0 1 0 6 0 0 1 7", "finite"),
            ("1 0 0 5 0 1 0 6 0 0 1 7 0 0 1 1", "last row"),
            ("1 0 0 5 2 0 0 6 0 0 1 7", "no inverse"),
        ] {
            assert!(matrix(wrong).is_err_and(|e| e.contains(named)), "{wrong}");
        }
        assert!("ImageToProbe=1 0 0 0 0 1 0 0 0 0 1 0".parse::<Calibration>().is_ok());
        assert!("1 0 0 0".parse::<Calibration>().is_err());
    }

    #[test]
    fn a_chain_goes_backwards_where_it_must() {
        let turn = DMat4::from_rotation_z(0.7) * DMat4::from_translation(DVec3::new(1.0, 2.0, 3.0));
        let mut poses = Poses::default();
        for (text, matrix) in [("ProbeToTracker", turn), ("ReferenceToTracker", DMat4::from_rotation_x(0.3))] {
            poses.add(name(text), 4, matrix);
        }
        poses.add(name("StylusToTracker"), 4, DMat4::IDENTITY);
        let scale = DMat4::from_scale(DVec3::splat(0.2));
        let fixed = [Calibration { name: name("ImageToProbe"), matrix: scale }];
        let chain = Chain::find(&poses, &fixed, "Image", "Reference").unwrap();
        let expected = DMat4::from_rotation_x(-0.3) * turn * scale;
        let at = DVec3::new(7.0, -2.0, 0.5);
        assert!(chain.of(4).unwrap().transform_point3(at).distance(expected.transform_point3(at)) < 1e-12);
        assert!(chain.of(5).is_none(), "a picture without poses");
        assert!(Chain::find(&poses, &[], "Image", "Reference").is_none());
        // Of what has the same name, the pose of the picture counts.
        poses.add(name("ImageToProbe"), 4, DMat4::IDENTITY);
        let chain = Chain::find(&poses, &fixed, "Image", "Probe").unwrap();
        assert_eq!(chain.of(4), Some(DMat4::IDENTITY));
        poses.remove(&name("ImageToProbe"), 4);
        assert!(Chain::find(&poses, &fixed, "Image", "Probe").unwrap().of(4).is_none());
    }
}
