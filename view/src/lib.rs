//! The browser viewer of tetmill: one page of raw WebGL 2, without anything loaded from elsewhere.
//!
//! A **message** is a mesh as the page reads it; the library `tetmill` makes it
//! (`tetmill::files::view`). [`page`] puts one into a self-contained file that can be mailed.
//! A [`Server`] serves the page and several messages, the levels of a mesh, to this machine.
//!
//! *Not* here: anything about meshes. This crate passes bytes on.
#![forbid(unsafe_code)]

mod base64;
mod browser;
mod request;
mod server;

pub use browser::open;
pub use server::{Level, Server};

const PAGE: &str = include_str!("../page/page.html");
const STYLE: &str = include_str!("../page/style.css");
const SCRIPT: &str = concat!(
    "'use strict';\n",
    include_str!("../page/math.js"),
    include_str!("../page/mesh.js"),
    include_str!("../page/visible.js"),
    include_str!("../page/draw.js"),
    include_str!("../page/pick.js"),
    include_str!("../page/overlay.js"),
    include_str!("../page/panel.js"),
    include_str!("../page/report.js"),
    include_str!("../page/state.js"),
    include_str!("../page/main.js"),
);

/// The page with a message in it: one file that needs no network.
///
/// The message is in base64, so no name in it can end the script or add another one.
pub fn page(message: &[u8]) -> String {
    filled("text/plain", &base64::encode(message))
}

/// The page that loads messages from the server.
fn served_page(levels: &[Level]) -> String {
    let list: Vec<String> =
        levels.iter().map(|level| format!("[{}, {}]", level.pieces, level.hollow)).collect();
    filled("application/json", &format!("[{}]", list.join(", ")))
}

fn filled(kind: &str, data: &str) -> String {
    // The data comes last: it is not searched for further places.
    let page = PAGE.replace("@STYLE@", STYLE).replace("@KIND@", kind);
    let page = page.replace("@SCRIPT@", SCRIPT);
    page.replacen("@DATA@", data, 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_has_no_place_left_and_loads_nothing() {
        let page = page(b"mesh");
        assert!(page.contains("bWVzaA=="));
        for place in ["@STYLE@", "@KIND@", "@DATA@", "@SCRIPT@", "http://www.google", "https://"] {
            assert!(!page.contains(place), "{place}");
        }
        assert_eq!(page.matches("</script>").count(), 2, "no script ends early");
    }
}
