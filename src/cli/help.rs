//! The appearance of the command line: flags in groups, a help of one screen (`-h`), and the values that shells complete.

use crate::scene::load::PRESETS;
use crate::scene::numbers;
use crate::source::formats;
use crate::source::phantom::Body;
use clap::builder::PossibleValuesParser;
use clap::{Arg, Command};

/// Flags by their group, with spaces between them. Flags that are not here are `Options`.
const GROUPS: [(&str, &str); 6] = [
    (
        "Input",
        "source from probe depth_axis voxel_spacing plus_config calibration reference volume real_time rounds \
         tool device_name no_checksum clip hole extent freehand_size config",
    ),
    ("Look", "mode layout transfer scene preset size camera roi set still tolerance budget report"),
    (
        "Output",
        "output out null record serve serve_spacing prometheus save_to turntable volumes mesh dump raw error_map \
         error_tolerance time cine cine_memory",
    ),
    (
        "Device",
        "device device_timeout update images queues max_memory full_screen monitor direct refresh present kiosk \
         no_ui no_panels scale",
    ),
    ("Motor", "motor angle sweeps homed delay stamps baud parity stop_bits timeout port"),
    ("Debugging", "verbose log_file explain timings validate glsl"),
];

/// Commands whose flags are in groups, with what a group holds of them alone. The others have few flags.
const GROUPED: [(&str, &[(&str, &str)]); 4] = [
    ("render", &[("rate", "Output")]),
    ("stream", &[("rate", "Input"), ("spacing", "Input")]),
    ("view", &[("rate", "Input"), ("spacing", "Input")]),
    ("worksheet", &[]),
];

/// The flags of `-h`, of commands with many.
const USUAL: [(&str, &str); 10] = [
    ("render", "mode transfer preset size camera roi set device probe volume output turntable volumes explain"),
    (
        "stream",
        "source probe rate real_time rounds mode preset size set device out null record serve volumes time motor",
    ),
    ("view", "source probe rate real_time mode preset set device kiosk config full_screen budget record save_to"),
    ("convert", "spacing volume probe outside mask sequence secondary_capture"),
    ("mesh", "threshold spacing smooth simplify fast base open volume probe"),
    ("segment", "output threshold dark seed smooth box least csv stl volume probe"),
    ("phantom", "output body volumes seed sampling frames lines truth"),
    ("worksheet", "output from scene set size device"),
    ("verify", "device full only list baseline json junit html self_test against"),
    ("profile", "mode preset set size device runs json compare against html"),
];

/// What `-h` says of flags whose first sentence is too long for a line.
const SHORT: [(&str, &str); 15] = [
    ("source", "phantom, a recording, - (a pipe) or igtl://HOST[:PORT]"),
    ("files", "Recordings, or workspaces (.toml) that were saved"),
    ("mode", "vr, sr, mixed, mip, minip, xray, mpr, orthogonal, tomography, cube"),
    ("transfer", "grey, sepia, skin, bone, cool, warm, or a .toml file"),
    ("preset", "bmode, bone, face, fetal, glass, skeleton, thesis, vessel"),
    ("camera", "azimuth, elevation, roll, fov (deg), zoom, target"),
    ("roi", "Region of interest, mm"),
    ("set", "Any setting, such as surface.threshold=0.1"),
    ("out", "Write each picture into this folder"),
    ("turntable", "Draw N pictures of one turn"),
    ("volumes", "Of volumes in time: those to use, or how many"),
    ("body", "head, sphere, step, wires, constant, ramp, heart, vessels"),
    ("truth", "Also write what is where, as labels"),
    ("base", "Make a relief with a flat base this thick, mm"),
    ("kiosk", "Kiosk mode"),
];

/// Most characters of a line of help behind the flag.
const LINE: usize = 64;

/// Puts the flags of `render`, `stream`, `view` and `worksheet`, and the flags that every command has, into groups for the help.
pub fn grouped(program: Command) -> Command {
    let of_all = ["verbose", "log_file", "max_memory"];
    let program =
        program.mut_args(|arg| if of_all.contains(&arg.get_id().as_str()) { in_group(arg, &[]) } else { arg });
    program.mut_subcommands(|command| {
        let Some((_, own)) = GROUPED.iter().find(|(name, _)| *name == command.get_name()) else { return command };
        command.mut_args(|arg| if arg.is_positional() { arg } else { in_group(arg, own) })
    })
}

fn in_group(arg: Arg, own: &[(&str, &'static str)]) -> Arg {
    let name = arg.get_id().to_string();
    let of_all = GROUPS.iter().find(|(_, names)| names.split(' ').any(|flag| flag == name)).map(|(group, _)| *group);
    match own.iter().find(|(id, _)| *id == name).map(|(_, group)| *group).or(of_all) {
        Some(group) => arg.help_heading(group),
        None => arg,
    }
}

/// Reduces the help of all commands to that of `-h`: the usual flags, one line each.
pub fn short(program: Command) -> Command {
    let is_rare = |arg: &Arg| ["log_file", "max_memory"].contains(&arg.get_id().as_str());
    let program = program.mut_args(|arg| short_line(arg.clone()).hide(is_rare(&arg)));
    program.mut_subcommands(|command| short_command(command, ""))
}

fn short_command(command: Command, above: &str) -> Command {
    let name = command.get_name().to_string();
    let usual = USUAL.iter().find(|(of, _)| *of == name && above.is_empty()).map(|(_, usual)| *usual);
    let whole = format!("{above}{name}");
    let more = format!("All flags, with examples: echolume {whole} --help");
    command.after_help(more).mut_subcommands(|below| short_command(below, &format!("{whole} "))).mut_args(|arg| {
        let is_usual = usual.is_none_or(|usual| usual.split(' ').any(|flag| flag == arg.get_id().as_str()));
        let is_shown = arg.is_positional() || is_usual && !arg.is_global_set();
        short_line(arg).hide(!is_shown)
    })
}

/// An argument with one line of help: the first sentence of what `--help` says.
fn short_line(arg: Arg) -> Arg {
    let whole = arg.get_help().map(ToString::to_string).unwrap_or_default();
    let line = match SHORT.iter().find(|(id, _)| *id == arg.get_id().as_str()) {
        _ if whole.len() <= LINE => first_part(&whole),
        _ if arg.get_id() == "input" => format!("Recording: {}, a folder of pictures", formats::names()),
        Some((_, line)) => line.to_string(),
        None => first_part(&whole),
    };
    arg.help(line)
}

/// The first sentence, without the parts behind it as far as the line is too long.
fn first_part(help: &str) -> String {
    let mut line = help.split(" [default").next().unwrap_or_default();
    for end in [". ", "; ", ": ", " (", ", "] {
        if line.chars().count() <= LINE {
            break;
        }
        line = line.split(end).next().unwrap_or_default();
    }
    line.to_string()
}

/// Adds the values that a shell completes, for writing a completion script. A parser made of the result refuses other valid values: synonyms of
/// modes, and presets of the user.
pub fn completed(program: Command) -> Command {
    program.mut_subcommands(|command| command.mut_args(with_values))
}

fn with_values(arg: Arg) -> Arg {
    let values: Vec<&'static str> = match arg.get_id().as_str() {
        "mode" => vec!["vr", "sr", "mixed", "mip", "minip", "xray", "mpr", "orthogonal", "tomography", "cube"],
        "layout" => vec!["single", "4up", "beside", "pair"],
        "preset" => PRESETS.iter().map(|(name, _)| *name).collect(),
        "body" => Body::ALL.map(Body::name).to_vec(),
        "sampling" => vec!["live", "gallery"],
        "update" => vec!["whole", "rolling"],
        // The process ends when the script is written.
        "set" => numbers().map(|number| &*format!("{}=", number.key).leak()).collect(),
        _ => return arg,
    };
    arg.value_parser(PossibleValuesParser::new(values))
}
