//! Tasks of one without a picture, and of one who leaves.

use super::*;

/// At another console, whose probe does not answer.
pub(super) fn no_picture(user: &mut User) -> String {
    let open: OpenSource = Arc::new(|| Err("connection refused".into()));
    let options = ConsoleOptions {
        retry: Some(Duration::from_secs(60)),
        source: SourceKind::Probe,
        ..ball_options(&user.folder)
    };
    user.console = Console::new(&user.device, open, options, WINDOW);
    user.console.describe(true);
    user.until("banner", |user| {
        let mut messages = user.tree.iter().filter(|node| matches!(node.role(), Role::Alert | Role::Status));
        messages.any(|node| node.label().is_some_and(|text| text.contains("connection refused"))).then_some(())
    });
    user.key(Key::Function(2));
    user.until("times", |user| user.shown(Role::Group, "Times"));
    user.count()
}

/// At another console, whose probe sends a volume and ends: what the window shows says so.
pub(super) fn dead_source(user: &mut User) -> String {
    let options = ConsoleOptions { source: SourceKind::Probe, ..ball_options(&user.folder) };
    user.console = Console::new(&user.device, source(ball), options, WINDOW);
    user.console.describe(true);
    user.until("word of the end", |user| user.shown(Role::Button, "Ended "));
    user.count()
}

/// At another console, of a probe whose volume is in no file.
pub(super) fn leave(user: &mut User) -> String {
    let options = ConsoleOptions { source: SourceKind::Probe, ..ball_options(&user.folder) };
    user.console = Console::new(&user.device, source(ball), options, WINDOW);
    user.until("a volume", |user| (user.console.stream().volumes_shown() > 0).then_some(()));
    user.request = LoopRequest::default();
    user.key(Key::Escape);
    assert!(user.console.asks_to_leave() && !user.request.exit);
    user.key(Key::Enter);
    user.until("end", |user| user.request.exit.then_some(()));
    assert!(std::fs::metadata(user.saved("frames")).is_ok_and(|file| file.len() > 100_000), "the loop is saved");
    user.count()
}
