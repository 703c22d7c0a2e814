//! A writer of binary databases of version 5, from the published layout: it shares nothing with the reader.

use std::io::Write;

/// How a part of an object is packed.
#[derive(Clone, Copy, PartialEq)]
pub enum Packing {
    Plain,
    Zlib,
    Gzip,
    /// Says that it is bzip2 and is not.
    Bzip2,
}

/// A database in the making.
pub struct Writer {
    pub bytes: Vec<u8>,
    /// Codes of the widths of all lengths: of objects, names, attributes, bodies, combinations.
    pub widths: [u8; 5],
    pub attributes: Packing,
    pub body: Packing,
}

impl Default for Writer {
    fn default() -> Self {
        let bytes = vec![0x76, 1, 0, 0, 0, 0, 1, 0x35];
        Self { bytes, widths: [1, 0, 1, 2, 1], attributes: Packing::Plain, body: Packing::Plain }
    }
}

fn number(out: &mut Vec<u8>, value: i64, width: u8) {
    out.extend_from_slice(&value.to_be_bytes()[8 - (1 << width)..]);
}

pub fn doubles(values: &[f64]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_be_bytes()).collect()
}

fn pack(bytes: &[u8], packing: Packing) -> Vec<u8> {
    let level = flate2::Compression::default();
    match packing {
        Packing::Zlib => {
            let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), level);
            encoder.write_all(bytes).unwrap();
            encoder.finish().unwrap()
        }
        Packing::Gzip => {
            let mut encoder = flate2::write::GzEncoder::new(Vec::new(), level);
            encoder.write_all(bytes).unwrap();
            encoder.finish().unwrap()
        }
        _ => bytes.to_vec(),
    }
}

impl Writer {
    /// Any object; `storage` is 0 for objects, 1 for headers, 2 for free space. Gives its place.
    pub fn object(
        &mut self,
        storage: u8,
        [major, minor]: [u8; 2],
        name: &str,
        attributes: &[(&str, &str)],
        body: &[u8],
    ) -> usize {
        let code = |packing| match packing {
            Packing::Plain => 0,
            Packing::Zlib | Packing::Gzip => 1,
            Packing::Bzip2 => 2,
        };
        let [object, of_name, of_attributes, of_body, _] = self.widths;
        let mut list: Vec<u8> = attributes.iter().flat_map(|(k, v)| format!("{k}\0{v}\0").into_bytes()).collect();
        list.push(0);
        let mut inside = Vec::new();
        let (mut flags, mut attribute_flags, mut body_flags) = (storage | object << 6, 0, 0);
        if !name.is_empty() {
            flags |= 0x20 | of_name << 3;
            number(&mut inside, name.len() as i64 + 1, of_name);
            inside.extend(name.bytes().chain([0]));
        }
        for (part, any, packing, width, flags) in [
            (&list[..], !attributes.is_empty(), self.attributes, of_attributes, &mut attribute_flags),
            (body, !body.is_empty(), self.body, of_body, &mut body_flags),
        ] {
            if any {
                *flags = 0x20 | width << 6 | code(packing);
                let part = pack(part, packing);
                number(&mut inside, part.len() as i64, width);
                inside.extend(part);
            }
        }
        let head = 6 + (1 << object);
        while (head + inside.len() + 1) % 8 != 0 {
            inside.push(0);
        }
        let start = self.bytes.len();
        self.bytes.extend([0x76, flags, attribute_flags, body_flags, major, minor]);
        number(&mut self.bytes, ((head + inside.len() + 1) / 8) as i64, object);
        self.bytes.extend(inside);
        self.bytes.push(0x35);
        start
    }

    pub fn solid(&mut self, minor: u8, name: &str, body: &[u8]) -> usize {
        self.object(0, [1, minor], name, &[], body)
    }

    /// A combination; operators are 1 for the next member, 2 union, 3 intersection, 4 difference, 5 exclusive or.
    pub fn combination(
        &mut self,
        name: &str,
        attributes: &[(&str, &str)],
        members: &[(&str, Option<[f64; 16]>)],
        operators: &[u8],
    ) -> usize {
        let width = self.widths[4];
        let (mut matrices, mut leaves, mut count) = (Vec::new(), Vec::new(), 0);
        for (name, matrix) in members {
            leaves.extend(name.bytes().chain([0]));
            let index = matrix.map_or(-1, |m| {
                matrices.extend(doubles(&m));
                count += 1;
                count - 1
            });
            number(&mut leaves, index, width);
        }
        let mut body = vec![width];
        for value in [count, members.len() as i64, leaves.len() as i64, operators.len() as i64, 9] {
            number(&mut body, value, width);
        }
        body.extend([matrices, leaves, operators.to_vec()].concat());
        self.object(0, [1, 31], name, attributes, &body)
    }

    /// Title, units and colours.
    pub fn global(&mut self, attributes: &[(&str, &str)]) {
        self.object(0, [2, 0], "_GLOBAL", attributes, &[]);
    }
}
