//! Numpy's archive of arrays: a zip file of `.npy` members, format 1.0 of
//! <https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>.

use std::io::{Cursor, Write};

use zip::result::ZipError;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

/// An archive in the making.
pub struct Npz(ZipWriter<Cursor<Vec<u8>>>);

impl Npz {
    pub fn new() -> Self {
        Self(ZipWriter::new(Cursor::new(Vec::new())))
    }

    /// An array of float64, the last axis running fastest.
    pub fn numbers(
        &mut self,
        name: &str,
        shape: &[usize],
        values: impl Iterator<Item = f64>,
    ) -> Result<(), ZipError> {
        let data: Vec<u8> = values.flat_map(f64::to_le_bytes).collect();
        self.array(name, "<f8", shape, &data)
    }

    /// A text, as an array without axes.
    pub fn text(&mut self, name: &str, text: &str) -> Result<(), ZipError> {
        let letters: Vec<char> = if text.is_empty() {
            vec![' ']
        } else {
            text.chars().collect()
        };
        let data: Vec<u8> = letters
            .iter()
            .flat_map(|&c| u32::from(c).to_le_bytes())
            .collect();
        self.array(name, &format!("<U{}", letters.len()), &[], &data)
    }

    fn array(
        &mut self,
        name: &str,
        kind: &str,
        shape: &[usize],
        data: &[u8],
    ) -> Result<(), ZipError> {
        let axes: String = shape.iter().map(|n| format!("{n}, ")).collect();
        let mut header =
            format!("{{'descr': '{kind}', 'fortran_order': False, 'shape': ({axes}), }}");
        // The data begins at a multiple of 64 bytes, ten of them before the header.
        let end = (10 + header.len() + 1).next_multiple_of(64) - 10;
        header = format!("{header:<0$}\n", end - 1);
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Stored)
            .large_file(data.len() > u32::MAX as usize / 2);
        self.0.start_file(format!("{name}.npy"), options)?;
        self.0.write_all(b"\x93NUMPY\x01\x00")?;
        self.0.write_all(&(header.len() as u16).to_le_bytes())?;
        self.0.write_all(header.as_bytes())?;
        self.0.write_all(data)?;
        Ok(())
    }

    pub fn finish(self) -> Result<Vec<u8>, ZipError> {
        Ok(self.0.finish()?.into_inner())
    }
}
