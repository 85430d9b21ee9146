//! What of the window is out of date, and when it is presented again. Nothing is presented unless something changed.

use crate::gpu::window::Screen;
use crate::panels::accesskit::TreeUpdate;
use crate::shown_picture::ShownPicture;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// While the next picture is not ready, the window keeps the old content for so long: less disturbing than a black moment.
const BLANK_DELAY: Duration = Duration::from_millis(400);
/// Panels that changed wait so long for the picture that is being drawn: presented on their own they take the device from it, and a picture of a view that
/// moves is done sooner.
const PICTURE_PATIENCE: Duration = Duration::from_millis(100);
/// Interval of the attempts to present while there is no surface.
const PRESENT_RETRY: Duration = Duration::from_millis(100);
/// Interval of the updates while there is no picture to show.
const BLANK_INTERVAL: Duration = Duration::from_millis(20);
/// Panels that want to be drawn again later than this are not.
const LATEST_REPAINT: Duration = Duration::from_secs(3600);

/// The state of the picture at the time of a presentation.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PictureState {
    /// True if there is a picture of the present volume.
    pub(super) has_drawn: bool,
    /// True while a picture is being drawn.
    pub(super) is_drawing: bool,
    /// Time since the picture that is being drawn was begun; None if none is.
    pub(super) drawn_for: Option<Duration>,
    /// True if panels can be drawn while a picture is being drawn.
    pub(super) is_paced: bool,
    /// True if there is nothing to draw.
    pub(super) is_idle: bool,
    /// True once a picture was drawn in full.
    pub(super) has_started: bool,
}

/// Decides when the window is presented, from what of its content is out of date.
#[derive(Default)]
pub(super) struct Presentation {
    pub(super) screen: Option<Screen>,
    /// Size of the window, pixels.
    pub(super) size: [u32; 2],
    /// Whether the window fills the screen and can leave that state.
    pub(super) is_full_screen: bool,
    /// Whether something besides the picture changed.
    needs_redraw: bool,
    /// Whether a picture was drawn that is not shown yet.
    has_new_picture: bool,
    /// The last picture that was drawn: the device's image holds it until the next one begins.
    drawn: Option<Arc<ShownPicture>>,
    /// The last picture that was shown: the screen has a copy of it while the next one is drawn.
    shown: Option<Arc<ShownPicture>>,
    /// Since when there is no picture to show.
    blank_since: Option<Instant>,
    /// When the panels want to be drawn again.
    repaint_at: Option<Instant>,
    /// Time of the next attempt after there was no surface to present to.
    retry_at: Option<Instant>,
    /// Number of presentations of the panels while a picture was being drawn.
    shown_between: u64,
    /// Where to draw the pointer, pixels of the window.
    pub(super) pointer: Option<[f64; 2]>,
    /// The tree of the panels for a screen reader, since they were last laid out.
    pub(super) tree: Option<TreeUpdate>,
}

impl Presentation {
    /// A window of this size, pixels, that has no screen yet.
    pub(super) fn new(size: [u32; 2]) -> Presentation {
        Presentation { size, needs_redraw: true, ..Presentation::default() }
    }

    /// Sets the screen on which pictures are presented; None: there is none.
    pub(super) fn set_screen(&mut self, screen: Option<Screen>) {
        // Drop the old one first: a window has one surface at a time.
        self.screen = None;
        self.screen = screen;
        // The copy was the old one's.
        self.shown = None;
        self.redraw();
    }

    /// Sets the size of the window, pixels; 0 while it is minimised. Returns false if it is minimised; the size before that is then kept.
    pub(super) fn resize(&mut self, size: [u32; 2]) -> bool {
        if let Some(screen) = &mut self.screen {
            screen.resize(size);
        }
        let is_open = !size.contains(&0);
        if is_open {
            self.size = size;
        }
        is_open
    }

    /// Number of all presentations, and of those while a picture was being drawn.
    pub(super) fn presentations(&self) -> [u64; 2] {
        [self.screen.as_ref().map_or(0, |screen| screen.shown()), self.shown_between]
    }

    /// Notes that something besides the picture changed.
    pub(super) fn redraw(&mut self) {
        self.needs_redraw = true;
    }

    /// Notes that something besides the picture changed, if `has_changed`.
    pub(super) fn redraw_if(&mut self, has_changed: bool) {
        self.needs_redraw |= has_changed;
    }

    /// Notes that the content of the window was lost, or that there is a surface to present to again.
    pub(super) fn content_lost(&mut self) {
        (self.needs_redraw, self.retry_at) = (true, None);
    }

    /// Notes that a picture was drawn.
    pub(super) fn picture_finished(&mut self, picture: ShownPicture) {
        self.drawn = Some(Arc::new(picture));
        self.has_new_picture = true;
    }

    /// The picture that the window shows, or else the last one that it showed; None before the first.
    pub(super) fn shown(&self) -> Option<&ShownPicture> {
        self.shown.as_deref()
    }

    /// The picture that the window would show if it were presented now; None if it would show none.
    pub(super) fn content(&self, picture: &PictureState) -> Option<Arc<ShownPicture>> {
        let latest = if picture.is_drawing { &self.shown } else { &self.drawn };
        latest.clone().filter(|_| picture.has_drawn)
    }

    /// Sets where the pointer is drawn, pixels of the window, if no window system draws it; None: it is not drawn.
    pub(super) fn set_pointer(&mut self, at: Option<[f64; 2]>) {
        self.needs_redraw |= self.pointer != at;
        self.pointer = at;
    }

    /// Notes a layout of the panels: their tree for a screen reader, and the time after which they have to be laid out again.
    pub(super) fn laid_out(&mut self, tree: Option<TreeUpdate>, repaint_after: Duration, now: Instant) {
        self.repaint_at = (repaint_after < LATEST_REPAINT).then(|| now + repaint_after);
        self.tree = tree.or(self.tree.take());
    }

    /// Notes that the window has to be presented, if the time for another layout of the panels has come.
    pub(super) fn repaint(&mut self, now: Instant) {
        self.needs_redraw |= self.repaint_at.is_some_and(|at| at <= now);
    }

    /// True if the window is to be presented now.
    pub(super) fn is_due(&mut self, picture: &PictureState, now: Instant) -> bool {
        // While a picture is being drawn, its image is the device's: panels get the last one, of which the screen has a copy, if they can be
        // drawn before the picture is done, and if that takes long. Otherwise both are presented together.
        let takes_long = picture.drawn_for.is_some_and(|time| time >= PICTURE_PATIENCE);
        let gets_between = picture.has_started && picture.is_paced && takes_long;
        let is_late = picture.is_drawing && !gets_between;
        let is_new = self.has_new_picture || self.needs_redraw;
        if !is_new || is_late || self.retry_at.is_some_and(|until| now < until) {
            return false;
        }
        // At the start there is no old content to keep.
        if !picture.has_drawn && !picture.is_idle && picture.has_started {
            let since = *self.blank_since.get_or_insert(now);
            if now.saturating_duration_since(since) < BLANK_DELAY {
                return false;
            }
        }
        self.blank_since = None;
        true
    }

    /// Notes that the content of the window stays as it is, because there is nothing to draw.
    pub(super) fn keep_content(&mut self) {
        self.needs_redraw = false;
    }

    /// Notes that the window shows this picture, if any, and that the panels are up to date. `has_more`: inputs that the panels have not handled
    /// remain.
    pub(super) fn up_to_date(&mut self, content: Option<Arc<ShownPicture>>, has_more: bool) {
        (self.has_new_picture, self.needs_redraw) = (false, has_more);
        self.shown = content.or(self.shown.take());
    }

    /// Notes that the window was presented with this picture. `is_between`: while another picture was being drawn.
    pub(super) fn presented(&mut self, content: Option<Arc<ShownPicture>>, is_between: bool, has_more: bool) {
        self.up_to_date(content, has_more);
        self.shown_between += u64::from(is_between);
        self.retry_at = None;
    }

    /// Notes that there is no surface to present to; another attempt is made later.
    pub(super) fn not_presentable(&mut self, now: Instant) {
        self.retry_at = Some(now + PRESENT_RETRY);
    }

    /// True if something has to be presented and nothing prevents it.
    pub(super) fn waits(&self) -> bool {
        let can_present = self.screen.is_some() && self.blank_since.is_none() && self.retry_at.is_none();
        self.needs_redraw && can_present
    }

    /// Times at which the window has to be checked again.
    pub(super) fn due(&self, now: Instant) -> impl Iterator<Item = Instant> {
        [self.retry_at, self.repaint_at, self.blank_since.map(|_| now + BLANK_INTERVAL)].into_iter().flatten()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::probe::{Geometry, Grid};
    use crate::scene::{Input, Scene, Settings};
    use crate::source::StoredType;

    const SHOWN: PictureState = PictureState {
        has_drawn: true,
        is_drawing: false,
        drawn_for: None,
        is_paced: true,
        is_idle: true,
        has_started: true,
    };

    /// A picture of the volume with this number.
    fn picture(volume: u32) -> ShownPicture {
        let grid = Grid { size: [4, 4, 4], spacing: [1.0; 3], origin: [0.0; 3] };
        let input = Input { stored: StoredType::U8, range: [0.0, 255.0] };
        let scene = Scene::new(Geometry::Cartesian(grid), input, Settings::default()).expect("a scene");
        ShownPicture { scene, volume, start_lines: Vec::new() }
    }

    /// Prevents marks of another picture than the one that the window shows: the device's image, or the screen's copy of the last one that was presented,
    /// over every order of pictures that begin, are held up, are finished, and cannot be presented.
    #[test]
    fn marks_are_those_of_the_picture_that_is_shown() {
        let mut random = 1_u64;
        let mut next = |of: u64| {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (random >> 33) % of
        };
        let mut window = Presentation::new([64, 64]);
        // What the device's image and the screen's copy hold.
        let (mut image, mut copy, mut drawing) = (None, None, None);
        let mut seen = [0; 3];
        for volume in 0..4000 {
            match next(5) {
                0 => drawing = drawing.or(Some(volume)),
                1 => {
                    if let Some(volume) = drawing.take() {
                        image = Some(volume);
                        window.picture_finished(picture(volume));
                    }
                }
                // Another size, or another geometry.
                2 if next(20) == 0 => (image, drawing) = (None, None),
                3 if next(50) == 0 => {
                    window.set_screen(None);
                    copy = None;
                }
                _ => {
                    let has_drawn = image.is_some() || drawing.is_some();
                    let state = PictureState { has_drawn, is_drawing: drawing.is_some(), ..SHOWN };
                    let expected = if drawing.is_some() { copy } else { image };
                    let content = window.content(&state);
                    assert_eq!(content.as_ref().map(|picture| picture.volume), expected);
                    seen[usize::from(drawing.is_some()) + usize::from(expected.is_none())] += 1;
                    match next(3) {
                        0 => window.not_presentable(Instant::now()),
                        _ => {
                            window.presented(content, drawing.is_some(), false);
                            copy = expected.or(copy);
                            assert_eq!(window.shown().map(|picture| picture.volume), copy);
                        }
                    }
                }
            }
        }
        assert!(seen.iter().all(|count| *count > 20), "{seen:?}");
    }

    /// Prevents a window that is drawn although nothing changed, panels that hold a picture up, and a black moment between two volumes.
    #[test]
    fn a_window_is_presented_when_something_changed_and_a_picture_is_not_held_up() {
        let begin = Instant::now();
        let at = |ms: u64| begin + Duration::from_millis(ms);
        let mut window = Presentation::new([64, 64]);
        assert!(window.is_due(&SHOWN, at(0)), "the first time");
        window.presented(None, false, false);
        assert!(!window.is_due(&SHOWN, at(1)), "nothing changed");
        window.picture_finished(picture(1));
        assert!(window.is_due(&SHOWN, at(2)));
        window.presented(None, false, true);
        assert!(window.is_due(&SHOWN, at(3)), "inputs for the panels remain");
        // A picture is being drawn.
        let drawn_for = |ms| PictureState { is_drawing: true, drawn_for: Some(Duration::from_millis(ms)), ..SHOWN };
        assert!(!window.is_due(&drawn_for(99), at(4)) && window.is_due(&drawn_for(100), at(4)));
        assert!(!window.is_due(&PictureState { is_paced: false, ..drawn_for(900) }, at(4)));
        assert!(!window.is_due(&PictureState { has_started: false, ..drawn_for(900) }, at(4)));
        window.presented(None, true, false);
        assert_eq!(window.presentations(), [0, 1]);
        // The next volume has no picture yet.
        let blank = PictureState { has_drawn: false, is_idle: false, ..SHOWN };
        window.redraw();
        assert!(!window.is_due(&blank, at(10)) && !window.is_due(&blank, at(409)) && window.is_due(&blank, at(410)));
        assert!(window.is_due(&PictureState { has_started: false, ..blank }, at(411)), "the start has no old content");
    }

    #[test]
    fn a_window_without_a_surface_is_tried_again_after_a_while_or_when_it_comes_back() {
        let begin = Instant::now();
        let at = |ms: u64| begin + Duration::from_millis(ms);
        let mut window = Presentation::new([64, 64]);
        window.not_presentable(at(0));
        assert!(!window.is_due(&SHOWN, at(99)) && window.is_due(&SHOWN, at(100)));
        assert_eq!(window.due(at(0)).collect::<Vec<_>>(), [at(100)]);
        window.content_lost();
        assert!(window.is_due(&SHOWN, at(1)));
        window.presented(None, false, false);
        window.laid_out(None, Duration::from_millis(50), at(10));
        window.repaint(at(59));
        assert!(!window.is_due(&SHOWN, at(59)), "no panel moves yet");
        window.repaint(at(60));
        assert!(window.is_due(&SHOWN, at(60)));
        window.laid_out(None, Duration::MAX, at(60));
        assert_eq!(window.due(at(60)).count(), 0);
        assert!(!window.resize([0, 64]) && window.resize([32, 16]) && window.size == [32, 16], "minimised");
    }
}
