//! Two devices, picture by picture: what one draws, the other should.

use super::{Check, Found, drawn, modes, shown};
use crate::gpu::Context;
use crate::verify::report::{Fault, Level, Shown};
use std::sync::Arc;

/// Every picture of the modes, on the bench's device and on `other`.
pub fn checks(_: Level, other: &Arc<Context>) -> Result<Vec<Check>, String> {
    let check = |view: modes::View| {
        let other = other.clone();
        Check::new("against", view.name.clone(), move |bench| {
            let mut found = Found::default();
            // An error of the other device is a fault, and none of the bench's.
            let theirs = match drawn::picture(&other, &view.scene, &view.frames) {
                Ok(picture) => picture,
                Err(error) => {
                    found.faults.push(Fault::new(format!("'{}': {error}", other.candidate.name)));
                    return Ok(found);
                }
            };
            let ours = drawn::picture(&bench.context, &view.scene, &view.frames)?;
            modes::judge(&mut found, &view.name, &theirs, &ours);
            let what = format!("'{}' beside '{}'", bench.context.candidate.name, other.candidate.name);
            let fault = (!found.faults.is_empty()).then_some(0);
            found.pictures.push(Shown { fault, ..shown::pictures(&what, &theirs, &ours) });
            Ok(found)
        })
    };
    Ok(modes::made()?.into_iter().map(check).collect())
}
