"""Damage of files: bits, pieces, cuts and doublings for any kind; lines and numbers of texts; sound checksums."""

import re
import struct
import zlib

PIECES = [
    b"nan", b"-", b"1e999", b"[", b"]", b"{", b"&a", b"*a", b"!!", b"\n", b"\x00", b"\xff", b"# ", b": ", b"\t",
    b"99999999999", b"P2", b"P5", b"65535", b"0", b"'", b'"', b"---", b"0x1F", b"1:60", b"\xef\xbb\xbf", b" ",
]  # fmt: skip
NUMBERS = [
    b"nan", b"inf", b"-inf", b"1e999", b"1e308", b"-1e308", b"1e-320", b"1.0E 20", b"0", b"-1",
    b"99999999999999999999", b"", b"x", b"0x1F", b"1,5", b"3.", b"1e6", b"-0.0", b"\xff", b"NaN",
    b"Infinity", b"true", b"null",
]  # fmt: skip
_NUMBER = re.compile(rb"-?\d+(?:\.\d+)?")


def mutated(content, draws):
    """Return the bytes with one to three changes: a bit, a piece put in, a cut, or a part doubled."""
    for _ in range(draws.integers(1, 3)):
        # Half changes strike the first bytes, where the header is.
        at = int(draws.integers(len(content) + 1) * draws.choice([1.0, 0.1]))
        kind = draws.integers(5)
        if kind == 0 and at < len(content):
            content = content[:at] + bytes([content[at] ^ (1 << draws.integers(8))]) + content[at + 1 :]
        elif kind == 1:
            content = content[:at] + PIECES[draws.integers(len(PIECES))] + content[at:]
        elif kind == 2:
            content = content[:at] + content[at + draws.integers(1, 12) :]
        elif kind == 3:
            content = content[:at]
        else:
            content = content[: at + 9] + content[at:]
    return content


def with_other_numbers(content, draws):
    """Return a text with one to three of its numbers replaced by others or by none."""
    for _ in range(draws.integers(1, 4)):
        found = list(_NUMBER.finditer(content))
        if not found:
            return content
        number = found[draws.integers(len(found))]
        content = content[: number.start()] + NUMBERS[draws.integers(len(NUMBERS))] + content[number.end() :]
    return content


def with_other_lines(content, draws):
    """Return a text with lines lost, doubled, exchanged or moved."""
    lines = content.split(b"\n")
    for _ in range(draws.integers(1, 4)):
        one, other = draws.integers(len(lines), size=2)
        kind = draws.integers(4)
        if kind == 0 and len(lines) > 1:
            del lines[one : one + draws.integers(1, 5)]
            lines = lines or [b""]
        elif kind == 1:
            lines[other:other] = lines[one : one + draws.integers(1, 9)]
        elif kind == 2:
            lines[one], lines[other] = lines[other], lines[one]
        else:
            lines.insert(other, lines.pop(one))
    return b"\n".join(lines)


def with_sound_checksums(content):
    """Return a PNG image whose chunks have the checksums of what they hold, as far as there are whole chunks."""
    parts, at = [content[:8]], 8
    while at + 12 <= len(content):
        (length,) = struct.unpack(">I", content[at : at + 4])
        if at + 12 + length > len(content):
            break
        body = content[at + 4 : at + 8 + length]
        parts += [content[at : at + 4], body, struct.pack(">I", zlib.crc32(body))]
        at += 12 + length
    return b"".join(parts) + content[at:]
