//! The messages of a recording one by one, checked before they are decoded: a bit that flipped on a disk costs its message
//! and is said, no more.
//!
//! A file of Rerun is a header of 12 bytes and messages, each behind 16 bytes: its kind and its length, little-endian.
//! Neither lengths nor contents carry a check sum, and what decodes them trusts both. So lengths are held against the
//! file, sizes inside a message against what can be, and a decoder that gives up takes its own message with it alone.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::path::Path;
use std::sync::Once;

use rerun::external::arrow::ipc::root_as_message;
use rerun::external::re_log_encoding::Decoder;
use rerun::log::LogMsg;

use super::trouble::RecordingFlaw;

/// Bytes of the file's header.
const HEADER: usize = 12;
/// Bytes in front of a message.
const FRAME: usize = 16;
/// Most bytes that follow the end.
const FOOTER: usize = 256;
/// Kinds of messages: the end, the opening of a store, rows, the activation of a blueprint.
const END: u64 = 0;
const ROWS: u64 = 2;
const LAST_KIND: u64 = 3;
/// Kinds of values in protobuf.
const NUMBER: u64 = 0;
const EIGHT_BYTES: u64 = 1;
const BYTES: u64 = 2;
const FOUR_BYTES: u64 = 5;
/// Fields of a message of rows.
const COMPRESSION: u64 = 2;
const SIZE: u64 = 3;
const PAYLOAD: u64 = 5;
/// Value of the compression that is used.
const LZ4: u64 = 2;
/// LZ4 makes at most so many bytes of one.
const MOST_PACKED: u64 = 255;
/// What follows the length of a message in Arrow's stream, where it has any.
const CONTINUATION: [u8; 4] = [0xff; 4];

/// What is wrong with a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Damage {
    /// Messages that cannot be read.
    pub messages: usize,
    /// First byte of what cannot be read.
    pub at: Option<u64>,
    /// The file ends within a message.
    pub cut: bool,
}

impl Damage {
    /// What is to be said of it; `None` where nothing is wrong.
    pub(super) fn flaw(&self, path: &Path) -> Option<RecordingFlaw> {
        let (path, at) = (path.display().to_string(), self.at.unwrap_or_default());
        match self {
            Self { messages: 0, .. } => None,
            Self { cut: true, messages: 1, .. } => Some(RecordingFlaw::Cut { path, at }),
            Self { messages, .. } => Some(RecordingFlaw::Damaged { path, at, messages: *messages }),
        }
    }

    fn add(&mut self, at: usize) {
        self.messages += 1;
        self.at = self.at.or(Some(at as u64));
    }
}

/// Hands over every message that can be read.
///
/// # Errors
/// Why the file is no recording.
pub(super) fn read(path: &Path, mut take: impl FnMut(LogMsg)) -> Result<Damage, String> {
    let bytes = std::fs::read(path).map_err(|error| error.to_string())?;
    let Some((header, _)) = bytes.split_at_checked(HEADER).filter(|(header, _)| header.starts_with(b"RRF2"))
    else {
        return Err("it does not begin like a recording of Rerun".to_owned());
    };
    let mut damage = Damage::default();
    let mut at = HEADER;
    while at < bytes.len() {
        let Some(frame) = frame_at(&bytes, at) else {
            let next = (at + 1..bytes.len()).find(|&next| is_certain(&bytes, next));
            // What nothing follows was not written to its end; all else was written over.
            damage.cut |= next.is_none();
            damage.add(at);
            match next {
                Some(next) => at = next,
                None => break,
            }
            continue;
        };
        let end = at + FRAME + frame.length;
        if frame.kind == END {
            if bytes.len() - end <= FOOTER {
                break;
            }
            // No end: a kind that was written over.
            damage.add(at);
            at = end;
            continue;
        }
        let body = &bytes[at + FRAME..end];
        let message = (frame.kind != ROWS || is_sound(body)).then(|| decoded(header, &bytes[at..end]));
        match message.flatten() {
            Some(message) => take(message),
            None => damage.add(at),
        }
        at = end;
    }
    Ok(damage)
}

/// One message, decoded by itself; `None` for one that cannot be.
fn decoded(header: &[u8], frame: &[u8]) -> Option<LogMsg> {
    let mut decoder = Decoder::<LogMsg>::new();
    decoder.push_byte_chunk(header.to_vec());
    decoder.push_byte_chunk(frame.to_vec());
    // Arrow panics on offsets that are out of order.
    quietly(|| decoder.try_read())?.ok()?
}

thread_local! {
    static QUIET: Cell<bool> = const { Cell::new(false) };
}

/// Runs what may panic on damaged bytes; `None` when it did. Nothing of it is printed.
pub(super) fn quietly<T>(work: impl FnOnce() -> T) -> Option<T> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let usual = take_hook();
        set_hook(Box::new(move |panic| {
            if !QUIET.get() {
                usual(panic);
            }
        }));
    });
    QUIET.set(true);
    let done = catch_unwind(AssertUnwindSafe(work));
    QUIET.set(false);
    done.ok()
}

struct Frame {
    kind: u64,
    length: usize,
}

fn frame_at(bytes: &[u8], at: usize) -> Option<Frame> {
    let number = |at: usize| Some(u64::from_le_bytes(bytes.get(at..at + 8)?.try_into().ok()?));
    let (kind, length) = (number(at)?, usize::try_from(number(at + 8)?).ok()?);
    let fits = length <= bytes.len().saturating_sub(at + FRAME);
    (kind <= LAST_KIND && fits).then_some(Frame { kind, length })
}

/// Whether a message surely begins here: another one follows, or the file ends.
fn is_certain(bytes: &[u8], at: usize) -> bool {
    let Some(frame) = frame_at(bytes, at) else { return false };
    let next = at + FRAME + frame.length;
    frame.kind != END && frame.length > 0 && (next == bytes.len() || frame_at(bytes, next).is_some())
}

/// Whether the sizes that a message of rows names can be true, so that nobody reserves memory for others.
fn is_sound(body: &[u8]) -> bool {
    let Some(rows) = Rows::of(body) else { return false };
    let unpacked;
    let stream = if rows.packed {
        if rows.size > rows.payload.len() as u64 * MOST_PACKED + 64 {
            return false;
        }
        let Ok(size) = usize::try_from(rows.size) else { return false };
        match lz4_flex::block::decompress(rows.payload, size) {
            Ok(bytes) => unpacked = bytes,
            Err(_) => return false,
        }
        &unpacked[..]
    } else {
        rows.payload
    };
    has_sound_lengths(stream)
}

/// Whether each message of an Arrow stream fits into it.
fn has_sound_lengths(mut stream: &[u8]) -> bool {
    while !stream.is_empty() {
        let rest = stream.strip_prefix(&CONTINUATION[..]).unwrap_or(stream);
        let Some((length, rest)) = rest.split_first_chunk::<4>() else { return false };
        let length = u32::from_le_bytes(*length) as usize;
        if length == 0 {
            return true;
        }
        let Some((head, rest)) = rest.split_at_checked(length) else { return false };
        let Ok(message) = root_as_message(head) else { return false };
        let Ok(body) = usize::try_from(message.bodyLength()) else { return false };
        let Some(next) = rest.get(body..) else { return false };
        stream = next;
    }
    true
}

/// The fields of a message of rows that say how large it is (protobuf).
struct Rows<'a> {
    packed: bool,
    size: u64,
    payload: &'a [u8],
}

impl<'a> Rows<'a> {
    fn of(mut body: &'a [u8]) -> Option<Self> {
        let mut rows = Self { packed: false, size: 0, payload: &[] };
        while !body.is_empty() {
            let key = varint(&mut body)?;
            match key & 7 {
                NUMBER => {
                    let value = varint(&mut body)?;
                    match key >> 3 {
                        COMPRESSION => rows.packed = value == LZ4,
                        SIZE => rows.size = value,
                        _ => {}
                    }
                }
                BYTES => {
                    let length = usize::try_from(varint(&mut body)?).ok()?;
                    let (bytes, rest) = body.split_at_checked(length)?;
                    if key >> 3 == PAYLOAD {
                        rows.payload = bytes;
                    }
                    body = rest;
                }
                EIGHT_BYTES => body = body.get(8..)?,
                FOUR_BYTES => body = body.get(4..)?,
                _ => return None,
            }
        }
        Some(rows)
    }
}

fn varint(bytes: &mut &[u8]) -> Option<u64> {
    let mut value = 0;
    for shift in (0..64).step_by(7) {
        let (&first, rest) = bytes.split_first()?;
        *bytes = rest;
        value |= u64::from(first & 0x7f) << shift;
        if first < 0x80 {
            return Some(value);
        }
    }
    None
}
