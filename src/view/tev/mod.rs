//! Pictures shown in tev, the viewer for HDR images (github.com/Tom94/tev), while they are made.

mod packet;

use std::io::{self, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::Mutex;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;
use std::time::Duration;

use crate::error::locked;
use crate::film::{Film, PlaneData, Window};
use crate::render::progressive::{Framebuffer, Viewer};
use packet::{create_image, update_image};

/// Where tev listens unless it is told otherwise.
pub const DEFAULT_ADDRESS: &str = "127.0.0.1:14158";

/// How long to wait for a viewer that does not answer, or does not read.
const PATIENCE: Duration = Duration::from_secs(3);
/// Packets that wait to be sent. What does not fit is sent when the picture is finished.
const WAITING: usize = 64;
/// More parts than this are sent as one.
const PARTS: usize = 256;

/// A connection to tev that shows one picture.
pub struct Tev {
    name: String,
    /// Names of the float planes, by number of the film's plane.
    channels: Vec<(usize, String)>,
    state: Mutex<State>,
}

struct State {
    /// To the thread that writes; `None` once it is to end.
    packets: Option<SyncSender<Vec<u8>>>,
    writer: Option<JoinHandle<io::Result<()>>>,
    /// Parts that tev has not been told of.
    missed: Vec<Window>,
}

impl Tev {
    /// Connects to the viewer at `address` (HOST:PORT) and creates an image called `name` for `film`.
    ///
    /// # Errors
    /// What the system says, if nobody listens there or the name of the host is unknown.
    pub fn connect(address: &str, name: &str, film: &Film) -> io::Result<Self> {
        let mut last = io::Error::new(io::ErrorKind::NotFound, "the host has no address");
        let stream = address
            .to_socket_addrs()?
            .find_map(|place| TcpStream::connect_timeout(&place, PATIENCE).map_err(|error| last = error).ok());
        let stream = stream.ok_or(last)?;
        stream.set_write_timeout(Some(PATIENCE))?;
        stream.set_nodelay(true)?;
        let planes = film.planes.iter().enumerate();
        let channels: Vec<(usize, String)> =
            planes.filter(|(_, p)| matches!(p.data, PlaneData::F32(_))).map(|(i, p)| (i, p.name.clone())).collect();
        let (sender, receiver) = sync_channel(WAITING);
        let writer = std::thread::spawn(move || write_all(stream, &receiver));
        let tev = Self {
            name: name.into(),
            channels,
            state: Mutex::new(State { packets: Some(sender), writer: Some(writer), missed: Vec::new() }),
        };
        let create = create_image(name, film.width, film.height, &tev.names());
        tev.send(create, Window::full(0, 0));
        Ok(tev)
    }

    fn names(&self) -> Vec<&str> {
        self.channels.iter().map(|(_, name)| name.as_str()).collect()
    }

    /// Hands a packet to the thread that writes, or remembers its part for later.
    fn send(&self, packet: Vec<u8>, part: Window) {
        let mut state = locked(&self.state);
        let Some(packets) = &state.packets else { return };
        match packets.try_send(packet) {
            Ok(()) => {}
            Err(TrySendError::Full(_)) if state.missed.len() < PARTS => state.missed.push(part),
            Err(TrySendError::Full(_)) => state.missed = vec![around(state.missed.iter().copied().chain([part]))],
            // The writer has met an error and says so at the end.
            Err(TrySendError::Disconnected(_)) => state.packets = None,
        }
    }

    fn update(&self, film: &Film, part: Window, shown: impl Fn(u32, u32) -> Option<usize>) -> Vec<u8> {
        let value = |channel: usize, x: u32, y: u32| match &film.planes[self.channels[channel].0].data {
            PlaneData::F32(plane) => shown(x, y).map_or(0.0, |index| plane[index]),
            PlaneData::U32(_) | PlaneData::U8(_) => 0.0,
        };
        update_image(&self.name, &self.names(), part, value)
    }

    /// Sends what tev has not seen of the finished picture and closes the connection.
    ///
    /// # Errors
    /// What the system says, if the viewer went away before it was told everything or does not read any more.
    pub fn finish(self, film: &Film) -> io::Result<()> {
        let (packets, writer, missed) = {
            let mut state = locked(&self.state);
            (state.packets.take(), state.writer.take(), std::mem::take(&mut state.missed))
        };
        if let Some(packets) = packets {
            for part in missed {
                // An error is the writer's to tell.
                let _gone = packets.send(self.update(film, part, |x, y| film.window.index(x, y)));
            }
        }
        let lost = || io::Error::other("the thread that writes was lost");
        writer.map_or(Ok(()), |writer| writer.join().map_err(|_| lost())?)
    }
}

impl Viewer for Tev {
    fn painted(&self, frame: &Framebuffer, part: Window) {
        self.send(self.update(frame.film(), part, |x, y| frame.shown(x, y)), part);
    }
}

/// Writes packets as they come, until there will be no more.
fn write_all(mut stream: TcpStream, packets: &Receiver<Vec<u8>>) -> io::Result<()> {
    packets.iter().try_for_each(|packet| stream.write_all(&packet))?;
    stream.flush()
}

/// The smallest window around all `parts`.
fn around(parts: impl Iterator<Item = Window>) -> Window {
    let start = Window { x0: u32::MAX, y0: u32::MAX, x1: 0, y1: 0 };
    parts.fold(start, |a, b| Window { x0: a.x0.min(b.x0), y0: a.y0.min(b.y0), x1: a.x1.max(b.x1), y1: a.y1.max(b.y1) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_grow_together() {
        let window = |x0, y0, x1, y1| Window { x0, y0, x1, y1 };
        assert_eq!(around([window(3, 4, 5, 6), window(1, 5, 2, 9)].into_iter()), window(1, 4, 5, 9));
    }
}
