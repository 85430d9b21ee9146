//! Every metric of the program.

use super::{Kind, Metric};

macro_rules! metrics {
    ($($id:ident: $kind:ident $name:literal [$($label:literal),*] $help:literal;)*) => {
        $(
            #[doc = $help]
            pub const $id: Metric = Metric { name: $name, kind: Kind::$kind, help: $help, labels: &[$($label),*] };
        )*
        /// All of them.
        pub const ALL: &[Metric] = &[$($id),*];
    };
}

metrics! {
    VERIFY_INFO: Gauge "echolume_verify_info" ["device", "driver", "vulkan", "program", "level", "validation"]
        "The device, its driver and the program, as labels; always 1.";
    VERIFY_CHECKS: Gauge "echolume_verify_checks" ["result"] "Number of checks of the last run by result.";
    VERIFY_CHECK_FAILED: Gauge "echolume_verify_check_failed" ["group", "check"]
        "1 for each check that failed in the last run.";
    VERIFY_PASS_SECONDS: Gauge "echolume_verify_pass_seconds" ["pass"] "Median time of one pass on the device.";
    VERIFY_DURATION: Gauge "echolume_verify_duration_seconds" [] "Duration of the last run.";
    VERIFY_TIMESTAMP: Gauge "echolume_verify_timestamp_seconds" [] "End of the last run, seconds since 1970.";
}
