"""The planes of packed samples (data/store/attempts.h), for tests that look into a database."""

import subprocess
import zlib

ZSTD_FRAME = bytes.fromhex("28b52ffd")
CRC_BYTES = 4


def planes_of(packed):
    """Unpacks the bytes of a row of `samples`. Packings 5 and 6 are zstd, 3 and 4 zlib."""
    body = packed[:-CRC_BYTES]
    if not body.startswith(ZSTD_FRAME):
        return zlib.decompress(body)
    return subprocess.run(["zstd", "-d"], input=body, capture_output=True, check=True).stdout
