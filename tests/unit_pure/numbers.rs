//! Every number of the settings has a row that says what is allowed, or a reason why it has none.

use crate::common::setting_keys;
use echolume::low_level::scene::numbers;
use std::collections::BTreeSet;

/// Numbers without a row.
const OTHERS: &[(&str, &str)] = &[
    ("volume.window", "rises"),
    ("surface.window", "rises"),
    ("projection.window", "rises"),
    ("planes.window", "rises"),
    ("cube.window", "rises"),
    ("samples.range", "rises"),
    ("region.lateral", "rises, and meets the volume"),
    ("region.depth", "rises, and meets the volume"),
    ("region.elevation", "rises, and meets the volume"),
    ("surface.start_depth", "lies in the region"),
    ("projection.start_depth", "lies in the region"),
    ("clip.normal", "a direction"),
    ("cuts.view.direction", "a direction"),
    ("cuts.view.up", "a direction"),
    ("light.direction", "a direction"),
    ("light.volume.back_direction", "a direction"),
    ("slices.perona_malik.step", "its limit depends on the scheme"),
    ("distance.perona_malik.step", "its limit depends on the scheme"),
    ("post.perona_malik.step", "its limit depends on the scheme"),
    ("volume.entries", "its limit depends on volume.compositing"),
    ("cine.first", "any number of a volume"),
    ("cine.last", "is not below cine.first"),
    ("still.seed", "any number"),
    ("measure.made.volume", "any number of a volume"),
];

#[test]
fn every_number_of_the_settings_says_what_is_allowed() {
    let keys = setting_keys::with_lists();
    let stated: BTreeSet<&str> = numbers().map(|number| number.key).collect();
    let others: BTreeSet<&str> = OTHERS.iter().map(|(key, _)| *key).collect();
    let all: BTreeSet<&str> = keys.iter().map(|key| key.path.as_str()).collect();
    let wrong: Vec<&&str> = stated.union(&others).filter(|key| !all.contains(**key)).collect();
    assert!(wrong.is_empty(), "no setting is named {wrong:?}");
    let is_number = |of: &str| of.contains("number") || of.starts_with("[Edge]");
    let numbers: BTreeSet<&str> = keys.iter().filter(|key| is_number(&key.of)).map(|key| key.path.as_str()).collect();
    assert!(numbers.len() > 150, "the page has changed its form: {} numbers", numbers.len());
    for key in numbers {
        assert!(stated.contains(key) != others.contains(key), "{key}: a row, or a reason why it has none");
    }
}
