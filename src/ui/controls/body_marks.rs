//! Body marks: adding, moving, rotating, changing and removing them. Controls refer to the last one that was touched.

use super::{Change, Controls, finite};
use crate::command::Command;
use crate::scene::{BODY_MARK_SIZES, BodyMark, MAX_BODY_MARKS};
use crate::texts;
use crate::view;

/// Where marks are put that are added: the corners of the picture, the one on the lower left first. Shares of the picture.
const PLACES: [[f64; 2]; MAX_BODY_MARKS] = [[0.12, 0.8], [0.88, 0.8], [0.12, 0.2], [0.88, 0.2]];

impl Controls {
    /// The body marks, in the order in which they are drawn.
    pub fn body_marks(&self) -> &[BodyMark] {
        &self.settings.drawn.body_marks
    }

    /// The selected body mark, to which the controls refer, and its index; None if there are none.
    pub fn body_mark(&self) -> Option<(usize, BodyMark)> {
        let last = self.settings.drawn.body_marks.len().checked_sub(1)?;
        let index = self.body_mark.min(last);
        Some((index, self.settings.drawn.body_marks[index]))
    }

    /// Applies a command about body marks. None if the command is about something else.
    pub(super) fn mark_body(&mut self, command: &Command) -> Option<Change> {
        let marks = &self.settings.drawn.body_marks;
        Some(match *command {
            Command::AddBodyMark(_) if marks.len() >= MAX_BODY_MARKS => Change::Refused(texts::TOO_MANY_BODY_MARKS),
            Command::AddBodyMark(body) => {
                let at = PLACES.into_iter().find(|at| marks.iter().all(|mark| mark.at != *at));
                let new = BodyMark { body, at: at.unwrap_or(PLACES[0]), ..BodyMark::default() };
                self.body_mark = marks.len();
                self.mark(command, |settings| settings.drawn.body_marks.push(new))
            }
            Command::ChangeBodyMark(index, new) => {
                let Some(valid) = marks.get(index).and_then(|_| checked(new)) else { return Some(Change::Nothing) };
                let is_same = marks[index] == valid;
                let was_about = std::mem::replace(&mut self.body_mark, index);
                match is_same {
                    true if was_about == index => Change::Nothing,
                    true => Change::Marks,
                    false => self.mark(command, |settings| settings.drawn.body_marks[index] = valid),
                }
            }
            Command::SelectBodyMark(index) if index < marks.len() => {
                self.history.seal();
                self.body_mark = index;
                Change::Marks
            }
            Command::RemoveBodyMark(index) if index < marks.len() => {
                self.mark(command, |settings| _ = settings.drawn.body_marks.remove(index))
            }
            Command::SelectBodyMark(_) | Command::RemoveBodyMark(_) => Change::Nothing,
            _ => return None,
        })
    }
}

/// A mark within its limits; none if one of its numbers is none.
fn checked(mark: BodyMark) -> Option<BodyMark> {
    let BodyMark { at, size, probe, angle, .. } = mark;
    (finite(&at) && finite(&probe) && finite(&[size, angle])).then(|| BodyMark {
        at: at.map(|share| share.clamp(0.0, 1.0)),
        size: size.clamp(BODY_MARK_SIZES[0], BODY_MARK_SIZES[1]),
        probe: probe.map(|share| share.clamp(-1.0, 1.0)),
        angle: view::wrap_degrees(angle),
        ..mark
    })
}
