"""Lines of numbers as text, many rows at a time, without a Python object per number.

Every number is put together from words of four characters that are looked up;
unused characters are NUL, and are taken out at the end.
"""

import numpy as np

_ROWS = 50_000  # put together at a time: bounds the memory


def _words(texts):
    """Texts of up to four characters as 32-bit words."""
    return np.frombuffer(b"".join(t.encode().ljust(4, b"\0") for t in texts), dtype=np.uint32)


_PADDED = _words([f"{i:04}" for i in range(10_000)])                # 0012
_LEADING = _words(["" if i == 0 else f"{i}" for i in range(10_000)])  # 12, nothing for 0
_NUMBER = _words([f"{i}" for i in range(10_000)])                   # 12, 0
_STRIPPED = _words([f"{i:04}".rstrip("0") for i in range(10_000)])  # 0012, 12 for 1200
_ZEROS = np.array([4 - len(f"{i:04}".rstrip("0")) for i in range(10_000)], dtype=np.int16)
_LEAST = -60
_EXPONENTS = _words(["" if e == 0 else f"e{e}" for e in range(_LEAST, 61)])
_SIGNS = _words([" ", " -"])
_UNITS = _words(["e-5"])[0]
_NEWLINE = _words(["\n"])[0]

# Of the exponent bits of a float32, the power of ten below, and what scales to nine digits.
_TENS = np.array([int(np.floor((e - 127) * np.log10(2.0))) for e in range(256)], dtype=np.int16)
_SCALES = np.array([10.0 ** (8 - int(t)) for t in _TENS])


def _floats(words, values):
    """Nine significant digits, with which a float32 survives exactly, without zeros at
    the end: 5e-1. `words` is (…, 5)."""
    magnitude = np.abs(values)
    field = magnitude.view(np.uint32) >> 23
    scaled = magnitude * _SCALES[field]
    over = scaled >= 999_999_999.5
    digits = np.rint(np.where(over, scaled * 0.1, scaled)).astype(np.uint32)
    exponent = _TENS[field] - 8 + over
    exponent[digits == 0] = 0
    high, low = np.divmod(digits, np.uint32(10_000))
    first, middle = np.divmod(high, np.uint32(10_000))
    words[..., 0] = _SIGNS[(values < 0.0).view(np.uint8)]
    words[..., 1] = _NUMBER[first]
    short = low == 0
    words[..., 2] = np.where(short, _STRIPPED[middle], _PADDED[middle])
    words[..., 3] = _STRIPPED[low]
    exponent += _ZEROS[low]
    exponent += np.where(short, _ZEROS[middle], np.int16(0))
    exponent[digits == 0] = 0
    words[..., 4] = _EXPONENTS[exponent - _LEAST]


def _integers(words, values):
    """Integers from 0 to 10⁸ − 1. `words` is (…, 2)."""
    high, low = np.divmod(values, np.uint32(10_000))
    words[..., 0] = _LEADING[high]
    words[..., 1] = np.where(high == 0, _NUMBER[low], _PADDED[low])


def _lines(name, rows, width, fill):
    """Lines of a name and what `fill(words, rows)` writes, `width` words a row; yields
    the bytes and how many rows they hold."""
    for start in range(0, len(rows), _ROWS):
        chunk = rows[start:start + _ROWS]
        words = np.empty((len(chunk), width + 2), dtype=np.uint32)
        words[:, 0] = _words([name])[0]
        fill(words[:, 1:-1], chunk)
        words[:, -1] = _NEWLINE
        yield words.tobytes().translate(None, b"\0"), len(chunk)


def floats(name, rows):
    """`v 1 5e-1 -25e-2`, of float32."""
    count = rows.shape[1]

    def fill(words, chunk):
        _floats(words.reshape(-1, count, 5), chunk)
    return _lines(name, np.ascontiguousarray(rows, dtype=np.float32), 5 * count, fill)


def units(name, rows):
    """`vn 0e-5 70711e-5 -70711e-5`, of integers in units of 1e-5."""
    count = rows.shape[1]

    def fill(words, chunk):
        words = words.reshape(-1, count, 4)
        words[..., 0] = _SIGNS[(chunk < 0).view(np.uint8)]
        _integers(words[..., 1:3], np.abs(chunk).astype(np.uint32))
        words[..., 3] = _UNITS
    return _lines(name, rows, 4 * count, fill)


def corners(name, faces, indices, separators):
    """`f 1/1/3 2/2/3 4/4/3`: `faces` has rows of corners; each of `indices`, one per separator,
    has a number from 0 on for every corner."""
    signs = _words(separators)

    def fill(words, chunk):
        words = words.reshape(*chunk.shape, len(indices), 3)
        words[..., 0] = signs
        for k, index in enumerate(indices):
            _integers(words[..., k, 1:], (index[chunk] + 1).astype(np.uint32))
    return _lines(name, faces, 3 * faces.shape[1] * len(indices), fill)
