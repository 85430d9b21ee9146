//! What was read and not yet taken: bounded in bytes, and whoever fills it waits.

use crate::source::live::Event;
use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

pub(super) struct Queue {
    state: Mutex<State>,
    changed: Condvar,
}

struct State {
    waiting: VecDeque<(Event, usize)>,
    /// Of memory, of all that wait, bytes.
    weight: usize,
    room: usize,
    /// Nothing comes any more, and why.
    end: Option<Option<String>>,
    /// Nobody takes any more.
    closed: bool,
}

impl Queue {
    pub fn new() -> Queue {
        let state = State { waiting: VecDeque::new(), weight: 0, room: 0, end: None, closed: false };
        Queue { state: Mutex::new(state), changed: Condvar::new() }
    }

    /// Bytes that may wait; whatever its size, one event always may.
    pub fn set_room(&self, room: usize) {
        self.lock().room = room;
    }

    /// Waits for room. False: nobody takes any more.
    pub fn push(&self, event: Event) -> bool {
        let weight = weight(&event);
        let mut state = self.lock();
        while !state.closed && !state.waiting.is_empty() && state.weight.saturating_add(weight) > state.room {
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        if !state.closed {
            state.weight += weight;
            state.waiting.push_back((event, weight));
            self.changed.notify_all();
        }
        !state.closed
    }

    /// Nothing comes any more. What is said first stays.
    pub fn end(&self, why: Option<String>) {
        self.lock().end.get_or_insert(why);
        self.changed.notify_all();
    }

    pub fn close(&self) {
        let mut state = self.lock();
        state.closed = true;
        state.waiting.clear();
        self.changed.notify_all();
    }

    pub fn next(&self, patience: Duration) -> Event {
        let started = Instant::now();
        let mut state = self.lock();
        loop {
            if let Some((event, weight)) = state.waiting.pop_front() {
                state.weight -= weight;
                self.changed.notify_all();
                return event;
            }
            if let Some(why) = &state.end {
                return Event::End(why.clone());
            }
            let left = patience.saturating_sub(started.elapsed());
            if left.is_zero() {
                return Event::Idle;
            }
            state = self.changed.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        // Nothing panics while it holds the lock.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

pub(super) fn weight(event: &Event) -> usize {
    let bytes = match event {
        Event::Frame(frame) | Event::Lines { frame, .. } => frame.bytes.len(),
        _ => 0,
    };
    // A line of a single byte is not free.
    bytes + size_of::<(Event, usize)>()
}
