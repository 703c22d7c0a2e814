//! Small libraries for every feature of the format.

use super::*;

fn read(text: &str) -> Library {
    parse(Path::new("m.mtl"), text.as_bytes()).unwrap()
}

fn material(text: &str) -> Material {
    read(&format!("newmtl m\n{text}")).entries[0].material()
}

#[test]
fn models_of_illumination() {
    let plain = material("Kd 0.5 0.25 1");
    assert_eq!((plain.diffuse, plain.scattering), (DVec3::new(0.5, 0.25, 1.0), Scattering::Matte));
    let coat = material("illum 2\nKs 0.5\nNs 30\nNi 1.3");
    assert_eq!(coat.scattering, Scattering::Plastic { ior: 1.3, roughness: 0.5 }, "alpha^2 is 2 / 32, alpha 1 / 4");
    assert_eq!(material("illum 1\nKs 1 1 1\nNs 9").scattering, Scattering::Matte);
    let mirror = material("illum 3\nKd 0.9\nKs 0.25 0.5 0");
    assert_eq!((mirror.mirror, mirror.diffuse), (DVec3::new(0.25, 0.5, 0.0), DVec3::new(0.75, 0.5, 0.9)));
    let glass = material("illum 7\nNi 1.52\nTf 0.9 1 0.9\nd 0.1");
    let tint = DVec3::new(0.9, 1.0, 0.9);
    assert_eq!(glass.scattering, Scattering::Dielectric { ior: 1.52, roughness: 0.0, tint });
    assert_eq!((glass.alpha, glass.opacity), (Alpha::Opaque, 1.0));
    let pbr = material("Pr 0.25\nPm 1\nillum 2\nKs 1");
    let expected = Scattering::MetallicRoughness { metallic: 1.0, roughness: 0.25, ior: 1.5, transmission: 0.0 };
    assert_eq!(pbr.scattering, expected);
    assert_eq!(material("Ke 4 2 1").emission, DVec3::new(4.0, 2.0, 1.0));
    for (text, opacity) in [("d 0.5", 0.5), ("Tr 0.25", 0.75), ("d 1\nTr 1", 1.0), ("d -halo 0.5", 0.5), ("d 7", 1.0)] {
        let m = material(text);
        assert_eq!((m.opacity, m.alpha == Alpha::Blend), (opacity, opacity < 1.0), "{text}");
    }
    assert_eq!(material("map_d a.png").alpha, Alpha::Blend);
    assert_eq!(material("Kd 0 0 0\nmap_Kd a.png").diffuse, DVec3::ONE);
    for (text, emission) in [("", 1.0), ("Ke 0 0 0\n", 1.0), ("Ke 2\n", 2.0)] {
        assert_eq!(material(&format!("{text}map_Ke a.png")).emission, DVec3::splat(emission), "{text}");
    }
}

#[test]
fn maps_have_options_and_names_with_blanks() {
    let library = read(
        "# head\nnewmtl a b #1\nMAP_KD -s 2 3 1 -o 0.5 -clamp on my picture.png\nbump -bm 0.3 -imfchan l h.png\n\
         norm -s 2 n.png\nmap_d 7.png\nmap_Ke -mm 0 1 -t 1 e.png # no comment\n\nnewmtl c\nmap_Ks s.png\nKa 1 1 1",
    );
    let map = |file: &str| Map { file: file.into(), scale: [1.0; 2], offset: [0.0; 2], clamp: false, multiplier: 1.0 };
    let first = &library.entries[0];
    assert_eq!((library.entries.len(), first.name.as_str(), library.ignored), (2, "a b #1", 4));
    let base = Map { scale: [2.0, 3.0], offset: [0.5, 0.0], clamp: true, ..map("my picture.png") };
    assert_eq!(first.base_map.as_deref(), Some(&base));
    assert_eq!(first.bump_map.as_deref(), Some(&Map { multiplier: 0.3, ..map("h.png") }));
    assert_eq!(first.normal_map.as_deref(), Some(&Map { scale: [2.0, 1.0], ..map("n.png") }));
    assert_eq!(first.opacity_map.as_deref(), Some(&map("7.png")));
    assert_eq!(first.emission_map.as_deref(), Some(&map("e.png # no comment")));
    assert_eq!(read(""), Library::default());
    let removed = read("newmtl a\nmap_Kd\nmap_Ke -s 1 1 \nKd 1\n");
    assert_eq!((removed.ignored, &removed.entries[0].base_map, &removed.entries[0].emission_map), (2, &None, &None));
    assert_eq!(removed.entries[0].diffuse, Some(DVec3::ONE));
}

#[test]
fn errors_say_where() {
    for (text, expected) in [
        ("\nKd 1 1 1", "m.mtl:2:1: expected `newmtl` and a name before `Kd`"),
        ("newmtl", "m.mtl:1:7: expected the material's name"),
        ("newmtl a\nKd 1 x 1", "m.mtl:2:6: expected a number, found `x`"),
        ("newmtl a\nKd 1 2", "m.mtl:2:7: expected one number or three, found 2"),
        ("newmtl a\nKd 1 2 3 4", "m.mtl:2:10: expected the end of the line: a colour has three numbers"),
        ("newmtl a\nNs inf", "m.mtl:2:4: expected a finite number, found `inf`"),
        ("newmtl a\nNs 1.#IND", "m.mtl:2:4: expected a finite number, found `1.#IND`"),
        ("newmtl a\nNi", "m.mtl:2:3: expected a number"),
        ("newmtl a\nmap_Kd -bm", "m.mtl:2:11: expected a number after `-bm`"),
    ] {
        let error = parse(Path::new("m.mtl"), text.as_bytes()).unwrap_err().to_string();
        assert_eq!(error.lines().next().unwrap(), expected, "{text}");
    }
}
