use super::*;
use proptest::prelude::*;

fn redacted(text: &str) -> String {
    let mut redactor = Redactor::new();
    redactor.add_folder(Path::new("/var/lib/echolume/pictures"));
    redactor.text(text)
}

#[test]
fn names_of_recordings_and_pictures_go_with_their_paths() {
    let stamp = "2026-11-22T01:00:00.000001Z";
    for (text, wanted) in [
        ("/data/Anna Smith/scan 1.mha: cut short", "<file-1>.mha: cut short"),
        ("source = \"/data/Smith, Anna (1980).MHA\"", "source = \"<file-1>.mha\""),
        ("file=/data/Anna.vol more samples", "file=<file-1>.vol more samples"),
        ("cannot open 'Anna O'Brien.dcm', trying", "cannot open '<file-1>.dcm', trying"),
        ("C:\\Users\\Anna\\a b.frames is cut", "<file-1>.frames is cut"),
        ("~/Anna/a.nrrd", "<file-1>.nrrd"),
        ("/data/a.mha.part and /data/b.png", "<file-1>.mha and <file-2>.png"),
        ("/data/a.mha, /other/a.mha, /data/b.mha", "<file-1>.mha, <file-1>.mha, <file-2>.mha"),
        ("/data/Anna Smith: is a folder", "<path-1>: is a folder"),
        ("/home/anna", "<path-1>"),
        ("/var/lib/echolume/pictures/Anna Smith: full", "<path-1>: full"),
        ("/var/lib/echolume/pictures: full", "/var/lib/echolume/pictures: full"),
        ("/etc/echolume/echolume.toml: line 3", "/etc/echolume/echolume.toml: line 3"),
        ("/usr/lib/libvulkan.so.1 and /dev/ttyUSB0", "/usr/lib/libvulkan.so.1 and /dev/ttyUSB0"),
        ("igtl://anna:secret@scanner:18944/x", "igtl://scanner:18944/x"),
        ("igtl://scanner:18944: 12 frames/s, 1 / 2", "igtl://scanner:18944: 12 frames/s, 1 / 2"),
        ("no raw data, 12.5 volumes", "no raw data, 12.5 volumes"),
        ("a\n/data/b.raw\n\nc", "a\n<file-1>.raw\n\nc"),
    ] {
        assert_eq!(redacted(text), wanted, "{text}");
    }
    // Nobody can say where a name without a root begins: the message goes with it, time and level stay.
    let line = format!("{stamp}  WARN saved Anna Smith.png at last");
    assert_eq!(redacted(&line), format!("{stamp}  WARN <file-1>.png at last"));
}

#[test]
fn the_names_of_a_recording_go_wherever_they_stand() {
    let mut redactor = Redactor::new();
    redactor.add_recording(Path::new("/etc/echolume/Anna Smith/Smith_20w.xyz"));
    for (text, wanted) in [
        ("/etc/echolume/Anna Smith/Smith_20w.xyz: none", "<path-1>: none"),
        ("volume 3 of smith_20W, ANNA SMITH", "volume 3 of <name-3>, <name-2>"),
        ("Smith_20w.xyz", "<name-4>"),
        ("Blacksmith_20wide echolume", "Blacksmith_20wide echolume"),
    ] {
        assert_eq!(redactor.text(text), wanted, "{text}");
    }
}

#[test]
fn a_line_without_end_is_left_out_and_not_looked_through_for_ever() {
    let mut redactor = Redactor::new();
    redactor.add_recording(Path::new("/data/anna.mha"));
    for part in ["anna ", "/data/a: ", "a.mha ", "://a@", "'"] {
        assert!(redactor.text(&part.repeat(1 << 20)).len() < 100);
        let said = redactor.text(&(part.repeat(2000) + "\n").repeat(20));
        assert_eq!((said.lines().count(), said.contains("anna")), (20, false));
    }
}

proptest! {
    /// Whatever surrounds it, and whatever the name is made of.
    #[test]
    fn no_name_gets_through(
        before in "[a-z :=,'\"(]{0,12}",
        folder in "(/data/|/mnt/x y/|~/|\\./|C:\\\\|)",
        name in "[a-z, ()-]{0,8}(O')?ZQX[a-z, ()_-]{0,8}",
        ending in "(mha|PNG|vol|frames|dcm)",
        after in "(|: [a-z ]{0,9}|, [a-z]{0,5}|\"|'|\\.part| \\.png)",
    ) {
        let said = redacted(&format!("2026-11-22T01:00:00Z  INFO {before}{folder}{name}.{ending}{after}"));
        prop_assert!(!said.contains("ZQX") && said.contains("INFO"), "{}", said);
    }

    #[test]
    fn any_text_is_survived_and_keeps_its_lines(text in "(\\PC|[\n/\\\\.~:'\"@]|://|\\.mha|/data/){0,40}") {
        let mut redactor = Redactor::new();
        redactor.add_recording(Path::new("/data/äöü/a b.mha"));
        prop_assert_eq!(redactor.text(&text).matches('\n').count(), text.matches('\n').count());
    }
}
