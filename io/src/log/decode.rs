//! Which character set a file is in, judged by its beginning: byte order marks, UTF-8, UTF-16 without a mark, Latin-1 in
//! its Windows form, and GB18030 for Chinese systems.

use std::borrow::Cow;

use super::utf32::{self, Decoder};
use super::{Encoding, ImportError};

/// A character set and how to read it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Charset {
    pub found: Encoding,
    codec: &'static encoding_rs::Encoding,
    /// Bytes of the byte order mark.
    pub mark: usize,
    /// Of UTF-32, whether the highest byte comes first.
    big: bool,
}

/// So many zeros in a row are a block that a crash left, and no text.
pub(super) const BLOCK_OF_ZEROS: usize = 16;
/// Bytes by which text is told from other files.
const JUDGED: usize = 65_536;

impl Charset {
    fn new(found: Encoding, codec: &'static encoding_rs::Encoding, mark: usize) -> Self {
        Self { found, codec, mark, big: false }
    }

    /// The decoder of a set in which separators and digits are not the bytes of ASCII.
    pub fn decoder(&self) -> Option<Decoder> {
        match self.found {
            Encoding::Utf16 => Some(Decoder::Known(Box::new(self.codec.new_decoder_without_bom_handling()))),
            Encoding::Utf32 => Some(Decoder::Utf32 { big: self.big, rest: Vec::new() }),
            _ => None,
        }
    }

    /// A line as text. A line that is no UTF-8 in a file of it is taken for Latin-1: nothing is lost.
    pub fn text<'a>(&self, line: &'a [u8]) -> Cow<'a, str> {
        match std::str::from_utf8(line) {
            Ok(text) => text.into(),
            Err(_) if self.found == Encoding::Gb18030 => self.codec.decode_without_bom_handling(line).0,
            Err(_) => encoding_rs::WINDOWS_1252.decode_without_bom_handling(line).0,
        }
    }
}

/// Finds the character set by the first bytes of a file.
///
/// # Errors
/// [`ImportError::Empty`], [`ImportError::Foreign`], [`ImportError::Binary`].
pub(super) fn detect(bytes: &[u8]) -> Result<Charset, ImportError> {
    if bytes.iter().all(u8::is_ascii_whitespace) {
        return Err(ImportError::Empty);
    }
    if let Some(format) = foreign(bytes) {
        return Err(ImportError::Foreign { format });
    }
    if let Some(big) = utf32::is_big(bytes) {
        if bytes[utf32::MARK..].iter().all(|b| b.is_ascii_whitespace() || *b == 0) {
            return Err(ImportError::Empty);
        }
        let charset = Charset::new(Encoding::Utf32, encoding_rs::UTF_8, utf32::MARK);
        return Ok(Charset { big, ..charset });
    }
    if let Some((codec, mark)) = encoding_rs::Encoding::for_bom(bytes) {
        if bytes[mark..].iter().all(|b| b.is_ascii_whitespace() || *b == 0) {
            return Err(ImportError::Empty);
        }
        let found = if codec == encoding_rs::UTF_8 { Encoding::Utf8 } else { Encoding::Utf16 };
        return Ok(Charset::new(found, codec, mark));
    }
    if let Some(codec) = unmarked_utf16(bytes) {
        return Ok(Charset::new(Encoding::Utf16, codec, 0));
    }
    // A logger that lost its power leaves zeros at the end of its file.
    let written = bytes.iter().rposition(|&b| b != 0).map_or(0, |last| last + 1);
    let sample = without_blocks(&bytes[..written]);
    let odd = sample.iter().filter(|&&b| b == 0 || (b < 32 && !matches!(b, b'\t' | b'\n' | b'\r' | 12 | 26)));
    if odd.count() * 100 > sample.len() || sample.contains(&0) {
        return Err(ImportError::Binary);
    }
    // The sample may end within a letter.
    if std::str::from_utf8(bytes).map_or_else(|e| e.error_len().is_none(), |_| true) {
        return Ok(Charset::new(Encoding::Utf8, encoding_rs::UTF_8, 0));
    }
    if high_bytes_come_in_pairs(bytes) {
        let whole = &bytes[..bytes.iter().rposition(|&b| b < 0x80).map_or(0, |last| last + 1)];
        if !encoding_rs::GB18030.decode_without_bom_handling(whole).1 {
            return Ok(Charset::new(Encoding::Gb18030, encoding_rs::GB18030, 0));
        }
    }
    Ok(Charset::new(Encoding::Windows1252, encoding_rs::WINDOWS_1252, 0))
}

/// The first bytes of a file without blocks of zeros, which a logger that crashed leaves in its midst.
fn without_blocks(bytes: &[u8]) -> Cow<'_, [u8]> {
    if memchr::memchr(0, bytes).is_none() {
        return bytes[..bytes.len().min(JUDGED)].into();
    }
    let is_block = |run: &&[u8]| run[0] == 0 && run.len() >= BLOCK_OF_ZEROS;
    let runs = bytes.chunk_by(|a, b| (*a == 0) == (*b == 0)).filter(|run| !is_block(run));
    let mut text: Vec<u8> = Vec::new();
    for run in runs {
        text.extend_from_slice(run);
        if text.len() >= JUDGED {
            break;
        }
    }
    text.truncate(JUDGED);
    text.into()
}

/// The name of a known format that is no text.
fn foreign(bytes: &[u8]) -> Option<&'static str> {
    let known: [(&[u8], &str); 9] = [
        (b"PK\x03\x04", "a damaged workbook or an archive"),
        (b"\xD0\xCF\x11\xE0", "a damaged or protected Excel workbook"),
        (b"MATLAB 5.0 MAT", "a MATLAB file"),
        (b"\x89HDF", "an HDF5 file"),
        (b"PAR1", "a damaged Parquet file"),
        (b"RRF2", "a Rerun recording"),
        (b"%PDF", "a PDF document"),
        (b"\x1F\x8B", "a compressed file"),
        (b"TDSm", "a LabVIEW TDMS file"),
    ];
    known.iter().find(|(start, _)| bytes.starts_with(start)).map(|(_, format)| *format)
}

/// Digits and separators in UTF-16 have a zero in every other byte.
fn unmarked_utf16(bytes: &[u8]) -> Option<&'static encoding_rs::Encoding> {
    let sample = &bytes[..bytes.len().min(4096) & !1];
    let zeros = |odd: usize| sample.iter().skip(odd).step_by(2).filter(|b| **b == 0).count();
    let (even, odd, pairs) = (zeros(0), zeros(1), sample.len() / 2);
    if pairs < 2 {
        return None;
    }
    if odd * 10 >= pairs * 7 && even * 10 < pairs {
        Some(encoding_rs::UTF_16LE)
    } else if even * 10 >= pairs * 7 && odd * 10 < pairs {
        Some(encoding_rs::UTF_16BE)
    } else {
        None
    }
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
