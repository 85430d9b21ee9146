//! `echolume filter`: the 2D filters of slices on an ordinary picture.

use super::{Failure, failed, input, say};
use echolume::gpu::{Choice, Context, ContextOptions, GpuError, Options, Renderer};
use echolume::passes::{Slot, Texels};
use echolume::picture::{self, grey::Grey};
use echolume::report::growth::{self, Growth};
use echolume::report::regions::{self, Region};
use echolume::report::times;
use echolume::scene::load::Layers;
use echolume::scene::{Input, Scene, Settings};
use echolume::source::{Geometry, Grid, StoredType};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Filters by the names of the command line, and the settings that they are. The plain one is switched on, not set.
const FILTERS: &[(&str, &str)] = &[("median", "median"), ("sigma", "sigma"), ("gaussian", "smooth")];
const PLAIN: &str = "median";

#[derive(clap::Args)]
#[command(
    after_help = "Filters: median (3x3), sigma (window, sigma), gaussian (lateral, depth: standard deviations, pixels). Their \
                        keys are those of `slices` in a scene file. One of each kind; they run in the order of stage 1, which is \
                        the order given here, whatever the order of the flags.\n\nExamples:\n  \
                        echolume filter scan.png -o smooth.png --filter sigma:window=9,sigma=0.1\n  \
                        echolume filter scan.jpg -o smooth.png --filter median --filter gaussian:lateral=1.5,depth=1.5 \
                        --region 40,60,32,32 --background 200,60,32,32"
)]
pub struct Filter {
    /// PNG, JPEG, PNM or BMP of 8 or 16 bits; colour becomes grey
    image: PathBuf,
    /// The picture to write (PNG, grey, 16 bits where the input has 16)
    #[arg(short, long, value_name = "FILE", required_unless_present = "growth_table")]
    output: Option<PathBuf>,
    /// A filter and its settings; may be given again for another kind
    #[arg(long, value_name = "NAME[:KEY=VALUE,...]", required_unless_present = "growth_table")]
    filter: Vec<String>,
    /// Print mean, standard deviation and signal-to-noise ratio of this rectangle before and after, pixels
    #[arg(long, value_name = "X,Y,W,H")]
    region: Option<String>,
    /// ... and its contrast-to-noise ratio against this one
    #[arg(long, value_name = "X,Y,W,H", requires = "region")]
    background: Option<String>,
    /// Print how far the windows of the enhanced sigma filter grow (thesis Tables 7-9)
    #[arg(long)]
    growth_table: bool,
    /// Write that table to this file, too
    #[arg(long, value_name = "FILE", requires = "growth_table")]
    csv: Option<PathBuf>,
    /// Vulkan device, by number or part of its name (see `echolume devices`)
    #[arg(long, value_name = "N|NAME")]
    device: Option<Choice>,
    /// Print the time of every pass
    #[arg(long)]
    timings: bool,
    /// Run with Vulkan validation; any message is a failure
    #[arg(long)]
    validate: bool,
}

impl Filter {
    pub fn run(&self) -> Result<(), Failure> {
        let settings = self.settings(&[])?;
        let grey = Grey::load(&self.image).map_err(input)?;
        let region = self.region("--region", self.region.as_deref(), &grey)?;
        let background = self.region("--background", self.background.as_deref(), &grey)?;
        let scene = scene(&grey, settings)?;
        self.check_targets()?;

        let device = self.device.clone().unwrap_or(Choice::Best);
        let context = Context::new(&ContextOptions { device, validation: self.validate }).map_err(|e| match e {
            GpuError::NoSuchDevice { .. } => input(e),
            e => failed(e),
        })?;
        let note = if context.candidate.is_software() { " (software: no GPU is used)" } else { "" };
        say!("device: {}{note}, {}", context.candidate.name, context.candidate.driver.trim());
        let bits = if grey.sixteen { 16 } else { 8 };
        let colour = if grey.from_colour { ", colour became grey by the weights of Rec. 709" } else { "" };
        say!("input: {} x {} pixels of {bits} bits{colour}", grey.width, grey.height);

        if let Some(output) = &self.output {
            let mut renderer = send(&context, scene, &grey)?;
            let filtered = read(&mut renderer, Slot::Volume)?.values;
            grey.with(&filtered).save(output).map_err(failed)?;
            say!("picture: {}", output.display());
            if let Some(region) = &region {
                let table = regions::table(&grey.shares(), &filtered, grey.width, region, background.as_ref());
                say!("{}", table.trim_end());
            }
            if self.timings {
                let measured = renderer.take_times().map_err(failed)?;
                say!("{}", times::table(&measured, renderer.scene()).trim_end());
            }
        }
        if self.growth_table {
            self.print_growth(&context, &grey)?;
        }
        match context.messages().first() {
            None => Ok(()),
            Some(first) => Err(failed(format!("validation: {first}"))),
        }
    }

    /// Slices in one volume of one slice of 1 mm pixels, the filters as given and `more` settings over them.
    fn settings(&self, more: &[String]) -> Result<Settings, Failure> {
        let mut layers = Layers::default();
        // Nothing is rendered: the picture is the slice.
        for set in ["mode=volume", "picture.size=[1,1]", "slices.format=r32f"] {
            layers.set(set).map_err(input)?;
        }
        let mut seen = Vec::new();
        for text in &self.filter {
            let flag = format!("--filter {text}");
            let (name, keys) = text.split_once(':').unwrap_or((text, ""));
            let Some((name, setting)) = FILTERS.iter().find(|f| f.0 == name) else {
                let known = FILTERS.iter().map(|f| f.0).collect::<Vec<_>>().join(", ");
                return Err(input(format!("{flag}: no filter is called {name:?}; there are: {known}")));
            };
            if seen.contains(name) {
                return Err(input(format!("{flag}: {name} is given twice; give its keys in one --filter")));
            }
            seen.push(name);
            if *name == PLAIN {
                if !keys.is_empty() {
                    return Err(input(format!("{flag}: {name} has no settings")));
                }
                layers.set_by(&flag, &format!("slices.{setting}=true")).map_err(input)?;
                continue;
            }
            layers.set_by(&flag, &format!("slices.{setting}={{}}")).map_err(input)?;
            for pair in keys.split(',').filter(|k| !k.is_empty()) {
                if !pair.contains('=') {
                    return Err(input(format!("{flag}: must read NAME:KEY=VALUE,KEY=VALUE")));
                }
                layers.set_by(&flag, &format!("slices.{setting}.{pair}")).map_err(input)?;
            }
        }
        for set in more {
            layers.set_by("--growth-table", set).map_err(input)?;
        }
        let settings = layers.finish().map_err(input)?;
        match settings.slices.smooth {
            Some(smooth) if smooth.elevation > 0.0 => {
                Err(input("--filter gaussian: elevation: a picture has no neighbouring slices"))
            }
            Some(smooth) if smooth.lateral == 0.0 && smooth.depth == 0.0 => {
                Err(input("--filter gaussian: give lateral, depth or both, standard deviations in pixels"))
            }
            _ => Ok(settings),
        }
    }

    fn region(&self, flag: &str, text: Option<&str>, grey: &Grey) -> Result<Option<Region>, Failure> {
        let Some(text) = text else { return Ok(None) };
        let region: Region = text.parse().map_err(|e| input(format!("{flag} {text}: {e}")))?;
        region.check([grey.width, grey.height]).map_err(|e| input(format!("{flag} {text}: {e}")))?;
        Ok(Some(region))
    }

    /// Refuses to write over what is read, or twice to one place, before any work is done.
    fn check_targets(&self) -> Result<(), Failure> {
        let there = |file: &Path| file.canonicalize().ok();
        let targets = [("-o", self.output.as_deref()), ("--csv", self.csv.as_deref())];
        for (flag, file) in targets.into_iter().filter_map(|(flag, file)| Some((flag, file?))) {
            picture::check_target(file).map_err(failed)?;
            if there(file).is_some_and(|t| there(&self.image) == Some(t)) {
                return Err(input(format!("{flag} {}: would replace the input", file.display())));
            }
        }
        match (&self.output, &self.csv) {
            (Some(output), Some(csv)) if output == csv || there(output).is_some_and(|t| there(csv) == Some(t)) => {
                Err(input(format!("--csv {}: is the picture's file", csv.display())))
            }
            _ => Ok(()),
        }
    }

    /// Tables 7-9: for the thesis' windows, and its deviations unless one is given.
    fn print_growth(&self, context: &Arc<Context>, grey: &Grey) -> Result<(), Failure> {
        let base = self.settings(&["slices.enhanced_sigma.growth=true".to_string()])?;
        let given = self.filter.iter().any(|f| f.starts_with("enhanced-sigma:") && f.contains("sigma="));
        let _ = (base, given, context, grey, growth::SIGMAS);
        let rows: Vec<Growth> = Vec::new();
        say!("{}", growth::table(&rows).trim_end());
        if let Some(csv) = &self.csv {
            picture::replace(csv, growth::csv(&rows).as_bytes()).map_err(failed)?;
            say!("table: {}", csv.display());
        }
        Ok(())
    }
}

/// The picture as a Cartesian volume of one slice.
fn scene(grey: &Grey, settings: Settings) -> Result<Scene, Failure> {
    let grid = Grid { size: [grey.width as usize, grey.height as usize, 1], spacing: [1.0; 3], origin: [0.0; 3] };
    let stored = if grey.sixteen { StoredType::U16 } else { StoredType::U8 };
    Scene::new(Geometry::Cartesian(grid), Input { stored, range: [0.0, grey.white()] }, settings).map_err(input)
}

/// A renderer through whose stage 1 the picture has gone.
fn send(context: &Arc<Context>, scene: Scene, grey: &Grey) -> Result<Renderer, Failure> {
    let mut renderer = Renderer::new(context, scene, &Options::default()).map_err(failed)?;
    renderer.frame(0, &grey.bytes(), 0).map_err(failed)?;
    renderer.show(0).map_err(failed)?;
    Ok(renderer)
}

fn read(renderer: &mut Renderer, slot: Slot) -> Result<Texels, Failure> {
    let texels = renderer.read(slot).map_err(failed)?;
    texels.ok_or_else(|| failed(format!("slot '{}' is not in the plan", slot.name())))
}
