//! Random changes to files that are read. Shared with the tests of the engine.

/// A sequence of numbers (xorshift), the same in every run.
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % n as u64) as usize
    }
}

/// What a damaged file may say in place of a number.
pub(crate) const WILD: [&str; 10] = [
    "-1",
    "nan",
    "inf",
    "1e999",
    "9223372036854775807",
    "18446744073709551615",
    "4294967296",
    "0",
    "",
    "x",
];

/// Bytes with one to four random changes: bits and numbers replaced, parts removed, doubled or taken from `others`, `words`
/// put in.
pub(crate) fn mutate(bytes: &[u8], others: &[Vec<u8>], words: &[&str], random: &mut Random) -> Vec<u8> {
    let mut out = bytes.to_vec();
    for _ in 0..1 + random.below(4) {
        let n = out.len().max(1);
        let (i, j) = (random.below(n).min(out.len()), random.below(n).min(out.len()));
        let (start, end) = (i.min(j), i.max(j));
        match random.below(9) {
            0 if !out.is_empty() => {
                let at = random.below(out.len());
                out[at] ^= 1 << random.below(8);
            }
            1 => drop(out.drain(start..end.min(start + 40))),
            2 => {
                let copy = out[start..end.min(start + 200)].to_vec();
                out.splice(i..i, copy);
            }
            3 => out.truncate(start),
            4 | 5 => {
                let digits: Vec<usize> = (0..out.len()).filter(|&k| out[k].is_ascii_digit()).collect();
                if let Some(&at) = digits.get(random.below(digits.len().max(1))) {
                    let length = out[at..].iter().take_while(|b| b.is_ascii_digit()).count();
                    out.splice(at..at + length, WILD[random.below(WILD.len())].bytes());
                }
            }
            6 => {
                let word = words[random.below(words.len())];
                out.splice(i..i, format!(" {word} ").into_bytes());
            }
            7 => {
                let other = &others[random.below(others.len())];
                let from = random.below(other.len().max(1)).min(other.len());
                let part = other[from..(from + random.below(200)).min(other.len())].to_vec();
                out.splice(start..end.min(start + 60), part);
            }
            _ => {
                let wild = [[0; 8], [0xff; 8], [0, 0, 0, 0x80, 0, 0, 0, 0x7f]][random.below(3)];
                let length = [1, 2, 4, 8][random.below(4)].min(out.len() - start);
                out[start..start + length].copy_from_slice(&wild[..length]);
            }
        }
    }
    out
}
