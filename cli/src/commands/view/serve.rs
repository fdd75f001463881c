//! The server of the page and the ranks that answer its queries.
//!
//! ```text
//! page ─► connection thread ─► queue ─► rank 0 ─► all ranks: the query   (a collective loop)
//! page ◄─ connection thread ◄────────── rank 0 ◄─ all ranks: their tets
//! ```
//! Threads of the server never communicate with other ranks. Between two queries all ranks sleep.

use super::query::Query;
use super::shown::Shown;
use crate::cancel;
use crate::failure::{Failure, Status, agree};
use std::io;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use tetmill::comm::Communicator;
use tetmill_view::Server;

/// A query, and where its answer goes.
type Asked = (String, Sender<Result<Vec<u8>, String>>);

/// **Collective.** Serves a mesh until Ctrl-C.
pub fn serve(comm: &dyn Communicator, shown: &Shown, port: Option<u16>) -> Result<(), Failure> {
    let server = if comm.rank() == 0 { started(shown, port).map(Some) } else { Ok(None) };
    let server = agree(comm, server)?;
    let (ask, asked) = channel::<Asked>();
    let ended = &AtomicBool::new(false);
    let stop = || ended.load(Ordering::Acquire) || cancel::is_cancelled();
    std::thread::scope(|scope| {
        let serving = server.map(|server| {
            let ask = Mutex::new(ask);
            scope.spawn(move || {
                let done = server.run(&|query: &str| forward(&ask, query), stop);
                ended.store(true, Ordering::Release);
                done.map_err(|error| failed(port, error))
            })
        });
        let answered = answer_all(comm, shown, &asked, &stop);
        ended.store(true, Ordering::Release);
        // Connections that wait for an answer end.
        drop(asked);
        let served = serving.map_or(Ok(()), |thread| thread.join().expect("the server does not panic"));
        answered.and(agree(comm, served))
    })
}

fn failed(port: Option<u16>, error: io::Error) -> Failure {
    match port {
        Some(port) => Failure::input(format!("cannot serve on port {port}: {error}; choose another --port")),
        None => Failure::new(Status::Resources, format!("cannot serve the page: {error}")),
    }
}

/// Starts the server and tells the user where the page is.
fn started(shown: &Shown, port: Option<u16>) -> Result<Server, Failure> {
    let server = Server::new(port, &shown.index()).map_err(|error| failed(port, error))?;
    let address = server.address().map_err(|error| failed(port, error))?;
    let opened = port.is_none() && tetmill_view::open(&address);
    let advice = if opened { "" } else { "; open this address in a browser" };
    eprintln!("viewing at {address} until Ctrl-C{advice}");
    Ok(server)
}

/// Passes a query to rank 0 and waits for its answer.
fn forward(ask: &Mutex<Sender<Asked>>, query: &str) -> Result<Vec<u8>, String> {
    let (reply, replied) = channel();
    const ENDS: &str = "tetmill has ended";
    let sent = match ask.lock() {
        Ok(ask) => ask.send((query.to_owned(), reply)).is_ok(),
        Err(_) => false,
    };
    if sent { replied.recv().unwrap_or(Err(ENDS.into())) } else { Err(ENDS.into()) }
}

/// **Collective.** Answers queries until `stop` returns true on rank 0.
fn answer_all(
    comm: &dyn Communicator,
    shown: &Shown,
    asked: &Receiver<Asked>,
    stop: &dyn Fn() -> bool,
) -> Result<(), Failure> {
    loop {
        let mut next = None;
        comm.rest(&mut || {
            next = asked.try_recv().ok();
            next.is_some() || stop()
        })?;
        // Ranks without a query end: a query is not empty.
        let mut query = next.as_ref().map_or_else(Vec::new, |(query, _)| query.clone().into_bytes());
        comm.broadcast_bytes(0, &mut query)?;
        if query.is_empty() {
            return Ok(());
        }
        let query = Query::parse(&String::from_utf8_lossy(&query));
        let answer = match query {
            Some(query) => shown.answer(comm, &query),
            None => Err(Failure::input("no such query")),
        };
        match answer {
            // The other ranks cannot answer any more.
            Err(failure) if failure.status == Status::Rank => return Err(failure),
            answer => {
                if let Some((_, reply)) = next {
                    // The client may be gone.
                    let _ = reply.send(answer.map_err(|failure| failure.message));
                }
            }
        }
    }
}
