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

/// Prevents live pictures that are seconds old without a word of it, and a word of it where nothing is live.
#[test]
fn a_live_picture_that_is_more_than_a_second_behind_says_so() {
    let delays = |shown: &Shown| -> Vec<(String, Area)> {
        texts_of(shown).into_iter().filter(|(text, _)| text.ends_with("behind")).collect()
    };
    let is_named = |shown: &Shown| {
        let mut labels = shown.tree.values().filter(|node| node.role() == Role::Image).filter_map(|node| node.label());
        labels.any(|label| label.contains(", live, 2.4 s behind, Demo data"))
    };
    for (toml, size) in
        [("mode='surface'", SIZE), ("mode='surface'\nlayout='four'", SIZE), ("mode='plane'", [300, 250])]
    {
        let mut shown = Shown::sized(toml, size, 1.0);
        (shown.timeliness.is_live, shown.times.latency) = (true, Some(999.0));
        shown.settle();
        assert!(delays(&shown).is_empty() && !is_named(&shown), "{toml}: under a second");
        shown.times.latency = Some(2410.0);
        shown.settle();
        let told = delays(&shown);
        let [(text, at)] = &told[..] else { panic!("{toml}: {:?}", texts_of(&shown)) };
        let ([x, y], [width, height]) = panels::picture_area(size, 1.0, true);
        let [x, y, width, height] = [x, y, width, height].map(|n| n as f32);
        assert_eq!(text, "2.4 s behind");
        assert!(at[0] >= x && at[0] < x + 0.3 * width && at[2] <= x + width, "{toml}: {at:?}");
        assert!(at[1] >= y && at[3] <= y + 0.5 * height && is_named(&shown), "{toml}: {at:?}");
        shown.visible.panels = false;
        shown.settle();
        assert_eq!(delays(&shown).len(), 1, "{toml}: without panels");
        shown.visible.panels = true;
        let mut is_silent = |change: &dyn Fn(&mut Shown, bool), what: &str| {
            change(&mut shown, true);
            shown.settle();
            assert!(delays(&shown).is_empty() && !is_named(&shown), "{toml}: {what}");
            change(&mut shown, false);
        };
        is_silent(&|shown, is_on| shown.timeliness.is_frozen = is_on, "frozen");
        is_silent(&|shown, is_on| shown.timeliness.is_live = !is_on, "a recording");
        is_silent(&|shown, is_on| shown.timeliness.ended = is_on.then_some(Duration::from_secs(3)), "ended");
    }
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
