//! The error budget of a scene: what each of its approximations adds to the error of its picture, and all of them together.
//!
//! For each source the scene is rendered with the finest setting of all others, and compared with one converged reference. The sum of the squares is the
//! square of the total where the errors are independent; where they are not, the total tells.

use super::dials::{self, Dial};
use super::{Errors, Kind, OwnError, Reference};
use crate::scene::Scene;
use serde::{Deserialize, Serialize};

/// The name of what is left with the finest setting of every source: arithmetic of the device in f32, and its formats.
pub const FLOOR: &str = "device";

/// What each approximation of a scene adds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Budget {
    pub reference: Reference,
    pub reference_error: OwnError,
    /// Each source alone; the last is [`FLOOR`].
    pub shares: Vec<Share>,
    /// The scene as it is.
    pub total: Errors,
}

/// An approximation of a scene, while all others have their finest settings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Share {
    /// The name of its dial.
    pub source: String,
    /// Its setting in the scene.
    pub label: String,
    pub errors: Errors,
}

impl Budget {
    /// Root of the sum of the squares of the shares' RMSE: the total of errors that are independent.
    pub fn sum(&self) -> f64 {
        self.shares.iter().map(|share| share.errors.rmse.powi(2)).sum::<f64>().sqrt()
    }
}

/// A source of error in a scene.
pub struct Source {
    pub name: &'static str,
    /// Its setting in the scene.
    pub label: String,
    /// The assignments that make it as fine as it gets, of its own keys alone.
    pub finest: Vec<String>,
    /// Those of the next coarser setting.
    pub nearly: Vec<String>,
}

/// The sources of error of a scene: its numerical dials, but for the rule of compositing, which chooses how fast the picture converges, for bricks, which
/// change no picture, and for the samples in a cell of a light volume, which converge with the cells.
pub fn sources(scene: &Scene) -> Vec<Source> {
    let numerical = dials::NAMES.iter().filter_map(|name| dials::dial(name, scene).ok());
    let numerical = numerical
        .filter(|dial| dial.kind == Kind::Numerical && !["compositing", "brick", "light-taps"].contains(&dial.name));
    let source = |dial: Dial| {
        let own = |all: &[String]| all.iter().filter(|set| is_own(&dial, set)).cloned().collect::<Vec<_>>();
        let label = dial.settings.first().map_or(String::new(), |setting| setting.label.clone());
        Source { name: dial.name, label, finest: own(&dial.best), nearly: own(&dial.nearly) }
    };
    numerical.map(source).filter(|source| !source.finest.is_empty()).collect()
}

/// True for an assignment of a key that the dial's settings assign. The references of some dials have finer steps as well, and settings of some name what
/// they need unchanged.
fn is_own(dial: &Dial, set: &str) -> bool {
    let key = |set: &str| set.split_once('=').map_or(String::new(), |(key, _)| key.to_string());
    let is_assigned = dial.settings.iter().flat_map(|setting| &setting.set).any(|other| key(other) == key(set));
    is_assigned && !["ray.rays", "volume.compositing"].contains(&key(set).as_str())
}
