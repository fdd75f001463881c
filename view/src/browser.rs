//! Opens the browser.

use std::process::{Command, Stdio};

/// Opens an address in the user's browser, and returns whether one was started.
///
/// On Linux without a display, as in a shell on another machine, none is.
pub fn open(address: &str) -> bool {
    let (program, arguments): (&str, &[&str]) = if cfg!(windows) {
        ("rundll32", &["url.dll,FileProtocolHandler"])
    } else if cfg!(target_os = "macos") {
        ("open", &[])
    } else if ["DISPLAY", "WAYLAND_DISPLAY"].iter().any(|name| std::env::var_os(name).is_some()) {
        ("xdg-open", &[])
    } else {
        return false;
    };
    let command = &mut Command::new(program);
    let command = command.args(arguments).arg(address);
    let started = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn();
    // The browser may outlive this program: nobody waits for it.
    started.is_ok()
}
