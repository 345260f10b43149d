"""Gives an object of a calibration or of measured delays its checksum, as palpate does (json_checksum)."""

import hashlib
import json


def sealed(one):
    body = {key: value for key, value in one.items() if key != "sha256"}
    text = json.dumps(body, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
    return body | {"sha256": hashlib.sha256(text.encode()).hexdigest()}
