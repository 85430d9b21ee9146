//! Edges of shadows.

use crate::gpu::GpuError;
use crate::gpu::resources::shape_size;
use crate::passes::shade::shadow;
use crate::passes::{Arrays, DispatchArgs, Slot, Texels};
use crate::verify::built_in::{BYTES, scene, wobbler};
use crate::verify::passes::POISON;
use crate::verify::report::{Fault, Figure, Shown, Unit};
use crate::verify::shown::shown;
use crate::verify::{Bench, Found, Slack, compare};

/// A hill under a low light: most of its shadow is edge, of which noise has little. Held against the reference; here none of the texels
/// may be beyond tolerance but where a ray to the light grazes the hill.
pub(super) fn of_a_hill(bench: &mut Bench) -> Result<Found, GpuError> {
    let mut found = Found::default();
    let toml = "mode = 'sr'\npicture = { size = [64, 48] }\nslices = { pixels = 12 }\ncamera = { field_of_view = 0 }\n\
                light = { direction = [1.0, 0.3, 0.5], shadow = { softness = 0.8 } }";
    let scene = scene(crate::probe::Geometry::Sweep(wobbler()), BYTES, toml).map_err(GpuError::Broken)?;
    let hill = |x: usize, y: usize| ((x as f64 - 40.0).powi(2) + (y as f64 - 24.0).powi(2)) / 40.0;
    let distances =
        Texels::from_fn([64, 48, 1], 1, |[x, y, _], _| f64::from((60.0 - 12.0 * (-hill(x, y)).exp()) as f32));
    let (args, mut inputs, mut expected) = (DispatchArgs::default(), Arrays::default(), Arrays::default());
    for bind in (shadow::PASS.reads)(&scene, &args) {
        inputs.insert(bind.name, distances.clone());
    }
    let writes = (shadow::PASS.writes)(&scene, &args);
    for bind in &writes {
        expected.insert(bind.name, Texels::untouched(shape_size(Slot::Shadow.shape(&scene)), 1));
    }
    shadow::PASS.expected(&scene, &args, &inputs, &mut expected);
    let got = bench.single()?.run(&scene, &shadow::PASS, &args, &inputs, POISON)?;
    let compared = compare(&shadow::PASS, &scene, Slack::default(), POISON, &expected, &got, &writes);
    let edge = expected.get("shadow").values.iter().filter(|v| (0.02..0.98).contains(*v)).count();
    found.expect(edge > 150, || format!("only {edge} texels are an edge of the shadow"));
    if let Some(worst) = compared.worst {
        let fault = Some(found.faults.len());
        found.pictures.push(Shown { fault, ..shown("shadow", expected.get("shadow"), got.get("shadow"), 0) });
        found.faults.push(Fault { worst: Some(worst), ..Fault::new("the edge of a shadow is another") });
    }
    let allowed = shadow::PASS.tolerance.outliers;
    found.figures.push(Figure::error("texels beyond tolerance", compared.outliers, allowed, Unit::Share));
    found.figures.push(Figure {
        what: "texels of edge".into(),
        allowed: None,
        ..Figure::error("", edge as f64, 0.0, Unit::Count)
    });
    Ok(found)
}
