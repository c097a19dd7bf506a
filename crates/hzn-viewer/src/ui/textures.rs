//! Textures of the pictures on the graphics card.

use std::collections::HashMap;
use std::sync::Arc;

use egui::{ColorImage, TextureFilter, TextureHandle, TextureId, TextureOptions};
use image::RgbImage;

use crate::work::FrameView;
use crate::work::frame_view::Shown;
use crate::work::thumbnails::Thumbnails;

/// Textures of the pictures on the graphics card.
#[derive(Default)]
pub(super) struct Textures {
    pub(super) shown: Option<(Arc<Shown>, TextureHandle)>,
    pub(super) touched: Option<(Arc<ColorImage>, TextureHandle)>,
    /// Small pictures of the page of an empty window.
    pub(super) thumbnails: Thumbnails,
    pub(super) small: HashMap<String, TextureHandle>,
}

impl Textures {
    /// Returns the texture of a small picture, by its name.
    pub(super) fn small(&mut self, name: &str, ctx: &egui::Context, picture: impl FnOnce() -> RgbImage) -> TextureId {
        let upload = || {
            let picture = picture();
            let size = [picture.width() as usize, picture.height() as usize];
            ctx.load_texture(name, ColorImage::from_rgb(size, picture.as_raw()), TextureOptions::LINEAR)
        };
        self.small.entry(name.to_owned()).or_insert_with(upload).id()
    }
}

impl Textures {
    /// Uploads the pictures that have changed.
    pub(super) fn take(&mut self, frame_view: Option<&FrameView>, ctx: &egui::Context) {
        // Enlarged pixels stay sharp squares; a picture that is made smaller is smoothed.
        let smooth = TextureOptions {
            magnification: TextureFilter::Nearest,
            minification: TextureFilter::Linear,
            mipmap_mode: Some(TextureFilter::Linear),
            ..TextureOptions::LINEAR
        };
        match frame_view.and_then(|s| s.image.as_ref()) {
            None => self.shown = None,
            Some(new) => match &mut self.shown {
                Some((old, _)) if Arc::ptr_eq(old, new) => {}
                Some((old, texture)) => {
                    texture.set(Arc::clone(&new.image), smooth);
                    *old = Arc::clone(new);
                }
                none => *none = Some((Arc::clone(new), ctx.load_texture("picture", Arc::clone(&new.image), smooth))),
            },
        }
        match frame_view.and_then(|s| s.answers.first()?.touched.as_ref()) {
            None => self.touched = None,
            Some(new) => match &mut self.touched {
                Some((old, _)) if Arc::ptr_eq(old, new) => {}
                slot => {
                    let options = TextureOptions { mipmap_mode: None, ..smooth };
                    *slot = Some((Arc::clone(new), ctx.load_texture("touched", Arc::clone(new), options)));
                }
            },
        }
    }
}
