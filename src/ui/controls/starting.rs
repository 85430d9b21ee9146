//! The start line of the region: bent at three to five handles, or straight, which is the region's near face.

use super::{Controls, finite, short};
use crate::command::Command;
use crate::scene::start_curve::StartCurve;
use crate::scene::{MAX_START_POINTS, MIN_START_POINTS, Scene, Settings};
use crate::texts;
use crate::view;
use glam::DVec3;

/// Handles that are dragged towards each other stay so far apart, mm.
const GAP: f64 = 1.0;

/// A line that is bent has its first handles at these shares of the region's width: the outer ones keep clear of the corners.
const FIRST: [f64; MIN_START_POINTS] = [0.1, 0.5, 0.9];

impl Controls {
    /// The points of the region's start curve: lateral and depth, mm; empty while rendering starts at a straight line.
    pub(crate) fn start_line(&self) -> &[[f64; 2]] {
        self.settings.region.start_curve.as_deref().unwrap_or_default()
    }
}

/// The reason why a command about the start curve has no effect; None if it has one.
pub(super) fn refusal(command: &Command, now: &Scene) -> Option<&'static str> {
    let count = now.settings.region.start_curve.as_ref().map(Vec::len);
    match (command, count) {
        (Command::ToggleStartCurve, None) if !now.renders() => Some(texts::NOTHING_STARTS),
        (Command::AddStartHandle(_), Some(count)) if count >= MAX_START_POINTS => Some(texts::START_LINE_FULL),
        (Command::RemoveStartHandle(_), Some(count)) if count <= MIN_START_POINTS => Some(texts::START_LINE_LEAST),
        _ => None,
    }
}

/// The settings after a command about the start curve. None if it changes nothing or is about something else.
pub(super) fn changed(command: &Command, now: &Scene) -> Option<Settings> {
    let points = now.settings.region.start_curve.as_deref();
    let curve = match (*command, points) {
        (Command::ToggleStartCurve, Some(_)) => None,
        (Command::ToggleStartCurve, None) => Some(straight(now)),
        (Command::MoveStartHandle(index, to), Some(points)) if finite(&to) => Some(moved(now, points, index, to)?),
        (Command::AddStartHandle(lateral), Some(points)) => Some(with_handle(now, points, lateral)?),
        (Command::RemoveStartHandle(index), Some(points)) => Some(without_handle(points, index)?),
        _ => return None,
    };
    let mut settings = now.settings.clone();
    settings.region.start_curve = curve;
    Some(settings)
}

/// A straight line where rendering starts now.
fn straight(now: &Scene) -> Vec<[f64; 2]> {
    let depth = view::below_face(now, DVec3::Y * view::start_depth(now)).y;
    let lateral = |share: f64| now.low.x + share * (now.high.x - now.low.x);
    FIRST.iter().map(|share| short([lateral(*share), depth])).collect()
}

/// Lower and upper bounds of a handle between its neighbours: it stays in the region.
fn bounds(now: &Scene, points: &[[f64; 2]], index: usize) -> [[f64; 2]; 2] {
    let [low, high] = [now.low, now.high].map(|corner| view::below_face(now, corner));
    let before = index.checked_sub(1).and_then(|n| points.get(n)).map_or(f64::NEG_INFINITY, |point| point[0] + GAP);
    let behind = points.get(index + 1).map_or(f64::INFINITY, |point| point[0] - GAP);
    [[low.x.max(before), low.y], [high.x.min(behind), high.y]]
}

fn moved(now: &Scene, points: &[[f64; 2]], index: usize, to: [f64; 2]) -> Option<Vec<[f64; 2]>> {
    let from = *points.get(index)?;
    let [low, high] = bounds(now, points, index);
    // Handles that are closer together than that, or outside of the region, move in depth alone.
    let is_inside = (low[0]..=high[0]).contains(&from[0]);
    let lateral = if is_inside { to[0].clamp(low[0], high[0]) } else { from[0] };
    let mut moved = points.to_vec();
    moved[index] = short([lateral, to[1].max(low[1]).min(high[1])]);
    Some(moved)
}

/// With one more handle on the line: at a lateral position, or in the middle of the widest gap.
fn with_handle(now: &Scene, points: &[[f64; 2]], lateral: Option<f64>) -> Option<Vec<[f64; 2]>> {
    let widest = || {
        let gaps = points.windows(2).map(|two| (two[1][0] - two[0][0], (two[0][0] + two[1][0]) / 2.0));
        gaps.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, middle)| middle)
    };
    let lateral = lateral.filter(|at| at.is_finite()).or_else(widest)?.max(now.low.x).min(now.high.x);
    if points.iter().any(|point| (point[0] - lateral).abs() < GAP) {
        return None;
    }
    let mut points = points.to_vec();
    let depth = StartCurve::new(&points).depth(lateral);
    points.insert(points.partition_point(|point| point[0] < lateral), short([lateral, depth]));
    Some(points)
}

/// With one handle less: the one with this index, or the one between others that bends the line the least.
fn without_handle(points: &[[f64; 2]], index: Option<usize>) -> Option<Vec<[f64; 2]>> {
    let bend = |three: &[[f64; 2]]| {
        let share = (three[1][0] - three[0][0]) / (three[2][0] - three[0][0]);
        (three[0][1] + share * (three[2][1] - three[0][1]) - three[1][1]).abs()
    };
    let least = || {
        let bends = points.windows(3).map(bend).enumerate();
        bends.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(n, _)| n + 1)
    };
    let index = index.or_else(least).filter(|index| *index < points.len())?;
    let mut points = points.to_vec();
    points.remove(index);
    Some(points)
}
