//! The connections that are open: how many there are, and which one ends for a new one.
//!
//! | a new connection finds | ends |
//! |---|---|
//! | [`OF_AN_ADDRESS`] of its own address | the one of them that has waited longest for a request, else the oldest of them |
//! | [`CLIENTS`] in all | the one that has waited longest for a request; where all are being answered, the new one is refused |
//!
//! So a client that opens connections without end, or sends a byte now and then, takes connections only from itself.

use std::net::{IpAddr, Shutdown, TcpStream};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// Most connections at a time; a browser opens up to six.
pub const CLIENTS: usize = 24;
/// Most connections of one address: two browsers and what they leave behind.
pub const OF_AN_ADDRESS: usize = 16;

/// A connection that is served.
struct Connection {
    stream: Arc<TcpStream>,
    address: IpAddr,
    /// Since when a request is waited for; `None` while one is answered.
    waits_since: Option<Instant>,
}

/// How a new connection was taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Taken {
    /// There was room.
    Free,
    /// Another one has ended for it.
    Instead,
    /// It is refused.
    Refused,
}

/// All connections that are served, in the order of their arrival.
#[derive(Default)]
pub struct Connections(Mutex<Vec<Connection>>);

impl Connections {
    fn lock(&self) -> MutexGuard<'_, Vec<Connection>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes a connection of an address.
    pub fn take(&self, stream: &Arc<TcpStream>, address: IpAddr) -> Taken {
        let mut connections = self.lock();
        let own = connections.iter().filter(|connection| connection.address == address).count();
        let taken = if own >= OF_AN_ADDRESS {
            let oldest = connections.iter().position(|connection| connection.address == address);
            let longest = longest(&connections, Some(address)).or(oldest);
            end(&mut connections, longest)
        } else if connections.len() >= CLIENTS {
            let longest = longest(&connections, None);
            end(&mut connections, longest)
        } else {
            Taken::Free
        };
        if taken != Taken::Refused {
            connections.push(Connection { stream: Arc::clone(stream), address, waits_since: Some(Instant::now()) });
        }
        taken
    }

    /// A request of the connection is waited for from now on, or is answered.
    pub fn waits(&self, stream: &Arc<TcpStream>, waits: bool) {
        if let Some(connection) = self.lock().iter_mut().find(|connection| Arc::ptr_eq(&connection.stream, stream)) {
            connection.waits_since = waits.then(Instant::now);
        }
    }

    /// Removes the connection, unless it was ended for another one.
    pub fn leave(&self, stream: &Arc<TcpStream>) {
        self.lock().retain(|connection| !Arc::ptr_eq(&connection.stream, stream));
    }

    /// Ends the connection that has waited longest for a request, if there is one.
    pub fn end_one(&self) {
        let mut connections = self.lock();
        let longest = longest(&connections, None);
        end(&mut connections, longest);
    }
}

/// The connection, of an address if one is given, that has waited longest for a request.
fn longest(connections: &[Connection], address: Option<IpAddr>) -> Option<usize> {
    let own = connections
        .iter()
        .enumerate()
        .filter(|(_, connection)| address.is_none_or(|address| connection.address == address));
    own.filter_map(|(k, connection)| Some((connection.waits_since?, k))).min().map(|(_, k)| k)
}

/// Ends a connection; what its thread waits for fails then.
fn end(connections: &mut Vec<Connection>, connection: Option<usize>) -> Taken {
    let Some(connection) = connection else { return Taken::Refused };
    // One that the other side has ended already is no error.
    let _ = connections.remove(connection).stream.shutdown(Shutdown::Both);
    Taken::Instead
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;
    use std::net::TcpListener;

    /// Connections to one listener, with their other ends.
    fn connections(count: usize) -> Vec<(Arc<TcpStream>, TcpStream)> {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let pair = |_| {
            let client = TcpStream::connect(address).unwrap();
            (Arc::new(listener.accept().unwrap().0), client)
        };
        (0..count).map(pair).collect()
    }

    /// Which of the connections have ended, seen from the other side.
    fn ended(connections: &mut [(Arc<TcpStream>, TcpStream)]) -> Vec<usize> {
        let is_at_end = |client: &mut TcpStream| {
            client.set_nonblocking(true).unwrap();
            matches!(client.read(&mut [0]), Ok(0))
        };
        (0..connections.len()).filter(|k| is_at_end(&mut connections[*k].1)).collect()
    }

    #[test]
    fn an_address_takes_connections_from_itself_alone() {
        let [own, other] = ["127.0.0.1", "10.0.0.7"].map(|text| text.parse::<IpAddr>().unwrap());
        let (connections, mut open) = (Connections::default(), connections(OF_AN_ADDRESS + 3));
        assert_eq!(connections.take(&open[0].0, other), Taken::Free);
        for (stream, _) in &open[1..=OF_AN_ADDRESS] {
            assert_eq!(connections.take(stream, own), Taken::Free);
        }
        // The first of the address is being answered, the second has waited longest.
        connections.waits(&open[1].0, false);
        assert_eq!(connections.take(&open[OF_AN_ADDRESS + 1].0, own), Taken::Instead);
        assert_eq!(ended(&mut open), [2]);
        // All are answered: the oldest ends, and not the other address's.
        open.iter().for_each(|(stream, _)| connections.waits(stream, false));
        assert_eq!(connections.take(&open[OF_AN_ADDRESS + 2].0, own), Taken::Instead);
        assert_eq!(ended(&mut open), [1, 2]);
    }

    #[test]
    fn there_are_so_many_connections_and_one_that_waits_is_ended() {
        let address = |k: usize| IpAddr::from([10, 0, 0, k as u8]);
        let (connections, mut open) = (Connections::default(), connections(CLIENTS + 2));
        for (k, (stream, _)) in open[..CLIENTS].iter().enumerate() {
            assert_eq!(connections.take(stream, address(k)), Taken::Free);
            connections.waits(stream, false);
        }
        assert_eq!(connections.take(&open[CLIENTS].0, address(CLIENTS)), Taken::Refused);
        connections.waits(&open[5].0, true);
        assert_eq!(connections.take(&open[CLIENTS].0, address(CLIENTS)), Taken::Instead);
        assert_eq!(ended(&mut open), [5]);
        // A connection that is left is free, once.
        connections.leave(&open[3].0);
        connections.leave(&open[5].0);
        assert_eq!(connections.take(&open[CLIENTS + 1].0, address(5)), Taken::Free);
        connections.end_one();
        assert_eq!(ended(&mut open).len(), 2);
    }
}
