//! Display of the image in tev, a viewer for high dynamic range images (<https://github.com/Tom94/tev>).

use furrow_render::film::Film;
use std::net::{SocketAddr, TcpStream};
use std::time::Duration;
use tev_client::{PacketCreateImage, PacketUpdateImage, TevClient};

/// Default address of tev.
const ADDRESS: ([u8; 4], u16) = ([127, 0, 0, 1], 14158);
/// Timeout for connecting and writing.
const PATIENCE: Duration = Duration::from_secs(1);
/// Name of the image in tev.
const NAME: &str = "furrow";

/// Connection to tev, opened with the first image and reopened when lost.
pub(super) struct Tev {
    address: SocketAddr,
    client: Option<TevClient>,
    size: (u32, u32),
    /// `true` once the user was warned that there is no connection.
    warned: bool,
}

impl Default for Tev {
    fn default() -> Self {
        Self { address: ADDRESS.into(), client: None, size: (0, 0), warned: false }
    }
}

impl Tev {
    /// Sends the radiance of the film. Warns once if tev is not running.
    pub(super) fn send(&mut self, film: &Film) {
        match self.try_send(film) {
            Ok(()) => self.warned = false,
            Err(e) => {
                self.client = None;
                if !std::mem::replace(&mut self.warned, true) {
                    let address = self.address;
                    furrow_cli::message!(
                        "warning: cannot send the image to tev at {address}: {e}; start tev, then save the scene file"
                    );
                }
            }
        }
    }

    fn try_send(&mut self, film: &Film) -> std::io::Result<()> {
        let size = (film.window.width(), film.window.height());
        let fresh = self.client.is_none() || self.size != size;
        if self.client.is_none() {
            let socket = TcpStream::connect_timeout(&self.address, PATIENCE)?;
            socket.set_write_timeout(Some(PATIENCE))?;
            self.client = Some(TevClient::wrap(socket));
        }
        let Some(client) = &mut self.client else { return Ok(()) };
        let channel_names = &["R", "G", "B", "NIR"];
        let (width, height) = size;
        if fresh {
            client.send(PacketCreateImage { image_name: NAME, grab_focus: false, width, height, channel_names })?;
            self.size = size;
        }
        let data: Vec<f32> = film.pixels.iter().flat_map(|pixel| pixel.mean.to_array()).collect();
        client.send(PacketUpdateImage {
            image_name: NAME,
            grab_focus: false,
            channel_names,
            channel_offsets: &[0, 1, 2, 3],
            channel_strides: &[4; 4],
            x: 0,
            y: 0,
            width,
            height,
            data: &data,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::geometry::Window;
    use furrow_base::math::{Spectrum, ToInt};
    use furrow_render::film::Pixel;
    use std::io::Read;
    use std::net::TcpListener;

    /// Expected: one message that creates the image, and one with four numbers per pixel for each film, in tev's
    /// protocol (version 3 of its updates): length, kind, content, little-endian. Source: tev's `Ipc.cpp`.
    #[test]
    fn a_film_is_sent_as_tev_reads_it() {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let mut tev = Tev { address: listener.local_addr().unwrap(), ..Tev::default() };
        let pixel = Pixel { mean: Spectrum::new(0.5, 1.0, 2.0, 4.0), ..Pixel::default() };
        let film = Film { window: Window::full(3, 2), pixels: vec![pixel; 6] };
        tev.send(&film);
        tev.send(&film);
        drop(tev);
        let mut bytes = Vec::new();
        listener.accept().unwrap().0.read_to_end(&mut bytes).unwrap();
        let mut kinds = Vec::new();
        let mut rest = bytes.as_slice();
        while let Some((length, _)) = rest.split_first_chunk::<4>() {
            let (message, after) = rest.split_at(u32::from_le_bytes(*length).to_usize());
            kinds.push(message[4]);
            rest = after;
            if message[4] == 6 {
                let numbers: Vec<u8> = [0.5_f32, 1.0, 2.0, 4.0].iter().flat_map(|x| x.to_le_bytes()).collect();
                assert!(message.ends_with(&numbers.repeat(6)));
            }
        }
        assert_eq!(kinds, [4, 6, 6]);
    }
}
