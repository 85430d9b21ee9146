//! The error budget of a scene: the contribution of each of its approximations to the error of its picture, and the total.
//!
//! For each source of error the scene is rendered with the finest settings of all other sources, and compared with one converged reference.
//! If the errors are independent, the sum of their squares is the square of the total; a difference shows dependence.

use super::dials::{self, Dial};
use super::{Errors, Kind, OwnError, Reference};
use crate::scene::Scene;
use crate::tree::{FromNode, ToNode};

/// Name of the share that remains with the finest setting of every source: the device's arithmetic in f32, and its texel formats.
pub const FLOOR: &str = "device";

/// How much each approximation contributes to the error of a scene.
#[derive(Clone, Debug, PartialEq, ToNode, FromNode)]
#[tree(deny_unknown_fields)]
pub struct Budget {
    pub reference: Reference,
    /// Estimate of the error of the reference itself; 0 for [`Reference::F64`].
    pub reference_error: OwnError,
    /// Each source of error alone, without those that have their finest setting in the scene. The last entry is [`FLOOR`].
    pub shares: Vec<Share>,
    /// Errors of the scene with its own setting of every source.
    pub total: Errors,
}

/// The error of one source: it has the scene's own setting, while all others have their finest.
#[derive(Clone, Debug, PartialEq, ToNode, FromNode)]
#[tree(deny_unknown_fields)]
pub struct Share {
    /// The name of the dial that is the source, or [`FLOOR`].
    pub source: String,
    /// Label of the scene's own setting of that dial; a remark for [`FLOOR`].
    pub label: String,
    pub errors: Errors,
}

impl Budget {
    /// Root of the sum of the squares of the shares' RMSE. If the errors are independent, it equals the RMSE of `total`.
    pub fn sum(&self) -> f64 {
        self.shares.iter().map(|share| share.errors.rmse.powi(2)).sum::<f64>().sqrt()
    }
}

/// A source of error in a scene: a dial whose setting decides how accurate the picture is, with the scene's own setting of it and its two finest
/// ones.
pub struct Source {
    pub name: &'static str,
    /// Label of the scene's own setting of the dial.
    pub label: String,
    /// Assignments `key=value` of the dial's finest setting, only of keys that the dial itself varies.
    pub finest: Vec<String>,
    /// Assignments `key=value` of the setting that is one step coarser than the finest, only of keys that the dial itself varies.
    pub nearly: Vec<String>,
}

/// The sources of error of a scene: its numerical dials, with three exceptions. The rule of compositing only decides how fast the picture converges,
/// bricks change no picture, and the samples in a cell of a light volume converge with the cells.
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

/// True for an assignment of a key that the dial's settings assign. The references of some dials have finer steps as well, and settings of some name
/// what they need unchanged.
fn is_own(dial: &Dial, set: &str) -> bool {
    let key = |set: &str| set.split_once('=').map_or(String::new(), |(key, _)| key.to_string());
    let is_assigned = dial.settings.iter().flat_map(|setting| &setting.set).any(|other| key(other) == key(set));
    is_assigned && !["ray.rays", "volume.compositing"].contains(&key(set).as_str())
}
