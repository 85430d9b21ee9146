//! JUnit XML, read back by another parser.

use super::simulated::{any_run, check, fail, run};
use echolume::low_level::baselines::Threshold;
use echolume::low_level::verify::report::baseline::compare;
use echolume::low_level::verify::report::junit::junit;
use echolume::low_level::verify::report::{Run, Verdict};
use proptest::prelude::*;
use roxmltree::{Document, Node};

fn written(run: &Run, old: Option<&Run>) -> String {
    let compared = old.map(|old| compare(old, run, Threshold::default()));
    junit(run, compared.as_ref()).expect("XML")
}

fn children<'a>(node: Node<'a, 'a>, name: &'static str) -> impl Iterator<Item = Node<'a, 'a>> {
    node.children().filter(move |child| child.has_tag_name(name))
}

fn number(node: Node, name: &str) -> usize {
    node.attribute(name).and_then(|v| v.parse().ok()).unwrap_or_else(|| panic!("{name} of {node:?}"))
}

/// The shape that the schema of the Jenkins xUnit plugin gives it: names, order, counts, and no element or attribute more.
fn has_the_shape(text: &str) {
    let document = Document::parse(text).unwrap_or_else(|e| panic!("{e}: {text}"));
    let allowed: &[(&str, &[&str], &[&str])] = &[
        ("testsuites", &["name", "tests", "failures", "errors", "skipped", "time", "timestamp"], &["testsuite"]),
        (
            "testsuite",
            &["name", "tests", "failures", "errors", "skipped", "time", "timestamp"],
            &["properties", "testcase"],
        ),
        ("properties", &[], &["property"]),
        ("property", &["name", "value"], &[]),
        ("testcase", &["name", "classname", "time"], &["failure", "error", "skipped", "system-out"]),
        ("failure", &["message", "type"], &[]),
        ("error", &["message", "type"], &[]),
        ("skipped", &["message"], &[]),
        ("system-out", &[], &[]),
    ];
    let mut totals = [0; 4];
    for node in document.descendants().filter(Node::is_element) {
        let name = node.tag_name().name();
        let (_, attributes, within) =
            allowed.iter().find(|(known, _, _)| *known == name).unwrap_or_else(|| panic!("<{name}>"));
        assert!(node.attributes().all(|a| attributes.contains(&a.name())), "{node:?}");
        assert!(node.children().filter(Node::is_element).all(|c| within.contains(&c.tag_name().name())), "{node:?}");
        if let Some(time) = node.attribute("time") {
            assert!(time.parse::<f64>().is_ok_and(|t| t.is_finite() && t >= 0.0), "{time}");
        }
        match name {
            "testsuite" => {
                let of =
                    |what: &str| children(node, "testcase").filter(|c| children(*c, what_is(what)).count() > 0).count();
                let counted = [children(node, "testcase").count(), of("failure"), of("error"), of("skipped")];
                assert_eq!(counted, ["tests", "failures", "errors", "skipped"].map(|what| number(node, what)));
                totals = std::array::from_fn(|i| totals[i] + counted[i]);
            }
            "testcase" => {
                assert!(node.attribute("name").is_some() && node.attribute("classname").is_some(), "{node:?}");
                let is_result = |c: &Node| ["failure", "error", "skipped"].iter().any(|name| c.has_tag_name(*name));
                let results = node.children().filter(is_result);
                assert!(results.count() <= 1, "{node:?}");
            }
            "error" => assert_eq!(node.attribute("type"), Some("interrupted"), "{node:?}"),
            "failure" => assert!(node.attribute("message").is_some() && node.text().is_some(), "{node:?}"),
            _ => {}
        }
    }
    let top = document.root_element();
    assert_eq!(top.tag_name().name(), "testsuites");
    // The format has no skipped in its head: readers sum over the suites.
    assert_eq!(totals[..3], ["tests", "failures", "errors"].map(|what| number(top, what)));
}

fn what_is(name: &str) -> &'static str {
    ["failure", "error", "skipped"].into_iter().find(|known| *known == name).expect("a result")
}

/// Prevents a run that was ended early from passing, and from being taken for a faulty device.
#[test]
fn an_interrupted_check_is_an_error_and_no_failure() {
    let mut run = run(1);
    let tone = check(&mut run, "passes", "tone");
    (tone.verdict, tone.notes) = (Verdict::Interrupted, vec!["not run: SIGINT".into()]);
    let text = written(&run, None);
    has_the_shape(&text);
    assert_eq!([text.matches("<failure").count(), text.matches("<error").count()], [0, 1], "{text}");
    assert!(text.contains("message=\"not run: SIGINT\""), "{text}");
}

#[test]
fn every_check_is_a_case_with_its_time_its_failure_or_why_it_was_left_out() {
    let mut run = run(1);
    fail(&mut run, "passes", "shade");
    check(&mut run, "passes", "shade").faults.push(echolume::low_level::verify::report::Fault::new("and another"));
    let text = written(&run, None);
    println!("{text}");
    has_the_shape(&text);
    let document = Document::parse(&text).expect("XML");
    let suites: Vec<&str> =
        children(document.root_element(), "testsuite").filter_map(|suite| suite.attribute("name")).collect();
    assert_eq!(suites, ["passes", "modes", "formats", "speed"]);
    let case = |name: &str| {
        let mut cases = document.descendants().filter(|n| n.has_tag_name("testcase"));
        cases.find(|n| n.attribute("name") == Some(name)).expect("case")
    };
    assert_eq!(
        (case("shade").attribute("classname"), case("shade").attribute("time")),
        (Some("passes"), Some("0.250"))
    );
    let failure = children(case("shade"), "failure").next().expect("failure");
    assert_eq!(failure.attribute("message"), Some("the output differs by more than its tolerance (and 1 more)"));
    let details = failure.text().expect("details");
    for part in [
        "pass: raycast_volume",
        "input: a sphere",
        "at (12, 34, 0)",
        "expected: 0.5",
        "got: NaN",
        "files: fail/actual.png",
    ] {
        assert!(details.contains(part), "{part}: {details}");
    }
    let skipped = children(case("r16f storage"), "skipped").next().expect("skipped");
    assert_eq!(skipped.attribute("message"), Some("the device has no storage images of r16f"));
    let out = children(case("median"), "system-out").next().and_then(|n| n.text()).expect("figures");
    assert_eq!(out.trim(), "largest error: 0.8 of 2 levels\nlargest error of floats: 4e-5 of 1e-4");
    let property = |name: &str| {
        let mut properties = document.descendants().filter(|n| n.has_tag_name("property"));
        properties.find(|n| n.attribute("name") == Some(name)).and_then(|n| n.attribute("value")).expect("property")
    };
    let told = ["device", "driver", "api", "program", "level", "validation", "date"].map(property);
    let expected =
        ["simulated", "none 1.0", "1.3.0", "echolume 0.1.0, release", "quick", "true", "2026-01-02T03:04:05Z"];
    assert_eq!(told, expected);
}

#[test]
fn what_is_worse_than_the_baseline_fails_a_case_of_its_own() {
    let old = run(1);
    let same = written(&old, Some(&old));
    has_the_shape(&same);
    assert!(same.contains("nothing is worse than before") && !same.contains("<failure"), "{same}");
    let mut new = old.clone();
    check(&mut new, "passes", "median").figures[0].value = 3.0;
    let worse = written(&new, Some(&old));
    has_the_shape(&worse);
    let document = Document::parse(&worse).expect("XML");
    let failure = document.descendants().find(|n| n.has_tag_name("failure")).expect("failure");
    assert!(
        failure.attribute("message").is_some_and(|m| m.starts_with("1 check is worse than in the run of 2026-01-02"))
    );
    assert!(failure.text().is_some_and(|t| t.contains("passes / median: largest error 0.8 -> 3 levels, now over 2")));
}

#[test]
fn names_come_back_from_markup() {
    let mut run = run(1);
    run.outcomes[0].name = "a < b && \"c\" ]]> 'd' <![CDATA[ e".into();
    run.outcomes[1].name = "bell \u{7} and nothing \0".into();
    run.outcomes[2].verdict = Verdict::Failed;
    let text = written(&run, None);
    has_the_shape(&text);
    let document = Document::parse(&text).expect("XML");
    let names: Vec<&str> =
        document.descendants().filter(|n| n.has_tag_name("testcase")).filter_map(|n| n.attribute("name")).collect();
    assert_eq!(names[0], run.outcomes[0].name);
    assert_eq!(names[1], "bell \\u{7} and nothing \\0");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    #[test]
    fn any_run_makes_xml_of_that_shape(run in any_run(), old in prop::option::of(any_run())) {
        has_the_shape(&written(&run, old.as_ref()));
    }
}
