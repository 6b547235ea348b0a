//! Bytes to text: byte order marks, UTF-8, Latin-1 in its Windows form, and GB18030 for Chinese systems.

use std::borrow::Cow;

use super::{Encoding, ImportError};

/// Text of a file and the character set it was in.
///
/// # Errors
/// [`ImportError::Empty`], [`ImportError::Foreign`], [`ImportError::Binary`].
pub(super) fn decode(bytes: &[u8]) -> Result<(Cow<'_, str>, Encoding), ImportError> {
    if bytes.iter().all(u8::is_ascii_whitespace) {
        return Err(ImportError::Empty);
    }
    if let Some(format) = foreign(bytes) {
        return Err(ImportError::Foreign { format });
    }
    if let Some((encoding, mark)) = encoding_rs::Encoding::for_bom(bytes) {
        let (text, _) = encoding.decode_without_bom_handling(&bytes[mark..]);
        let found = if encoding == encoding_rs::UTF_8 { Encoding::Utf8 } else { Encoding::Utf16 };
        return if text.trim().is_empty() { Err(ImportError::Empty) } else { Ok((text, found)) };
    }
    let sample = &bytes[..bytes.len().min(65_536)];
    let odd = sample.iter().filter(|&&b| b == 0 || (b < 32 && !matches!(b, b'\t' | b'\n' | b'\r' | 12 | 26)));
    if odd.count() * 100 > sample.len() || sample.contains(&0) {
        return Err(ImportError::Binary);
    }
    if let Ok(text) = std::str::from_utf8(bytes) {
        return Ok((text.into(), Encoding::Utf8));
    }
    if high_bytes_come_in_pairs(bytes) {
        let (text, _, broken) = encoding_rs::GB18030.decode(bytes);
        if !broken {
            return Ok((text, Encoding::Gb18030));
        }
    }
    let (text, _, _) = encoding_rs::WINDOWS_1252.decode(bytes);
    Ok((text, Encoding::Windows1252))
}

fn foreign(bytes: &[u8]) -> Option<&'static str> {
    let known: [(&[u8], &str); 8] = [
        (b"PK\x03\x04", "a workbook (.xlsx, .ods) or an archive"),
        (b"\xD0\xCF\x11\xE0", "an old Excel workbook (.xls)"),
        (b"MATLAB 5.0 MAT", "a MATLAB file"),
        (b"\x89HDF", "an HDF5 file"),
        (b"PAR1", "a Parquet file"),
        (b"RRF2", "a Rerun recording"),
        (b"%PDF", "a PDF document"),
        (b"\x1F\x8B", "a compressed file"),
    ];
    known.iter().find(|(start, _)| bytes.starts_with(start)).map(|(_, format)| *format)
}

/// In Latin-1 accented letters stand alone between plain ones; Chinese comes in pairs.
fn high_bytes_come_in_pairs(bytes: &[u8]) -> bool {
    let (mut alone, mut paired, mut run) = (0, 0, 0);
    for &b in bytes.iter().chain(b"\n") {
        if b >= 0x80 {
            run += 1;
        } else {
            match run {
                0 => {}
                1 => alone += 1,
                _ => paired += 1,
            }
            run = 0;
        }
    }
    paired > alone
}
