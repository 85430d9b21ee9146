//! Two devices, picture by picture: what one draws, the other should.

use super::{Check, Found, drawn, modes, shown};
use crate::gpu::Context;
use crate::report::verify::Level;
use std::sync::Arc;

/// Every picture of the modes, on the bench's device and on `other`.
pub fn checks(_: Level, other: &Arc<Context>) -> Result<Vec<Check>, String> {
    let check = |view: modes::View| {
        let other = other.clone();
        Check::new("against", view.name.clone(), move |bench| {
            let mut found = Found::default();
            let theirs = drawn::picture(&other, &view.scene, &view.frames)?;
            let ours = drawn::picture(&bench.context, &view.scene, &view.frames)?;
            modes::judge(&mut found, &view.name, &theirs, &ours);
            let what = format!("'{}' beside '{}'", bench.context.candidate.name, other.candidate.name);
            found.pictures.push(shown::pictures(&what, &theirs, &ours));
            let fault = (!found.faults.is_empty()).then_some(0);
            found.pictures.iter_mut().for_each(|p| p.fault = fault);
            Ok(found)
        })
    };
    Ok(modes::made()?.into_iter().map(check).collect())
}
