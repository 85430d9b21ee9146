//! `echolume filter`: applies the 2D slice filters to an ordinary picture.

use crate::args::{PictureFile, check_messages, check_outputs, open_device};
use crate::gpu::{Context, DeviceChoice, Renderer, RendererOptions, TimeStamps};
use crate::passes::times::pass_time_table;
use crate::passes::{Slot, Texels};
use crate::picture::{self, Grey, Region};
use crate::scene::Settings;
use crate::scene::load::Layers;
use crate::terminal::{Failure, failed, input, remark, say};
use crate::thesis_tables::growth::{self, GrowthSettings, measure, scene_of};
use std::path::PathBuf;
use std::sync::Arc;

/// A filter of stage 1 and its name on the command line.
struct NamedFilter {
    name: &'static str,
    /// The setting that switches it on.
    on: &'static str,
    /// Keys of the command line and their settings. If empty, the keys are those of the table that `on` names.
    keys: &'static [(&'static str, &'static str)],
}

/// The filters in the order in which they run.
const FILTERS: &[NamedFilter] = &[
    NamedFilter { name: "median", on: "slices.median=true", keys: &[] },
    NamedFilter {
        name: "estimator",
        on: "slices.estimator=median",
        keys: &[("kind", "slices.estimator"), ("edge", "slices.estimator_edge")],
    },
    NamedFilter { name: "sigma", on: "slices.sigma={}", keys: &[] },
    NamedFilter { name: ENHANCED, on: "slices.enhanced_sigma={}", keys: &[] },
    NamedFilter { name: "perona-malik", on: "slices.perona_malik={}", keys: &[] },
    NamedFilter { name: "blur", on: "slices.blur=true", keys: &[] },
    NamedFilter { name: "gaussian", on: "slices.smooth={}", keys: &[] },
];
const ENHANCED: &str = "enhanced-sigma";

impl NamedFilter {
    /// The setting of a key, or an error that lists this filter's keys.
    fn setting(&self, key: &str) -> Result<String, String> {
        let (table, value) = self.on.split_once('=').unwrap_or((self.on, ""));
        match self.keys.iter().find(|(name, _)| *name == key) {
            Some((_, setting)) => Ok(setting.to_string()),
            None if value == "{}" => Ok(format!("{table}.{key}")),
            None if self.keys.is_empty() => Err(format!("{} has no settings", self.name)),
            None => {
                let there = self.keys.iter().map(|k| k.0).collect::<Vec<_>>().join(", ");
                Err(format!("{} has no key {key:?}; its keys are: {there}", self.name))
            }
        }
    }
}

#[derive(clap::Args)]
#[command(
    after_help = "Filters: median (3x3); estimator (kind: median, perona-malik, gradient-inverse, nagao-matsuyama; edge); sigma \
                        (window, sigma, noise); enhanced-sigma (window, largest, sigma, noise, centre, edge); perona-malik \
                        (scheme: explicit, aos, aos-richardson, rkl1; edge, conductance, step, repeat); blur (3x3); gaussian (lateral, depth: standard deviations, \
                        pixels). Keys and defaults are those of `slices` in a scene file. One of each kind; they run in the order \
                        of stage 1, which is the order given here, whatever the order of the flags.\n\nExamples:\n  \
                        echolume filter scan.png -o smooth.png --filter sigma:window=9,sigma=0.1\n  \
                        echolume filter scan.jpg -o smooth.png --filter median --filter gaussian:lateral=1.5,depth=1.5 \
                        --region 40,60,32,32 --background 200,60,32,32\n  \
                        echolume filter scan.png --growth-table --filter enhanced-sigma:sigma=0.1 --csv growth.csv"
)]
pub struct Filter {
    /// PNG, JPEG, PNM or BMP of 8 or 16 bits. Colour is converted to grey
    image: PathBuf,
    /// The picture to write, grey: .png, .jpg, .bmp or .pgm by its ending, 16 bits if the input has 16; - for a PNG on standard output
    #[arg(short, long, value_name = "FILE", required_unless_present = "growth_table")]
    output: Option<PathBuf>,
    /// A filter and its settings; may be repeated for other filters
    #[arg(long, value_name = "NAME[:KEY=VALUE,...]", required_unless_present = "growth_table")]
    filter: Vec<String>,
    /// Print mean, standard deviation and signal-to-noise ratio of this rectangle before and after, pixels
    #[arg(long, value_name = "X,Y,W,H")]
    region: Option<String>,
    /// Print also its contrast-to-noise ratio against this rectangle, pixels
    #[arg(long, value_name = "X,Y,W,H", requires = "region")]
    background: Option<String>,
    /// Print how far the windows of the enhanced sigma filter grow (thesis Tables 7-9), for windows of 3 to 13 pixels and
    /// sigmas of 0.03, 0.1 and 0.17, or for those given with --filter enhanced-sigma
    #[arg(long)]
    growth_table: bool,
    /// Write that table also to this file (CSV)
    #[arg(long, value_name = "FILE", requires = "growth_table")]
    csv: Option<PathBuf>,
    /// Vulkan device, by number or part of its name (see `echolume devices`)
    #[arg(long, value_name = "N|NAME")]
    device: Option<DeviceChoice>,
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
        let rows = if self.growth_table { self.growth_rows()? } else { Vec::new() };
        let output = self.output.as_deref().map(|output| PictureFile::new("-o", output)).transpose()?;
        let grey = Grey::load(&self.image).map_err(input)?;
        let region = self.region("--region", self.region.as_deref(), &grey)?;
        let background = self.region("--background", self.background.as_deref(), &grey)?;
        let scene = scene_of(&grey, settings).map_err(input)?;
        check_outputs(
            &[("-o", output.and_then(|o| o.path())), ("--csv", self.csv.as_deref())],
            [self.image.as_path()],
        )?;

        let context = open_device(self.device.clone(), self.validate)?;
        let bits = if grey.sixteen { 16 } else { 8 };
        let colour = if grey.from_colour { ", converted from colour with the weights of Rec. 709" } else { "" };
        say!("input: {} x {} pixels of {bits} bits{colour}", grey.width, grey.height);

        if let Some(output) = &output {
            let time_stamps = if self.timings { TimeStamps::EachPass } else { TimeStamps::None };
            let options = RendererOptions { time_stamps, ..RendererOptions::default() };
            let mut renderer = Renderer::new(&context, scene, &options).map_err(failed)?;
            renderer.frame(0, &grey.bytes(), 0).map_err(failed)?;
            let filtered = read(&mut renderer, Slot::Volume)?.values;
            let made = grey.with(&filtered);
            output.write(|format| made.encoded(format))?;
            if let Some(level) = one_level(&made) {
                let why = match one_level(&grey) {
                    Some(_) => "so is the input",
                    None => "the filters levelled all of it",
                };
                remark(&format!("{}: is wholly of one level, {level}: {why}", output.name()));
            }
            if let Some(region) = &region {
                let table = picture::region_table(&grey.shares(), &filtered, grey.width, region, background.as_ref());
                say!("{}", table.trim_end());
            }
            if self.timings {
                let measured = renderer.take_times().map_err(failed)?;
                say!("{}", pass_time_table(&measured, renderer.scene()).trim_end());
            }
        }
        if self.growth_table {
            self.print_growth(&context, &grey, rows)?;
        }
        check_messages(&context)
    }

    /// The settings of the given filters, with the assignments `more` on top.
    fn settings(&self, more: &[String]) -> Result<Settings, Failure> {
        let mut layers = Layers::default();
        // Nothing is rendered: the output is the filtered slice.
        for set in ["mode=plane", "picture.size=[1,1]", "slices.format=r32f"] {
            layers.set(set).map_err(input)?;
        }
        let mut seen = Vec::new();
        for text in &self.filter {
            let flag = format!("--filter {text}");
            let (name, keys) = text.split_once(':').unwrap_or((text, ""));
            let Some(known) = FILTERS.iter().find(|f| f.name == name) else {
                let names = FILTERS.iter().map(|f| f.name).collect::<Vec<_>>().join(", ");
                return Err(input(format!("{flag}: there is no filter {name:?}; the filters are: {names}")));
            };
            if seen.contains(&name) {
                return Err(input(format!("{flag}: {name} is given twice; put all of its keys into one --filter")));
            }
            seen.push(name);
            layers.set_by(&flag, known.on).map_err(input)?;
            for pair in keys.split(',').filter(|k| !k.is_empty()) {
                let Some((key, value)) = pair.split_once('=') else {
                    return Err(input(format!("{flag}: must read NAME:KEY=VALUE,KEY=VALUE")));
                };
                let setting = known.setting(key.trim()).map_err(|e| input(format!("{flag}: {e}")))?;
                layers.set_by(&flag, &format!("{setting}={value}")).map_err(input)?;
            }
        }
        for set in more {
            layers.set_by("--growth-table", set).map_err(input)?;
        }
        let settings = layers.finish().map_err(input)?;
        match settings.slices.smooth {
            Some(smooth) if smooth.elevation > 0.0 || smooth.elevation_mm.is_some() || smooth.kernel.is_some() => {
                Err(input(
                    "--filter gaussian: elevation and kernel need several slices, and a picture is one; give lateral and depth",
                ))
            }
            Some(smooth) if smooth.lateral == 0.0 && smooth.depth == 0.0 => {
                Err(input("--filter gaussian: give lateral, depth or both, standard deviations in pixels"))
            }
            Some(_) if settings.slices.blur.is_on(settings.mode.is_flat()) => {
                Err(input("--filter blur: cannot be combined with gaussian, which blurs already"))
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

    /// The rows of the growth table: those of the filter if it has values of its own, else the thesis'.
    fn growth_rows(&self) -> Result<Vec<GrowthSettings>, Failure> {
        let keys = self.filter.iter().filter_map(|f| f.split_once(':')).filter(|f| f.0 == ENHANCED);
        let keys: Vec<&str> = keys.flat_map(|f| f.1.split(',')).filter_map(|k| k.split('=').next()).collect();
        let given = |key: &str| keys.iter().any(|k| k.trim() == key);
        let asked = self.settings(&[])?.slices.enhanced_sigma.unwrap_or_default();
        let sigmas = if given("sigma") { vec![asked.sigma] } else { growth::SIGMAS.to_vec() };
        if asked.sigma <= 0.0 {
            return Err(input("--growth-table: sigma must be above 0; at 0 the filter changes nothing"));
        }
        let is_one = given("window") || given("largest");
        let windows = if is_one { vec![[asked.window, asked.largest]] } else { growth::WINDOWS.to_vec() };
        let centres = match asked.centre {
            Some(centre) if given("centre") => vec![centre],
            _ => growth::CENTRES.to_vec(),
        };
        let mut rows = Vec::new();
        for (centre, sigma) in centres.iter().flat_map(|centre| sigmas.iter().map(move |sigma| (*centre, *sigma))) {
            for [window, largest] in &windows {
                let keys = format!("window={window},largest={largest},sigma={sigma:?},centre='{}'", centre.name());
                let settings = self.settings(&[format!("slices.enhanced_sigma={{{keys},growth=true}}")])?;
                rows.push((centre, sigma, [*window, *largest], settings));
            }
        }
        Ok(rows)
    }

    fn print_growth(&self, context: &Arc<Context>, grey: &Grey, asked: Vec<GrowthSettings>) -> Result<(), Failure> {
        let rows = measure(context, grey, asked).map_err(failed)?;
        say!("{}", growth::table(&rows).trim_end());
        if let Some(csv) = &self.csv {
            picture::replace(csv, growth::csv(&rows).as_bytes()).map_err(failed)?;
            say!("table: {}", csv.display());
        }
        Ok(())
    }
}

fn read(renderer: &mut Renderer, slot: Slot) -> Result<Texels, Failure> {
    let texels = renderer.read(slot).map_err(failed)?;
    texels.ok_or_else(|| failed(format!("slot '{}' is not in the plan", slot.name())))
}

/// The level of a picture that has only one.
fn one_level(picture: &Grey) -> Option<u16> {
    let first = *picture.values.first()?;
    picture.values.iter().all(|value| *value == first).then_some(first)
}
