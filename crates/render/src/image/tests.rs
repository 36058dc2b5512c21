//! Round trips and failures of image files.

use super::*;

fn gradient(width: u32, height: u32) -> Image {
    let pixel = |i: u32| [i as f32 * 0.25, 1e-6 * i as f32, 1e5 / (1.0 + i as f32)];
    Image {
        width,
        height,
        pixels: (0..width * height).map(pixel).collect(),
    }
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

fn read_parts(path: &Path) -> exr::image::FlatImage {
    exr::prelude::read_all_flat_layers_from_file(path).expect("a valid EXR")
}

#[test]
fn exr_gives_back_every_bit_and_its_metadata() {
    let folder = folder();
    let path = folder.path().join("a.exr");
    let image = gradient(33, 17);
    let mut channels = Channel::rgb("", &image).to_vec();
    channels.push(Channel {
        name: "depth.Z".into(),
        values: vec![f32::INFINITY; 33 * 17],
    });
    channels.extend(Channel::rgb("albedo", &gradient(33, 17)));
    let long = "{\"seed\": 7}".repeat(100);
    let metadata = [
        ("settings".to_string(), long.clone()),
        ("scene".to_string(), "naïve λ".to_string()),
    ];
    write_exr(&path, 33, 17, &channels, &metadata).expect("writable");

    assert_eq!(read_exr(&path).expect("readable"), image);
    let parts = read_parts(&path);
    let layer = &parts.layer_data[0];
    let names: Vec<String> = layer.channel_data.list.iter().map(|c| c.name.to_string()).collect();
    assert_eq!(names, ["B", "G", "R", "albedo.B", "albedo.G", "albedo.R", "depth.Z"]);
    assert!(
        layer
            .channel_data
            .list
            .iter()
            .all(|c| matches!(c.sample_data, FlatSamples::F32(_)))
    );
    assert_eq!(layer.encoding.line_order, LineOrder::Increasing);
    assert_eq!(layer.encoding.blocks, Blocks::ScanLines);
    assert_eq!(layer.encoding.compression, Compression::ZIP16);
    let attribute = |name: &str| match layer.attributes.other.get(&text(name)) {
        Some(AttributeValue::Text(value)) => value.to_string(),
        other => panic!("{name}: {other:?}"),
    };
    assert_eq!(attribute("settings"), long);
    assert_eq!(attribute("scene"), "naïve ?");
}

#[test]
fn exr_of_other_programs_half_and_grey_and_layers() {
    use exr::prelude::*;
    let folder = folder();
    let grey = folder.path().join("grey.exr");
    let half = FlatSamples::F16(vec![f16::from_f32(0.5); 6]);
    let channels = AnyChannels::sort(SmallVec::from_vec(vec![
        AnyChannel::new("Y", half.clone()),
        AnyChannel::new("id", FlatSamples::U32(vec![3; 6])),
    ]));
    Image::from_channels((3, 2), channels)
        .write()
        .non_parallel()
        .to_file(&grey)
        .expect("writable");
    let image = read_exr(&grey).expect("readable");
    assert_eq!((image.width, image.height, image.pixels), (3, 2, vec![[0.5; 3]; 6]));

    let depth_only = folder.path().join("depth.exr");
    let channels = AnyChannels::sort(SmallVec::from_vec(vec![AnyChannel::new("depth.Z", half)]));
    Image::from_channels((3, 2), channels)
        .write()
        .non_parallel()
        .to_file(&depth_only)
        .expect("writable");
    let message = read_exr(&depth_only).expect_err("no colour").to_string();
    assert!(
        message.contains("depth.exr") && message.contains("depth.Z"),
        "{message}"
    );
}

#[test]
fn unreadable_files_are_errors_that_name_them() {
    let folder = folder();
    let good = folder.path().join("good.exr");
    let image = gradient(40, 40);
    write_exr(&good, 40, 40, &Channel::rgb("", &image), &[]).expect("writable");
    let bytes = std::fs::read(&good).expect("readable");
    let path = folder.path().join("bad.exr");
    for end in [0, 3, 100, bytes.len() / 2] {
        std::fs::write(&path, &bytes[..end]).expect("writable");
        let message = read_exr(&path).expect_err("truncated").to_string();
        assert!(message.contains("bad.exr"), "{message}");
    }
    assert!(read_exr(&folder.path().join("none.exr")).is_err());
    assert!(read_exr(folder.path()).is_err());
}

/// The reader of EXR files allocates what the header claims: 200 TB ended the program.
#[test]
fn sizes_that_cannot_be_are_refused() {
    let folder = folder();
    let path = folder.path().join("vast.exr");
    write_exr(&path, 4, 4, &Channel::rgb("", &gradient(4, 4)), &[]).expect("writable");
    let mut bytes = std::fs::read(&path).expect("readable");
    let name = b"dataWindow\0box2i\0";
    let at = bytes
        .windows(name.len())
        .position(|window| window == name)
        .expect("required");
    // Its length and the lower corner come first.
    let upper = at + name.len() + 4 + 8;
    for (size, known) in [(3_i32, true), (30_000, false), (10_000_000, false)] {
        bytes[upper..upper + 4].copy_from_slice(&size.to_le_bytes());
        bytes[upper + 4..upper + 8].copy_from_slice(&size.to_le_bytes());
        std::fs::write(&path, &bytes).expect("writable");
        match read_exr(&path) {
            Ok(image) => assert!(known && image.width == 4),
            Err(error) => assert!(!known && error.to_string().contains("vast.exr"), "{error}"),
        }
    }
}

#[test]
fn a_failed_write_leaves_nothing_behind() {
    let folder = folder();
    let image = gradient(2, 2);
    let nowhere = folder.path().join("no/such/folder/a.exr");
    assert!(write_exr(&nowhere, 2, 2, &Channel::rgb("", &image), &[]).is_err());
    assert!(write_png(folder.path(), &image, 0.0).is_err(), "a folder is no file");
    let short = [Channel {
        name: "Y".into(),
        values: vec![0.0; 3],
    }];
    assert!(write_exr(&folder.path().join("a.exr"), 2, 2, &short, &[]).is_err());
    assert_eq!(std::fs::read_dir(folder.path()).expect("readable").count(), 0);
}

#[test]
fn writing_replaces_the_old_file() {
    let folder = folder();
    let path = folder.path().join("a.exr");
    for size in [8, 4] {
        write_exr(&path, size, size, &Channel::rgb("", &gradient(size, size)), &[]).expect("writable");
        assert_eq!(read_exr(&path).expect("readable").width, size);
    }
    assert_eq!(std::fs::read_dir(folder.path()).expect("readable").count(), 1);
}

#[test]
fn png_is_valid_and_exposed() {
    let folder = folder();
    let path = folder.path().join("a.png");
    let grey = Image {
        width: 5,
        height: 3,
        pixels: vec![[0.05; 3]; 15],
    };
    let mut last = 0;
    for exposure in [-2.0, 0.0, 2.0] {
        write_png(&path, &grey, exposure).expect("writable");
        let read = image::open(&path).expect("a valid PNG").to_rgb8();
        assert_eq!(read.dimensions(), (5, 3));
        assert!(read.get_pixel(4, 2)[0] > last);
        last = read.get_pixel(4, 2)[0];
    }
    let colors = Image {
        width: 1,
        height: 1,
        pixels: vec![[1.0, 0.0, 0.5]],
    };
    write_png_as_is(&path, &colors).expect("writable");
    assert_eq!(
        image::open(&path).expect("a valid PNG").to_rgb8().get_pixel(0, 0).0,
        [255, 0, 188]
    );
}

#[test]
fn automatic_exposure_follows_the_scale_and_resists_outliers() {
    let scaled = |s: f32| {
        let pixels = (1..=1000).map(|i| [s * i as f32 / 1000.0; 3]).collect();
        Image {
            width: 1000,
            height: 1,
            pixels,
        }
    };
    let base = auto_exposure(&scaled(1.0));
    assert!((auto_exposure(&scaled(8.0)) - (base - 3.0)).abs() < 1e-3);
    let mut odd = scaled(1.0);
    odd.pixels[0] = [1e30; 3];
    odd.pixels[1] = [f32::NAN; 3];
    odd.pixels[2] = [0.0; 3];
    odd.pixels[3] = [f32::INFINITY; 3];
    assert!((auto_exposure(&odd) - base).abs() < 0.1);
    let black = Image {
        width: 2,
        height: 1,
        pixels: vec![[0.0; 3]; 2],
    };
    assert_eq!(auto_exposure(&black), 0.0);
}
