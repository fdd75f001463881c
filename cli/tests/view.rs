//! `tetmill view` without a browser; `tests/viewer` has the tests in one.

use crate::common::{own, succeed, tetmill};

#[test]
fn a_page_contains_the_mesh_and_loads_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let page = folder.path().join("page.html");
    succeed(tetmill().arg("view").arg(own("dome")).args(["-n", "2", "-q", "-o"]).arg(&page));
    let text = std::fs::read_to_string(&page).unwrap();
    assert!(text.starts_with("<!doctype html>") && text.ends_with("</html>\n"));
    assert!(text.len() > 100_000, "{}", text.len());
    assert!(text.contains("connect-src 'self'") && !text.contains("src=\""));
}

#[test]
fn bad_requests_end_with_a_reason() {
    let folder = tempfile::tempdir().unwrap();
    let missing = tetmill().arg("view").arg(folder.path().join("none.msh")).output().unwrap();
    assert_eq!(missing.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&missing.stderr).contains("none.msh"));
    let taken = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    let refused = tetmill().arg("view").arg(own("dome")).args(["-q", "--port", &port]).output().unwrap();
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("choose another --port"));
}
