//! Opening of input files.
//!
//! Opening never waits (`O_NONBLOCK`). The open handle is checked, and only regular files are
//! accepted. Failures of the system are stored, because decoders would report them as damage of the
//! file.

use super::FileError;
use std::ffi::OsStr;
use std::fs::{File, FileType, OpenOptions};
use std::io::{self, BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};

/// A regular file that is open for reading. Failures of the system are stored in it, because
/// decoders may report a failure as wrong contents.
pub(crate) struct Input {
    file: File,
    length: u64,
    failure: ReadFailure,
}

/// Error of the system, if reading an [`Input`] failed. Clones share the error.
#[derive(Clone, Default)]
pub(crate) struct ReadFailure(Arc<OnceLock<io::Error>>);

impl ReadFailure {
    /// Returns the error of the file `path`. If reading failed, this is the failure of the system.
    /// Otherwise it is `error`, which a decoder reported for the contents.
    pub fn or(&self, path: &Path, error: FileError) -> FileError {
        match self.0.get() {
            Some(failure) => FileError::system(path, "cannot read it", failure).help("check the disk or the network"),
            None => error,
        }
    }
}

impl Input {
    /// Opens a regular file. `what` is the name of the file in error messages, such as `the OBJ
    /// file`. The call never waits for a pipe without a writer. Pipes and all other files that are
    /// not regular files are refused.
    pub fn open(path: &Path, what: &str) -> Result<Self, FileError> {
        if path == OsStr::new("-") {
            let error = FileError::new(path, format!("{what} cannot be standard input"));
            return Err(error
                .help("give a file name; write ./- for a file called `-`")
                .unreadable());
        }
        let refused = |error: io::Error| match error.kind() {
            io::ErrorKind::NotFound => FileError::new(path, format!("cannot read {what}: no such file")),
            _ => FileError::system(path, &format!("cannot read {what}"), &error),
        };
        let mut options = OpenOptions::new();
        options.read(true);
        #[cfg(unix)]
        {
            // Opening a pipe without this flag waits for a writer.
            let flags = rustix::fs::OFlags::NONBLOCK | rustix::fs::OFlags::NOCTTY;
            std::os::unix::fs::OpenOptionsExt::custom_flags(&mut options, flags.bits() as i32);
        }
        // Use the metadata of the open handle, because the path may lead to another file by now.
        let opened = options.open(path).and_then(|file| Ok((file.metadata()?, file)));
        let (metadata, file) = opened.map_err(refused)?;
        if !metadata.is_file() {
            let kind = kind_name(metadata.file_type());
            let error = FileError::new(path, format!("{what} is {kind}, not a regular file"));
            return Err(error
                .help("give the name of a file, or save the data in a file")
                .unreadable());
        }
        Ok(Self {
            file,
            length: metadata.len(),
            failure: ReadFailure::default(),
        })
    }

    /// Length of the file in bytes when it was opened.
    pub fn length(&self) -> u64 {
        self.length
    }

    /// Failure of the input. Clones share the failure, so it can be read after a decoder has taken
    /// the input.
    pub fn failure(&self) -> ReadFailure {
        self.failure.clone()
    }

    /// Adds a buffer. Returns an error if the file is empty.
    pub fn buffered(self, path: &Path) -> Result<BufReader<Self>, FileError> {
        let failure = self.failure();
        let mut reader = BufReader::new(self);
        match reader.fill_buf() {
            Ok([]) => Err(FileError::new(path, "the file is empty").help("save or copy the file again")),
            Ok(_) => Ok(reader),
            Err(error) => Err(failure.or(path, FileError::system(path, "cannot read it", &error))),
        }
    }

    /// Reads all bytes. `path` is the path in error messages.
    pub fn bytes(mut self, path: &Path) -> Result<Vec<u8>, FileError> {
        let mut bytes = Vec::new();
        let length = usize::try_from(self.length).unwrap_or(usize::MAX);
        if bytes.try_reserve_exact(length).is_err() {
            let error = FileError::new(path, format!("not enough memory for the {length} bytes of the file"));
            return Err(error.help("free some memory, or cut the file into several files"));
        }
        self.read_to_end(&mut bytes)
            .map_err(|error| FileError::system(path, "cannot read it", &error).help("check the disk or the network"))?;
        if bytes.len() < length {
            let message = format!("the file shrank while it was read: {} of {length} bytes", bytes.len());
            return Err(FileError::new(path, message)
                .help("try again when the file is complete")
                .unreadable());
        }
        Ok(bytes)
    }
}

/// A reader that counts the bytes that a decoder has read from it.
pub(crate) struct CountingReader<R> {
    reader: R,
    position: Position,
}

/// Position of a [`CountingReader`], in bytes from the start of the file. Clones share the
/// position.
#[derive(Clone, Default)]
pub(crate) struct Position(Arc<AtomicU64>);

impl Position {
    /// Offset in bytes of the next byte.
    pub fn get(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }
}

impl<R> CountingReader<R> {
    /// Counts the bytes that are read from `reader`, from 0.
    pub fn new(reader: R) -> Self {
        let position = Position::default();
        Self { reader, position }
    }

    /// Position of the reader. Clones share the position, so it can be read after a decoder has
    /// taken the reader.
    pub fn position(&self) -> Position {
        self.position.clone()
    }
}

impl<R: Read> Read for CountingReader<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.reader.read(buffer)?;
        self.position.0.fetch_add(read as u64, Ordering::Relaxed);
        Ok(read)
    }
}

impl<R: Seek> Seek for CountingReader<R> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        let position = self.reader.seek(to)?;
        self.position.0.store(position, Ordering::Relaxed);
        Ok(position)
    }
}

/// Reads all bytes of a regular file. `what` is the name of the file in error messages.
pub fn read_bytes(path: &Path, what: &str) -> Result<Vec<u8>, FileError> {
    Input::open(path, what)?.bytes(path)
}

/// Reads a regular file as text, in UTF-8 or UTF-16. Bytes that are neither are decoded as
/// Windows-1252.
///
/// # Errors
///
/// If the file cannot be read. `what` is the name of the file in error messages.
pub fn read_text(path: &Path, what: &str) -> Result<String, FileError> {
    let bytes = read_bytes(path, what)?;
    if let Some(characters) = utf16_characters(&bytes) {
        return Ok(characters
            .map(|character| character.unwrap_or(char::REPLACEMENT_CHARACTER))
            .collect());
    }
    Ok(String::from_utf8(bytes).unwrap_or_else(|error| decoded(error.as_bytes())))
}

/// Characters of the bytes 0x80 to 0x9f in Windows-1252 (WHATWG Encoding Standard, index
/// windows-1252). The bytes 0xa0 to 0xff are the same as in Latin-1.
const WINDOWS_1252: [char; 32] = [
    '€', '\u{81}', '‚', 'ƒ', '„', '…', '†', '‡', 'ˆ', '‰', 'Š', '‹', 'Œ', '\u{8d}', 'Ž', '\u{8f}', '\u{90}', '‘', '’',
    '“', '”', '•', '–', '—', '˜', '™', 'š', '›', 'œ', '\u{9d}', 'ž', 'Ÿ',
];

/// Decodes UTF-8. Invalid bytes are decoded as Windows-1252. Different invalid bytes become
/// different characters, so different names stay different. A name has the same text in both
/// encodings.
pub fn decoded(bytes: &[u8]) -> String {
    let character = |&byte: &u8| match byte {
        0x80..=0x9f => WINDOWS_1252[usize::from(byte - 0x80)],
        _ => char::from(byte),
    };
    let mut text = String::with_capacity(bytes.len());
    for chunk in bytes.utf8_chunks() {
        text.push_str(chunk.valid());
        text.extend(chunk.invalid().iter().map(character));
    }
    text
}

/// Characters of a text in UTF-16. `None` if the text begins neither with a byte-order mark nor
/// with ASCII in which every other byte is 0.
fn utf16_characters(bytes: &[u8]) -> Option<impl Iterator<Item = Result<char, std::char::DecodeUtf16Error>>> {
    let (start, decode): (usize, fn([u8; 2]) -> u16) = match *bytes {
        [0xff, 0xfe, ..] => (2, u16::from_le_bytes),
        [0xfe, 0xff, ..] => (2, u16::from_be_bytes),
        [first, 0, second, 0, ..] if first != 0 && second != 0 => (0, u16::from_le_bytes),
        [0, first, 0, second, ..] if first != 0 && second != 0 => (0, u16::from_be_bytes),
        _ => return None,
    };
    let pairs = bytes[start..].chunks_exact(2);
    Some(char::decode_utf16(pairs.map(move |pair| decode([pair[0], pair[1]]))))
}

/// Name, for error messages, of a kind of file that is not a regular file.
fn kind_name(kind: FileType) -> &'static str {
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt;
        if kind.is_fifo() {
            return "a pipe";
        }
        if kind.is_char_device() || kind.is_block_device() {
            return "a device";
        }
        if kind.is_socket() {
            return "a socket";
        }
    }
    if kind.is_dir() { "a directory" } else { "something else" }
}

impl Read for Input {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.file.read(buffer);
        let failed = read.as_ref().err().filter(|e| e.kind() != io::ErrorKind::Interrupted);
        if let Some(code) = failed.and_then(io::Error::raw_os_error) {
            _ = self.failure.0.set(io::Error::from_raw_os_error(code));
        }
        read
    }
}

impl Seek for Input {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_in_utf16_are_read_like_others() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.obj");
        let text = "usemtl wände 🎨\nv 1 2 3\n";
        let units: Vec<u16> = text.encode_utf16().collect();
        let little: Vec<u8> = units.iter().flat_map(|unit| unit.to_le_bytes()).collect();
        let big: Vec<u8> = units.iter().flat_map(|unit| unit.to_be_bytes()).collect();
        for bytes in [
            text.as_bytes().to_vec(),
            little.clone(),
            big.clone(),
            [&[0xff, 0xfe], &little[..]].concat(),
            [&[0xfe, 0xff], &big[..]].concat(),
        ] {
            std::fs::write(&path, &bytes).unwrap();
            assert_eq!(read_text(&path, "the file").unwrap(), text, "{:?}", &bytes[..4]);
        }
        // Bytes of other encodings are decoded as Windows-1252. A text that consists of zeros is
        // not UTF-16.
        for (bytes, expected) in [
            (&b"v\xe4 \x80\xff\x81 1"[..], "vä €ÿ\u{81} 1"),
            (b"Stra\xdfe Stra\xc3\x9fe \xe2\x82", "Straße Straße â‚"),
            (b"\0\0\0\0", "\0\0\0\0"),
            (b"", ""),
        ] {
            std::fs::write(&path, bytes).unwrap();
            assert_eq!(read_text(&path, "the file").unwrap(), expected);
        }
    }

    /// Files of `/proc`, such as `/proc/self/mem`, may be regular, have length 0, and fail when
    /// they are read.
    #[cfg(target_os = "linux")]
    #[test]
    fn failure_of_the_system_replaces_other_errors() {
        let path = Path::new("/proc/self/mem");
        let input = Input::open(path, "the picture").unwrap();
        let failure = input.failure();
        let error = input.buffered(path).err().unwrap();
        assert!(
            error.is_unreadable() && error.message.starts_with("cannot read it"),
            "{error}"
        );
        let damage = FileError::new(path, "the picture is invalid");
        assert_eq!(failure.or(path, damage.clone()).message, error.message);
        assert_eq!(ReadFailure::default().or(path, damage.clone()), damage);
        assert!(read_bytes(path, "the picture").unwrap_err().is_unreadable());
    }
}
