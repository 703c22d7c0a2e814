//! `render --preview`: who looks at the picture while it is made.

use std::io::{self, IsTerminal};

use super::output::OutputArgs;
use crate::camera::Camera;
use crate::error::Result;
use crate::render::progressive::{LARGEST_BLOCK, Progressive};
use crate::render::{Keeper, Progress, RenderOptions, RenderOutput, render_kept};
use crate::scene::description::Description;
use crate::scene::world::World;
use crate::shade::Shades;
use crate::trace::Engine;
use crate::view::term::Terminal;
use crate::view::tev::{DEFAULT_ADDRESS, Tev};
use crate::view::window::live::Live;

/// Values of `--preview`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Preview {
    /// Nobody looks.
    Off,
    /// The terminal.
    Term,
    /// A window, which stays until it is closed.
    Window,
    /// The viewer tev at an address.
    Tev(String),
}

/// How a picture appears.
#[derive(Clone, Debug, clap::Args)]
pub struct PreviewArgs {
    /// Show the picture while it is made: off, term (in the terminal), window (stays until it is closed)
    /// or tev[:HOST:PORT] (in the viewer tev)
    #[arg(long, value_name = "WHERE", default_value = "off", value_parser = preview, help_heading = "Output")]
    preview: Preview,
    /// Make the picture appear as blocks, first of this many pixels on a side: 16, 8, 4, 2 or 1 [default with --preview: 16]
    #[arg(long, value_name = "PIXELS", value_parser = blocks, help_heading = "Output")]
    blocks: Option<u32>,
}

impl Default for PreviewArgs {
    fn default() -> Self {
        Self { preview: Preview::Off, blocks: None }
    }
}

impl PreviewArgs {
    /// Whether the picture appears as blocks.
    pub fn by_blocks(&self) -> bool {
        self.preview != Preview::Off || self.blocks.is_some()
    }
}

/// A picture to be made, and how it is shown.
pub(super) struct Job<'a, S: Shades> {
    pub engine: &'a dyn Engine<S>,
    pub world: &'a World<S>,
    pub description: &'a Description,
    pub camera: &'a Camera,
    pub options: &'a RenderOptions,
    /// Where finished tiles are kept, if they are. Not for pictures that are shown by blocks.
    pub keeper: Option<&'a Keeper>,
    /// Brightness of previews in stops.
    pub exposure: f32,
    /// What a viewer calls the picture.
    pub name: &'a str,
    pub output: &'a OutputArgs,
}

impl<S: Shades> Job<'_, S> {
    /// Renders, shown as `how` says. A place where nothing can be shown is a line on stderr, and the render goes on. A
    /// window that was opened comes back with the picture.
    ///
    /// # Errors
    /// Options out of range.
    pub fn render(&self, how: &PreviewArgs, progress: &dyn Progress) -> Result<(RenderOutput, Option<Live>)> {
        let Self { engine, world, description, camera, options, .. } = *self;
        if !how.by_blocks() {
            return Ok((render_kept(engine, world, description, camera, options, progress, self.keeper)?, None));
        }
        let start = how.blocks.unwrap_or(LARGEST_BLOCK);
        let picture = Progressive::new(engine, world, description, camera, options, start)?;
        if how.preview == Preview::Window {
            return Ok(self.in_window(picture, progress));
        }
        let output = match &how.preview {
            Preview::Term if io::stderr().is_terminal() => self.in_terminal(picture, progress),
            Preview::Term => {
                self.output.say("preview: stderr is no terminal; going on without");
                unseen(picture, progress)
            }
            Preview::Tev(address) => self.in_tev(picture, address, progress),
            Preview::Off | Preview::Window => unseen(picture, progress),
        };
        Ok((output, None))
    }

    fn in_window(&self, mut picture: Progressive<'_, S>, progress: &dyn Progress) -> (RenderOutput, Option<Live>) {
        match Live::open(self.name, (self.options.width, self.options.height), self.exposure) {
            Ok(window) => {
                picture.run(progress, &window);
                let output = picture.finish();
                window.finish(&output.film);
                (output, Some(window))
            }
            Err(error) => {
                self.output.say(&format!("preview: no window: {error}; going on without"));
                (unseen(picture, progress), None)
            }
        }
    }

    fn in_terminal(&self, mut picture: Progressive<'_, S>, progress: &dyn Progress) -> RenderOutput {
        let window = picture.look(|frame| frame.window());
        let terminal = Terminal::new(io::stderr(), None, window, self.exposure);
        picture.run(&WithBar { progress, terminal: &terminal }, &terminal);
        let output = picture.finish();
        terminal.finish(&output.film);
        output
    }

    fn in_tev(&self, mut picture: Progressive<'_, S>, address: &str, progress: &dyn Progress) -> RenderOutput {
        let tev = match picture.look(|frame| Tev::connect(address, self.name, frame.film())) {
            Ok(tev) => tev,
            Err(error) => {
                self.output.say(&format!("preview: no tev at {address}: {error}; going on without"));
                return unseen(picture, progress);
            }
        };
        picture.run(progress, &tev);
        let output = picture.finish();
        if let Err(error) = tev.finish(&output.film) {
            self.output.say(&format!("preview: tev at {address} was lost: {error}"));
        }
        output
    }
}

fn unseen<S: Shades>(mut picture: Progressive<'_, S>, progress: &dyn Progress) -> RenderOutput {
    picture.run(progress, &());
    picture.finish()
}

/// The bar under the picture in a terminal.
struct WithBar<'a> {
    progress: &'a dyn Progress,
    terminal: &'a Terminal<io::Stderr>,
}

impl Progress for WithBar<'_> {
    fn tile_done(&self, total: u64) {
        self.terminal.batch_done(total);
    }
    fn stopped(&self) -> bool {
        self.progress.stopped()
    }
}

fn preview(text: &str) -> std::result::Result<Preview, String> {
    match text.split_once(':') {
        None if text == "off" => Ok(Preview::Off),
        None if text == "term" => Ok(Preview::Term),
        None if text == "window" => Ok(Preview::Window),
        None if text == "tev" => Ok(Preview::Tev(DEFAULT_ADDRESS.into())),
        Some(("tev", address)) if is_address(address) => Ok(Preview::Tev(address.into())),
        _ => Err("expected off, term, window, tev or tev:HOST:PORT, for example tev:127.0.0.1:14158".into()),
    }
}

fn is_address(text: &str) -> bool {
    text.rsplit_once(':').is_some_and(|(host, port)| !host.is_empty() && port.parse::<u16>().is_ok())
}

fn blocks(text: &str) -> std::result::Result<u32, String> {
    let edge = text.parse().ok().filter(|edge: &u32| edge.is_power_of_two() && *edge <= LARGEST_BLOCK);
    edge.ok_or_else(|| "expected 16, 8, 4, 2 or 1 pixels".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn previews_parse_or_say_what_is_expected() {
        assert_eq!(preview("off"), Ok(Preview::Off));
        assert_eq!(preview("tev"), Ok(Preview::Tev("127.0.0.1:14158".into())));
        assert_eq!(preview("tev:[::1]:99"), Ok(Preview::Tev("[::1]:99".into())));
        for wrong in ["", "tev:", "tev:host", "tev::1", "tev:host:70000", "term:1", "screen"] {
            assert!(preview(wrong).is_err(), "{wrong}");
        }
        assert_eq!((blocks("16"), blocks("1")), (Ok(16), Ok(1)));
        assert!(["0", "3", "32", "-2", "x"].iter().all(|wrong| blocks(wrong).is_err()));
    }
}
