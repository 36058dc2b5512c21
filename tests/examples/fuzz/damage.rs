//! Damage by rules that keep most of a text readable, so that wrong numbers get far.

use sampling::Random;

/// Numbers that programs do not expect.
const ODD_NUMBERS: [&str; 16] = [
    "-1",
    "0",
    "1",
    "2",
    "255",
    "65536",
    "2147483647",
    "4294967295",
    "4294967296",
    "9007199254740993",
    "18446744073709551615",
    "1e38",
    "1e39",
    "-1e-45",
    "1e999",
    "null",
];

/// A copy with one to four faults.
pub(crate) fn damage(original: &[u8], other: &[u8], random: Random) -> Vec<u8> {
    let mut bytes = original.to_vec();
    for fault in 0..1 + random.u32(2) % 4 {
        let number = |i: u32| random.u32(8 * fault + 8 + i) as usize;
        if bytes.is_empty() {
            break;
        }
        let at = number(0) % bytes.len();
        let span = at..(at + 1 + number(1) % 40).min(bytes.len());
        let digit = bytes
            .iter()
            .skip(at)
            .position(u8::is_ascii_digit)
            .map(|ahead| at + ahead);
        match (number(2) % 8, digit) {
            (0 | 1, Some(digit)) => bytes[digit] = b'0' + (number(3) % 10) as u8,
            (2 | 3, Some(digit)) => {
                let end = digit + bytes[digit..].iter().take_while(|b| b.is_ascii_digit()).count();
                bytes.splice(digit..end, ODD_NUMBERS[number(3) % ODD_NUMBERS.len()].bytes());
            }
            (4, _) => bytes[at] = number(3) as u8,
            (5, _) => drop(bytes.drain(span)),
            (6, _) if !other.is_empty() => {
                let from = number(3) % other.len();
                let to = (from + 1 + number(4) % 200).min(other.len());
                bytes.splice(span, other[from..to].iter().copied());
            }
            (7, _) if number(3) % 4 == 0 => bytes.truncate(at),
            _ => {
                let repeated = bytes[span.clone()].to_vec();
                bytes.splice(span.start..span.start, repeated);
            }
        }
    }
    bytes
}
