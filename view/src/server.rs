//! A small HTTP server on the loopback address: one thread for each connection, one answer each.

use crate::request::{MOST, Refused, Wanted, parse};
use crate::{Source, served_page};
use std::io::{self, ErrorKind, Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// How often the server tests whether it is to stop.
const PAUSE: Duration = Duration::from_millis(20);

/// Maximum time for the head of a request.
const PATIENCE: Duration = Duration::from_secs(5);

/// Maximum time of a write without progress: a tunnel can be slow.
const WRITING: Duration = Duration::from_secs(60);

/// Maximum number of connections at a time; others wait in the queue of the system.
const CONNECTIONS: usize = 16;

/// Sent with all answers: the page runs its own script only, is shown in no frame, and is not kept.
const FIELDS: &str = "Connection: close\r\nCache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\n\
    X-Frame-Options: DENY\r\nReferrer-Policy: no-referrer\r\nCross-Origin-Resource-Policy: same-origin\r\n";

/// The status of a query that the source refuses.
const UNANSWERED: &str = "422 Unprocessable Content";

/// A server of one page and the messages that it queries.
#[derive(Debug)]
pub struct Server {
    listener: TcpListener,
    token: String,
    page: String,
    open: AtomicUsize,
}

impl Server {
    /// A server on a port of the loopback address, or on any free one. `index` is a JSON value that
    /// the page gets with its script.
    ///
    /// # Errors
    /// If the port is taken or not allowed, or the system has no random numbers.
    pub fn new(port: Option<u16>, index: &str) -> io::Result<Self> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port.unwrap_or(0)))?;
        listener.set_nonblocking(true)?;
        let mut random = [0; 16];
        getrandom::fill(&mut random).map_err(io::Error::other)?;
        let token = random.iter().map(|byte| format!("{byte:02x}")).collect();
        let page = served_page(index);
        Ok(Self { listener, token, page, open: AtomicUsize::new(0) })
    }

    /// The address of the page, with the token.
    ///
    /// # Errors
    /// If the system does not know the port.
    pub fn address(&self) -> io::Result<String> {
        let SocketAddr::V4(place) = self.listener.local_addr()? else { unreachable!("bound to IPv4") };
        Ok(format!("http://{place}/{}/", self.token))
    }

    /// Answers requests until `stop` returns true, queries by the source.
    ///
    /// # Errors
    /// If the system accepts no more connections.
    pub fn run(&self, source: &dyn Source, stop: impl Fn() -> bool) -> io::Result<()> {
        std::thread::scope(|scope| {
            while !stop() {
                if self.open.load(Ordering::Acquire) >= CONNECTIONS {
                    std::thread::sleep(PAUSE);
                    continue;
                }
                match self.listener.accept() {
                    Ok((stream, _)) => {
                        self.open.fetch_add(1, Ordering::AcqRel);
                        scope.spawn(|| {
                            // A client that went away needs no answer.
                            let _ = self.answer(source, stream);
                            self.open.fetch_sub(1, Ordering::AcqRel);
                        });
                    }
                    Err(error) if error.kind() == ErrorKind::WouldBlock => std::thread::sleep(PAUSE),
                    Err(error) if error.kind() == ErrorKind::ConnectionAborted => {}
                    Err(error) => return Err(error),
                }
            }
            Ok(())
        })
    }

    fn answer(&self, source: &dyn Source, mut stream: TcpStream) -> io::Result<()> {
        stream.set_nonblocking(false)?;
        stream.set_write_timeout(Some(WRITING))?;
        let head = head(&mut stream);
        match head.as_ref().map_err(|refused| *refused).and_then(|head| parse(head, &self.token)) {
            Ok(Wanted::Page) => send(&mut stream, "200 OK", "text/html; charset=utf-8", self.page.as_bytes()),
            Ok(Wanted::Message(query)) => match source.answer(query) {
                Ok(message) => send(&mut stream, "200 OK", "application/octet-stream", &message),
                Err(reason) => send(&mut stream, UNANSWERED, "text/plain; charset=utf-8", reason.as_bytes()),
            },
            Err(refused) => {
                let status = refused.status();
                send(&mut stream, status, "text/plain", format!("{status}\n").as_bytes())
            }
        }
    }
}

/// Reads up to the empty line after the head.
fn head(stream: &mut TcpStream) -> Result<Vec<u8>, Refused> {
    let start = Instant::now();
    let mut head = Vec::new();
    let mut chunk = [0; 1024];
    while !head.windows(4).any(|end| end == b"\r\n\r\n") {
        let left = PATIENCE.checked_sub(start.elapsed()).filter(|left| !left.is_zero());
        stream.set_read_timeout(Some(left.ok_or(Refused::TooSlow)?)).map_err(|_| Refused::Malformed)?;
        match stream.read(&mut chunk) {
            Ok(0) => return Err(Refused::Malformed),
            Ok(count) => head.extend_from_slice(&chunk[..count]),
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(_) => return Err(Refused::TooSlow),
        }
        if head.len() > MOST {
            return Err(Refused::TooLarge);
        }
    }
    Ok(head)
}

fn send(stream: &mut TcpStream, status: &str, kind: &str, body: &[u8]) -> io::Result<()> {
    let length = body.len();
    let head =
        format!("HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {length}\r\n{FIELDS}\r\n");
    stream.write_all(head.as_bytes())?;
    stream.write_all(body)?;
    stream.flush()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::AtomicBool;

    /// What a server whose source knows one query answers to raw bytes.
    fn answers(asked: impl Fn(&Server) -> Vec<Vec<u8>>) -> Vec<String> {
        let server = Server::new(None, "[]").unwrap();
        let source = |query: &str| match query {
            "level/1" => Ok(b"mesh".to_vec()),
            _ => Err("no such level".to_owned()),
        };
        let place = server.listener.local_addr().unwrap();
        let done = AtomicBool::new(false);
        std::thread::scope(|scope| {
            scope.spawn(|| server.run(&source, || done.load(Ordering::Relaxed)).unwrap());
            let ask = |bytes: Vec<u8>| {
                let mut stream = TcpStream::connect(place).unwrap();
                stream.write_all(&bytes).unwrap();
                stream.shutdown(std::net::Shutdown::Write).unwrap();
                let mut answer = Vec::new();
                // The server may close a connection with unread bytes.
                let _ = stream.read_to_end(&mut answer);
                String::from_utf8(answer).unwrap()
            };
            let answers = asked(&server).into_iter().map(ask).collect();
            done.store(true, Ordering::Relaxed);
            answers
        })
    }

    #[test]
    fn the_page_and_the_message_are_served_with_the_token_only() {
        let found = answers(|server| {
            let ask = |path: &str| format!("GET {path} HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n").into_bytes();
            let token = &server.token;
            let mesh = |query: &str| ask(&format!("/{token}/mesh/{query}"));
            vec![
                ask(&format!("/{token}/")),
                mesh("level/1"),
                mesh("level/2"),
                ask("/0123/mesh/level/1"),
                ask("/"),
            ]
        });
        assert!(found[0].starts_with("HTTP/1.1 200 OK") && found[0].contains("<canvas"));
        assert!(found[1].ends_with("\r\n\r\nmesh"));
        assert!(found[2].starts_with("HTTP/1.1 422 ") && found[2].ends_with("\r\n\r\nno such level"));
        for refused in &found[3..] {
            assert!(refused.starts_with("HTTP/1.1 403 Forbidden"));
            assert!(refused.ends_with("\r\n\r\n403 Forbidden\n"), "an error and nothing else");
        }
    }

    #[test]
    fn oversized_and_broken_requests_are_refused() {
        let found =
            answers(|_| vec![vec![b'x'; MOST + 2000], b"GET / HT".to_vec(), b"\0\0\r\n\r\n".to_vec()]);
        assert!(found[0].is_empty() || found[0].starts_with("HTTP/1.1 431"), "{}", found[0]);
        assert!(found[1].starts_with("HTTP/1.1 400") && found[2].starts_with("HTTP/1.1 400"));
    }
}
