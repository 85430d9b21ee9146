//! How the frames of a recording make up volumes, and in which direction each was swept.

use super::axis::Axis;
use super::geometry::Advance;

/// How the frames of a recording make up volumes.
#[derive(Clone, Debug, PartialEq)]
pub struct Volumes {
    /// Frames a volume (K).
    pub frames: usize,
    /// Complete volumes in the recording.
    pub count: usize,
    /// Frames after the last complete volume.
    pub left_over: usize,
    /// Every second volume was swept in the other direction.
    pub both_ways: bool,
    /// The first volume was swept backwards.
    pub first_backward: bool,
    /// Fraction of the distance to the next frame that the motor travels while one frame is acquired (s), 0..=1.
    pub speed_ratio: f64,
}

impl Volumes {
    /// `count` volumes of `frames`, all swept forwards by a motor that stops for each frame.
    pub fn forward(frames: usize, count: usize) -> Volumes {
        Volumes { frames, count, left_over: 0, both_ways: false, first_backward: false, speed_ratio: 0.0 }
    }

    /// True if this volume was swept backwards.
    pub fn backward(&self, volume: usize) -> bool {
        self.first_backward ^ (self.both_ways && volume % 2 == 1)
    }

    /// Travel of the motor while each frame of this volume was acquired: towards the frame that followed in time, so negative for a
    /// backward sweep: f = f_first + dir df (k + s j / L) for line j of frame k (thesis 4.4.2.2, Fig. 40).
    pub fn advance(&self, volume: usize, slices: &Axis) -> Advance {
        if self.speed_ratio == 0.0 || slices.len() < 2 {
            return Advance::None;
        }
        let backward = self.backward(volume);
        let sign = if backward { -self.speed_ratio } else { self.speed_ratio };
        match slices {
            Axis::Even { pitch, .. } => Advance::Same(sign * pitch),
            Axis::Table(table) => {
                let gap = |k: usize| table[k + 1] - table[k];
                let last = table.len() - 2;
                // The last frame in time has no successor: the motor is assumed to continue at the same speed.
                let gap_after = |k: usize| if backward { gap(k.max(1) - 1) } else { gap(k.min(last)) };
                Advance::Each((0..table.len()).map(|k| sign * gap_after(k)).collect())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Line 0 of the next frame in time is where the motor is when the last line of this one is done.
    #[test]
    fn the_motor_moves_towards_the_next_frame_in_time_both_ways() {
        let slices = Axis::Table(vec![0.0, 1.0, 3.0, 6.0]);
        let volumes = Volumes { both_ways: true, speed_ratio: 1.0, ..Volumes::forward(4, 2) };
        let Advance::Each(forward) = volumes.advance(0, &slices) else { panic!("a table has one advance a slice") };
        let Advance::Each(back) = volumes.advance(1, &slices) else { panic!("a table has one advance a slice") };
        for k in 0..3 {
            assert_eq!(slices.at(k as f64) + forward[k], slices.at(k as f64 + 1.0));
            assert_eq!(slices.at(k as f64 + 1.0) + back[k + 1], slices.at(k as f64));
        }
        assert_eq!(volumes.advance(1, &Axis::centred(0.5, 4)), Advance::Same(-0.5));
        assert_eq!(Volumes::forward(4, 1).advance(0, &slices), Advance::None);
    }

    #[test]
    fn the_first_direction_and_the_alternation_are_independent() {
        let volumes = Volumes { first_backward: true, ..Volumes::forward(4, 3) };
        assert_eq!([0, 1, 2].map(|v| volumes.backward(v)), [true; 3]);
        let volumes = Volumes { both_ways: true, ..volumes };
        assert_eq!([0, 1, 2].map(|v| volumes.backward(v)), [true, false, true]);
    }
}
