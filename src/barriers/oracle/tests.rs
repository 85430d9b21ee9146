use super::*;
use crate::probe::{Geometry, Grid};
use crate::source::StoredType;

fn scene() -> Scene {
    let grid = Grid { size: [8, 8, 6], spacing: [1.0; 3], origin: [0.0; 3] };
    let input = crate::scene::Input { stored: StoredType::U8, range: [0.0, 255.0] };
    Scene::new(Geometry::Cartesian(grid), input, toml::from_str("mode = 'sr'").unwrap()).unwrap()
}

fn touch(slot: Slot, part: u32, write: bool) -> Event {
    Event::Operation(vec![Access::of_slot(slot, 0, part..part + 1, write, Worker::Compute)])
}

fn barrier(from: Worker, to: Worker) -> Event {
    Event::Barrier(Barrier { from: from.into(), to: to.into() })
}

fn submitted(queue: usize, value: u64, waits: &[Wait], events: Vec<Event>) -> Submission {
    Submission { queue, value, waits: waits.to_vec(), events }
}

fn finds(submissions: Vec<Submission>) -> Option<Unordered> {
    Log { submissions, ..Log::default() }.unordered(&scene())
}

#[test]
fn a_write_and_a_read_need_a_barrier_of_their_workers_between_them() {
    let [write, read] = [touch(Slot::Picture, 0, true), touch(Slot::Picture, 0, false)];
    let one = |events: Vec<Event>| finds(vec![submitted(0, 1, &[], events)]);
    let found = one(vec![write.clone(), read.clone()]).expect("unordered");
    assert_eq!((found.earlier, found.later), ((0, 0), (0, 1)));
    assert_eq!(one(vec![write.clone(), barrier(Worker::Compute, Worker::Compute), read.clone()]), None);
    assert!(one(vec![write.clone(), barrier(Worker::Compute, Worker::Copy), read.clone()]).is_some());
    assert!(one(vec![barrier(Worker::Compute, Worker::Compute), write.clone(), read.clone()]).is_some());
    // Two barriers are a chain where the second begins with what the first ends with.
    let [there, back] = [barrier(Worker::Compute, Worker::Copy), barrier(Worker::Copy, Worker::Compute)];
    assert_eq!(one(vec![write.clone(), there.clone(), back.clone(), read.clone()]), None);
    assert!(one(vec![write, back, there, read]).is_some());
}

#[test]
fn parts_of_an_array_are_apart_and_slices_of_a_volume_are_not() {
    let one = |a: Event, b: Event| finds(vec![submitted(0, 1, &[], vec![a, b])]).is_some();
    assert!(!one(touch(Slot::Frames, 0, true), touch(Slot::Frames, 1, false)));
    assert!(one(touch(Slot::Frames, 1, true), touch(Slot::Frames, 1, false)));
    assert!(one(touch(Slot::Volume, 0, true), touch(Slot::Volume, 1, false)));
    assert!(!one(touch(Slot::Volume, 0, true), touch(Slot::Volume, 1, true)));
    assert!(!one(touch(Slot::Volume, 0, false), touch(Slot::Volume, 0, false)));
}

#[test]
fn between_queues_only_a_wait_orders_and_what_it_waits_for_carries_on() {
    let write = || vec![touch(Slot::Volume, 0, true)];
    let read = || vec![touch(Slot::Volume, 0, false)];
    let wait = |queue, value| Wait { queue, value };
    assert!(finds(vec![submitted(1, 1, &[], write()), submitted(0, 1, &[], read())]).is_some());
    assert_eq!(finds(vec![submitted(1, 1, &[], write()), submitted(0, 1, &[wait(1, 1)], read())]), None);
    // A wait for what came before it is none.
    let late =
        vec![submitted(1, 1, &[], vec![]), submitted(1, 2, &[], write()), submitted(0, 1, &[wait(1, 1)], read())];
    assert!(finds(late).is_some());
    // From queue to queue to queue.
    let chain = vec![
        submitted(2, 1, &[], write()),
        submitted(1, 1, &[wait(2, 1)], vec![]),
        submitted(0, 1, &[wait(1, 1)], read()),
    ];
    let log = Log { submissions: chain, ..Log::default() };
    assert_eq!(log.unordered(&scene()), None);
    assert_eq!(log.waits(), [(1, 0), (2, 0)]);
    assert!(log.waits().into_iter().all(|w| log.without_wait(w).unordered(&scene()).is_some()));
}

#[test]
fn what_was_not_submitted_counts_for_nothing() {
    let mut log = Log::default();
    let access = [Access::of_slot(Slot::Picture, 0, 0..1, true, Worker::Compute)];
    log.begin(0);
    log.record(0, None, &access);
    log.begin(0);
    log.record(0, None, &access);
    log.submit(0, &[], 1);
    assert_eq!(log.submissions.len(), 1);
    assert_eq!(log.unordered(&scene()), None);
}
