//! `echolume worksheet`: a report of the measurements of a workspace, with their pictures.

use super::drawing::{DrawFault, DrawingDevice, send_volume};
use crate::args::{InputArgs, Output, check_outputs, check_volume};
use crate::digest::digest_of;
use crate::files::{self, replace};
use crate::gpu::{Context, Renderer, RendererOptions};
use crate::marked;
use crate::picture::Picture;
use crate::scene::Scene;
use crate::source::{DEMO_DATA, Source};
use crate::terminal::{Failure, failed, input, progress_bar, say};
use crate::worksheet::{Block, Recording, Sheet, VERSION, html, pdf};
use crate::workspace::{self, Origin, Workspace};
use std::cell::Cell;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;
use std::time::SystemTime;

#[derive(clap::Args)]
#[command(
    after_help = "Each measurement has its quantities, volume, time, plane, settings, and a picture with the caliper: the view of the workspace where \
                  that shows it, otherwise the plane that holds its points. Beside the report NAME.json is written, which names the recording by its \
                  digest and has all settings; --from draws the same pictures again from it.\n\n\
                  Examples:\n  \
                  echolume worksheet exam.toml -o exam.pdf\n  \
                  echolume worksheet sweep.mha --scene calipers.toml --mode mpr -o report.html\n  \
                  echolume worksheet --from exam.json -o again.pdf"
)]
pub struct Worksheet {
    #[command(flatten)]
    input: InputArgs,
    /// Report to write: .pdf, .html, .csv or .json by its ending
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Make the report of this NAME.json again, and say whether its pictures are the same. The recording is INPUT if that is given, otherwise
    /// the one that the JSON names, where it was or beside the JSON
    #[arg(long, value_name = "JSON", conflicts_with_all = SETTINGS)]
    from: Option<PathBuf>,
}

/// Longest edge of a picture, pixels, unless `--size` states one: the labels of calipers, of 14 pixels, are to be read beside the table.
const EDGE: u32 = 560;
/// The flags of what the JSON of a report states.
const SETTINGS: [&str; 11] =
    ["mode", "layout", "transfer", "scene", "preset", "size", "camera", "roi", "set", "volume", "labels"];
/// Most bytes of the JSON of a report.
const MAX_BYTES: u64 = 32 << 20;

/// A picture with its marks, and the time stamp of its volume, s.
type Drawn = (Rc<Picture>, Option<f64>);

impl Worksheet {
    pub fn run(mut self) -> Result<(), Failure> {
        let ending = self.output.extension().unwrap_or_default().to_ascii_lowercase();
        let form = ending
            .to_str()
            .filter(|form| ["pdf", "html", "csv", "json"].contains(form))
            .ok_or_else(|| input(format!("-o {}: must end in .pdf, .html, .csv or .json", self.output.display())))?;
        let (output, beside) = (self.output.clone(), self.output.with_extension("json"));
        let outputs: [Output; 2] = [("-o", Some(&*output)), ("-o", Some(&*beside).filter(|_| form != "json"))];
        check_outputs(&outputs, self.from.as_deref())?;
        let earlier = self.from.clone().map(|file| self.take(&file)).transpose()?;
        if self.input.is_standard() {
            return Err(input("worksheet: a report names a file; save what standard input has to one"));
        }
        let (mut source, mut scene) = self.input.open()?;
        let longest = scene.settings.picture.size.into_iter().max().unwrap_or(EDGE);
        if longest > EDGE && earlier.is_none() && !self.input.has_size() {
            let mut settings = scene.settings.clone();
            let shorter = |edge: u32| (f64::from(edge) * f64::from(EDGE) / f64::from(longest)).round().max(1.0) as u32;
            settings.picture.size = settings.picture.size.map(shorter);
            scene = Scene::new(scene.geometry.clone(), scene.input, settings).map_err(input)?;
        }
        self.input.check_outputs(&outputs, &*source)?;
        let origin = self.input.origin()?;
        let recording = recording(&origin, &*source)?;
        if let Some((file, earlier)) = &earlier
            && earlier.recording.sha256 != recording.sha256
        {
            let [now, then] =
                [&recording, &earlier.recording].map(|of| if of.files == 0 { "none" } else { &of.sha256 });
            let (name, file) = (&recording.name, file.display());
            return Err(input(format!("{name}: is not the recording of {file}: its SHA-256 is {now}, not {then}")));
        }
        let blocks = self.blocks(&*source, &scene, earlier.as_ref().map(|(_, sheet)| sheet))?;
        // A bar below a picture has the date: the same one again.
        let date =
            earlier.as_ref().map_or_else(|| marked::time_line(SystemTime::now()), |(_, sheet)| sheet.date.clone());
        let mut device = DrawingDevice::open(&self.input, false, false, RendererOptions::default())?;
        let drawn = self.draw(&mut device, &mut source, &blocks, &date)?;
        let entries = blocks.iter().zip(&drawn).map(|(block, (picture, time))| block.entry(picture, *time)).collect();
        let candidate = &device.context.candidate;
        let sheet = Sheet {
            echolume_worksheet: VERSION,
            program: env!("CARGO_PKG_VERSION").into(),
            date,
            device: format!("{}, {}", candidate.name, candidate.driver.trim()),
            workspace: match &earlier {
                Some((_, sheet)) => sheet.workspace.clone(),
                None => self.input.workspace_name().unwrap_or_default(),
            },
            recording,
            measurements: entries,
            source: workspace::text(&scene.settings, &seen_from(&beside, origin)).map_err(failed)?,
        };
        let pictures: Vec<Rc<Picture>> = drawn.into_iter().map(|(picture, _)| picture).collect();
        let bytes = match form {
            "pdf" => Some(pdf::write(&sheet, &scene.settings, &pictures).map_err(failed)?),
            "html" => Some(html::write(&sheet, &scene.settings, &pictures).map_err(failed)?.into_bytes()),
            "csv" => Some(sheet.csv(&scene.settings).into_bytes()),
            _ => None,
        };
        replace(&beside, sheet.json().map_err(failed)?.as_bytes()).map_err(failed)?;
        if let Some(bytes) = bytes {
            replace(&output, &bytes).map_err(failed)?;
        }
        let (count, json) = (sheet.measurements.len(), beside.display());
        say!("report: {}, measurements: {count}; --from {json} makes it again", output.display());
        if let Some((file, earlier)) = &earlier {
            say!("{}", compared(&sheet, earlier, file));
        }
        Ok(())
    }

    /// Takes recording and settings from the JSON of a report.
    fn take(&mut self, file: &Path) -> Result<(PathBuf, Sheet), Failure> {
        let fault = |fault: String| input(format!("{}: {fault}", file.display()));
        let sheet = Sheet::read(&files::read_text(file, MAX_BYTES, "report").map_err(fault)?).map_err(fault)?;
        let mut stored = Workspace::of_text(file, &sheet.source).map_err(input)?;
        let beside = || Some(file.with_file_name(stored.origin.recording.as_ref()?.file_name()?));
        let is_gone = stored.origin.recording.as_ref().is_some_and(|there| !there.exists());
        let moved = if is_gone { beside().filter(|there| there.exists()) } else { None };
        if let Some(there) = self.input.given().or(moved) {
            stored.origin.recording = Some(there);
        }
        self.input.take_stored(file.into(), stored);
        Ok((file.into(), sheet))
    }

    /// The pictures to draw, in the order of the measurements.
    fn blocks(&self, source: &dyn Source, scene: &Scene, earlier: Option<&Sheet>) -> Result<Vec<Block>, Failure> {
        let (name, chosen) = (self.input.name(), self.input.volume()?);
        let of_name = |why: String| input(format!("{name}: {why}"));
        let mut blocks = Vec::new();
        for (index, measured) in scene.settings.drawn.measure.iter().enumerate().filter(|(_, of)| Block::is_for(of)) {
            let volume = measured.made.as_ref().map_or(chosen, |made| made.volume as usize);
            check_volume(source, &format!("measurement {} is of volume", index + 1), volume, &name)?;
            let own = match volume == chosen {
                true => scene.clone(),
                false => Scene::new(source.geometry(volume), scene.input, scene.settings.clone()).map_err(input)?,
            };
            let before = earlier.and_then(|sheet| sheet.measurements.iter().find(|of| of.number == index + 1));
            let volume = u32::try_from(volume).map_err(input)?;
            let set = before.map(|entry| &*entry.picture.set);
            let block = Block::new(&own, index, volume, set);
            blocks.push(block.map_err(|why| of_name(format!("measurement {}: {why}", index + 1)))?);
        }
        match blocks.is_empty() {
            true => {
                Err(of_name("has no measurements: a caliper is made in the viewer, or in a file for --scene".into()))
            }
            false => Ok(blocks),
        }
    }

    /// Draws the pictures; the same one once.
    fn draw(
        &self,
        device: &mut DrawingDevice,
        source: &mut Box<dyn Source>,
        blocks: &[Block],
        date: &str,
    ) -> Result<Vec<Drawn>, Failure> {
        let bar = progress_bar(blocks.len() as u64).with_message("pictures");
        let (mut drawn, count): (Vec<Drawn>, _) = (Vec::new(), Cell::new(0));
        let draw = |context: &Arc<Context>, options: &RendererOptions, is_again: bool| {
            if is_again {
                *source = self.input.open()?.0;
            }
            while let Some(block) = blocks.get(drawn.len()) {
                let same = blocks.iter().zip(&drawn).find(|(other, _)| block.is_drawn_as(other));
                let one = match same {
                    Some((_, drawn)) => drawn.clone(),
                    None => self.draw_one(context, options, &mut **source, block, date)?,
                };
                drawn.push(one);
                count.set(drawn.len());
                bar.inc(1);
            }
            Ok(())
        };
        device.draw(|| count.get(), draw)?;
        bar.finish_and_clear();
        Ok(drawn)
    }

    /// Draws a picture with a renderer of its own: nothing of what was drawn before is in it.
    fn draw_one(
        &self,
        context: &Arc<Context>,
        options: &RendererOptions,
        source: &mut dyn Source,
        block: &Block,
        date: &str,
    ) -> Result<Drawn, DrawFault> {
        let mut renderer = Renderer::new(context, block.scene().clone(), options)?;
        let mut times = Vec::new();
        send_volume(&mut renderer, source, block.volume as usize, |frame| {
            times.push(frame.time);
            Ok(())
        })?;
        renderer.show(0)?;
        let picture = renderer.picture()?;
        let (scene, start, demo) = (renderer.scene(), renderer.unveiled(), self.input.demo(source));
        let marked = match scene.settings.drawn.marks.bar {
            true => marked::marked(&picture, scene, Some(block.volume), start, date, demo.map(|_| DEMO_DATA)),
            false => marked::as_set(&picture, scene, Some(block.volume), start, demo).map(std::borrow::Cow::into_owned),
        };
        let time = times.first().copied().flatten().filter(|time| time.is_finite());
        Ok((Rc::new(marked.map_err(failed)?), time))
    }
}

/// The recording with its digest.
fn recording(origin: &Origin, source: &dyn Source) -> Result<Recording, Failure> {
    let mut files = source.files();
    files.extend(origin.probe.clone());
    files.sort();
    files.dedup();
    let (sha256, bytes) = if files.is_empty() { Default::default() } else { digest_of(&files).map_err(input)? };
    let path = origin.recording.as_deref().unwrap_or(Path::new(workspace::PHANTOM));
    let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
    Ok(Recording { name, volumes: source.volumes(), files: files.len(), bytes, sha256 })
}

/// The origin with its paths relative to the folder of a file, as far as they are below it.
fn seen_from(file: &Path, mut origin: Origin) -> Origin {
    let folder = std::path::absolute(file).ok().and_then(|file| file.parent().map(Path::to_path_buf));
    for path in [&mut origin.recording, &mut origin.labels, &mut origin.probe].into_iter().flatten() {
        if let Some(Ok(below)) = folder.as_deref().map(|folder| path.strip_prefix(folder)) {
            *path = below.to_path_buf();
        }
    }
    origin
}

/// What the digests of the pixels say.
fn compared(sheet: &Sheet, earlier: &Sheet, file: &Path) -> String {
    let is_same = |number: usize, sha256: &str| {
        earlier.measurements.iter().any(|before| before.number == number && before.picture.sha256 == sha256)
    };
    let differing = sheet.measurements.iter().filter(|entry| !is_same(entry.number, &entry.picture.sha256));
    let numbers: Vec<String> = differing.map(|entry| entry.number.to_string()).collect();
    let (file, count) = (file.display(), sheet.measurements.len());
    match numbers.is_empty() && count == earlier.measurements.len() {
        true => format!("pictures: all {count} are those of {file}, bit for bit"),
        false => format!(
            "pictures: those of {} of {count} measurements differ from {file} ({}), which Echolume {} drew on {}",
            numbers.len(),
            numbers.join(", "),
            earlier.program,
            earlier.device
        ),
    }
}
