"""Checks the published JSON Schemas with the same good and bad files as the parser.

Usage: schema_test.py SOURCE_DIR
"""

import json
import pathlib
import re
import sys

import jsonschema

# Beyond JSON Schema, which cannot compare values, count across the file or look for files; and the JSON reader drops
# duplicate keys. The program refuses these.
PROGRAM_ONLY = {
    "codes-alike", "compounds-too-deep", "friction-static-below-dynamic", "grip-off-the-stylus", "key-for-unknown",
    "keys-that-are-one", "keys-that-are-one-elsewhere",
    "keys-given-twice", "labels-alike", "layers-out-of-order", "material-twice", "max-run-alone", "min-distance-too-far", "more-blocks-than-repetitions",
    "more-sessions-than-trials", "quaternions", "same-names", "stimulus-without-key", "surface-without-layers",
    "too-many-trials", "tool-radius", "tool-segment-without-length", "textures-together", "two-keys", "fields-that-feed-energy",
    "v2-adjust-limits", "v2-dimensions-beyond", "v2-dimensions-groups", "v2-dimensions-reversed", "v2-dimensions-roles", "v2-dimensions-together", "v2-codes-of-no-answer", "v2-cues", "v2-answer-without-key", "v2-criterion-with-an-adaptive-procedure", "v2-easier-of-the-other-side", "v2-labels-alike", "v2-level-axis-of-no-length", "v2-level-nowhere",
    "v2-level-of-another-shape", "v2-level-out-of-range",
    "v2-names-alike", "v2-order-of-an-adaptive-block", "v2-order-without-solution", "v2-page-before-unknown-block",
    "v2-renderer-not-of-the-protocol", "v2-same-different-of-three", "v2-seen-from-behind", "v2-seen-without-view", "v2-scale-falls", "v2-sessions-in-order",
    "v2-factors-crossed", "v2-first-session", "v2-groups-patched", "v2-no-time-to-answer", "v2-picture-damaged", "v2-picture-files", "v2-practice-counts", "v2-reach-together", "v2-standard-without-the-number", "v2-too-many-trials", "v2-two-keys", "v2-unknown-stimuli",
}
# The same for sweep spaces and studies.
SPACES_PROGRAM_ONLY = {"limits-in-order", "names-twice", "normal-far-away", "values-set-twice"}
STUDIES_PROGRAM_ONLY = {"keys-given-twice", "orcid-digit"}


def refuse_constant(word):
    raise ValueError(f"{word} is no JSON")


def read(path):
    return json.loads(path.read_bytes().decode("utf-8"), parse_constant=refuse_constant)


def rewrite(value, replace):
    """Every $ref passed through replace()."""
    if isinstance(value, dict):
        return {k: replace(v) if k == "$ref" else rewrite(v, replace) for k, v in value.items()}
    if isinstance(value, list):
        return [rewrite(v, replace) for v in value]
    return value


def load_schemas(folder):
    """The two schemas; the protocols' with the scenes' inside, for a validator without files."""
    scene = read(folder / "scene.schema.json")
    protocol = read(folder / "protocol.schema.json")
    for schema in (scene, protocol):
        jsonschema.Draft202012Validator.check_schema(schema)
    inner = rewrite(scene, lambda ref: ref.replace("#/$defs/", "#/$defs/scene/$defs/"))
    inner.pop("$schema")
    bundled = rewrite(
        protocol, lambda ref: ref.replace("scene.schema.json#/$defs/", "#/$defs/scene/$defs/"))
    bundled["$defs"]["scene"] = inner
    return jsonschema.Draft202012Validator(scene), jsonschema.Draft202012Validator(bundled)


def load_version_2(folder, bundled):
    """The schema of version 2, with the others inside."""
    schema = read(folder / "protocol.v2.schema.json")
    jsonschema.Draft202012Validator.check_schema(schema)
    inner = rewrite(bundled, lambda ref: ref.replace("#/", "#/$defs/one/"))
    inner.pop("$schema")
    schema = rewrite(schema, lambda ref: ref.replace("protocol.schema.json#/", "#/$defs/one/").replace(
        "scene.schema.json#/$defs/", "#/$defs/one/$defs/scene/$defs/"))
    schema["$defs"]["one"] = inner
    return jsonschema.Draft202012Validator(schema)


def properties(schema):
    """All keys that a schema names."""
    found = set()
    if isinstance(schema, dict):
        found |= set(schema.get("properties", {}))
        for value in schema.values():
            found |= properties(value)
    elif isinstance(schema, list):
        for value in schema:
            found |= properties(value)
    return found


def keys(value):
    if isinstance(value, dict):
        return set(value).union(*map(keys, value.values()))
    return set().union(*map(keys, value)) if isinstance(value, list) else set()


def failures_of(schema, files, program_only, more_good=()):
    """Faults of a standalone schema, with the folders good and bad in `files`."""
    validator = jsonschema.Draft202012Validator(read(schema))
    validator.check_schema(validator.schema)
    good, bad = [*sorted((files / "good").glob("*.json")), *more_good], sorted((files / "bad").glob("*.json"))
    failures = [f"{path.name}, which is good: {fault.message}" for path in good for fault in validator.iter_errors(read(path))]
    for path in bad:
        try:
            accepted = validator.is_valid(read(path))
        except ValueError:
            accepted = False
        if accepted != (path.stem in program_only):
            failures.append(f"{path.name}: {schema.name} {'accepts' if accepted else 'refuses'} it")
    if len(good) < 2 or len(bad) < 15:
        failures.append(f"only {len(good)} good and {len(bad)} bad files of {schema.name} were found")
    return failures


class Protocols:
    """Protocols and scenes by their schemas, against the good and bad files of the parser's tests."""

    def __init__(self, source):
        self.source, self.files = source, source / "tests" / "protocols"
        self.scene, self.protocol = load_schemas(source / "protocols")
        self.version_2 = load_version_2(source / "protocols", self.protocol.schema)
        published = sorted((source / "protocols").glob("*.json"))
        self.good = sorted((self.files / "good").glob("*.json")) + [
            path for path in published if ".schema" not in path.name and ".texts." not in path.name]
        self.bad = sorted((self.files / "bad").glob("*.json"))

    def faults(self, path):
        validator = self.scene if path.name.startswith("scene") else self.protocol
        try:
            document = read(path)
        except (ValueError, RecursionError) as error:
            return [str(error)]
        if "1e999" in path.read_text(encoding="utf-8"):
            return ["Python reads a number that is too large as infinity"]
        if isinstance(document, dict) and document.get("version") == 2:
            validator = self.version_2
        return [f"{error.json_path}: {error.message}" for error in validator.iter_errors(document)]

    def of_files(self):
        failures = [f"{path.name}, which is good: {fault}" for path in self.good for fault in self.faults(path)]
        for path in self.bad:
            accepted = not self.faults(path)
            if accepted and path.stem not in PROGRAM_ONLY:
                failures.append(f"{path.name}: the schema accepts it")
            if not accepted and path.stem in PROGRAM_ONLY:
                failures.append(f"{path.name}: the schema refuses it, so it is not for the program only")
        if len(self.good) < 7 or len(self.bad) < 40:
            failures.append(f"only {len(self.good)} good and {len(self.bad)} bad files were found")
        return failures

    def of_unused_keys(self):
        """The parser accepts these files, so it knows every key that the schema names."""
        def keys_in(*names):
            return set().union(*(keys(read(self.files / "good" / name)) for name in names))

        failures = []
        unused = properties(self.protocol.schema) - keys_in("everything.json", "scene-textures.json")
        unused -= {"objects"}  # of scenes
        if unused:
            failures.append(f"everything.json and scene-textures.json lack {sorted(unused)}")
        own = {k: v for k, v in self.version_2.schema.items() if k != "$defs"}
        own["$defs"] = {k: v for k, v in self.version_2.schema["$defs"].items() if k != "one"}
        unused = properties(own) - keys_in("everything-v2.json", "external-v2.json", "procedures-v2.json", "reach-v2.json", "seen-v2.json", "heard-v2.json", "dimensions-v2.json")
        if unused:
            failures.append(f"everything-v2.json, external-v2.json, procedures-v2.json, reach-v2.json, seen-v2.json and heard-v2.json lack {sorted(unused)}")
        return failures

    def of_mesh_files(self):
        """The schema takes the names that the program takes."""
        header = (self.source / "stimuli" / "mesh_file.h").read_text()
        endings = re.findall(r"\.\w+", re.search(r'kMeshExtensions = "(.*)"', header)[1])
        return [f"the schema refuses the mesh file {name}"
                for name in [f"mesh{ending}" for ending in endings] + ["MESH.3MF", "mesh.msh"]
                if next(self.scene.iter_errors({"objects": [{"shape": "mesh", "file": name}]}), None)]


def spaces(source):
    published = sorted((source / "protocols" / "spaces").glob("*.json"))
    return failures_of(source / "protocols" / "sweep_space.schema.json", source / "tests" / "protocols" / "spaces",
                       SPACES_PROGRAM_ONLY, published)


def studies(source):
    schema, files = source / "protocols" / "study.schema.json", source / "tests" / "protocols" / "studies"
    failures = failures_of(schema, files, STUDIES_PROGRAM_ONLY)
    unused = properties(read(schema)) - keys(read(files / "good" / "everything.json"))
    if unused:
        failures.append(f"everything.json of the studies lacks {sorted(unused)}")
    return failures


def main(source):
    protocols = Protocols(source)
    failures = [*protocols.of_files(), *protocols.of_unused_keys(), *protocols.of_mesh_files(), *spaces(source),
                *studies(source)]
    print("\n".join(failures) or f"{len(protocols.good)} good and {len(protocols.bad)} bad files: as they should be")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main(pathlib.Path(sys.argv[1])))
