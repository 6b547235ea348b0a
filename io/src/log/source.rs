//! A text file in blocks of whole lines, so that no more than a block of it is ever in memory.

use std::io::{Read, Seek, SeekFrom};

use super::ImportError;
use super::decode::{Charset, detect};
use super::quotes::{fold, unfolded};
use super::utf32::Decoder;

/// Bytes read at once.
const BLOCK: usize = 1 << 18;
/// A line longer than this is cut: it is no row of a log.
const LONGEST_LINE: usize = 1 << 20;
/// What the format is judged by: so much from the beginning, and so many stretches of the rest.
const HEAD: usize = 1 << 20;
const STRETCHES: u64 = 64;
const STRETCH: usize = 1 << 14;

/// Lines to judge a format by.
#[derive(Debug)]
pub(super) struct Sample {
    /// The first lines of the file.
    pub head: Vec<String>,
    /// Lines from all over the rest of a file that is longer than that.
    pub beyond: Vec<String>,
    /// Bytes of the file.
    pub length: u64,
    /// Rows the file will have, as far as one can tell.
    pub expected_lines: usize,
    pub charset: Charset,
    pub line_end: u8,
}

impl Sample {
    /// Takes the sample.
    ///
    /// # Errors
    /// [`ImportError::Read`] when the disk fails, and those of a file that is no text.
    pub fn take<R: Read + Seek>(input: &mut R) -> Result<Self, ImportError> {
        let length = input.seek(SeekFrom::End(0))?;
        let head = read_at(input, 0, HEAD)?;
        let charset = detect(&head)?;
        let whole = head.len() as u64 >= length;
        let mut text = decoded(&charset, &head[charset.mark..]);
        let line_end = if text.contains(&b'\n') { b'\n' } else { b'\r' };
        fold(&mut text, line_end);
        let mut lines = lines_of(&text, line_end, &charset);
        if !whole && lines.len() > 1 {
            lines.pop();
        }
        let mut beyond = Vec::new();
        if !whole {
            let room = length - HEAD as u64;
            for k in 0..STRETCHES {
                let at = HEAD as u64 + room / STRETCHES * k;
                let bytes = read_at(input, at & !3, STRETCH)?;
                let part = lines_of(&decoded(&charset, &bytes), line_end, &charset);
                // The first and the last are cut.
                let count = part.len();
                beyond.extend(part.into_iter().skip(1).take(count.saturating_sub(2)));
            }
        }
        let bytes_a_line = head.len() as f64 / (lines.len() + 1) as f64;
        let expected_lines = (length as f64 / bytes_a_line * 1.02) as usize + 16;
        Ok(Self { head: lines, beyond, length, expected_lines, charset, line_end })
    }
}

fn read_at<R: Read + Seek>(input: &mut R, at: u64, count: usize) -> Result<Vec<u8>, ImportError> {
    input.seek(SeekFrom::Start(at))?;
    let mut bytes = Vec::new();
    input.take(count as u64).read_to_end(&mut bytes)?;
    Ok(bytes)
}

fn decoded(charset: &Charset, bytes: &[u8]) -> Vec<u8> {
    let Some(mut decoder) = charset.decoder() else { return bytes.to_vec() };
    let mut text = Vec::new();
    decoder.decode(bytes, true, &mut text);
    text
}

fn lines_of(text: &[u8], line_end: u8, charset: &Charset) -> Vec<String> {
    text.split(|&b| b == line_end)
        .map(|line| unfolded(charset.text(&line[..line.len().min(LONGEST_LINE)])))
        .map(|line| line.strip_suffix('\r').unwrap_or(&line).to_owned())
        .collect()
}

/// Whole lines of a file; `last`: with its end.
#[derive(Debug, Clone, Copy)]
pub(super) struct Block<'a> {
    pub text: &'a [u8],
    pub last: bool,
}

/// The lines of a file, block by block.
pub(super) struct Blocks<R> {
    input: R,
    decoder: Option<Decoder>,
    line_end: u8,
    raw: Vec<u8>,
    text: Vec<u8>,
    /// End of the block given out last.
    given: usize,
    ended: bool,
}

impl<R: Read + Seek> Blocks<R> {
    /// From the first byte behind the byte order mark.
    ///
    /// # Errors
    /// [`ImportError::Read`]
    pub fn new(mut input: R, sample: &Sample) -> Result<Self, ImportError> {
        input.seek(SeekFrom::Start(sample.charset.mark as u64))?;
        Ok(Self {
            input,
            decoder: sample.charset.decoder(),
            line_end: sample.line_end,
            raw: vec![0; BLOCK.min(sample.length as usize + 1)],
            text: Vec::new(),
            given: 0,
            ended: false,
        })
    }

    /// The next whole lines, each with its line end but the last of the file; `None` at the end.
    ///
    /// # Errors
    /// [`ImportError::Read`]
    pub fn next(&mut self) -> Result<Option<Block<'_>>, ImportError> {
        self.text.drain(..self.given);
        self.given = 0;
        let mut searched = 0;
        loop {
            if let Some(last) = memchr::memrchr(self.line_end, &self.text[searched..]) {
                let whole = fold(&mut self.text[..=searched + last], self.line_end);
                if whole > 0 {
                    self.given = whole;
                    return Ok(Some(Block { text: &self.text[..whole], last: false }));
                }
            }
            if self.ended || self.text.len() > LONGEST_LINE {
                fold(&mut self.text, self.line_end);
                self.given = self.text.len();
                let last = self.ended;
                return Ok((self.given > 0).then_some(Block { text: &self.text[..self.given], last }));
            }
            searched = self.text.len();
            self.fill()?;
        }
    }

    fn fill(&mut self) -> Result<(), ImportError> {
        let count = self.input.read(&mut self.raw)?;
        self.ended = count == 0;
        match &mut self.decoder {
            None => self.text.extend_from_slice(&self.raw[..count]),
            Some(decoder) => decoder.decode(&self.raw[..count], self.ended, &mut self.text),
        }
        Ok(())
    }
}
