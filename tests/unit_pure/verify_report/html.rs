//! The page, read back as a browser would.

use super::simulated::{any_run, check, fail, outcome, run, shown, slower};
use echolume::low_level::baselines::Threshold;
use echolume::low_level::verify::report::baseline::compare;
use echolume::low_level::verify::report::html::html;
use echolume::low_level::verify::report::{Fault, Figure, Run, Unit, Verdict};
use proptest::prelude::*;
use scraper::{ElementRef, Html, Selector};

fn page(run: &Run, old: Option<&Run>) -> String {
    let compared = old.map(|old| compare(old, run, Threshold::default()));
    html(run, compared.as_ref()).expect("page")
}

fn all<'a>(document: &'a Html, selector: &str) -> Vec<ElementRef<'a>> {
    document.select(&Selector::parse(selector).expect("selector")).collect()
}

fn text(element: ElementRef) -> String {
    element.text().flat_map(str::split_whitespace).collect::<Vec<_>>().join(" ")
}

/// The page has no error that a browser would repair, no script, and no external resource.
fn checked(page: &str) -> Html {
    let document = Html::parse_document(page);
    assert!(document.errors.is_empty(), "{:?}", document.errors);
    let known = "html head meta link title style body header main section article footer h1 h2 h3 p ul li dl div dt dd span strong \
                 table thead tbody tr th td details summary figure figcaption img";
    for element in all(&document, "*") {
        let name = element.value().name();
        assert!(known.split_whitespace().any(|k| k == name), "<{name}>");
        for (attribute, value) in element.value().attrs() {
            assert!(!attribute.starts_with("on") && !value.contains("javascript:"), "{attribute}={value}");
            if ["src", "href"].contains(&attribute) {
                assert!(value.starts_with("data:"), "{attribute}={value}");
            }
        }
    }
    assert!(all(&document, "#injected, b, script").is_empty());
    for word in ["http:", "https:", "@import", "url("] {
        assert!(
            !include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/base/html_page/style.css")).contains(word),
            "{word}"
        );
    }
    document
}

/// A page as after a bad driver update: for the tests, and to look at.
fn bad_update() -> (Run, Run) {
    let old = run(1);
    let mut new = run(2);
    new.device.driver = "none 1.1".into();
    fail(&mut new, "passes", "raycast_volume");
    fail(&mut new, "modes", "vr");
    check(&mut new, "passes", "raycast_volume").figures[0].value = 17.0;
    check(&mut new, "modes", "vr").figures[0].value = f64::NAN;
    check(&mut new, "modes", "vr").pictures = vec![shown("a head, seen from the left", 256, Some(0))];
    check(&mut new, "passes", "median").figures[0].value = 1.4;
    check(&mut new, "passes", "shade").notes.push("without r16f it takes r32f".into());
    slower(&mut new, "shade", 1.14);
    let mut lost = Fault::new("the device was lost: VK_ERROR_DEVICE_LOST");
    lost.pass = Some("shadow".into());
    let shadow = check(&mut new, "passes", "shadow");
    shadow.verdict = Verdict::Failed;
    shadow.faults.push(lost);
    for (name, size) in [("mip", 256), ("sr", 256), ("plane", 24)] {
        check(&mut new, "modes", name).pictures.push(shown("a sphere", size, None));
    }
    for format in ["r16f", "rgba16f"] {
        let mut left_out = outcome("formats", &format!("{format} filtered"), Verdict::LeftOut);
        left_out.notes.push("the device does not filter 16-bit floats".into());
        new.outcomes.push(left_out);
    }
    (old, new)
}

#[test]
fn what_went_wrong_comes_first_with_its_pictures_side_by_side() {
    let (old, new) = bad_update();
    let page = page(&new, Some(&old));
    let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("verify.html");
    std::fs::write(&path, &page).expect("the page, to be looked at");
    let document = checked(&page);
    assert_eq!(text(all(&document, "h1")[0]), "3 of 23 checks failed");
    assert_eq!(text(all(&document, "title")[0]), "echolume verify: failed, simulated");
    let ids: Vec<&str> = all(&document, "section").iter().filter_map(|s| s.value().id()).collect();
    assert_eq!(ids, ["baseline", "failures", "group-0", "group-1", "group-2", "group-3", "times"]);
    let baseline = text(all(&document, "#baseline")[0]);
    assert!(baseline.contains("driver: none 1.0 -> none 1.1") && baseline.contains("largest error 0.8 -> 1.4 levels"));
    let failures = all(&document, "#failures article");
    assert_eq!(failures.len(), 3);
    let words = text(failures[0]);
    for part in [
        "passes / raycast_volume failed",
        "the output differs by more than its tolerance",
        "pass raycast_volume",
        "input a sphere in 64 x 64 x 32, mode vr",
        "worst pixel at (12, 34, 0) of picture, channel 2",
        "expected 0.5",
        "got NaN",
        "largest error 17 of 2 levels beyond",
    ] {
        assert!(words.contains(part), "{part}: {words}");
    }
    let names: Vec<String> =
        all(&document, "#failures article:first-of-type .three span").into_iter().map(text).collect();
    assert_eq!(names, ["actual", "expected", "difference, 10 times"]);
    assert_eq!(all(&document, "#failures img").len(), 6);
    assert_eq!(all(&document, ".gallery img").len(), 9);
    assert!(all(&document, "img").iter().all(|i| i.attr("alt").is_some_and(|alt| alt.len() > 8)));
    let rows = all(&document, "table.checks tbody tr");
    assert_eq!(rows.len(), new.outcomes.len());
    let median = rows.iter().map(|r| text(*r)).find(|r| r.starts_with("median")).expect("row");
    assert_eq!(
        median,
        "median passed largest error 1.4 of 2 levels 70 % largest error of floats 4e-5 of 1e-4 40 % 250 ms"
    );
    assert_eq!(all(&document, "#times tr").len(), 8);
    let reasons = all(&document, ".reasons > div").into_iter().map(text).collect::<Vec<_>>();
    let expected = "the device does not filter 16-bit floats formats / r16f filtered formats / rgba16f filtered";
    assert!(reasons.iter().any(|r| r == expected), "{reasons:?}");
}

#[test]
fn a_run_without_failures_says_so_and_an_empty_run_does_not() {
    let well = checked(&page(&run(1), Some(&run(1))));
    assert_eq!(text(all(&well, "h1")[0]), "Passed");
    assert!(all(&well, "#failures").is_empty());
    assert!(text(all(&well, "#baseline")[0]).contains("nothing changed: 21 checks are as before"));
    let mut nothing = run(1);
    nothing.outcomes.retain(|o| o.verdict == Verdict::LeftOut);
    assert_eq!(text(all(&checked(&page(&nothing, None)), "h1")[0]), "Nothing was checked");
    let mut interrupted = run(1);
    interrupted.outcomes.iter_mut().skip(18).for_each(|o| o.verdict = Verdict::Interrupted);
    let ended = checked(&page(&interrupted, None));
    assert_eq!(text(all(&ended, "h1")[0]), "Interrupted: 3 of 21 checks were not run");
    assert!(text(all(&ended, "title")[0]).starts_with("echolume verify: interrupted"));
    assert!(text(all(&ended, ".counts")[0]).contains("3 interrupted"));
    let mut slow = run(1);
    slower(&mut slow, "tone", 2.0);
    assert_eq!(text(all(&checked(&page(&slow, Some(&run(1)))), "h1")[0]), "Worse than before");
}

#[test]
fn a_broken_picture_is_reported_and_the_page_still_written() {
    let mut run = run(1);
    fail(&mut run, "passes", "tone");
    check(&mut run, "passes", "tone").pictures[0].actual.rgba.pop();
    let document = checked(&page(&run, None));
    assert!(all(&document, "img").is_empty());
    let article = text(all(&document, "article")[0]);
    assert!(article.contains("the picture: the pictures cannot be shown: 9215 bytes are no picture of 48 x 48 pixels"));
}

#[test]
fn many_checks_and_many_pictures_make_a_page_of_bounded_size() {
    let mut many = run(1);
    let tone = outcome("passes", "tone", Verdict::Passed);
    for i in 0..2000 {
        let mut check = outcome("every input", &format!("raycast_volume, input {i}"), Verdict::Passed);
        check.figures.push(Figure::error("largest error", 0.001 * f64::from(i % 100), 2.0, Unit::Levels));
        check.figures.push(Figure::error("largest error of floats", 1e-7 * f64::from(i % 100), 1e-4, Unit::Value));
        check.figures.push(Figure::times("device time", vec![1e5 + f64::from(i); 10]).expect("times"));
        many.outcomes.push(check);
    }
    let bare = page(&many, None);
    println!("{} bytes of {} checks", bare.len(), many.outcomes.len());
    assert!(bare.len() < 4 << 20, "{} bytes", bare.len());
    for check in many.outcomes.iter_mut().filter(|o| o.group == "every input").take(400) {
        check.pictures.push(shown("a sphere", 8, None));
    }
    fail(&mut many, "modes", "plane");
    assert!(tone.pictures.is_empty());
    let document = checked(&page(&many, None));
    assert_eq!(all(&document, ".set").len(), 300);
    assert_eq!(all(&document, "#failures .set").len(), 1);
    let note = text(all(&document, "footer")[0]);
    assert!(note.contains("101 of 401 sets of pictures are left out: a page holds 300 sets and 24 MiB."), "{note}");
}

/// Noise does not compress: the size of pictures is limited in bytes too.
#[test]
fn large_pictures_are_left_out_where_the_page_is_full() {
    let mut large = run(1);
    let mut picture = shown("noise", 512, None);
    let mut random = super::profile::Random(9);
    picture.actual.rgba.iter_mut().for_each(|v| *v = (256.0 * random.unit()) as u8);
    for name in super::simulated::PASSES {
        check(&mut large, "passes", name).pictures = vec![picture.clone(); 5];
    }
    let text = page(&large, None);
    assert!(text.len() < 25 << 20 && text.contains(" of 40 sets of pictures are left out"), "{} bytes", text.len());
}

#[test]
fn a_run_that_contradicts_itself_is_refused() {
    let mut run = run(1);
    run.outcomes.push(run.outcomes[0].clone());
    assert_eq!(html(&run, None).expect_err("refused"), "passes / scan_convert: is there twice");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn no_text_of_any_run_becomes_markup(run in any_run(), old in prop::option::of(any_run())) {
        let document = checked(&page(&run, old.as_ref()));
        let names: Vec<String> = all(&document, "table.checks td.name").into_iter().map(|e| e.text().collect()).collect();
        let groups = run.groups();
        let expected = groups.iter().flat_map(|(_, outcomes)| outcomes.iter().map(|o| echolume::low_level::text::escaped(&o.name)));
        prop_assert_eq!(names, expected.collect::<Vec<_>>());
        prop_assert_eq!(all(&document, "article").len(), run.failures().count());
    }
}
