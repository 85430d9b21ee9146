//! The hints of the first start, and what names demo data where nothing else is over the picture.

use super::shown::{SIZE, Shown};
use super::*;
use crate::panels::accesskit::{Action, Role};
use crate::panels::drawn::{Area, Kind};
use crate::panels::{self, first_steps};
use crate::texts;

/// The texts that are drawn, each once, and where.
fn texts_of(shown: &Shown) -> Vec<(String, Area)> {
    let texts = shown.drawn.iter().filter_map(|drawn| match &drawn.kind {
        Kind::Text { area, text, .. } => Some((text.clone(), *area)),
        _ => None,
    });
    let mut texts: Vec<_> = texts.collect();
    texts.dedup_by(|a, b| a.0 == b.0);
    texts
}

/// Prevents hints that leave the picture, that cover the buttons below it, or that cannot be closed.
#[test]
fn the_hints_stay_in_the_picture_and_are_closed() {
    for (size, scale) in [(SIZE, 1.0), ([1920, 1080], 1.5), ([640, 480], 1.0), ([3840, 2160], 3.0)] {
        let mut shown = Shown::sized("mode='surface'", size, scale);
        let has_hints = |shown: &Shown| {
            let of_hints = texts::HINTS.map(|(_, effect)| effect);
            texts_of(shown).iter().filter(|(text, _)| of_hints.contains(&text.as_str())).count()
        };
        assert_eq!(has_hints(&shown), 0);
        let ([x, y], [width, height]) = panels::picture_area(size, scale, true);
        assert!(first_steps::has_room([width, height], scale));
        shown.shows[0] = true;
        // An area is placed by its size of the layout before.
        (0..3).for_each(|_| shown.settle());
        assert_eq!(has_hints(&shown), 3, "{size:?}");
        shown.check("the hints");
        let close = shown.find(texts::FIRST_STEPS, Role::Button, "Close");
        let at = shown.tree[&close].bounds().expect("its place");
        let picture = [x, y, x + width, y + height].map(|n| f64::from(n) / f64::from(scale));
        assert!(at.x0 >= picture[0] && at.x1 <= picture[2], "{size:?}: {at:?}");
        assert!(at.y0 >= picture[1] && at.y1 < picture[3], "{size:?}: {at:?} is over the bar");
        assert_eq!(shown.ask(close, Action::Click, None), [Command::CloseHints]);
    }
    assert!(!first_steps::has_room([300, 250], 1.0) && !first_steps::has_room([700, 500], 2.0));
}

/// Prevents pictures of the phantom without a word of it: without panels, and with no interface at all.
#[test]
fn demo_data_is_named_without_panels_too() {
    let mut shown = Shown::new("mode='surface'");
    let is_named = |shown: &Shown| texts_of(shown).iter().any(|(text, _)| text == "Demo data (phantom)");
    assert!(is_named(&shown));
    shown.visible.panels = false;
    shown.apply(Command::Mode(Mode::Surface));
    shown.lay_out();
    assert!(is_named(&shown));
    shown.shows[1] = true;
    shown.open(3);
    (shown.visible.help, shown.visible.times, shown.visible.exports) = (true, true, true);
    shown.settle();
    let all = texts_of(&shown);
    assert!(all.iter().all(|(text, _)| text == "Demo data (phantom)") && is_named(&shown), "{all:?}");
    shown.has_drawn = false;
    shown.settle();
    assert!(!is_named(&shown), "there is no picture");
}
