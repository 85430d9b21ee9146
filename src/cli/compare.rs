//! `echolume render --compare`: volumes beside each other in one picture, drawn with the same settings on one device.

use super::drawing::{DrawFault, Job};
use super::recordings::read_volume;
use crate::args::{PictureFile, check_messages, check_outputs, check_volume, recorded};
use crate::compare::{self, Difference, MAX_TILES, tile_name};
use crate::gpu::{Context, Renderer, RendererOptions};
use crate::marked::{self, Demo};
use crate::picture::Picture;
use crate::probe::Rigid;
use crate::scene::load::Layers;
use crate::scene::{Scene, Settings};
use crate::segment::registration::{centre, register};
use crate::source::Source;
use crate::source::convert::Volume;
use crate::terminal::{Failure, failed, input, remark, say};
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Arc;

/// The flags that compare volumes.
#[derive(clap::Args)]
pub struct CompareArgs {
    /// With --compare: one to three recordings to draw beside the first, with the same settings
    #[arg(value_name = "COMPARED", requires = "compare")]
    compared: Vec<PathBuf>,
    /// Draw several recordings beside each other, with the difference of two of them
    #[arg(long, requires = "compared")]
    compare: bool,
    /// difference: tiles, and of two recordings their difference in brightness, first minus second; tiles; wipe or wipe=SHARE: the first up to this share of the width,
    /// the second beyond it
    #[arg(long, value_name = "VIEW", default_value = "difference", requires = "compare")]
    compare_view: View,
    /// Volume of the compared recordings, counted from 0 [default: that of the first]
    #[arg(long, value_name = "N", requires = "compare")]
    compare_volume: Option<usize>,
    /// A setting that the compared recordings have in place of the first one's. May be repeated
    #[arg(long, value_name = "KEY.PATH=VALUE", allow_hyphen_values = true, requires = "compare")]
    compare_set: Vec<String>,
    /// Move the compared volumes onto the first, rigidly: find: by least squares of the echoes; or a shift in mm along lateral, depth and elevation and a rotation vector
    /// in degrees about the first one's centre, such as 2,0,-1.5,0,0,5
    #[arg(long, value_name = "find|MOTION", allow_hyphen_values = true, requires = "compare")]
    register: Option<Motion>,
}

/// How volumes are shown together.
#[derive(Clone, Copy, Debug, PartialEq)]
enum View {
    Difference,
    Tiles,
    Wipe(f64),
}

impl FromStr for View {
    type Err = String;

    fn from_str(text: &str) -> Result<View, String> {
        match text.to_ascii_lowercase().split_once('=') {
            None if text.eq_ignore_ascii_case("difference") => Ok(View::Difference),
            None if text.eq_ignore_ascii_case("tiles") => Ok(View::Tiles),
            None if text.eq_ignore_ascii_case("wipe") => Ok(View::Wipe(0.5)),
            Some(("wipe", share)) => {
                let share = share.parse().ok().filter(|share| (0.0..=1.0).contains(share));
                share.map(View::Wipe).ok_or_else(|| "wipe=SHARE must lie in 0..=1".into())
            }
            _ => Err("must be difference, tiles, wipe or wipe=SHARE".into()),
        }
    }
}

/// How the compared volumes are moved.
#[derive(Clone, Copy, Debug)]
enum Motion {
    Find,
    Given(Rigid),
}

impl FromStr for Motion {
    type Err = String;

    fn from_str(text: &str) -> Result<Motion, String> {
        match text.eq_ignore_ascii_case("find") {
            true => Ok(Motion::Find),
            false => Ok(Motion::Given(text.parse().map_err(|why| format!("must be find, or {why}"))?)),
        }
    }
}

/// A volume that is drawn, and its scene.
struct Drawn {
    name: String,
    is_synthetic: bool,
    scene: Scene,
    volume: Volume,
}

impl CompareArgs {
    pub fn is_given(&self) -> bool {
        self.compare
    }

    pub fn run(&self, job: &Job) -> Result<(), Failure> {
        let output = PictureFile::new("-o", job.output)?;
        let shows_difference = self.compare_view == View::Difference && self.compared.len() == 1;
        let tiles = 1 + self.compared.len() + usize::from(shows_difference);
        if tiles > MAX_TILES {
            return Err(input(format!("--compare: shows at most {MAX_TILES} recordings")));
        }
        if matches!(self.compare_view, View::Wipe(_)) && self.compared.len() != 1 {
            return Err(input("--compare-view wipe: is for two recordings"));
        }
        let (mut source, scene) = job.input.open()?;
        job.input.check_outputs(&[("-o", output.path())], &*source)?;
        if scene.settings.drawn.marks.bar {
            return Err(input("marks.bar: is for one volume; leave --compare out, or set marks.bar=false"));
        }
        let size = scene.picture_size();
        let each = match self.compare_view {
            View::Wipe(_) => size,
            _ => compare::tile_size(tiles, size),
        };
        let number = job.input.volume()?;
        let (_, volume, _) = read_volume(&mut *source, Path::new(&job.input.name()), number, |_, _| ())?;
        let settings = sized(scene.settings.clone(), each);
        let first = Drawn {
            name: tile_name('A', short(&job.input.name()), source.is_synthetic()),
            is_synthetic: source.is_synthetic(),
            scene: scene_of(&*source, number, &settings)?,
            volume,
        };
        drop(source);
        let mut drawn = vec![first];
        for (n, file) in self.compared.iter().enumerate() {
            let letter = char::from(b'B' + n as u8);
            let next = self.other(job, file, letter, &drawn[0], &settings)?;
            drawn.push(next);
        }
        let mut device = job.open_device()?;
        let (mut bare, mut pictures) = (Vec::new(), Vec::with_capacity(tiles));
        for of in &drawn {
            let picture = device.draw(|| 0, |context, options, _| draw(context, of, options))?;
            // The names of tiles say it, too.
            let demo = matches!(self.compare_view, View::Wipe(_)) && of.is_synthetic;
            let demo = demo.then_some(Demo::Always);
            let shown = marked::as_set(&picture, &of.scene, u32::try_from(number).ok(), None, demo).map_err(failed)?;
            let shown = shown.into_owned();
            // Calipers are no difference.
            bare.push(picture);
            pictures.push((of.name.clone(), shown));
        }
        let composed = match self.compare_view {
            View::Wipe(share) => compare::wipe(&pictures[0].1, &pictures[1].1, share),
            _ => {
                if shows_difference {
                    let Difference { picture, end, rms } = compare::difference(&bare[0], &bare[1]).map_err(failed)?;
                    say!("difference: A - B, RMS {rms:.2} of 255 levels; scale -{end} to {end}");
                    pictures.push((compare::DIFFERENCE.into(), picture));
                }
                compare::beside(pictures, size)
            }
        };
        let composed = composed.map_err(failed)?;
        output.write(|format| composed.encoded(format))?;
        check_messages(&device.context)
    }

    /// A compared recording, moved onto the first one if that was asked for.
    fn other(
        &self,
        job: &Job,
        file: &Path,
        letter: char,
        first: &Drawn,
        settings: &Settings,
    ) -> Result<Drawn, Failure> {
        let mut source = job.input.open_another(file)?;
        let number = self.compare_volume.map_or_else(|| job.input.volume(), Ok)?;
        check_volume(&*source, "--compare-volume", number, file.display())?;
        let read = source.files();
        check_outputs(&[("-o", Some(job.output))], read.iter().map(PathBuf::as_path))?;
        let fault = |why: String| input(format!("{}: {why}", file.display()));
        let mut layers = Layers::of(settings).ok_or_else(|| failed("the settings cannot be written"))?;
        for assignment in &self.compare_set {
            layers.set_by("--compare-set", assignment).map_err(input)?;
        }
        // Measurements belong to the first volume.
        let mut settings = layers.finish().map_err(input)?.without_drawings();
        // So do its labels, wherever the other is.
        if self.register.is_none() {
            settings.labels.volume = None;
        }
        let (_, mut volume, _) = read_volume(&mut *source, file, number, |_, _| ())?;
        let mut scene = scene_of(&*source, number, &settings)?;
        let motion = match self.register {
            None => None,
            Some(Motion::Given(motion)) => Some(Rigid { about: centre(first.volume.geometry()), ..motion }),
            Some(Motion::Find) => {
                let found = register(&first.volume, &volume).map_err(fault)?;
                let motion = found.motion;
                say!(
                    "registration of {letter}: {motion} (mm and degrees, {:.2} mm and {:.2} degrees in all), correlation {:.3}, overlap {:.0} %",
                    motion.shift.length(),
                    motion.angle(),
                    found.correlation,
                    100.0 * found.overlap
                );
                if found.correlation < UNLIKE {
                    remark(&format!(
                        "registration of {letter}: the volumes are hardly alike; the motion may be a wrong one"
                    ));
                }
                Some(motion)
            }
        };
        if let Some(motion) = motion {
            let (geometry, back) = (first.volume.geometry(), motion.map().inverse());
            volume = volume.moved_onto(geometry, |place| back.transform_point3(place), source.range()[0]);
            scene = Scene::new(geometry.clone(), scene.input, settings).map_err(input)?;
        }
        let name = tile_name(letter, short(&file.display().to_string()), source.is_synthetic());
        Ok(Drawn { name, is_synthetic: source.is_synthetic(), scene, volume })
    }
}

/// Correlation below which a registration is doubted.
const UNLIKE: f64 = 0.5;

/// The settings for a tile of this size.
fn sized(mut settings: Settings, size: [u32; 2]) -> Settings {
    settings.picture.size = size;
    settings
}

/// The scene of a volume with these settings as they are.
fn scene_of(source: &dyn Source, volume: usize, settings: &Settings) -> Result<Scene, Failure> {
    let mut recorded = recorded(source, volume);
    recorded.is_completed = false;
    let layers = Layers::of(settings).ok_or_else(|| failed("the settings cannot be written"))?;
    recorded.scene(&layers).map_err(input)
}

/// The name of a file without its folder.
fn short(name: &str) -> &str {
    Path::new(name).file_name().and_then(|name| name.to_str()).unwrap_or(name)
}

fn draw(context: &Arc<Context>, drawn: &Drawn, options: &RendererOptions) -> Result<Picture, DrawFault> {
    let mut renderer = Renderer::new(context, drawn.scene.clone(), options)?;
    for (slice, bytes) in drawn.volume.frames().iter().enumerate().filter(|(_, bytes)| !bytes.is_empty()) {
        renderer.frame(slice as u32, bytes, 0)?;
    }
    renderer.show(0)?;
    Ok(renderer.picture()?)
}
