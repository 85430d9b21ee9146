//! `echolume render`: renders a recording to a picture.

use super::budget;
use super::compare::CompareArgs;
use super::drawing::{DrawFault, Job, send_volume};
use super::mesh_sheet;
use super::one_colour;
use super::series::SeriesArgs;
use super::still::{self, StillArgs};
use crate::args::{
    InputArgs, Output, PictureFile, ShaderArgs, check_messages, check_number, check_outputs, make_folder,
};
use crate::dump;
use crate::error_map;
use crate::files::replace;
use crate::gpu::{Context, Renderer, RendererOptions, TimeStamps};
use crate::marked;
use crate::mesh::files::MeshFile;
use crate::passes::raycast::tolerance::LEVELS;
use crate::passes::times::pass_time_table;
use crate::passes::{Frequency, PassTime, Slot, Texels, by_name};
use crate::picture::{Picture, PictureFormat};
use crate::plan::Plan;
use crate::probe::Probe;
use crate::scene::{Scene, Still};
use crate::source::{Frame, Source};
use crate::stated_error::Stated;
use crate::terminal::{Failure, failed, input, progress_bar, remark, say};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

#[derive(clap::Args)]
#[command(
    after_help = "Settings come in layers: defaults, --preset, --scene, then flags and --set, each overriding the one \
                        before.\n\nExamples:\n  \
                        echolume render sweep.mha --preset fetal\n  \
                        echolume render sweep.vol --mode vr --camera azimuth=30,zoom=1.5 -o view.png\n  \
                        echolume render sweep.mha --preset face --still samples=64\n  \
                        echolume render sweep.mha --preset face --tolerance 1level\n  \
                        echolume render bone.mha --preset bone --roi depth=20:50 --explain\n  \
                        echolume render sweep.mha --turntable 120 -o turn/\n  \
                        echolume render loop.mha --volumes all -o loop-%03d.png\n  \
                        echolume render --compare before.mha after.mha --register find -o compared.png\n  \
                        zcat sweep.mha.gz | echolume render - -o - | display"
)]
pub struct Render {
    #[command(flatten)]
    input: InputArgs,
    /// The picture to write: .png, .jpg, .bmp or .ppm by its ending; - for a PNG on standard output
    #[arg(short, long, value_name = "FILE", default_value = "picture.png")]
    output: PathBuf,
    #[command(flatten)]
    compare: CompareArgs,
    #[command(flatten)]
    series: SeriesArgs,
    /// Print the plan without rendering: passes, bytes, and the reason for each pass
    #[arg(long)]
    explain: bool,
    /// Write every slot (GPU resource) as a picture into this folder
    #[arg(long, value_name = "DIR")]
    dump: Option<PathBuf>,
    /// With --dump: write every slot as an array for numpy (.npy) too, with its units and axes beside it (.json), and scene.json
    #[arg(long, requires = "dump")]
    raw: bool,
    /// Use the most accurate settings that take less time, such as 16ms, by an error report; flags and --set override
    #[arg(long, value_name = "TIME", requires = "report")]
    budget: Option<String>,
    /// The error.json that `echolume report error -o DIR` wrote for this recording on this device
    #[arg(long, value_name = "FILE", requires = "budget")]
    report: Option<PathBuf>,
    /// Write the surface that the picture shows as a mesh too (.glb, .ply, .stl): an open sheet, a vertex for each ray, in the picture's
    /// colours. For modes sr and mixed; echolume mesh writes closed surfaces
    #[arg(long, value_name = "FILE")]
    mesh: Option<PathBuf>,
    /// Draw the picture with half the step too, and write the difference of every pixel as a map; hatched where it exceeds
    /// --error-tolerance
    #[arg(long, value_name = "FILE")]
    error_map: Option<PathBuf>,
    /// Largest difference of a pixel that --error-map does not hatch, 0..=1; 0.01 unless set. Not with --tolerance, whose levels are hatched
    #[arg(long, value_name = "ERROR", requires = "error_map", conflicts_with = "tolerance")]
    error_tolerance: Option<f64>,
    /// Draw a still: volume rendering (mode vr) by paths of light that collide many times in the tissue. samples=N paths of a pixel, or a time such as
    /// 20s, which chooses N and prints it; further settings of the table still, such as seed=1 or extinction=4
    #[arg(long, value_name = "KEY=VALUE,...|TIME")]
    still: Option<String>,
    /// Choose the rays and steps of every pixel by the error that they leave, such as 1level of the 255 of the finished picture, and print the shares
    /// of the pixels that keep it by proof (their error is surely 0) and by estimate; --error-map then shows the estimated error of every pixel.
    /// For mode vr; the same as ray.tolerance
    #[arg(long, value_name = "LEVELS")]
    tolerance: Option<String>,
    /// Print the time of every pass
    #[arg(long)]
    timings: bool,
    /// Run with Vulkan validation; any message is a failure
    #[arg(long)]
    validate: bool,
    #[command(flatten)]
    shaders: ShaderArgs,
}

impl Render {
    pub fn run(&self) -> Result<(), Failure> {
        let job = Job {
            input: &self.input,
            output: &self.output,
            options: self.options()?,
            validate: self.validate,
            timings: self.timings,
            own_shaders: self.shaders.are_given(),
        };
        self.series.check()?;
        let alone = [
            ("--dump", self.dump.is_some()),
            ("--mesh", self.mesh.is_some()),
            ("--error-map", self.error_map.is_some()),
            ("--budget", self.budget.is_some()),
            ("--still", self.still.is_some()),
            ("--tolerance", self.tolerance.is_some()),
        ];
        let alone = alone.iter().find(|(_, is_given)| *is_given);
        if self.compare.is_given() {
            let series = [
                ("--turntable and --volumes", self.series.is_given()),
                ("--explain", self.explain),
                ("--timings", self.timings),
            ];
            if let Some((flag, _)) = alone.or(series.iter().find(|(_, is_given)| *is_given)) {
                return Err(input(format!("{flag}: is for one volume; leave --compare out")));
            }
            return self.compare.run(&job);
        }
        if self.series.is_given() && !self.explain {
            if let Some((flag, _)) = alone {
                return Err(input(format!("{flag}: is for one picture; leave --turntable and --volumes out")));
            }
            return self.series.run(&job);
        }
        let output = PictureFile::new("-o", &self.output)?;
        let targets: [Output; 3] =
            [("-o", output.path()), ("--mesh", self.mesh.as_deref()), ("--error-map", self.error_map.as_deref())];
        let mesh = self.mesh.as_deref().map(|path| Ok::<_, Failure>((MeshFile::of(path).map_err(input)?, path)));
        let mesh = mesh.transpose()?;
        if !self.explain {
            if let Some(map) = &self.error_map {
                PictureFormat::of(map).map_err(|fault| input(format!("--error-map {fault}")))?;
            }
            // Before the report is read: what a wrong target is refused for does not depend on what the report says.
            check_outputs(&targets, self.report.as_deref())?;
        }
        let (mut source, scene) = self.open()?;
        if self.explain {
            let scene = self.input.resolve_sampling(scene);
            let plan = Plan::new(&scene);
            say!("{}", plan.explain(&scene).trim_end());
            return Ok(());
        }

        self.input.check_outputs(&targets, &*source)?;
        if let Some(cut) = scene.probe().and_then(Probe::folded) {
            remark(&cut);
        }
        if mesh.is_some() && !Plan::new(&scene).slots.contains(&Slot::Distance) {
            return Err(input("--mesh: this mode has no distance map; use --mode sr or mixed"));
        }
        let finer = self.finer(&scene)?;
        self.dump.as_deref().map_or(Ok(()), make_folder)?;
        let mut device = job.open_device()?;
        let scene = self.with_samples(&device.context, scene, &device.options)?;
        let draw = |context: &Arc<Context>, options: &RendererOptions, is_again: bool| {
            if is_again {
                source = self.open()?.0;
            }
            self.draw(context, &mut *source, scene.clone(), options)
        };
        let Drawn { mut renderer, picture, kept } = device.draw(|| 0, draw)?;
        let (volume, demo, unveiled) = (self.input.volume()?, self.input.demo(&*source), renderer.unveiled());
        let of = u32::try_from(volume).ok();
        let shown = marked::as_set(&picture, renderer.scene(), of, unveiled, demo).map_err(failed)?;
        output.write(|format| shown.encoded(format))?;
        if let Some(outcome) = unveiled.map(|unveiled| unveiled.outcome).filter(|outcome| !outcome.is_found()) {
            remark(&format!("unveil: {outcome}"));
        }
        let measured = renderer.take_times().map_err(failed)?;
        if let Some(stated) = self.stated(&mut renderer, &measured)? {
            say!("{stated}");
        }
        if let Some(noise) = still::noise(&mut renderer).map_err(failed)? {
            say!("{noise}");
        }
        if let Some(budget) = &self.budget {
            budget::judge(budget, &measured)?;
        }
        let shift = source.sample_type().shift();
        let warning = one_colour::warning(&mut renderer, &picture, shift, &output.name()).map_err(failed)?;
        warning.iter().for_each(|line| remark(line));
        if self.timings {
            say!("{}", pass_time_table(&measured, renderer.scene()).trim_end());
        }
        if let Some((format, path)) = mesh {
            mesh_sheet::write(&mut renderer, &picture, source.world_of(volume), format, path)?;
        }
        if let Some(folder) = &self.dump {
            self.write_dump(folder, &mut renderer)?;
        }
        drop(renderer);
        if let (Some(finer), Some(file)) = (finer, &self.error_map) {
            let [picture, finer] =
                [scene, finer].map(|scene| in_floats(&device.context, scene, &device.options, &kept));
            self.write_error_map(file, &picture?, &finer?)?;
        }
        check_messages(&device.context)
    }

    /// Sends a volume and draws its picture. The frames are kept for an error map.
    fn draw(
        &self,
        context: &Arc<Context>,
        source: &mut dyn Source,
        scene: Scene,
        options: &RendererOptions,
    ) -> Result<Drawn, DrawFault> {
        let mut renderer = Renderer::new(context, scene, options)?;
        let mut kept = Vec::new();
        let volume = self.input.volume()?;
        let bar = progress_bar(source.frames_per_volume() as u64).with_message("frames");
        send_volume(&mut renderer, source, volume, |frame| {
            kept.extend(self.error_map.is_some().then(|| frame.clone()));
            bar.inc(1);
            Ok(())
        })?;
        bar.finish_and_clear();
        renderer.show(0)?;
        let picture = renderer.picture()?;
        Ok(Drawn { renderer, picture, kept })
    }

    /// Opens the recording and builds its scene, with the settings that keep the budget if there is one.
    fn open(&self) -> Result<(Box<dyn Source>, Scene), Failure> {
        let mut own = self.still_args()?.map_or_else(Vec::new, |still| still.set);
        if let Some(levels) = &self.tolerance {
            let number = ["levels", "level"].iter().find_map(|unit| levels.strip_suffix(unit)).unwrap_or(levels).trim();
            if !number.parse::<f64>().is_ok_and(|number| number > 0.0) {
                return Err(input(format!("--tolerance {levels}: must be a number of levels above 0, such as 1level")));
            }
            own.push((format!("--tolerance {levels}"), format!("ray.tolerance={number}")));
        }
        let (Some(budget), Some(file)) = (&self.budget, &self.report) else { return self.opened(&own) };
        let chosen = budget::chosen(budget, file, || Ok(self.input.open()?.1))?;
        let chosen = chosen.into_iter().map(|set| (format!("--budget, {set}"), set)).chain(own);
        self.opened(&chosen.collect::<Vec<_>>())
    }

    /// Opens the recording, with settings of flags and where each comes from.
    fn opened(&self, set: &[(String, String)]) -> Result<(Box<dyn Source>, Scene), Failure> {
        let (source, scene) = self.input.open_with(set)?;
        match (&self.tolerance, scene.tolerance()) {
            (Some(_), None) if scene.settings.ray.tolerance > 0.0 => {
                Err(input("--tolerance: is for volume rendering without first-hit shading; use --mode vr"))
            }
            _ => Ok((source, scene)),
        }
    }

    /// What a picture with `ray.tolerance` says of its error, and its time.
    fn stated(&self, renderer: &mut Renderer, times: &[PassTime]) -> Result<Option<String>, Failure> {
        let Some(tolerance) = renderer.scene().tolerance() else { return Ok(None) };
        let [errors, marks] = Stated::SLOTS.map(|slot| renderer.read(slot));
        let (Some(errors), Some(marks)) = (errors.map_err(failed)?, marks.map_err(failed)?) else { return Ok(None) };
        if let Some(file) = &self.error_map {
            let colours = Texels::from_fn(errors.size, 3, |[x, y, _], _| errors.one(x, y, 0));
            let none = Texels::from_fn(errors.size, 3, |_, _| 0.0);
            let found = error_map::error_map(&colours, &none, tolerance / LEVELS).map_err(failed)?;
            found.picture.save(file).map_err(failed)?;
        }
        let picture = times.iter().filter(|time| by_name(time.name).is_some_and(|p| p.frequency == Frequency::Picture));
        let taken = match times.is_empty() {
            true => String::new(),
            false => format!("; the picture took {:.3} ms", picture.map(|time| time.total).sum::<f64>() * 1e-6),
        };
        Ok(Some(format!("{}{taken}", Stated::new(&errors, &marks, tolerance))))
    }

    fn still_args(&self) -> Result<Option<StillArgs>, Failure> {
        self.still.as_deref().map(StillArgs::parse).transpose()
    }

    /// The scene, with the samples that the time of `--still` is enough for, if it gives a time.
    fn with_samples(&self, context: &Arc<Context>, scene: Scene, options: &RendererOptions) -> Result<Scene, Failure> {
        let Some(time) = self.still_args()?.and_then(|still| still.time) else { return Ok(scene) };
        if self.input.is_standard() {
            return Err(input("--still: standard input is read once: give samples=N in place of a time"));
        }
        let with = |samples: u32| {
            let mut scene = scene.clone();
            scene.settings.still = scene.settings.still.map(|still| Still { samples, ..still });
            scene
        };
        let samples = still::samples_within(time, |samples| {
            let (mut source, _) = self.open()?;
            let mut renderer = Renderer::new(context, with(samples), options).map_err(failed)?;
            send_volume(&mut renderer, &mut *source, self.input.volume()?, |_| Ok(())).map_err(DrawFault::failed)?;
            renderer.show(0).map_err(failed)?;
            let begin = Instant::now();
            renderer.picture().map_err(failed)?;
            Ok(begin.elapsed().as_secs_f64())
        })?;
        let seed = scene.still().map_or(0, |still| still.seed);
        say!(
            "still: {time} s are enough for {samples} samples: --still samples={samples},seed={seed} draws this picture again"
        );
        Ok(with(samples))
    }

    fn write_error_map(&self, file: &Path, picture: &Texels, finer: &Texels) -> Result<(), Failure> {
        let tolerance = self.error_tolerance.unwrap_or(MAP_TOLERANCE);
        let found = error_map::error_map(picture, finer, tolerance).map_err(failed)?;
        found.picture.save(file).map_err(failed)?;
        let [least, most] = error_map::SCALE;
        say!(
            "error map: {}: difference from half the step, dark {least:e} to light {most}, logarithmic; RMS {:.1e}, largest {:.1e}; \
             hatched above {tolerance}: {:.1} % of the pixels",
            file.display(),
            found.rms,
            found.largest,
            100.0 * found.share_above
        );
        Ok(())
    }

    /// With --error-map the scene at half its step.
    fn finer(&self, scene: &Scene) -> Result<Option<Scene>, Failure> {
        let tolerance = self.error_tolerance;
        check_number("--error-tolerance", tolerance, |share| (0.0..=1.0).contains(&share), "must lie in 0..=1")?;
        if tolerance.is_some() && scene.tolerance().is_some() {
            return Err(input("--error-tolerance: the map of a picture with ray.tolerance hatches that tolerance"));
        }
        // A picture with a tolerance states its error itself.
        if self.error_map.is_none() || scene.tolerance().is_some() {
            return Ok(None);
        }
        error_map::finer(scene).map(Some).map_err(|why| input(format!("--error-map: {why}")))
    }

    fn options(&self) -> Result<RendererOptions, Failure> {
        let times_passes = self.timings || self.budget.is_some() || self.tolerance.is_some();
        let time_stamps = if times_passes { TimeStamps::EachPass } else { TimeStamps::None };
        Ok(RendererOptions { time_stamps, shaders: self.shaders.open()?, ..RendererOptions::default() })
    }

    fn write_dump(&self, folder: &Path, renderer: &mut Renderer) -> Result<(), Failure> {
        for slot in renderer.plan().slots.clone() {
            let texels = renderer.read(slot).map_err(failed)?;
            let drawn = dump::draw(slot, texels.as_ref(), renderer.scene());
            let file = folder.join(format!("{}.png", slot.name()));
            drawn.save(&file).map_err(failed)?;
            if self.raw {
                let (array, about) = dump::array(slot, texels.as_ref(), renderer.scene());
                replace(&file.with_extension("npy"), &array).map_err(failed)?;
                replace(&file.with_extension("json"), format!("{about:#}\n").as_bytes()).map_err(failed)?;
            }
        }
        if self.raw {
            let about = dump::scene_description(renderer.scene());
            replace(&folder.join("scene.json"), format!("{about:#}\n").as_bytes()).map_err(failed)?;
        }
        say!("slots: {}", folder.display());
        Ok(())
    }
}

/// Difference of a pixel above which `--error-map` hatches, unless `--error-tolerance` is set.
const MAP_TOLERANCE: f64 = 0.01;

/// A picture, the renderer that drew it, and the frames that it shows, if they are needed again.
struct Drawn {
    renderer: Renderer,
    picture: Picture,
    kept: Vec<Frame>,
}

/// The picture before the tone mapping of stage 4.
fn in_floats(
    context: &Arc<Context>,
    mut scene: Scene,
    options: &RendererOptions,
    frames: &[Frame],
) -> Result<Texels, Failure> {
    scene.settings.post.floats = true;
    let mut renderer = Renderer::new(context, scene, options).map_err(failed)?;
    renderer.volume(frames).map_err(failed)?;
    renderer.picture().map_err(failed)?;
    renderer.read(Slot::Picture).map_err(failed)?.ok_or_else(|| failed("--error-map: the plan has no picture"))
}
