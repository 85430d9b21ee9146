//! Finding home: by the module's own reference search, or from here by the home switch.

use super::drive::Drive;
use super::fault::Fault;
use super::table::{Home, Side};
use super::tmcl::{Request, axis};
use std::time::{Duration, Instant};

/// Without any movement for so long a search has stalled. A module's own search may pause between its steps.
const STILL: Duration = Duration::from_millis(1500);
/// Speed of the second, exact approach to the switch, of that of the first.
const SLOW: f64 = 0.1;

/// What ended a rotation.
enum Met {
    /// The home switch is as wanted, at this position.
    Switch(i32),
    Limit,
}

impl Drive {
    pub(super) fn find_home(&mut self) -> Result<(), Fault> {
        self.set(axis::LARGEST_ACCELERATION, self.table.acceleration(self.table.acceleration_deg_per_s2))?;
        match self.table.home {
            Home::ReferenceSearch => self.search_by_module(),
            Home::Switch => self.search_by_switch(),
        }?;
        self.wait_still()?;
        self.guard.at_rest();
        Ok(())
    }

    /// Longest time that a search may take: there and back over the whole travel, and as much again.
    fn longest_search(&self) -> Duration {
        Duration::from_secs_f64(5.0 + 4.0 * self.table.largest_angle_deg / self.table.search_speed())
    }

    fn search_by_module(&mut self) -> Result<(), Fault> {
        if let Some(speed) = self.table.search_speed_deg_per_s {
            let velocity = self.table.velocity(speed);
            self.set(axis::SEARCH_SPEED, velocity)?;
            self.set(axis::SWITCH_SPEED, (velocity / 2).max(1))?;
        }
        let limit = self.longest_search();
        self.ask(Request::search_start)?;
        let (start, mut moved, mut last) = (Instant::now(), Instant::now(), None);
        while self.ask(Request::search_status)?.value != 0 {
            let position = self.get(axis::POSITION)?;
            if last != Some(position) {
                (last, moved) = (Some(position), Instant::now());
            }
            self.watch(position, moved)?;
            if start.elapsed() > limit {
                return Err(Fault::TooLong { what: "the module's reference search", limit });
            }
        }
        Ok(())
    }

    /// Turns towards the switch, turning round once at a limit switch; then slowly back over its edge, which is home. The edge is
    /// always met in the same direction, so that the play of the gear is the same.
    fn search_by_switch(&mut self) -> Result<(), Fault> {
        let (towards, speed) = (self.table.home_direction, self.table.search_speed());
        if !self.at_home_switch()? && matches!(self.rotate(towards, speed, true)?, Met::Limit) {
            self.rest()?;
            if let Met::Limit = self.rotate(towards.other(), speed, true)? {
                return Err(Fault::HomeNotFound);
            }
        }
        self.rest()?;
        // Fast off the switch and again onto it: the slow way below is then short wherever the search began.
        if let Met::Limit = self.rotate(towards.other(), speed, false)? {
            return Err(Fault::HomeNotFound);
        }
        self.rest()?;
        if let Met::Limit = self.rotate(towards, speed * SLOW.sqrt(), true)? {
            return Err(Fault::HomeNotFound);
        }
        self.rest()?;
        let Met::Switch(edge) = self.rotate(towards.other(), speed * SLOW, false)? else {
            return Err(Fault::HomeNotFound);
        };
        self.rest()?;
        // Position and target together, at rest: the motor has nowhere to go.
        let position = self.get(axis::POSITION)?.saturating_sub(edge);
        self.set(axis::POSITION, position)?;
        self.set(axis::TARGET, position)
    }

    fn rest(&mut self) -> Result<(), Fault> {
        self.ask(Request::stop)?;
        self.wait_still()
    }

    /// Turns until the home switch is closed, or open, or the limit switch ahead is closed.
    fn rotate(&mut self, side: Side, speed: f64, until_closed: bool) -> Result<Met, Fault> {
        let (velocity, limit) = (self.table.velocity(speed), self.longest_search().mul_f64(1.0 / SLOW));
        let turn = if side == Side::Left { Request::rotate_left } else { Request::rotate_right };
        if self.limit_closed(side)? {
            return Ok(Met::Limit);
        }
        let first = self.get(axis::POSITION)?;
        let travel = 1.5 * self.table.largest_angle_deg * self.table.steps_per_degree();
        self.ask(|a, m| turn(a, m, velocity))?;
        let (start, mut moved, mut last) = (Instant::now(), Instant::now(), None);
        loop {
            // The position before and after: the switch changed somewhere between.
            let before = self.get(axis::POSITION)?;
            if self.at_home_switch()? == until_closed {
                let after = self.get(axis::POSITION)?;
                return Ok(Met::Switch(((i64::from(before) + i64::from(after)) / 2) as i32));
            }
            if self.limit_closed(side)? {
                return Ok(Met::Limit);
            }
            if last != Some(before) {
                (last, moved) = (Some(before), Instant::now());
            }
            self.watch(before, moved)?;
            if (f64::from(before) - f64::from(first)).abs() > travel {
                return Err(Fault::HomeNotFound);
            }
            if start.elapsed() > limit {
                return Err(Fault::TooLong { what: "the search for the home switch", limit });
            }
        }
    }

    /// # Errors
    /// The motor has not moved for long: at a limit switch, or stalled.
    fn watch(&mut self, position: i32, moved: Instant) -> Result<(), Fault> {
        if moved.elapsed() < STILL {
            return Ok(());
        }
        let angle = self.table.angle(position);
        for side in [Side::Left, Side::Right] {
            if self.limit_closed(side)? {
                return Err(Fault::LimitSwitch { side, angle });
            }
        }
        Err(Fault::Stalled { angle })
    }
}
