"""Closed meshes as CAD programs and scanners give them, made from a seed, and their files. Needs numpy.

A mesh is (vertices, faces): an array of n x 3 in m and an array of m x 3, or a list of index loops.
"""

import struct
import zipfile

import numpy as np


def rotation(rng):
    w, x, y, z = (lambda q: q / np.linalg.norm(q))(rng.normal(size=4))
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


def triangles(faces):
    """Fans: of plane convex faces only."""
    if isinstance(faces, np.ndarray):
        return faces
    return np.array([(f[0], f[k - 1], f[k]) for f in faces for k in range(2, len(f))])


def joined(*meshes):
    """Several shells in one mesh."""
    counts = np.cumsum([0] + [len(v) for v, _ in meshes])
    return np.vstack([v for v, _ in meshes]), np.vstack([triangles(f) + n for (_, f), n in zip(meshes, counts)])


def box(size, at=(0, 0, 0)):
    v = np.array([(x, y, z) for x in (-.5, .5) for y in (-.5, .5) for z in (-.5, .5)]) * size + at
    return v, np.array([(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4),
                        (1, 5, 7), (1, 7, 3)])


def tube(outer, inner, height):
    """Between two star-shaped outlines with as many corners: a ring with a hole."""
    n = len(outer)
    low, high = np.full((n, 1), -height / 2), np.full((n, 1), height / 2)
    v = np.vstack([np.hstack([outer, low]), np.hstack([outer, high]), np.hstack([inner, low]), np.hstack([inner, high])])
    i = np.arange(n)
    k = (i + 1) % n
    quads = [(i, k, n + k, n + i), (2 * n + k, 2 * n + i, 3 * n + i, 3 * n + k), (n + i, n + k, 3 * n + k, 3 * n + i),
             (2 * n + i, 2 * n + k, k, i)]
    return v, np.vstack([np.stack([a, b, c], 1) for q in quads for a, b, c in ((q[0], q[1], q[2]), (q[0], q[2], q[3]))])


def circle(n, radius, phase=0):
    a = 2 * np.pi * np.arange(n) / n + phase
    return np.stack([radius * np.cos(a), radius * np.sin(a)], 1)


def gear(rng, teeth=None):
    teeth = teeth or int(rng.integers(6, 60))
    n = 4 * teeth
    radius = np.where(np.arange(n) % 4 < 2, .03, .03 * (1 - 2.2 / teeth))
    phase = np.array([0, .25, .5, .75])[np.arange(n) % 4] + np.arange(n) // 4 + np.array([.05, -.05, 0, 0])[np.arange(n) % 4]
    a = 2 * np.pi * phase / teeth
    return tube(np.stack([radius * np.cos(a), radius * np.sin(a)], 1), circle(n, .008), rng.uniform(.004, .02))


def gear_on_shaft(rng):
    n = int(rng.integers(8, 80))
    shaft = tube(circle(n, .0085), circle(n, .002), .08)  # thicker than the bore: they overlap
    return joined(gear(rng), shaft)


def plate_with_bores(rng, columns=None, rows=None, sides=None):
    columns, rows = columns or int(rng.integers(1, 6)), rows or int(rng.integers(1, 6))
    quarter = (sides or 4 * int(rng.integers(2, 20))) // 4
    n = 4 * quarter
    t = np.arange(quarter) / quarter - .5
    square = np.vstack([np.stack([t, np.full(quarter, -.5)], 1), np.stack([np.full(quarter, .5), t], 1),
                        np.stack([-t, np.full(quarter, .5)], 1), np.stack([np.full(quarter, -.5), -t], 1)])
    a = np.arctan2(square[:, 1], square[:, 0])
    cells = []
    for i in range(columns):
        for k in range(rows):
            r = rng.uniform(.1, .4)
            v, f = tube(square, r * np.stack([np.cos(a), np.sin(a)], 1), .6)
            side = np.arange(n) // quarter  # the walls between two cells are no surface
            inside = ((side == 0) & (k > 0)) | ((side == 1) & (i < columns - 1)) | ((side == 2) & (k < rows - 1)) | ((side == 3) & (i > 0))
            keep = np.ones(len(f), bool)
            keep[:n][inside] = keep[n:2 * n][inside] = False
            cells.append((v + [i, k, 0], f[keep]))
    v, f = joined(*cells)
    return welded(v * .012, f)


def welded(v, f):
    _, first, inverse = np.unique(np.round(v, 12), axis=0, return_index=True, return_inverse=True)
    return v[first], inverse[f]


def voxels(filled, edge):
    """The surface of cells of a grid; where cells share only an edge or corner, so does the surface."""
    faces = []
    padded = np.pad(filled, 1)
    for axis in range(3):
        for step in (1, -1):
            open_side = padded & ~np.roll(padded, -step, axis)
            c = np.argwhere(open_side) - 1
            u, w = (axis + 1) % 3, (axis + 2) % 3
            corners = []
            for a, b in ((0, 0), (1, 0), (1, 1), (0, 1)):
                p = c.copy()
                p[:, axis] += step > 0
                p[:, u] += a
                p[:, w] += b
                corners.append(p)
            if step < 0:
                corners.reverse()
            faces.append(np.stack(corners, 1))
    quads = np.vstack(faces)
    v, index = np.unique(quads.reshape(-1, 3), axis=0, return_inverse=True)
    q = index.reshape(-1, 4)
    return v * edge, np.vstack([q[:, [0, 1, 2]], q[:, [0, 2, 3]]])


def lattice(rng, cells=None):
    n = cells or int(rng.integers(2, 8))
    filled = np.zeros((3 * n + 1,) * 3, bool)
    for axis in range(3):
        s = [slice(0, None, 3)] * 3
        s[axis] = slice(None)
        filled[tuple(s)] = True
    return voxels(filled, .05 / (3 * n + 1))


def random_voxels(rng):
    n = int(rng.integers(3, 9))
    return voxels(rng.random((n, n, n)) < rng.uniform(.1, .8), .04 / n)


TETRAHEDRA = np.array([(0, 1, 3, 7), (0, 3, 2, 7), (0, 2, 6, 7), (0, 6, 4, 7), (0, 4, 5, 7), (0, 5, 1, 7)])


def isosurface(field, spacing):
    """Where a field on a grid is positive: marching tetrahedra, closed where it is negative on the grid's border."""
    shape = np.array(field.shape)
    number = np.arange(field.size).reshape(field.shape)
    cube = np.stack([number[i:shape[0] - 1 + i, j:shape[1] - 1 + j, k:shape[2] - 1 + k].ravel()
                     for k in (0, 1) for j in (0, 1) for i in (0, 1)], 1)
    value = field.ravel()
    positive = value > 0
    some = positive[cube].any(1) & ~positive[cube].all(1)
    tets = cube[some][:, TETRAHEDRA].reshape(-1, 4)
    inside = positive[tets]
    ends, outward = [], []
    count = inside.sum(1)
    place = lambda numbers: np.stack(np.unravel_index(numbers, field.shape), -1).astype(float)
    for lone in (1, 3):  # one corner differs: a triangle
        t, is_in = tets[count == lone], inside[count == lone]
        k = np.argmax(is_in if lone == 1 else ~is_in, 1)
        a = t[np.arange(len(t)), k]
        o = t[np.arange(4) != k[:, None]].reshape(-1, 3)
        ends.append(np.stack([np.stack([a, o[:, j]], 1) for j in range(3)], 1))
        outward.append((place(o).mean(1) - place(a)) * (1 if lone == 1 else -1))
    t, is_in = tets[count == 2], inside[count == 2]  # two by two: a quadrilateral
    a, b, c, d = np.take_along_axis(t, np.argsort(~is_in, 1, kind="stable"), 1).T
    q = [np.stack(e, 1) for e in ((a, c), (a, d), (b, d), (b, c))]
    for tri in ((0, 1, 2), (0, 2, 3)):
        ends.append(np.stack([q[j] for j in tri], 1))
        outward.append(place(c) + place(d) - place(a) - place(b))
    e = np.vstack(ends)
    e.sort(2)
    edges, index = np.unique(e.reshape(-1, 2), axis=0, return_inverse=True)
    at, w = place(edges), value[edges]
    s = np.clip(w[:, 0] / (w[:, 0] - w[:, 1]), .02, .98)[:, None]
    v = (at[:, 0] * (1 - s) + at[:, 1] * s) * spacing
    f = index.reshape(-1, 3)
    normal = np.cross(v[f[:, 1]] - v[f[:, 0]], v[f[:, 2]] - v[f[:, 0]])
    inward = np.einsum("ij,ij->i", normal, np.vstack(outward)) < 0
    f[inward] = f[inward][:, ::-1]
    return v, f


def bone(rng, n=None):
    """A shaft with two heads and a rough surface, out of a noise field."""
    n = n or int(rng.integers(12, 48))
    m = 2 * n
    x, y, z = np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n), np.linspace(-2, 2, m), indexing="ij")
    r = np.hypot(x, y)
    field = .35 + .35 * np.exp(-4 * (np.abs(z) - 1.5) ** 2) - r - np.maximum(0, np.abs(z) - 1.7)
    for octave in (2, 5, 11):
        k = rng.normal(size=(3, 3)) * octave
        p = rng.uniform(0, 6, 3)
        field = field + .12 / octave * sum(np.sin(k[i, 0] * x + k[i, 1] * y + k[i, 2] * z + p[i]) for i in range(3))
    field[[0, -1]] = field[:, [0, -1]] = -1
    field[:, :, [0, -1]] = -1
    return isosurface(field, .03 / n)


def foam(rng, n=None):
    """Of many handles and cavities."""
    n = n or int(rng.integers(10, 30))
    x, y, z = np.meshgrid(*[np.linspace(0, rng.uniform(6, 14), n)] * 3, indexing="ij")
    field = np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x) + rng.uniform(-.6, .9)
    field[[0, -1]] = field[:, [0, -1]] = -1
    field[:, :, [0, -1]] = -1
    return isosurface(field, .05 / n)


def knot(rng, n=None, m=None):
    """A tube along a knot."""
    n, m = n or int(rng.integers(40, 200)), m or int(rng.integers(5, 16))
    a = 2 * np.pi * np.arange(n) / n
    at = lambda a: np.stack([(2 + np.cos(3 * a)) * np.cos(2 * a), (2 + np.cos(3 * a)) * np.sin(2 * a), np.sin(3 * a)], 1)
    along = at(a + 1e-4) - at(a - 1e-4)
    along /= np.linalg.norm(along, axis=1)[:, None]
    out = np.stack([np.cos(2 * a), np.sin(2 * a), 0 * a], 1)
    out -= (out * along).sum(1)[:, None] * along
    out /= np.linalg.norm(out, axis=1)[:, None]
    side = np.cross(along, out)
    b = 2 * np.pi * np.arange(m) / m
    v = at(a)[:, None] + .35 * (np.cos(b)[:, None] * out[:, None] + np.sin(b)[:, None] * side[:, None])
    i, k = np.meshgrid(np.arange(n), np.arange(m), indexing="ij")
    p = lambda i, k: (i % n * m + k % m).ravel()
    f = np.vstack([np.stack([p(i, k), p(i + 1, k), p(i + 1, k + 1)], 1), np.stack([p(i, k), p(i + 1, k + 1), p(i, k + 1)], 1)])
    v = v.reshape(-1, 3) * .012
    c = v[f]
    return (v, f) if np.einsum("ij,ij->i", c[:, 0], np.cross(c[:, 1], c[:, 2])).sum() > 0 else (v, f[:, ::-1])


def boxes(rng):
    """Shells that overlap, abut and stand apart."""
    return joined(*[box(rng.uniform(.005, .03, 3), rng.uniform(-.02, .02, 3).round(3)) for _ in range(int(rng.integers(2, 8)))])


def hollow(rng):
    v, f = box(np.array([.05, .04, .03]))
    inner = box(np.array([.03, .02, .01]), rng.uniform(-.003, .003, 3))
    return joined((v, f), (inner[0], inner[1][:, ::-1]))


KINDS = (gear, gear_on_shaft, plate_with_bores, lattice, random_voxels, bone, foam, knot, boxes, hollow)

# Of a million triangles and of 327,680, about.
LARGE = (("bone", lambda rng, n: bone(rng, n)), ("foam", lambda rng, n: foam(rng, n)), ("knot", lambda rng, n: knot(rng, n, 64)),
         ("lattice", lambda rng, n: lattice(rng, n)), ("plate", lambda rng, n: plate_with_bores(rng, n, n, 64)))


def mesh(n, seed):
    """Mesh n of a seed: its kind's name, vertices, triangles. Turned."""
    rng = np.random.default_rng([seed, n])
    kind = KINDS[n % len(KINDS)]
    v, f = kind(rng)
    return kind.__name__, v @ rotation(rng).T, triangles(f)


def write(path, v, f, digits=None):
    """By the ending of the path: .obj and .off with digits after the point (None: all 17), .ply of doubles in big-endian
    order, .3mf in millimetres, or binary .stl (single precision)."""
    f = triangles(f)
    number = "%.17g" if digits is None else f"%.{digits}f"
    if path.endswith(".stl"):
        rows = np.zeros(len(f), dtype=[("n", "<f4", 3), ("v", "<f4", (3, 3)), ("a", "<u2")])
        rows["v"] = v[f]
        with open(path, "wb") as out:
            out.write(b" " * 80 + struct.pack("<I", len(f)) + rows.tobytes())
    elif path.endswith(".ply"):
        rows = np.zeros(len(f), dtype=[("n", "u1"), ("f", ">i4", 3)])
        rows["n"], rows["f"] = 3, f
        with open(path, "wb") as out:
            out.write((f"ply\nformat binary_big_endian 1.0\nelement vertex {len(v)}\nproperty double x\nproperty double y\nproperty double z\n"
                       f"element face {len(f)}\nproperty list uchar int vertex_indices\nend_header\n").encode())
            out.write(v.astype(">f8").tobytes() + rows.tobytes())
    elif path.endswith(".3mf"):
        text = ('<model unit="millimeter" xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"><resources><object id="1"><mesh><vertices>'
                + "".join(f'<vertex x="{number}" y="{number}" z="{number}"/>' % tuple(1000 * p) for p in v) + "</vertices>\n<triangles>"
                + "".join('<triangle v1="%d" v2="%d" v3="%d"/>' % tuple(t) for t in f)
                + '</triangles></mesh></object></resources><build><item objectid="1"/></build></model>')
        kind = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as out:
            out.writestr("_rels/.rels", '<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">'
                         f'<Relationship Target="/3D/3dmodel.model" Id="r" Type="{kind}"/></Relationships>')
            out.writestr("3D/3dmodel.model", text)
    elif path.endswith(".off"):
        with open(path, "w") as out:
            out.write(f"OFF\n{len(v)} {len(f)} 0\n")
            np.savetxt(out, v, number)
            np.savetxt(out, np.hstack([np.full((len(f), 1), 3), f]), "%d")
    else:
        with open(path, "w") as out:
            np.savetxt(out, v, "v " + " ".join([number] * 3))
            np.savetxt(out, f + 1, "f %d %d %d")
