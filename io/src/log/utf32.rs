//! UTF-32, which the decoders of the web leave out, beside those.

/// What turns the bytes of a file into UTF-8.
pub(super) enum Decoder {
    Known(Box<encoding_rs::Decoder>),
    Utf32 { big: bool, rest: Vec<u8> },
}

impl std::fmt::Debug for Decoder {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Decoder")
    }
}

/// Bytes of the mark of UTF-32.
pub(super) const MARK: usize = 4;

/// Whether the highest byte of a letter comes first, by that mark; `None` where it is not there.
pub(super) fn is_big(bytes: &[u8]) -> Option<bool> {
    match bytes.get(..MARK)? {
        [0xFF, 0xFE, 0, 0] => Some(false),
        [0, 0, 0xFE, 0xFF] => Some(true),
        _ => None,
    }
}

impl Decoder {
    /// Puts the text of further bytes behind `text`; what is no letter becomes U+FFFD.
    pub fn decode(&mut self, bytes: &[u8], last: bool, text: &mut Vec<u8>) {
        match self {
            Self::Known(decoder) => {
                let room = decoder.max_utf8_buffer_length(bytes.len()).unwrap_or(3 * bytes.len() + 16);
                let mut part = String::with_capacity(room);
                let _ = decoder.decode_to_string(bytes, &mut part, last);
                text.extend_from_slice(part.as_bytes());
            }
            Self::Utf32 { big, rest } => {
                rest.extend_from_slice(bytes);
                let mut part = String::with_capacity(rest.len() / 4 + 4);
                let letters = rest.chunks_exact(4);
                let left = letters.remainder().to_vec();
                for letter in letters {
                    let bytes = [letter[0], letter[1], letter[2], letter[3]];
                    let code = if *big { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) };
                    part.push(char::from_u32(code).unwrap_or(char::REPLACEMENT_CHARACTER));
                }
                text.extend_from_slice(part.as_bytes());
                *rest = left;
            }
        }
    }
}
