//! What needs neither a device nor the program: geometry, plans, references, statistics, reports, and the rules of the source tree.

mod batch;
mod bounds;
mod bricks;
mod cardiac;
mod cluster;
#[path = "../common/mod.rs"]
mod common;
mod compositing_orders;
mod cuts;
mod default_look;
mod error_report;
mod exact_ray;
mod floating;
mod freehand;
mod geometry;
mod measure;
mod metrics;
mod module_cycles;
mod named_profiles;
mod phantom;
mod plan;
mod profile;
mod ray_keys;
mod references;
mod rules;
mod sampling;
mod sizes_in_mm;
mod soak;
mod start_curve;
mod still;
mod supply;
mod unveil;
mod user_presets;
mod verify_report;
mod vessels;
mod workspace;
