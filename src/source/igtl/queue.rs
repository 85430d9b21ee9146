//! What was received and not yet taken: bounded, and the oldest goes first.

use super::message::Message;
use std::collections::VecDeque;
use std::time::Instant;

/// A message and when it came.
#[derive(Clone, Debug)]
pub struct Received {
    pub message: Message,
    /// When its last byte was there.
    pub arrived: Instant,
}

pub(super) struct Queue {
    waiting: VecDeque<(Received, usize)>,
    /// Of memory, of all that wait.
    bytes: usize,
    most_messages: usize,
    most_bytes: usize,
}

impl Queue {
    pub fn new(most_messages: usize, most_bytes: usize) -> Queue {
        Queue { waiting: VecDeque::new(), bytes: 0, most_messages, most_bytes }
    }

    /// How many had to go for it. The newest itself always stays: with a limit below its size nothing would ever come.
    pub fn push(&mut self, received: Received) -> u64 {
        let weight = received.message.weight();
        self.bytes = self.bytes.saturating_add(weight);
        self.waiting.push_back((received, weight));
        let mut dropped = 0;
        while self.waiting.len() > 1 && (self.waiting.len() > self.most_messages || self.bytes > self.most_bytes) {
            self.pop();
            dropped += 1;
        }
        dropped
    }

    pub fn pop(&mut self) -> Option<Received> {
        let (received, weight) = self.waiting.pop_front()?;
        self.bytes = self.bytes.saturating_sub(weight);
        Some(received)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::igtl::Text;

    fn text(length: usize) -> Received {
        let text = Text { device: String::new(), time: length as f64, text: "x".repeat(length) };
        Received { message: Message::Text(text), arrived: Instant::now() }
    }

    #[test]
    fn the_oldest_go_by_number_and_by_bytes_and_the_newest_stays() {
        let mut queue = Queue::new(2, 10_000);
        assert_eq!([1, 2, 3].map(|n| queue.push(text(n))), [0, 0, 1]);
        assert_eq!(queue.push(text(9_000)), 1);
        assert_eq!(queue.push(text(20_000)), 2);
        assert_eq!(queue.pop().map(|r| r.message.time()), Some(20_000.0));
        assert!(queue.pop().is_none());
        assert_eq!(queue.bytes, 0);
    }
}
