//! tools/cluster: values that Kubernetes' own client-side validation accepts although the API refuses them, and the exit codes of the program.

use crate::common::files::repository;
use std::process::Command;

fn read(name: &str) -> String {
    std::fs::read_to_string(repository("tools/cluster").join(name)).expect(name)
}

/// Keys and values of a YAML file of our own, in order, comments and list marks left out.
fn pairs(text: &str) -> Vec<(String, String)> {
    let lines = text.lines().map(|line| line.split('#').next().unwrap_or_default().trim().trim_start_matches("- "));
    let pairs = lines.filter_map(|line| line.split_once(':'));
    pairs.map(|(key, value)| (key.trim().to_string(), value.trim().trim_matches('"').to_string())).collect()
}

#[test]
fn the_jobs_use_values_that_the_api_knows_and_exit_codes_that_the_program_has() {
    for name in ["job.yaml", "job-lavapipe.yaml"] {
        let text = read(name);
        let pairs = pairs(&text);
        let of = |key: &str| pairs.iter().filter(|(k, _)| k == key).map(|(_, v)| v.as_str()).collect::<Vec<_>>();
        for (key, known) in [
            ("action", &["FailJob", "FailIndex", "Ignore", "Count"][..]),
            ("operator", &["In", "NotIn"]),
            ("completionMode", &["Indexed"]),
            ("restartPolicy", &["Never"]),
            ("podReplacementPolicy", &["Failed"]),
            ("backoffLimitPerIndex", &["5"]),
            ("status", &["True", "False", "Unknown"]),
            ("kind", &["Job"]),
            ("apiVersion", &["batch/v1"]),
        ] {
            let found = of(key);
            assert!(!found.is_empty() && found.iter().all(|value| known.contains(value)), "{name}: {key}: {found:?}");
        }
        assert!(
            !pairs.iter().any(|(key, _)| key == "backoffLimit"),
            "{name}: the limit of the whole Job would end it early"
        );
        let container = of("containerName");
        assert!(
            container.iter().all(|c| text.contains(&format!("- name: {c}\n          image:"))),
            "{name}: {container:?}"
        );
        // The number of shards stands twice.
        let completions = of("completions");
        assert!(completions.len() == 1 && text.contains(&format!("--shards, \"{}\"", completions[0])), "{name}");
        assert_eq!(of("maxFailedIndexes"), completions, "{name}: the other shards go on");
        // Rules of exit codes: every code but 0 in one of them, and what is never to be tried again fails its index.
        let rules: Vec<(&str, Vec<u8>)> = text
            .split("- action: ")
            .skip(1)
            .filter_map(|rule| {
                let action = rule.lines().next()?.trim();
                let values = rule.split("values: [").nth(1)?.split(']').next()?;
                Some((action, values.split(',').map(|v| v.trim().parse().expect("a code")).collect()))
            })
            .collect();
        assert_eq!(rules, [("FailIndex", vec![2, 4]), ("Count", vec![1, 3])], "{name}");
        // The unit in flight has its grace time, and the process some seconds more.
        let seconds = |text: &str| text.trim_end_matches('s').parse::<u32>().expect("seconds");
        let grace = text.split("--grace, ").nth(1).and_then(|rest| rest.split(']').next()).expect("a grace time");
        assert!(seconds(of("terminationGracePeriodSeconds")[0]) >= seconds(grace) + 10, "{name}");
    }
}

/// The image's packages have these drivers: Debian 13 no longer has the architecture in their names.
#[test]
fn the_job_for_software_names_the_driver_of_the_image() {
    let (job, image) = (read("job-lavapipe.yaml"), read("Containerfile"));
    assert!(image.contains("debian:trixie-slim") && image.contains("mesa-vulkan-drivers"));
    let driver = pairs(&job).into_iter().find(|(_, value)| value.ends_with(".json")).map(|(_, value)| value);
    assert_eq!(driver.as_deref(), Some("/usr/share/vulkan/icd.d/lvp_icd.json"));
}

#[test]
fn the_scripts_are_bash() {
    for name in ["batch.sbatch", "test-slurm", "test-snakemake", "test-jobs", "test-image", "test-devices"] {
        let checked =
            Command::new("bash").arg("-n").arg(repository("tools/cluster").join(name)).output().expect("bash");
        assert!(checked.status.success(), "{name}: {}", String::from_utf8_lossy(&checked.stderr));
    }
    let script = read("batch.sbatch");
    assert!(script.contains("--grace 40s") && script.contains("TERM@60"), "the grace time is below Slurm's");
    assert!(script.contains("--open-mode=append"), "a requeued task would lose its log");
}
