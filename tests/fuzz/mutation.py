"""Small damage to a file, aimed at what its structure is made of."""

import io
import random
import re
import zipfile

_TOKEN = re.compile(rb"[A-Za-z_][A-Za-z0-9_]*|\d+(?:\.\d+)?|\"[^\"\n]*\"|[\[\]{}<>=,:;]")
_ZIP = b"PK\x03\x04"
STRANGE = (
    *(b"", b"0", b"-1", b"1e999", b"-1e308", b"nan", b"inf", b"1e-320", b"true", b"null", b"{}"),
    *(b"9" * 30, b"9" * 5000, b"[" * 2000, b'{"a":' * 1000, b"a." * 2000, b"0x7fffffffffffffff"),
    *(b'"', b"'", b"\\", b"\x00", b"\xff\xfe", b"\xed\xa0\x80", "é".encode(), b"..", b"/", b"%s"),
    *(b'"9**9**8 bar"', b'"1e308 bar"', b'"inf bar"', b'"-3 mm"', b"\n", b"\n[a]\n"),
)
"""What takes the place of a token: numbers, texts and brackets that somebody has stumbled over."""


def mutated(chance: random.Random, content: bytes) -> bytes:
    """Return a file's content with one to four kinds of damage; in archives often of a member."""
    if content.startswith(_ZIP) and chance.random() < 0.6:
        return _in_archive(chance, content)
    for _ in range(chance.choice((1, 1, 1, 2, 4))):
        content = chance.choice(DAMAGES)(chance, content)
    return content


def _in_archive(chance: random.Random, content: bytes) -> bytes:
    """Damage a member of an archive, whose checksum is right afterwards."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    name = chance.choice(list(members))
    members[name] = mutated(chance, members[name])
    if chance.random() < 0.1:
        members[chance.choice((*members, "x.npy", "../x.npy", "\u00e9"))] = members.pop(name)
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as archive:
        for member, data in members.items():
            archive.writestr(member, data)
    return out.getvalue()


def _flipped(chance: random.Random, content: bytes) -> bytes:
    data = bytearray(content)
    for _ in range(chance.choice((1, 1, 3, 20))):
        if data:
            data[chance.randrange(len(data))] ^= 1 << chance.randrange(8)
    return bytes(data)


def _overwritten(chance: random.Random, content: bytes) -> bytes:
    """Put an extreme number of 1, 2, 4 or 8 bytes somewhere."""
    size = chance.choice((1, 2, 4, 8))
    at = chance.randrange(max(1, len(content) - size + 1))
    number = chance.choice((0, 1, 2 ** (8 * size) - 1, 2 ** (8 * size - 1), chance.getrandbits(8)))
    return content[:at] + number.to_bytes(size, "little") + content[at + size :]


def _cut(chance: random.Random, content: bytes) -> bytes:
    first, last = sorted(chance.randrange(len(content) + 1) for _ in range(2))
    return chance.choice((content[:first], content[:first] + content[last:], content[first:last]))


def _repeated(chance: random.Random, content: bytes) -> bytes:
    first, last = sorted(chance.randrange(len(content) + 1) for _ in range(2))
    return content[:last] + content[first : min(last, first + 2000)] + content[last:]


def _exchanged(chance: random.Random, content: bytes) -> bytes:
    """Put something strange, or another token of the file, in the place of a token."""
    window = chance.randrange(max(1, len(content)))
    tokens = list(_TOKEN.finditer(content, window, window + 4000))
    if not tokens:
        return content
    token, other = chance.choice(tokens), chance.choice(tokens)
    given = chance.choice(STRANGE) if chance.random() < 0.7 else other[0]
    return content[: token.start()] + given + content[token.end() :]


def _shuffled(chance: random.Random, content: bytes) -> bytes:
    """Move a line elsewhere."""
    lines = content.split(b"\n")
    line = lines.pop(chance.randrange(len(lines)))
    lines.insert(chance.randrange(len(lines) + 1), line)
    return b"\n".join(lines)


DAMAGES = (_flipped, _overwritten, _cut, _repeated, _exchanged, _exchanged, _exchanged, _shuffled)
