//! A window of the system with memory to draw in.

use std::num::NonZeroU32;
use std::rc::Rc;

use winit::dpi::PhysicalSize;
use winit::event_loop::ActiveEventLoop;
use winit::window::Window;

use super::screen::Screen;

/// A window and its pixels.
pub(super) struct Surface {
    window: Rc<Window>,
    pixels: softbuffer::Surface<Rc<Window>, Rc<Window>>,
}

impl Surface {
    /// Opens a window of `size` pixels, named after the program and `title`.
    ///
    /// # Errors
    /// What the system says if it refuses.
    pub fn open(event_loop: &ActiveEventLoop, title: &str, size: (u32, u32)) -> Result<Self, String> {
        let said = |e: &dyn std::fmt::Display| e.to_string();
        let attributes = Window::default_attributes()
            .with_title(format!("lanecast {title}"))
            .with_inner_size(PhysicalSize::new(size.0, size.1));
        let window = Rc::new(event_loop.create_window(attributes).map_err(|e| said(&e))?);
        let context = softbuffer::Context::new(window.clone()).map_err(|e| said(&e))?;
        let pixels = softbuffer::Surface::new(&context, window.clone()).map_err(|e| said(&e))?;
        Ok(Self { window, pixels })
    }

    /// Asks for an event in which to draw.
    pub fn request_redraw(&self) {
        self.window.request_redraw();
    }

    /// Width and height inside, pixels.
    pub fn size(&self) -> (u32, u32) {
        self.window.inner_size().into()
    }

    /// Shows `screen`, from the upper left corner. A window without pixels shows nothing.
    ///
    /// # Errors
    /// What the system says if it cannot.
    pub fn show(&mut self, screen: &Screen) -> Result<(), softbuffer::SoftBufferError> {
        let (width, height) = self.size();
        let (Some(columns), Some(rows)) = (NonZeroU32::new(width), NonZeroU32::new(height)) else { return Ok(()) };
        self.pixels.resize(columns, rows)?;
        let mut buffer = self.pixels.buffer_mut()?;
        screen.copy_to(width, height, &mut buffer);
        buffer.present()
    }
}
