//! Texts about the formats of an export.

pub(crate) const VOLUME_NRRD: &str = "Volume, NRRD";
pub(crate) const VOLUME_NRRD_HINT: &str = "The scan-converted volume in its place, for 3D Slicer and ITK.";
pub(crate) const VOLUME_NIFTI: &str = "Volume, NIfTI";
pub(crate) const VOLUME_NIFTI_HINT: &str = "The scan-converted volume in its place, for tools of imaging research.";
pub(crate) const VOLUME_METAIMAGE: &str = "Volume, MetaImage";
pub(crate) const VOLUME_METAIMAGE_HINT: &str = "The scan-converted volume in its place, for ITK and PLUS.";
pub(crate) const VOLUME_DICOM: &str = "Volume, DICOM";
pub(crate) const VOLUME_DICOM_HINT: &str = "An Enhanced US Volume without a patient's name.";
pub(crate) const SURFACE_STL: &str = "Surface, STL";
pub(crate) const SURFACE_STL_HINT: &str = "The surface between darker and brighter echoes as closed triangles, mm.";
pub(crate) const SURFACE_GLTF: &str = "Surface, glTF";
pub(crate) const SURFACE_GLTF_HINT: &str = "The same with a colour, for viewers and slides.";
pub(crate) const RELIEF_STL: &str = "Relief to print, STL";
pub(crate) const RELIEF_STL_HINT: &str = "The surface as the probe sees it, filled down to a flat base.";
pub(crate) const TURNTABLE_PICTURES: &str = "Turntable, pictures";
pub(crate) const TURNTABLE_PICTURES_HINT: &str = "A folder of 72 PNG files: one turn of the rendering as it is shown.";
pub(crate) const TURNTABLE_FILM: &str = "Turntable, film";
pub(crate) const TURNTABLE_FILM_HINT: &str =
    "One turn of the rendering as it is shown, as MP4: AV1, or what the installed ffmpeg makes.";
pub(crate) const PICTURE_1000: &str = "Picture, 1000 pixels";
pub(crate) const PICTURE_2000: &str = "Picture, 2000 pixels";
pub(crate) const PICTURE_4000: &str = "Picture, 4000 pixels";
pub(crate) const PICTURE_HINT: &str = "The picture as it is shown in full quality, as PNG; its longer edge has so many pixels. Ctrl+I saves it at the size of the window.";
pub(crate) const LOOP_PICTURES: &str = "Loop, pictures";
pub(crate) const LOOP_PICTURES_HINT: &str =
    "A folder of PNG files: the rendering as it is shown, of each volume of the loop from its first mark to its last.";
pub(crate) const LOOP_FILM: &str = "Loop, film";
pub(crate) const LOOP_FILM_HINT: &str = "The same as MP4, back as well if the loop plays so, at the mean rate times its speed (0.1 to 240 pictures a second).";
pub(crate) const REPORT: &str = "Report, PDF";
pub(crate) const REPORT_HINT: &str = "Every measurement with its picture, plane, volume and settings, and what identifies the recording. A JSON file beside it makes the same report again.";
pub(crate) const LABELS_NRRD: &str = "Labels, .seg.nrrd";
pub(crate) const LABELS_NRRD_HINT: &str = "What the tool Labels shows, as a segmentation of 3D Slicer.";
pub(crate) const WHY_NO_REPORT: &str =
    "a report names the file of its volumes, and these are live: save the loop (Ctrl+R), and open it";
text!(why_export_not_started(e) = "the export cannot be started: {e}");
text!(why_export_lost(e) = "the export was lost: {e}");
pub(crate) const WHY_EXPORT_ENDED: &str = "it ended early";
text!(why_no_program(e) = "this program's file is not known: {e}");
