//! The browser viewer of tetmill: one page of raw WebGL 2, without anything loaded from elsewhere.
//!
//! A **message** is a mesh as the page reads it; the library `tetmill` makes it
//! (`tetmill::files::view`). [`page`] puts one into a self-contained file that can be mailed.
//! A [`Server`] serves the page and the messages that a [`Source`] makes for its queries, to this
//! machine.
//!
//! *Not* here: anything about meshes. This crate passes bytes on.
#![forbid(unsafe_code)]

mod browser;
mod encode;
mod request;
mod server;
mod source;

pub use browser::open;
pub use encode::base64;
pub use server::Server;
pub use source::Source;

const PAGE: &str = include_str!("../page/page.html");
const STYLE: &str = include_str!("../page/style.css");
const SCRIPT: &str = concat!(
    "'use strict';\n",
    include_str!("../page/math.js"),
    include_str!("../page/mesh.js"),
    include_str!("../page/cut.js"),
    include_str!("../page/visible.js"),
    include_str!("../page/layers.js"),
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
    filled("text/plain", &base64(message))
}

/// The page that loads messages from the server. The index, in JSON, is what the page knows from
/// the start. No text in it can end the script.
fn served_page(index: &str) -> String {
    filled("application/json", &index.replace('<', "\\u003c"))
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
        let served = served_page(r#"{"title": "</script><script>"}"#);
        assert_eq!(served.matches("</script>").count(), 2, "no script ends early");
        assert!(served.contains(r#"{"title": "\u003c/script>\u003cscript>"}"#));
    }
}
