//! How far a recording is read: each reader counts to its end, and ends when it is told to.

use crate::common::files::{Folder, SWEEP, data};
use echolume::low_level::files::progress::{Progress, Share};
use echolume::low_level::picture::Grey;
use echolume::low_level::probe::DepthAxis;
use echolume::low_level::source::recorder::{Reader, Writer};
use echolume::low_level::source::{self, OpenOptions, Source};
use std::path::{Path, PathBuf};

const SPACING: [f64; 3] = [0.2, 0.3, 0.5];

/// Opens a file as the window does.
fn read(path: &Path, options: OpenOptions, progress: &Progress) -> Result<Box<dyn Source>, String> {
    progress.during(|| {
        let mut source = source::open_with(path, options).map_err(|e| e.to_string())?;
        source.prepare().map_err(|e| e.to_string())?;
        Ok(source)
    })
}

/// Frames without an index, as a crash leaves them.
fn without_index(folder: &Folder) -> PathBuf {
    let mut source = source::open(Path::new(SWEEP), None).expect("the sweep");
    let file = folder.0.join("cut.frames");
    let mut writer = Writer::create(&file, source.header()).expect("a file");
    while let Some(frame) = source.next_frame().expect("frames") {
        writer.frame(&frame, 0.0).expect("written");
    }
    writer.finish().expect("whole");
    let whole = std::fs::read(&file).expect("the file");
    let frames = Reader::open(&file).expect("read").frames();
    std::fs::write(&file, &whole[..whole.len() - 8 * frames]).expect("cut");
    file
}

/// Pictures of 8 bits, or of 16, whose samples are all read for their range.
fn pictures(folder: &Folder, sixteen: bool) -> PathBuf {
    let pictures = folder.0.join(if sixteen { "deep" } else { "pictures" });
    std::fs::create_dir(&pictures).expect("a folder");
    let most = if sixteen { u16::MAX } else { 255 };
    for n in 0..5u16 {
        let values = (0..64 * 64u32).map(|i| (n * 4096 + i as u16) % most).collect();
        let grey = Grey { width: 64, height: 64, sixteen, values, from_colour: false };
        grey.save(&pictures.join(format!("s{n}.png"))).expect("written");
    }
    pictures
}

#[test]
fn every_reader_that_reads_all_of_a_file_counts_to_its_end() {
    let folder = Folder::new("progress");
    let (cut, deep) = (without_index(&folder), pictures(&folder, true));
    let usual = OpenOptions::default();
    let spaced = OpenOptions { voxel_spacing: Some(SPACING), ..usual };
    let turned = OpenOptions { depth_axis: "z".parse::<DepthAxis>().ok(), ..usual };
    for (path, options) in [
        // Measured: raw, packed as a whole, packed within, several volumes, coded frames.
        (data("formats/short.mha"), usual),
        (data("formats/packed.mha.gz"), usual),
        (data("formats/detached.nhdr"), usual),
        (data("formats/int.mha"), usual),
        (data("formats/bzip2-las.nrrd"), usual),
        (data("formats/big-endian-4d.nii"), usual),
        (data("dicom/enhanced-big.dcm"), usual),
        (data("dicom/enhanced-rle.dcm"), usual),
        (data("dicom/image-lossless.dcm"), usual),
        // Bytes, of which no stored slice is a drawn one.
        (data("formats/gzip-lps.nrrd"), turned),
        (data("uff/linear.uff"), usual),
        (cut, usual),
        (deep, spaced),
    ] {
        let progress = Progress::default();
        let source = read(&path, options, &progress);
        assert!(source.is_ok(), "{path:?}: {:?}", source.err());
        let Share::Percent(share) = progress.share() else { panic!("{path:?}: {:?}", progress.share()) };
        // A library may leave a few bytes of a compressed stream.
        assert!((95..=100).contains(&share), "{path:?} ends at {share} %");
    }
    // Of bytes only the headers are read.
    let progress = Progress::default();
    read(&data("dicom/series"), usual, &progress).map(drop).expect("a series");
    let is_whole = |share| matches!(share, Share::Files { done, count } if done == count && count > 1);
    assert!(is_whole(progress.share()), "{:?}", progress.share());
    let progress = Progress::default();
    read(&pictures(&folder, false), spaced, &progress).map(drop).expect("a stack");
    assert!(is_whole(progress.share()), "{:?}", progress.share());
}

#[test]
fn a_reader_that_is_cancelled_ends_and_says_so() {
    let folder = Folder::new("cancelled");
    let (cut, deep) = (without_index(&folder), pictures(&folder, true));
    let spaced = OpenOptions { voxel_spacing: Some(SPACING), ..OpenOptions::default() };
    let files =
        ["formats/short.mha", "formats/packed.mha.gz", "dicom/enhanced-rle.dcm", "uff/linear.uff", "dicom/series"];
    let files = files.map(|name| (data(name), OpenOptions::default()));
    for (path, options) in files.into_iter().chain([(cut, OpenOptions::default()), (deep, spaced)]) {
        let progress = Progress::default();
        progress.cancel();
        let fault = read(&path, options, &progress).err().unwrap_or_else(|| panic!("{path:?} was opened"));
        assert!(fault.contains("cancelled"), "{path:?}: {fault}");
        // Not for ever.
        let again = read(&path, options, &Progress::default());
        assert!(again.is_ok(), "{path:?}: {:?}", again.err());
    }
}

/// Prevents a recording that cannot be played since the window waits no longer for it to be opened.
#[test]
fn what_was_opened_is_read_on_when_its_progress_is_gone() {
    let progress = Progress::default();
    let mut source = read(&data("formats/packed.mha.gz"), OpenOptions::default(), &progress).expect("opened");
    drop(progress);
    assert!(source.next_frame().expect("a frame").is_some());
}
