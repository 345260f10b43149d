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
    "too-many-trials", "tool-radius", "tool-segment-without-length", "two-keys",
    "v2-adjust-limits", "v2-codes-of-no-answer", "v2-answer-without-key", "v2-criterion-with-an-adaptive-procedure", "v2-easier-of-the-other-side", "v2-labels-alike", "v2-level-axis-of-no-length", "v2-level-nowhere",
    "v2-level-of-another-shape", "v2-level-out-of-range",
    "v2-names-alike", "v2-order-of-an-adaptive-block", "v2-order-without-solution", "v2-page-before-unknown-block",
    "v2-renderer-not-of-the-protocol", "v2-same-different-of-three", "v2-scale-falls", "v2-sessions-in-order",
    "v2-first-session", "v2-no-time-to-answer", "v2-picture-damaged", "v2-picture-files", "v2-practice-counts", "v2-standard-without-the-number", "v2-too-many-trials", "v2-two-keys", "v2-unknown-stimuli",
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


def main(source):
    tests = source / "tests" / "protocols"
    scene, protocol = load_schemas(source / "protocols")
    version_2 = load_version_2(source / "protocols", protocol.schema)
    failures = []

    def faults(path):
        validator = scene if path.name.startswith("scene") else protocol
        try:
            document = read(path)
        except (ValueError, RecursionError) as error:
            return [str(error)]
        if "1e999" in path.read_text(encoding="utf-8"):
            return ["Python reads a number that is too large as infinity"]
        if isinstance(document, dict) and document.get("version") == 2:
            validator = version_2
        return [f"{error.json_path}: {error.message}" for error in validator.iter_errors(document)]

    good = sorted((tests / "good").glob("*.json")) + [
        p for p in sorted((source / "protocols").glob("*.json")) if ".schema" not in p.name and ".texts." not in p.name]
    for path in good:
        failures += [f"{path.name}, which is good: {fault}" for fault in faults(path)]
    bad = sorted((tests / "bad").glob("*.json"))
    for path in bad:
        accepted = not faults(path)
        if accepted and path.stem not in PROGRAM_ONLY:
            failures.append(f"{path.name}: the schema accepts it")
        if not accepted and path.stem in PROGRAM_ONLY:
            failures.append(f"{path.name}: the schema refuses it, so it is not for the program only")
    published = sorted((source / "protocols" / "spaces").glob("*.json"))
    failures += failures_of(source / "protocols" / "sweep_space.schema.json", tests / "spaces", SPACES_PROGRAM_ONLY, published)
    study = source / "protocols" / "study.schema.json"
    failures += failures_of(study, tests / "studies", STUDIES_PROGRAM_ONLY)
    unused = properties(read(study)) - keys(read(tests / "studies" / "good" / "everything.json"))
    if unused:
        failures.append(f"everything.json of the studies lacks {sorted(unused)}")
    # The parser accepts everything.json, so it knows every key that the schema names.
    unused = properties(protocol.schema) - keys(read(tests / "good" / "everything.json"))
    unused -= {"objects"}  # of scenes
    if unused:
        failures.append(f"everything.json lacks {sorted(unused)}")
    own = {k: v for k, v in version_2.schema.items() if k != "$defs"}
    own["$defs"] = {k: v for k, v in version_2.schema["$defs"].items() if k != "one"}
    unused = properties(own) - keys(read(tests / "good" / "everything-v2.json")) - keys(read(tests / "good" / "external-v2.json"))
    if unused:
        failures.append(f"everything-v2.json and external-v2.json lack {sorted(unused)}")
    endings = re.findall(r"\.\w+", re.search(r'kMeshExtensions = "(.*)"', (source / "stimuli" / "mesh_file.h").read_text())[1])
    for name in [f"mesh{ending}" for ending in endings] + ["MESH.3MF", "mesh.msh"]:
        if next(scene.iter_errors({"objects": [{"shape": "mesh", "file": name}]}), None):
            failures.append(f"the schema refuses the mesh file {name}")
    if len(good) < 7 or len(bad) < 40:
        failures.append(f"only {len(good)} good and {len(bad)} bad files were found")

    print("\n".join(failures) or f"{len(good)} good and {len(bad)} bad files: as they should be")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main(pathlib.Path(sys.argv[1])))
