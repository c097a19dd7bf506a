//! Small pictures of files and folders that were opened before.

use std::collections::{HashMap, HashSet, VecDeque};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::UNIX_EPOCH;

use hzn_run::source;
use image::RgbImage;
use image::imageops::{self, FilterType};

use super::Wake;

/// Width and height of a small picture in pixels. It is drawn at half of this size, so that it is sharp on a screen of
/// scale 2.
pub const SIZE: (u32, u32) = (192, 108);
/// Largest number of small pictures that are kept on the disk.
const MOST: usize = 40;

/// What is known of a small picture.
#[derive(Debug, Clone)]
pub enum Thumbnail {
    /// It is being made.
    Awaited,
    /// The file cannot be read, or it has no picture.
    Missing,
    /// The picture.
    Ready(Arc<RgbImage>),
}

#[derive(Default)]
struct Shared {
    made: HashMap<PathBuf, Option<Arc<RgbImage>>>,
    waiting: VecDeque<PathBuf>,
    is_running: bool,
}

/// The small pictures. A thread makes them, one after the other.
#[derive(Default)]
pub struct Thumbnails {
    asked: HashSet<PathBuf>,
    shared: Arc<Mutex<Shared>>,
}

impl Thumbnails {
    /// Returns the small picture of a file or a folder. `kept` is the folder in which small pictures are kept.
    pub fn of(&mut self, path: &Path, kept: Option<&Path>, wake: &Wake) -> Thumbnail {
        let Ok(mut shared) = self.shared.lock() else { return Thumbnail::Missing };
        if self.asked.insert(path.to_owned()) {
            shared.waiting.push_back(path.to_owned());
            if !std::mem::replace(&mut shared.is_running, true) {
                let (all, kept, wake) = (Arc::clone(&self.shared), kept.map(Path::to_owned), Arc::clone(wake));
                std::thread::spawn(move || make_all(&all, kept.as_deref(), &wake));
            }
        }
        match shared.made.get(path) {
            None => Thumbnail::Awaited,
            Some(None) => Thumbnail::Missing,
            Some(Some(picture)) => Thumbnail::Ready(Arc::clone(picture)),
        }
    }
}

/// Makes all small pictures that are waited for.
fn make_all(shared: &Mutex<Shared>, kept: Option<&Path>, wake: &Wake) {
    loop {
        let next = shared.lock().ok().and_then(|mut shared| {
            let next = shared.waiting.pop_front();
            shared.is_running = next.is_some();
            next
        });
        let Some(path) = next else { return };
        let picture = read(&path, kept).map(Arc::new);
        if let Ok(mut shared) = shared.lock() {
            shared.made.insert(path, picture);
        }
        wake();
    }
}

/// Returns a small picture: the one that is kept, or else a new one of the first picture.
fn read(path: &Path, kept: Option<&Path>) -> Option<RgbImage> {
    let file = kept.and_then(|folder| Some(folder.join(name(path)?)));
    let before = file.as_ref().and_then(|file| Some(image::open(file).ok()?.into_rgb8()));
    if let Some(before) = before.filter(|picture| picture.dimensions() == SIZE) {
        return Some(before);
    }
    let picture = small(&first_picture(path)?);
    if let (Some(folder), Some(file)) = (kept, &file) {
        // Without a place for it, the picture is made again the next time.
        let _ = std::fs::create_dir_all(folder).and_then(|()| picture.save(file).map_err(std::io::Error::other));
        forget_oldest(folder);
    }
    Some(picture)
}

fn first_picture(path: &Path) -> Option<RgbImage> {
    let mut source = source::open(&[path.to_owned()], None, None).ok()?;
    let (picture, _) = source.next()?.ok()?.payload.decode(None).ok()?;
    Some(stretched(picture.to_rgb()))
}

/// Makes a dark picture brighter: pictures of 12 or 16 bits often use a small part of their range.
fn stretched(mut picture: RgbImage) -> RgbImage {
    let most = picture.iter().copied().max().unwrap_or(0);
    if (1..128).contains(&most) {
        picture.iter_mut().for_each(|x| *x = (u32::from(*x) * 255 / u32::from(most)) as u8);
    }
    picture
}

/// Returns the middle of a picture in the size of all small pictures.
pub(super) fn small(picture: &RgbImage) -> RgbImage {
    let (w, h) = picture.dimensions();
    let (wide, high) = SIZE;
    // The largest part with these proportions.
    let part_w = w.min((h * wide).div_ceil(high)).max(1);
    let part_h = h.min((w * high).div_ceil(wide)).max(1);
    let part = imageops::crop_imm(picture, (w - part_w) / 2, (h - part_h) / 2, part_w, part_h).to_image();
    imageops::resize(&part, wide, high, FilterType::Triangle)
}

/// Returns the name of the kept picture. It changes with the file.
fn name(path: &Path) -> Option<String> {
    let changed = std::fs::metadata(path).ok()?.modified().ok()?;
    let mut hasher = DefaultHasher::new();
    (path, changed.duration_since(UNIX_EPOCH).ok()?.as_nanos()).hash(&mut hasher);
    Some(format!("{:016x}.png", hasher.finish()))
}

/// Removes the oldest pictures, so that the folder does not grow.
fn forget_oldest(folder: &Path) {
    let Ok(files) = std::fs::read_dir(folder) else { return };
    let age = |entry: std::fs::DirEntry| Some((entry.metadata().ok()?.modified().ok()?, entry.path()));
    let mut all: Vec<_> = files.filter_map(|entry| age(entry.ok()?)).collect();
    all.sort();
    for (_, path) in all.iter().take(all.len().saturating_sub(MOST)) {
        let _ = std::fs::remove_file(path);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wait(all: &mut Thumbnails, path: &Path, kept: &Path) -> Thumbnail {
        let wake: Wake = Arc::new(|| {});
        for _ in 0..1000 {
            match all.of(path, Some(kept), &wake) {
                Thumbnail::Awaited => std::thread::sleep(std::time::Duration::from_millis(5)),
                known => return known,
            }
        }
        panic!("no thumbnail is made")
    }

    #[test]
    fn the_first_picture_is_made_small_and_kept() {
        let dir = tempfile::tempdir().unwrap();
        let (folder, kept) = (dir.path().join("flight"), dir.path().join("thumbnails"));
        std::fs::create_dir(&folder).unwrap();
        image::RgbImage::from_pixel(640, 480, image::Rgb([200, 100, 50])).save(folder.join("a.png")).unwrap();
        image::RgbImage::new(640, 480).save(folder.join("b.png")).unwrap();
        let mut all = Thumbnails::default();
        let Thumbnail::Ready(picture) = wait(&mut all, &folder, &kept) else { panic!("it has a picture") };
        assert_eq!((picture.dimensions(), picture.get_pixel(96, 54).0), (SIZE, [200, 100, 50]));
        assert!(matches!(wait(&mut all, &dir.path().join("gone"), &kept), Thumbnail::Missing));
        let files: Vec<_> = std::fs::read_dir(&kept).unwrap().map(|e| e.unwrap().path()).collect();
        assert_eq!(files.len(), 1);
        // The kept picture is used as long as the folder is the same.
        image::RgbImage::from_pixel(SIZE.0, SIZE.1, image::Rgb([1, 2, 3])).save(&files[0]).unwrap();
        let Thumbnail::Ready(again) = wait(&mut Thumbnails::default(), &folder, &kept) else { panic!() };
        assert_eq!(again.get_pixel(0, 0).0, [1, 2, 3]);
    }

    #[test]
    fn a_small_picture_is_the_middle_and_a_dark_one_is_brighter() {
        let tall =
            image::RgbImage::from_fn(100, 300, |_, y| image::Rgb(if y < 100 { [255, 0, 0] } else { [0, 40, 0] }));
        let picture = small(&tall);
        assert_eq!((picture.dimensions(), picture.get_pixel(0, 0).0[0]), (SIZE, 0), "the top is cut");
        assert_eq!(
            stretched(image::RgbImage::from_pixel(2, 2, image::Rgb([0, 16, 32]))).get_pixel(0, 0).0,
            [0, 127, 255]
        );
        let black = image::RgbImage::new(2, 2);
        assert_eq!(stretched(black.clone()), black);
    }

    #[test]
    fn the_folder_does_not_grow() {
        let dir = tempfile::tempdir().unwrap();
        for n in 0..MOST + 7 {
            std::fs::write(dir.path().join(format!("{n}.png")), b"").unwrap();
        }
        forget_oldest(dir.path());
        assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), MOST);
    }
}
