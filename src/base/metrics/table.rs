//! Every metric of the program.

use super::{Kind, Metric};

macro_rules! metrics {
    ($($id:ident: $kind:ident $name:literal [$($label:literal),*] $help:literal;)*) => {
        $(
            #[doc = $help]
            pub const $id: Metric = Metric { name: $name, kind: Kind::$kind, help: $help, labels: &[$($label),*] };
        )*
        /// Every metric that the program exports.
        pub const ALL: &[Metric] = &[$($id),*];
    };
}

metrics! {
    INFO: Gauge "echolume_info" ["command", "version", "device", "driver", "vulkan"]
        "The program, its device and the driver, as labels; always 1.";
    RUNNING: Gauge "echolume_running" [] "1 while the program runs, 0 after it ended in order.";
    START: Gauge "echolume_start_time_seconds" [] "When the counters began, seconds since 1970.";
    WRITTEN: Gauge "echolume_written_timestamp_seconds" [] "When these metrics were written, seconds since 1970.";
    WRITE_FAILURES: Counter "echolume_metrics_write_failures_total" [] "How often these metrics could not be written.";
    MEMORY: Gauge "echolume_resident_memory_bytes" [] "Resident memory of the process.";
    FRAMES: Counter "echolume_frames_total" [] "Frames that arrived and were taken.";
    FRAMES_DROPPED: Counter "echolume_frames_dropped_total" ["reason"]
        "Frames that no picture shows: full (the queue was full), refused (wrong size or slice), late (their volume was over), frozen (the user keeps the picture).";
    FRAMES_UNRECORDED: Counter "echolume_frames_unrecorded_total" [] "Frames that could not be recorded.";
    VOLUMES: Counter "echolume_volumes_total" ["result"]
        "Volumes that are over: shown, dropped (complete, but a newer one was shown), incomplete.";
    PICTURES: Counter "echolume_pictures_total" [] "Pictures that were drawn.";
    LATENCY: Histogram "echolume_latency_seconds" []
        "Time from the arrival of a frame to the end of the first picture that shows it.";
    PASS_SECONDS: Summary "echolume_pass_seconds" ["pass"]
        "Time on the device of a picture, of the conversion of a frame, of a copy; with --timings of every pass.";
    DEVICE_LOSSES: Counter "echolume_device_losses_total" [] "How often the device was lost, stalls included.";
    DEVICE_STALLS: Counter "echolume_device_stalls_total" []
        "How often the device did not finish within its deadline and was given up.";
    DEVICE_BUSY: Gauge "echolume_device_busy_seconds" []
        "How long the device has been at work without finishing anything; 0 if it is idle.";
    SOURCE_CONNECTED: Gauge "echolume_source_connected" [] "1 while the probe or other source is open and connected.";
    SOURCE_FAULTS: Counter "echolume_source_faults_total" ["kind"]
        "Faults of the probe or other source: reported (something was left out), ended, disconnected, not_opened.";
    FROZEN: Gauge "echolume_frozen" [] "1 while the user keeps the picture: frames that arrive are not taken.";
    VERIFY_INFO: Gauge "echolume_verify_info" ["device", "driver", "vulkan", "program", "level", "validation"]
        "The device, its driver and the program, as labels; always 1.";
    VERIFY_CHECKS: Gauge "echolume_verify_checks" ["result"] "Number of checks of the last run by result.";
    VERIFY_CHECKS_FLAKY: Gauge "echolume_verify_checks_flaky" []
        "Number of checks that passed in the last run only when they were run again.";
    VERIFY_CHECK_FAILED: Gauge "echolume_verify_check_failed" ["group", "check"]
        "1 for each check that failed in the last run.";
    VERIFY_CHECKS_WORSE: Gauge "echolume_verify_checks_worse" []
        "Number of checks that became worse since the baseline; missing without a baseline.";
    VERIFY_PASS_SECONDS: Gauge "echolume_verify_pass_seconds" ["pass"] "Median time of one pass on the device.";
    VERIFY_DURATION: Gauge "echolume_verify_duration_seconds" [] "Duration of the last run.";
    VERIFY_TIMESTAMP: Gauge "echolume_verify_timestamp_seconds" [] "End of the last run, seconds since 1970.";
}
