//! Requests: which are answered, and with what.
//!
//! Other pages in the browser can send requests to the loopback address. They know neither the
//! token nor, by a name of their own that resolves to it (DNS rebinding), the Host header.

/// Maximum size of the head of a request (bytes).
pub const MOST: usize = 8192;

/// Maximum length of a query.
const LONGEST: usize = 300;

/// What a valid request asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wanted<'a> {
    /// The page.
    Page,
    /// The message that the source makes for a query.
    Message(&'a str),
}

/// Why a request is refused: the status and its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refused {
    /// 400
    Malformed,
    /// 403
    Forbidden,
    /// 404
    NotFound,
    /// 405
    Method,
    /// 408
    TooSlow,
    /// 431
    TooLarge,
}

impl Refused {
    /// The status line after the version.
    pub fn status(self) -> &'static str {
        match self {
            Self::Malformed => "400 Bad Request",
            Self::Forbidden => "403 Forbidden",
            Self::NotFound => "404 Not Found",
            Self::Method => "405 Method Not Allowed",
            Self::TooSlow => "408 Request Timeout",
            Self::TooLarge => "431 Request Header Fields Too Large",
        }
    }
}

/// Reads the head of a request, up to the empty line.
pub fn parse<'a>(head: &'a [u8], token: &str) -> Result<Wanted<'a>, Refused> {
    let text = std::str::from_utf8(head).map_err(|_| Refused::Malformed)?;
    let mut lines = text.split("\r\n");
    let words: Vec<&str> = lines.next().unwrap_or_default().split(' ').collect();
    let [method, target, version] = words[..] else { return Err(Refused::Malformed) };
    if !version.starts_with("HTTP/1.") {
        return Err(Refused::Malformed);
    }
    let fields = lines.take_while(|line| !line.is_empty()).map(|line| line.split_once(':'));
    let fields: Vec<(&str, &str)> = fields.collect::<Option<_>>().ok_or(Refused::Malformed)?;
    let mut hosts = fields.iter().filter(|(name, _)| name.eq_ignore_ascii_case("host"));
    match (hosts.next(), hosts.next()) {
        (Some((_, host)), None) if is_loopback(host.trim()) => {}
        _ => return Err(Refused::Forbidden),
    }
    if method != "GET" {
        return Err(Refused::Method);
    }
    let (given, rest) =
        target.strip_prefix('/').and_then(|path| path.split_once('/')).ok_or(Refused::Forbidden)?;
    if !is_same(given, token) {
        return Err(Refused::Forbidden);
    }
    match rest.strip_prefix("mesh/") {
        None if rest.is_empty() => Ok(Wanted::Page),
        Some(query) if is_query(query) => Ok(Wanted::Message(query)),
        _ => Err(Refused::NotFound),
    }
}

/// Whether a text can be a query: what [`Source`](crate::Source) promises.
fn is_query(text: &str) -> bool {
    let fits = |byte: u8| byte.is_ascii_lowercase() || byte.is_ascii_digit() || b"/.,+-".contains(&byte);
    (1..=LONGEST).contains(&text.len()) && text.bytes().all(fits)
}

/// Whether a Host header names this machine. The port can differ: it is that of a tunnel.
fn is_loopback(host: &str) -> bool {
    let (name, port) = match host.strip_prefix("[::1]") {
        Some(rest) => ("localhost", rest.strip_prefix(':').unwrap_or(rest)),
        None => host.split_once(':').unwrap_or((host, "")),
    };
    ["localhost", "127.0.0.1"].contains(&name) && port.len() <= 5 && port.bytes().all(|b| b.is_ascii_digit())
}

/// Compares in a time that does not depend on where texts differ.
fn is_same(a: &str, b: &str) -> bool {
    a.len() == b.len() && a.bytes().zip(b.bytes()).fold(0, |sum, (x, y)| sum | (x ^ y)) == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The query of a message, and the empty one for the page.
    fn ask(target: &str, host: &str) -> Result<String, Refused> {
        let head = format!("GET {target} HTTP/1.1\r\nHost: {host}\r\n\r\n");
        parse(head.as_bytes(), "abc").map(|wanted| match wanted {
            Wanted::Page => String::new(),
            Wanted::Message(query) => query.to_owned(),
        })
    }

    #[test]
    fn the_page_and_its_messages_are_found() {
        assert_eq!(ask("/abc/", "127.0.0.1:80"), Ok("".into()));
        assert_eq!(ask("/abc/mesh/level/1", "localhost:9000"), Ok("level/1".into()));
        assert_eq!(ask("/abc/mesh/cut/4/0,-1e-3,1,2/0.5", "[::1]:80"), Ok("cut/4/0,-1e-3,1,2/0.5".into()));
        assert_eq!(ask(&format!("/abc/mesh/{}", "9".repeat(300)), "localhost"), Ok("9".repeat(300)));
    }

    #[test]
    fn everything_else_is_refused() {
        let host = "localhost";
        for target in
            ["/", "/abd/", "/ab/", "//", "/abcd/", "/mesh/0", "/../abc/", "abc/", "http://localhost/abc/"]
        {
            assert_eq!(ask(target, host), Err(Refused::Forbidden), "{target}");
        }
        let long = format!("/abc/mesh/{}", "9".repeat(301));
        let strange =
            ["/abc/mesh/", "/abc/../x", "/abc/?x", "/abc/mesh/0?x", "/abc/mesh/%2e", "/abc/mesh/LEVEL"];
        for target in strange.into_iter().chain(["/abc/mesh/<b>", "/abc/mesh/\u{e9}", "/abc/mesh/\0", &long])
        {
            assert_eq!(ask(target, host), Err(Refused::NotFound), "{target}");
        }
        for host in
            ["evil.example", "localhost.evil.example", "127.0.0.1.evil:80", "", "localhost:x", "[::1]x"]
        {
            assert_eq!(ask("/abc/", host), Err(Refused::Forbidden), "{host}");
        }
        let raw = |text: &[u8]| parse(text, "abc").map(|_| ());
        assert_eq!(raw(b"GET /abc/ HTTP/1.1\r\n\r\n"), Err(Refused::Forbidden), "no host");
        let twice = b"GET /abc/ HTTP/1.1\r\nHost: localhost\r\nHost: localhost\r\n\r\n";
        assert_eq!(raw(twice), Err(Refused::Forbidden));
        assert_eq!(raw(b"POST /abc/ HTTP/1.1\r\nHost: localhost\r\n\r\n"), Err(Refused::Method));
        for text in [
            &b"GET\r\n\r\n"[..],
            b"",
            b"\xff\xfe",
            b"GET /abc/ HTTP/1.1\r\nHost\r\n\r\n",
            b"GET /abc/ FTP\r\n",
        ] {
            assert_eq!(raw(text), Err(Refused::Malformed));
        }
    }
}
