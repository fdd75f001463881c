//! Writes images to PNG files; the only file that names the crate `png`.

use super::raster::Image;
use crate::files::WriteError;
use crate::files::output::write_file;
use std::path::Path;

/// Writes an image; an existing file is kept on failure. See [`write_file`] for paths that are not
/// regular files.
pub fn write_png(image: &Image, path: &Path) -> Result<(), WriteError> {
    let bytes = png_bytes(image);
    write_file(path, bytes.len() as u64, |output| output.write(&bytes))?;
    Ok(())
}

/// The content of a PNG file.
///
/// # Panics
/// If the number of pixels is not width times height.
pub fn png_bytes(image: &Image) -> Vec<u8> {
    encode(image).expect("the pixels fill the image, and memory takes all bytes")
}

fn encode(image: &Image) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, image.width, image.height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::High);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(image.pixels.as_flattened())?;
    writer.finish()?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_image_reads_back() {
        let pixels = (0..12).map(|k| [k, 2 * k, 255 - k]).collect();
        let image = Image { width: 4, height: 3, pixels };
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("image.png");
        write_png(&image, &path).unwrap();
        let file = std::io::BufReader::new(std::fs::File::open(&path).unwrap());
        let mut reader = png::Decoder::new(file).read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut bytes).unwrap();
        assert_eq!((info.width, info.height), (4, 3));
        assert_eq!(bytes, image.pixels.as_flattened());
    }
}
