//! Shows a rendering in progress in the image viewer tev (or HDRView).
//!
//! The protocol (tev's README): TCP, little-endian packets `[u32 length, itself included][u8 operation][payload]`;
//! create the image once, then update tiles. Sending runs on a thread of its own, so that a slow viewer does not hold up
//! the rendering; a viewer that is not there, or leaves, is a warning.

use crate::message;
use render::Image;
use std::io::Write;
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

const CREATE_IMAGE: u8 = 4;
/// Interleaved channels with offsets and strides.
const UPDATE_IMAGE_V3: u8 = 6;
const CHANNELS: [&str; 3] = ["R", "G", "B"];
/// Side of a tile in pixels.
const TILE: u32 = 256;
/// Least time between two updates.
const INTERVAL: Duration = Duration::from_millis(500);
/// How long to wait for the viewer.
const PATIENCE: Duration = Duration::from_secs(3);

/// A connection to the viewer.
pub(crate) struct Display {
    sender: Option<SyncSender<Image>>,
    thread: Option<JoinHandle<()>>,
    last: Option<Instant>,
}

impl Display {
    /// Connects to `HOST:PORT` and creates the image there; on failure warns and shows nothing.
    pub(crate) fn connect(address: &str, title: &str, width: u32, height: u32) -> Self {
        let stream = open(address).and_then(|mut stream| {
            stream.write_all(&create_packet(title, width, height))?;
            Ok(stream)
        });
        let stream = match stream {
            Ok(stream) => stream,
            Err(error) => {
                message::warn(format!("no display server at {address}: {error}; rendering without"));
                return Self {
                    sender: None,
                    thread: None,
                    last: None,
                };
            }
        };
        let (sender, images) = sync_channel(1);
        let title = title.to_string();
        let thread = std::thread::spawn(move || send_all(stream, &title, &images));
        Self {
            sender: Some(sender),
            thread: Some(thread),
            last: None,
        }
    }

    /// Shows an image if the last one was long enough ago and has been sent.
    pub(crate) fn update(&mut self, image: impl FnOnce() -> Image) {
        let due = self.last.is_none_or(|last| last.elapsed() >= INTERVAL);
        if let (true, Some(sender)) = (due, &self.sender) {
            // A full channel means a slow viewer: it gets a later image.
            let _ = sender.try_send(image());
            self.last = Some(Instant::now());
        }
    }

    /// Shows the last image, and waits until it has been sent.
    pub(crate) fn finish(&mut self, image: &Image) {
        if let Some(sender) = self.sender.take() {
            // An error means that the viewer has gone, which has been told.
            let _ = sender.send(image.clone());
        }
        if let Some(thread) = self.thread.take() {
            // The thread does not panic; there is nothing to tell if it did.
            let _ = thread.join();
        }
    }
}

fn open(address: &str) -> std::io::Result<TcpStream> {
    let mut last = std::io::Error::other("no such host");
    for address in address.to_socket_addrs()? {
        match TcpStream::connect_timeout(&address, PATIENCE) {
            Ok(stream) => {
                stream.set_write_timeout(Some(PATIENCE))?;
                stream.set_nodelay(true)?;
                return Ok(stream);
            }
            Err(error) => last = error,
        }
    }
    Err(last)
}

fn send_all(mut stream: TcpStream, title: &str, images: &Receiver<Image>) {
    for image in images {
        for (x, y) in corners(&image) {
            if let Err(error) = stream.write_all(&tile_packet(title, &image, x, y)) {
                message::warn(format!("the display server has gone: {error}; rendering goes on"));
                return;
            }
        }
    }
}

/// The bytes of a packet in the making; the first four will be its length.
struct Packet(Vec<u8>);

impl Packet {
    fn new(operation: u8, title: &str) -> Self {
        const DO_NOT_GRAB_FOCUS: u8 = 0;
        let mut packet = Self(vec![0, 0, 0, 0, operation, DO_NOT_GRAB_FOCUS]);
        packet.text(title);
        packet
    }

    fn text(&mut self, text: &str) {
        self.0.extend(text.bytes().filter(|byte| *byte != 0));
        self.0.push(0);
    }

    fn u32s(&mut self, values: &[u32]) {
        self.0.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    }

    fn u64s(&mut self, values: &[u64]) {
        self.0.extend(values.iter().flat_map(|value| value.to_le_bytes()));
    }

    fn finish(mut self) -> Vec<u8> {
        let length = u32::try_from(self.0.len()).expect("a tile is far below 4 GiB");
        self.0[..4].copy_from_slice(&length.to_le_bytes());
        self.0
    }
}

/// The packets that create an image of this title and show its pixels, each with its length ahead.
pub(crate) fn packets(title: &str, image: &Image) -> Vec<Vec<u8>> {
    let mut packets = vec![create_packet(title, image.width, image.height)];
    packets.extend(corners(image).map(|(x, y)| tile_packet(title, image, x, y)));
    packets
}

/// Left column and top row of each tile.
fn corners(image: &Image) -> impl Iterator<Item = (u32, u32)> + use<> {
    let (width, height) = (image.width, image.height);
    let rows = (0..height).step_by(TILE as usize);
    rows.flat_map(move |y| (0..width).step_by(TILE as usize).map(move |x| (x, y)))
}

fn create_packet(title: &str, width: u32, height: u32) -> Vec<u8> {
    let mut packet = Packet::new(CREATE_IMAGE, title);
    packet.u32s(&[width, height, CHANNELS.len() as u32]);
    CHANNELS.iter().for_each(|channel| packet.text(channel));
    packet.finish()
}

fn tile_packet(title: &str, image: &Image, x: u32, y: u32) -> Vec<u8> {
    let (width, height) = (TILE.min(image.width - x), TILE.min(image.height - y));
    let mut packet = Packet::new(UPDATE_IMAGE_V3, title);
    packet.u32s(&[CHANNELS.len() as u32]);
    CHANNELS.iter().for_each(|channel| packet.text(channel));
    packet.u32s(&[x, y, width, height]);
    packet.u64s(&[0, 1, 2]); // offset of each channel, in floats
    packet.u64s(&[3, 3, 3]); // stride of each channel, in floats
    for row in y..y + height {
        let start = row as usize * image.width as usize + x as usize;
        let pixels = &image.pixels[start..start + width as usize];
        packet
            .0
            .extend(pixels.iter().flatten().flat_map(|value| value.to_le_bytes()));
    }
    packet.finish()
}

#[cfg(test)]
mod tests {
    use super::{Display, Image};
    use std::io::Read;
    use std::net::TcpListener;

    /// A viewer that takes every byte, cut into packets by their lengths.
    fn packets(bytes: &[u8]) -> Vec<&[u8]> {
        let mut rest = bytes;
        let mut found = Vec::new();
        while !rest.is_empty() {
            let length = u32::from_le_bytes([rest[0], rest[1], rest[2], rest[3]]) as usize;
            let (packet, after) = rest.split_at(length);
            found.push(packet);
            rest = after;
        }
        found
    }

    #[test]
    fn a_viewer_gets_the_image_created_and_then_every_pixel() {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a free port");
        let address = listener.local_addr().expect("bound").to_string();
        let viewer = std::thread::spawn(move || {
            let mut bytes = Vec::new();
            listener
                .accept()
                .expect("a client")
                .0
                .read_to_end(&mut bytes)
                .expect("bytes");
            bytes
        });
        let pixels = (0..300 * 2).map(|i| [i as f32, 0.5, -1.0]).collect();
        let image = Image {
            width: 300,
            height: 2,
            pixels,
        };
        let mut display = Display::connect(&address, "test", 300, 2);
        display.finish(&image);
        let bytes = viewer.join().expect("no panic");

        let packets = packets(&bytes);
        assert_eq!(packets.len(), 3, "create, and two tiles");
        assert_eq!(packets[0][4], 4);
        assert_eq!(&packets[0][6..11], b"test\0");
        let header = 4 + 2 + 5 + 4 + 6 + 16 + 48;
        for (packet, x, width) in [(packets[1], 0u32, 256u32), (packets[2], 256, 44)] {
            assert_eq!(packet[4], 6);
            assert_eq!(&packet[21..25], &x.to_le_bytes());
            assert_eq!(packet.len(), header + width as usize * 2 * 3 * 4);
            assert_eq!(&packet[header..header + 4], &(x as f32).to_le_bytes());
        }
    }

    #[test]
    fn no_viewer_is_no_error() {
        let mut display = Display::connect("127.0.0.1:1", "test", 1, 1);
        let image = Image {
            width: 1,
            height: 1,
            pixels: vec![[0.0; 3]],
        };
        display.update(|| image.clone());
        display.finish(&image);
    }
}
