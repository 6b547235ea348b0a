//! What tells one file from another, whatever it is called.

use std::io::Read;
use std::path::Path;

use sha2::{Digest, Sha256};

/// SHA-256 of a file, in hexadecimal, read block by block.
///
/// # Errors
/// What the system says when the file cannot be read.
pub fn sha256_of_file(path: &Path) -> std::io::Result<String> {
    sha256(&mut std::fs::File::open(path)?)
}

fn sha256(from: &mut impl Read) -> std::io::Result<String> {
    let mut digest = Sha256::new();
    let mut block = vec![0; 1 << 16];
    loop {
        match from.read(&mut block)? {
            0 => break,
            count => digest.update(&block[..count]),
        }
    }
    Ok(digest.finalize().iter().map(|b| format!("{b:02x}")).collect())
}

#[cfg(test)]
mod tests {
    /// FIPS 180-2, appendix B.1.
    #[test]
    fn val_sha256_of_abc() {
        let published = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(super::sha256(&mut &b"abc"[..]).expect("read"), published);
    }
}
