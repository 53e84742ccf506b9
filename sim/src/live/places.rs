//! The connections that are open: how many there are, and which one ends for a new one.
//!
//! | a new connection finds | ends |
//! |---|---|
//! | [`OF_AN_ADDRESS`] of its own address | the one of them that has waited longest for a request, else the oldest of them |
//! | [`CLIENTS`] in all | the one that has waited longest for a request; where all are being answered, the new one is refused |
//!
//! So a client that opens connections without end, or sends a byte now and then, takes places only from itself.

use std::net::{IpAddr, Shutdown, TcpStream};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// Most connections at a time; a browser opens up to six.
pub const CLIENTS: usize = 24;
/// Most connections of one address: two browsers and what they leave behind.
pub const OF_AN_ADDRESS: usize = 16;

/// A connection that is served.
struct Place {
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
pub struct Places(Mutex<Vec<Place>>);

impl Places {
    fn lock(&self) -> MutexGuard<'_, Vec<Place>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes a place for a connection of an address.
    pub fn take(&self, stream: &Arc<TcpStream>, address: IpAddr) -> Taken {
        let mut places = self.lock();
        let own = places.iter().filter(|place| place.address == address).count();
        let taken = if own >= OF_AN_ADDRESS {
            let oldest = places.iter().position(|place| place.address == address);
            let longest = longest(&places, Some(address)).or(oldest);
            end(&mut places, longest)
        } else if places.len() >= CLIENTS {
            let longest = longest(&places, None);
            end(&mut places, longest)
        } else {
            Taken::Free
        };
        if taken != Taken::Refused {
            places.push(Place { stream: Arc::clone(stream), address, waits_since: Some(Instant::now()) });
        }
        taken
    }

    /// A request of the connection is waited for from now on, or is answered.
    pub fn waits(&self, stream: &Arc<TcpStream>, waits: bool) {
        if let Some(place) = self.lock().iter_mut().find(|place| Arc::ptr_eq(&place.stream, stream)) {
            place.waits_since = waits.then(Instant::now);
        }
    }

    /// Gives up the connection's place, unless another one has it.
    pub fn leave(&self, stream: &Arc<TcpStream>) {
        self.lock().retain(|place| !Arc::ptr_eq(&place.stream, stream));
    }

    /// Ends the connection that has waited longest for a request, if there is one.
    pub fn end_one(&self) {
        let mut places = self.lock();
        let longest = longest(&places, None);
        end(&mut places, longest);
    }
}

/// The place, of an address if one is given, that has waited longest for a request.
fn longest(places: &[Place], address: Option<IpAddr>) -> Option<usize> {
    let own = places.iter().enumerate().filter(|(_, place)| address.is_none_or(|address| place.address == address));
    own.filter_map(|(k, place)| Some((place.waits_since?, k))).min().map(|(_, k)| k)
}

/// Ends the connection of a place; what its thread waits for fails then.
fn end(places: &mut Vec<Place>, place: Option<usize>) -> Taken {
    let Some(place) = place else { return Taken::Refused };
    // One that the other side has ended already is no error.
    let _ = places.remove(place).stream.shutdown(Shutdown::Both);
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
    fn an_address_takes_places_from_itself_alone() {
        let [own, other] = ["127.0.0.1", "10.0.0.7"].map(|text| text.parse::<IpAddr>().unwrap());
        let (places, mut open) = (Places::default(), connections(OF_AN_ADDRESS + 3));
        assert_eq!(places.take(&open[0].0, other), Taken::Free);
        for (stream, _) in &open[1..=OF_AN_ADDRESS] {
            assert_eq!(places.take(stream, own), Taken::Free);
        }
        // The first of the address is being answered, the second has waited longest.
        places.waits(&open[1].0, false);
        assert_eq!(places.take(&open[OF_AN_ADDRESS + 1].0, own), Taken::Instead);
        assert_eq!(ended(&mut open), [2]);
        // All are answered: the oldest ends, and not the other address's.
        open.iter().for_each(|(stream, _)| places.waits(stream, false));
        assert_eq!(places.take(&open[OF_AN_ADDRESS + 2].0, own), Taken::Instead);
        assert_eq!(ended(&mut open), [1, 2]);
    }

    #[test]
    fn there_are_so_many_places_and_who_waits_gives_one_up() {
        let address = |k: usize| IpAddr::from([10, 0, 0, k as u8]);
        let (places, mut open) = (Places::default(), connections(CLIENTS + 2));
        for (k, (stream, _)) in open[..CLIENTS].iter().enumerate() {
            assert_eq!(places.take(stream, address(k)), Taken::Free);
            places.waits(stream, false);
        }
        assert_eq!(places.take(&open[CLIENTS].0, address(CLIENTS)), Taken::Refused);
        places.waits(&open[5].0, true);
        assert_eq!(places.take(&open[CLIENTS].0, address(CLIENTS)), Taken::Instead);
        assert_eq!(ended(&mut open), [5]);
        // A place that is left is free, once.
        places.leave(&open[3].0);
        places.leave(&open[5].0);
        assert_eq!(places.take(&open[CLIENTS + 1].0, address(5)), Taken::Free);
        places.end_one();
        assert_eq!(ended(&mut open).len(), 2);
    }
}
