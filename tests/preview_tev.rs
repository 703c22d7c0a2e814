//! `render --preview tev` against a server that takes the protocol apart byte by byte and puts the picture together.
//!
//! The reader here is written from the protocol's description (github.com/Tom94/tev), not with the writer's code.

mod binary;

use std::collections::HashMap;
use std::io::Read;
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::thread::JoinHandle;

use binary::{Ended, lanecast};
use lanecast::film::{Film, exr};

/// A picture that was sent.
#[derive(Default)]
struct Image {
    name: String,
    width: usize,
    height: usize,
    channels: HashMap<String, Vec<f32>>,
    updates: usize,
    /// Red of the first update's pixels, to see that blocks came first.
    first: Vec<f32>,
}

/// Bytes of one packet not yet read.
struct Packet<'a>(&'a [u8]);

impl Packet<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let (head, rest) = self.0.split_first_chunk().expect("enough bytes");
        self.0 = rest;
        *head
    }
    fn flag(&mut self) -> bool {
        match self.take::<1>() {
            [byte @ 0..=1] => byte == 1,
            [byte] => panic!("a flag of {byte}"),
        }
    }
    fn text(&mut self) -> String {
        let end = self.0.iter().position(|&b| b == 0).expect("a text's end");
        let text = String::from_utf8(self.0[..end].to_vec()).expect("UTF-8");
        self.0 = &self.0[end + 1..];
        text
    }
    fn int(&mut self) -> usize {
        usize::try_from(i32::from_le_bytes(self.take())).expect("not negative")
    }
    fn long(&mut self) -> usize {
        usize::try_from(i64::from_le_bytes(self.take())).expect("not negative")
    }
}

impl Image {
    fn create(&mut self, mut p: Packet<'_>) {
        assert!(self.name.is_empty(), "created once");
        assert!(p.flag(), "a new picture comes to the front");
        self.name = p.text();
        (self.width, self.height) = (p.int(), p.int());
        for _ in 0..p.int() {
            self.channels.insert(p.text(), vec![f32::NAN; self.width * self.height]);
        }
        assert!(p.0.is_empty(), "nothing after the channels");
    }

    fn update(&mut self, mut p: Packet<'_>) {
        assert!(!p.flag(), "updates do not steal the focus");
        assert_eq!(p.text(), self.name);
        let names: Vec<String> = (0..p.int()).map(|_| p.text()).collect();
        let (x0, y0, width, height) = (p.int(), p.int(), p.int(), p.int());
        assert!(width > 0 && height > 0 && x0 + width <= self.width && y0 + height <= self.height);
        let offsets: Vec<usize> = names.iter().map(|_| p.long()).collect();
        let strides: Vec<usize> = names.iter().map(|_| p.long()).collect();
        let data: Vec<f32> = p.0.chunks(4).map(|b| f32::from_le_bytes(b.try_into().expect("whole floats"))).collect();
        let last = offsets.iter().zip(&strides).map(|(o, s)| o + (width * height - 1) * s + 1).max();
        assert_eq!(Some(data.len()), last, "as many values as offsets and strides reach");
        for ((name, offset), stride) in names.iter().zip(offsets).zip(strides) {
            let plane = self.channels.get_mut(name).expect("a channel that was created");
            for i in 0..width * height {
                plane[(y0 + i / width) * self.width + x0 + i % width] = data[offset + i * stride];
            }
        }
        if self.updates == 0 {
            self.first = data[..width * height].to_vec();
        }
        self.updates += 1;
    }
}

/// Reads all packets of one connection.
fn serve(mut stream: TcpStream) -> Image {
    let mut bytes = Vec::new();
    stream.read_to_end(&mut bytes).expect("the whole conversation");
    let (mut image, mut rest) = (Image::default(), &bytes[..]);
    while !rest.is_empty() {
        let length = u32::from_le_bytes(rest[..4].try_into().expect("a length")) as usize;
        assert!(length > 5 && length <= rest.len(), "a packet of {length} bytes, {} are left", rest.len());
        let packet = Packet(&rest[5..length]);
        match rest[4] {
            4 => image.create(packet),
            6 => image.update(packet),
            kind => panic!("a packet of kind {kind}"),
        }
        rest = &rest[length..];
    }
    image
}

fn server() -> (String, JoinHandle<Image>) {
    let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = listener.local_addr().expect("an address").to_string();
    (address, std::thread::spawn(move || serve(listener.accept().expect("a connection").0)))
}

fn render(dir: &Path, line: &str) -> Ended {
    let ended = lanecast(dir, &line.split(' ').collect::<Vec<_>>());
    assert_eq!(ended.code, Some(0), "{line}: {}", ended.err);
    assert!(!ended.err.contains("panicked"), "{}", ended.err);
    ended
}

fn check(image: &Image, film: &Film) {
    assert_eq!((image.width, image.height), (film.width as usize, film.height as usize));
    let float_planes = film.planes.iter().filter(|p| film.f32_plane(&p.name).is_some()).count();
    assert_eq!(image.channels.len(), float_planes);
    for (name, sent) in &image.channels {
        let plane = film.f32_plane(name).expect("the same channels");
        for y in film.window.y0..film.window.y1 {
            for x in film.window.x0..film.window.x1 {
                let (got, want) =
                    (sent[y as usize * image.width + x as usize], plane[film.window.index(x, y).unwrap()]);
                assert_eq!(got.to_bits(), want.to_bits(), "{name} at {x},{y}");
            }
        }
    }
}

#[test]
fn the_picture_that_was_sent_is_the_file() {
    let dir = tempfile::tempdir().unwrap();
    for (more, blocks) in
        [("--spp 1", true), ("--spp 3 --aov all --engine scalar", false), ("--crop 33,7,120,80 --threads 1", true)]
    {
        let (address, server) = server();
        render(dir.path(), &format!("render builtin:gallery -o out.exr --size 150x90 --preview tev:{address} {more}"));
        let image = server.join().expect("a server that is content");
        assert_eq!(image.name, "out.exr");
        check(&image, &exr::read(&dir.path().join("out.exr")).unwrap());
        // Costs are counted by neighbours: with them there are no coarse blocks.
        let steps = if blocks { 5 } else { 15 };
        assert!(image.updates >= steps, "{more}: {} updates", image.updates);
        let row = &image.first[..16];
        assert_eq!(blocks, row.iter().all(|v| v.to_bits() == row[0].to_bits()), "{more}: {row:?}");
    }
}

/// The picture shown is the one made without a preview by the exact engine.
#[test]
fn a_preview_changes_no_bit() {
    let dir = tempfile::tempdir().unwrap();
    let (address, server) = server();
    let common = "render builtin:sphere-flake --size 97x61 --spp 2";
    render(dir.path(), &format!("{common} -o seen.exr --preview tev:{address}"));
    server.join().expect("a server that is content");
    render(dir.path(), &format!("{common} -o plain.exr --exact"));
    let [seen, plain] = ["seen.exr", "plain.exr"].map(|name| exr::read(&dir.path().join(name)).unwrap());
    assert_eq!(seen, plain);
}

#[test]
fn without_a_viewer_the_render_goes_on_and_says_so() {
    let dir = tempfile::tempdir().unwrap();
    // A port that was free a moment ago, and a host that no resolver knows.
    let free = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    for address in [free.to_string(), "no.such.host.invalid:1".into()] {
        let line = format!("render builtin:die -o out.png --size 20x20 --preview tev:{address}");
        let ended = render(dir.path(), &line);
        assert!(ended.err.contains(&format!("no tev at {address}")) && ended.err.contains("going on"), "{}", ended.err);
        std::fs::remove_file(dir.path().join("out.png")).expect("the picture");
    }
}

/// A viewer that hangs up in the middle is a line on stderr.
#[test]
fn a_viewer_that_goes_away_is_told() {
    let dir = tempfile::tempdir().unwrap();
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    let gone = std::thread::spawn(move || {
        let mut stream = listener.accept().unwrap().0;
        stream.read_exact(&mut [0; 8]).unwrap();
    });
    let line = format!("render builtin:die -o out.png --size 600x600 --preview tev:{address}");
    let ended = render(dir.path(), &line);
    gone.join().unwrap();
    assert!(ended.err.contains("was lost"), "{}", ended.err);
    assert!(dir.path().join("out.png").exists());
}
