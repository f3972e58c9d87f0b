//! `<DataArray>` elements of VTK XML files: ASCII, base64 or appended bytes, compressed or not.
//!
//! Bytes come as `[n][data]`, with a compressor as `[blocks][block size][size of the last block, 0 if full][compressed size
//! of each block][blocks]`, where the numbers of the header have the file's `header_type`.

use std::borrow::Cow;
use std::io::Read;

use base64::Engine;
use base64::engine::DecodePaddingMode;
use base64::engine::general_purpose::{GeneralPurpose, GeneralPurposeConfig};

use super::text::shown;
use super::xml::Element;

/// What the attributes of `<VTKFile>` say about bytes, and the appended ones.
pub(super) struct Encoding<'a> {
    pub(super) big_endian: bool,
    pub(super) header_bytes: usize,
    pub(super) compressor: Option<Compressor>,
    pub(super) appended: Option<Appended<'a>>,
}

#[derive(Clone, Copy)]
pub(super) enum Compressor {
    Zlib,
    Lz4,
    Lzma,
}

/// The bytes behind the underscore of `<AppendedData>`, to the end of the file.
pub(super) struct Appended<'a> {
    pub(super) base64: bool,
    pub(super) bytes: &'a [u8],
}

/// Numbers of an array, as they are in the file.
pub(super) enum Values {
    Integers(Vec<i64>),
    Reals(Vec<f64>),
}

impl Values {
    /// Integers, or a message.
    pub(super) fn integers(self) -> Result<Vec<i64>, String> {
        match self {
            Values::Integers(values) => Ok(values),
            Values::Reals(_) => Err("is of a floating-point type; integers are accepted".into()),
        }
    }

    /// Integers are converted.
    pub(super) fn reals(self) -> Vec<f64> {
        match self {
            Values::Integers(values) => values.into_iter().map(|v| v as f64).collect(),
            Values::Reals(values) => values,
        }
    }

    fn len(&self) -> usize {
        match self {
            Values::Integers(values) => values.len(),
            Values::Reals(values) => values.len(),
        }
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl Scalar {
    fn new(name: &str) -> Result<Self, String> {
        Ok(match name {
            "Int8" => Scalar::I8,
            "UInt8" => Scalar::U8,
            "Int16" => Scalar::I16,
            "UInt16" => Scalar::U16,
            "Int32" => Scalar::I32,
            "UInt32" => Scalar::U32,
            "Int64" => Scalar::I64,
            "UInt64" => Scalar::U64,
            "Float32" => Scalar::F32,
            "Float64" => Scalar::F64,
            _ => {
                let name = shown(name.as_bytes());
                return Err(format!(
                    "type '{name}'; Float32, Float64, Int8 to Int64 and UInt8 to UInt64 are accepted"
                ));
            }
        })
    }

    fn bytes(self) -> usize {
        match self {
            Scalar::I8 | Scalar::U8 => 1,
            Scalar::I16 | Scalar::U16 => 2,
            Scalar::I32 | Scalar::U32 | Scalar::F32 => 4,
            Scalar::I64 | Scalar::U64 | Scalar::F64 => 8,
        }
    }

    fn is_real(self) -> bool {
        matches!(self, Scalar::F32 | Scalar::F64)
    }
}

/// Numbers in a row of the array.
pub(super) fn components(array: &Element) -> Result<usize, String> {
    match array.attribute("NumberOfComponents") {
        None => Ok(1),
        Some(text) => match text.trim().parse() {
            Ok(n) if n > 0 => Ok(n),
            _ => Err(format!(
                "NumberOfComponents is '{}'; 1 or more is accepted",
                shown(text.as_bytes())
            )),
        },
    }
}

/// The `count` numbers of an array.
pub(super) fn read(array: &Element, count: usize, encoding: &Encoding) -> Result<Values, String> {
    let scalar = Scalar::new(array.attribute("type").unwrap_or_default())?;
    let format = array.attribute("format").unwrap_or("ascii");
    let bytes = || {
        count
            .checked_mul(scalar.bytes())
            .ok_or_else(|| format!("{count} numbers are announced"))
    };
    let values = match format {
        "ascii" => ascii(&array.text, scalar)?,
        "binary" => {
            let text: Vec<u8> = array.text.bytes().filter(|b| !b.is_ascii_whitespace()).collect();
            from_bytes(
                &payload(&mut Source::base64(&text), bytes()?, encoding)?,
                scalar,
                encoding.big_endian,
            )?
        }
        "appended" => {
            let appended = encoding
                .appended
                .as_ref()
                .ok_or("is appended, but the file has no <AppendedData>")?;
            let offset = array.attribute("offset").unwrap_or_default();
            let rest = offset.trim().parse().ok().and_then(|o: usize| appended.bytes.get(o..));
            let rest = rest.ok_or_else(|| {
                let offset = shown(offset.as_bytes());
                format!(
                    "offset '{offset}' does not lie in the {} appended bytes",
                    appended.bytes.len()
                )
            })?;
            let mut source = if appended.base64 {
                Source::base64(rest)
            } else {
                Source::Raw(rest)
            };
            from_bytes(&payload(&mut source, bytes()?, encoding)?, scalar, encoding.big_endian)?
        }
        _ => {
            let format = shown(format.as_bytes());
            return Err(format!("format '{format}'; ascii, binary and appended are accepted"));
        }
    };
    if values.len() != count {
        return Err(format!("has {} numbers where {count} are announced", values.len()));
    }
    Ok(values)
}

fn ascii(text: &str, scalar: Scalar) -> Result<Values, String> {
    fn all<T: std::str::FromStr>(text: &str, accepted: &str) -> Result<Vec<T>, String> {
        text.split_ascii_whitespace()
            .map(|w| {
                w.parse()
                    .map_err(|_| format!("'{}'; {accepted} is accepted", shown(w.as_bytes())))
            })
            .collect()
    }
    if scalar.is_real() {
        Ok(Values::Reals(all(text, "a number")?))
    } else {
        Ok(Values::Integers(all(text, "a whole number")?))
    }
}

fn from_bytes(bytes: &[u8], scalar: Scalar, big_endian: bool) -> Result<Values, String> {
    fn all<const N: usize, T>(bytes: &[u8], big_endian: bool, make: impl Fn([u8; N]) -> T) -> Vec<T> {
        let chunks = bytes.as_chunks::<N>().0.iter();
        chunks
            .map(|chunk| {
                let mut chunk = *chunk;
                if big_endian {
                    chunk.reverse();
                }
                make(chunk)
            })
            .collect()
    }
    let be = big_endian;
    Ok(match scalar {
        Scalar::I8 => Values::Integers(all(bytes, be, |b| i8::from_le_bytes(b).into())),
        Scalar::U8 => Values::Integers(all(bytes, be, |b| u8::from_le_bytes(b).into())),
        Scalar::I16 => Values::Integers(all(bytes, be, |b| i16::from_le_bytes(b).into())),
        Scalar::U16 => Values::Integers(all(bytes, be, |b| u16::from_le_bytes(b).into())),
        Scalar::I32 => Values::Integers(all(bytes, be, |b| i32::from_le_bytes(b).into())),
        Scalar::U32 => Values::Integers(all(bytes, be, |b| u32::from_le_bytes(b).into())),
        Scalar::I64 => Values::Integers(all(bytes, be, i64::from_le_bytes)),
        Scalar::U64 => {
            let values: Result<Vec<i64>, _> = all(bytes, be, |b| i64::try_from(u64::from_le_bytes(b)))
                .into_iter()
                .collect();
            Values::Integers(values.map_err(|_| format!("has a number above {}", i64::MAX))?)
        }
        Scalar::F32 => Values::Reals(all(bytes, be, |b| f32::from_le_bytes(b).into())),
        Scalar::F64 => Values::Reals(all(bytes, be, f64::from_le_bytes)),
    })
}

/// The `expected` bytes of an array behind their header.
fn payload<'a>(source: &mut Source<'a>, expected: usize, encoding: &Encoding) -> Result<Cow<'a, [u8]>, String> {
    let wrong_size = |found: u128| format!("has {found} bytes where {expected} are announced");
    let header = |source: &mut Source<'a>| -> Result<u64, String> {
        let bytes = source.take(encoding.header_bytes)?;
        let mut wide = [0; 8];
        wide[..bytes.len()].copy_from_slice(&bytes);
        if encoding.big_endian {
            wide[..bytes.len()].reverse();
        }
        Ok(u64::from_le_bytes(wide))
    };
    let Some(compressor) = encoding.compressor else {
        let size = header(source)?;
        return if size == expected as u64 {
            source.take(expected)
        } else {
            Err(wrong_size(size.into()))
        };
    };
    let (blocks, block_size, last_size) = (header(source)?, header(source)?, header(source)?);
    let total = match (blocks, last_size) {
        (0, _) => 0,
        (_, 0) => u128::from(blocks) * u128::from(block_size),
        _ => u128::from(blocks - 1) * u128::from(block_size) + u128::from(last_size),
    };
    if total != expected as u128 {
        return Err(wrong_size(total));
    }
    let mut sizes = Vec::new(); // grows with what is read, so that a false number of blocks takes no memory
    for _ in 0..blocks {
        sizes.push(header(source)?);
    }
    let mut bytes = Vec::new();
    for (k, compressed) in sizes.iter().enumerate() {
        let last = k + 1 == sizes.len() && last_size > 0;
        // no more than `expected`, which is a usize
        let size = if last { last_size } else { block_size } as usize;
        let compressed = source.take(usize::try_from(*compressed).map_err(|_| "a block is too large")?)?;
        decompress(&compressed, size, compressor, &mut bytes).map_err(|e| format!("block {k}: {e}"))?;
    }
    Ok(bytes.into())
}

/// Appends the `size` bytes of a block.
fn decompress(block: &[u8], size: usize, compressor: Compressor, out: &mut Vec<u8>) -> Result<(), String> {
    /// More than the 8 MiB that VTK and Python use, less than a damaged file may ask for.
    const LZMA_MEMORY_KIB: u32 = 128 * 1024;
    fn all(reader: impl Read, size: usize, out: &mut Vec<u8>) -> Result<usize, String> {
        // one byte more, so that the end of the stream, with its checksum, is read
        reader.take(size as u64 + 1).read_to_end(out).map_err(|e| e.to_string())
    }
    let found = match compressor {
        Compressor::Zlib => all(flate2::read::ZlibDecoder::new(block), size, out)?,
        Compressor::Lzma => all(
            lzma_rust2::XzReader::new_mem_limit(block, false, LZMA_MEMORY_KIB),
            size,
            out,
        )?,
        Compressor::Lz4 => {
            // a byte of LZ4 stands for at most 255
            if size / 255 > block.len() {
                return Err(format!("{} bytes cannot hold {size}", block.len()));
            }
            let bytes = lz4_flex::block::decompress(block, size).map_err(|e| e.to_string())?;
            out.extend_from_slice(&bytes);
            bytes.len()
        }
    };
    if found != size {
        return Err(format!("has {found} bytes where {size} are announced"));
    }
    Ok(())
}

/// Bytes one after another, from bytes or base64.
enum Source<'a> {
    Raw(&'a [u8]),
    /// What is left of the text, and bytes that have been decoded and not taken.
    Base64(&'a [u8], Vec<u8>),
}

/// Header and data may be encoded apart, so that padding can occur in between: it is dealt with below.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &base64::alphabet::STANDARD,
    GeneralPurposeConfig::new()
        .with_decode_allow_trailing_bits(true)
        .with_decode_padding_mode(DecodePaddingMode::RequireCanonical),
);

impl<'a> Source<'a> {
    fn base64(text: &'a [u8]) -> Self {
        Source::Base64(text, Vec::new())
    }

    /// The next `size` bytes.
    fn take(&mut self, size: usize) -> Result<Cow<'a, [u8]>, String> {
        const TOO_SHORT: &str = "the data end too early";
        match self {
            Source::Raw(bytes) => {
                let (first, rest) = bytes.split_at_checked(size).ok_or(TOO_SHORT)?;
                *bytes = rest;
                Ok(first.into())
            }
            Source::Base64(text, decoded) => {
                if size / 3 > text.len() / 4 + 1 {
                    return Err(TOO_SHORT.into());
                }
                while decoded.len() < size {
                    let wanted = (size - decoded.len()).div_ceil(3) * 4;
                    let chunk = &text[..wanted.min(text.len())];
                    let chunk = match chunk.iter().position(|&b| b == b'=') {
                        Some(padding) => &chunk[..((padding / 4 + 1) * 4).min(chunk.len())],
                        None => chunk,
                    };
                    if chunk.is_empty() {
                        return Err(TOO_SHORT.into());
                    }
                    BASE64
                        .decode_vec(chunk, decoded)
                        .map_err(|e| format!("is not base64: {e}"))?;
                    *text = &text[chunk.len()..];
                }
                let rest = decoded.split_off(size);
                Ok(std::mem::replace(decoded, rest).into())
            }
        }
    }
}
