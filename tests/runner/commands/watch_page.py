"""Reads the numbers of a page of `palpate watch`, apart from its script."""

import base64
import json
import re
import zlib


def columns(data, specs):
    """{name: values} of columns of whole numbers: varints, zigzag, differences of some order."""
    content = iter(zlib.decompress(base64.b64decode(data)))
    found = {}
    for name, count, step, order in specs:
        whole = []
        for _ in range(count):
            value = shift = 0
            while True:
                byte = next(content)
                value |= (byte & 127) << shift
                shift += 7
                if byte < 128:
                    break
            whole.append(value >> 1 if value % 2 == 0 else -(value >> 1) - 1)
        for _ in range(order):
            total, sums = 0, []
            for value in whole:
                total += value
                sums.append(total)
            whole = sums
        found[name] = [value / step for value in whole]
    assert next(content, None) is None
    return found


def read(text):
    """The document of a page, its columns decoded; those of a path are those of the show that it names."""
    document = json.loads(re.search(r'<script type="application/json" id="ticks">(.*?)</script>', text, re.S).group(1))
    for mesh in document["meshes"]:
        mesh["columns"] = columns(mesh.pop("data"), mesh["columns"])
    for show in document["shows"]:
        show["columns"] = columns(show.pop("data"), show["columns"])
        if "path" in show:
            show["columns"] = {**document["shows"][show["path"]]["columns"], **show["columns"]}
    return document
