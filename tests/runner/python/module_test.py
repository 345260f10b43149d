"""The Python module gives what the program gives, to the bit, and says what it says."""

import ast
import concurrent.futures
import csv
import inspect
import io
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import palpate

QUICK = {"version": 1, "name": "tiny", "renderers": ["point", "ray"], "repetitions": 1,
         "stimuli": [{"name": "sphere", "shape": "sphere", "radius_m": 0.03, "subdivisions": 1},
                     {"name": "cube", "shape": "cube", "edge_m": 0.05}],
         "practice": {"repetitions": 1}, "sessions": {"count": 2}, "blocks_per_renderer": 1,
         "response": {"keys": {"1": "sphere", "2": "cube"}, "time_out_s": 5}, "seed": 7}
CUBE = {"objects": [{"shape": "cube", "edge_m": 0.05, "stiffness_n_per_m": 500}]}


def with_(document, **changes):
    return {**document, **changes}


def assert_same(columns, text):
    """Columns against the program's CSV: names, order and every value, bit for bit."""
    rows = list(csv.reader(io.StringIO(text)))
    assert list(columns) == rows[0]
    assert len(rows) > 1
    for number, name in enumerate(rows[0]):
        column, fields = columns[name], [row[number] for row in rows[1:]]
        assert column.shape == (len(fields),), name
        if column.dtype.kind == "U":
            assert column.tolist() == fields, name
        elif column.dtype.kind == "b":
            assert [str(int(v)) for v in column] == fields, name
        elif column.dtype.kind == "i":
            assert [str(v) for v in column] == fields, name
        else:
            expected = np.array([float(field or "nan") for field in fields])
            assert column.dtype == np.float64
            assert np.array_equal(column.view(np.int64), expected.view(np.int64)) or np.array_equal(
                column, expected, equal_nan=True), name


def study_csv(program, folder, *options):
    program(folder, "simulate", *options, "--db", "study.db")
    program(folder, "export", "--db", "study.db", "--format", "csv", "--out", "trials.csv")
    return (folder / "trials.csv").read_text()


@pytest.mark.parametrize("version,seed", [(1, 1), (2, 5), (3, 18446744073709551615)])
def test_a_study_equals_the_programs_bit_by_bit(program, tmp_path, version, seed):
    (tmp_path / "p.json").write_text(json.dumps(QUICK))
    text = study_csv(program, tmp_path, "p.json", "--participants", 2, "--seed", seed, "--participant-version", version)
    columns = palpate.simulate(tmp_path / "p.json", palpate.settings(version), participants=2, seed=seed)
    assert_same(columns, text)
    assert set(columns["participant_id"]) == {"S001", "S002"}
    assert set(columns["session"]) == {1, 2}
    assert columns["practice"].any() and not columns["practice"].all()
    from_dict = palpate.simulate(QUICK, palpate.settings(version), participants=2, seed=seed)
    assert from_dict["response_time"].tobytes() == columns["response_time"].tobytes()


def test_changed_settings_equal_the_programs_patch(program, tmp_path):
    (tmp_path / "p.json").write_text(json.dumps(with_(QUICK, sessions={"count": 1})))
    (tmp_path / "patch.json").write_text(json.dumps({"motor": {"slide_speed_m_per_s": 0.031}, "observer": {"threshold": 0.7}}))
    text = study_csv(program, tmp_path, "p.json", "--participants", 1, "--settings", "patch.json")
    person = palpate.settings()
    person["motor"]["slide_speed_m_per_s"] = np.float64(0.031)
    person["observer"]["threshold"] = 0.7
    columns = palpate.simulate(tmp_path / "p.json", person, participants=1)
    assert_same(columns, text)
    assert columns["observer_sha256"][0] != palpate.simulate(tmp_path / "p.json", participants=1)["observer_sha256"][0]


def test_no_answer_is_nan_not_a_text(program, tmp_path):
    (tmp_path / "p.json").write_text(json.dumps(with_(QUICK, response={"keys": QUICK["response"]["keys"], "time_out_s": 0.5})))
    text = study_csv(program, tmp_path, "p.json", "--participants", 1)
    columns = palpate.simulate(tmp_path / "p.json", participants=1)
    assert_same(columns, text)
    assert (columns["response"][columns["timed_out"]] == "").all() and columns["timed_out"].any()
    assert np.isnan(columns["first_contact_time"]).any()


def test_a_schedule_equals_the_programs(program, protocols):
    for number in (1, 2, 11):
        text = program(protocols, "schedule", "quick.json", "--participant", number, "--format", "csv")
        assert_same(palpate.schedule(protocols / "quick.json", number), text)


def path_of_stylus(side=False):
    t = np.arange(400) * 0.001
    columns = {"t": t, "tip_x": 0.001 * np.sin(40 * t), "tip_y": 0.01 + 0.02 * t, "tip_z": 0.05 - 0.1 * t,
               "tail_x": 0.0 * t + 0.02, "tail_y": 0.05 + 0.0 * t, "tail_z": 0.14 - 0.02 * t}
    if side:
        columns.update(side_x=1 + 0 * t, side_y=0.2 * t, side_z=0 * t)
    return columns


def write_csv(file, columns):
    np.savetxt(file, np.column_stack(list(columns.values())), fmt="%.17g", delimiter=",", header=",".join(columns), comments="")


@pytest.mark.parametrize("renderer", ["point", "ray"])
@pytest.mark.parametrize("extra,side", [({}, False), ({"reach": {"factor": 1.2, "pivot": "grip"}}, False),
                                        ({"tool": {"segments": [{"from_m": [0, 0, 0], "to_m": [0, 0, 0.1]},
                                                                {"from_m": [0, 0, 0], "to_m": [0.01, 0, 0.02]}]}}, True)])
def test_forces_equal_the_programs_bit_by_bit(program, tmp_path, renderer, extra, side):
    scene, columns = with_(CUBE, **extra), path_of_stylus(side)
    (tmp_path / "s.json").write_text(json.dumps(scene))
    write_csv(tmp_path / "t.csv", columns)
    program(tmp_path, "render", "--scene", "s.json", "--renderer", renderer, "--trajectory", "t.csv", "--out", "o.csv")
    text = (tmp_path / "o.csv").read_text()
    for trajectory in (columns, tmp_path / "t.csv", np.genfromtxt(tmp_path / "t.csv", delimiter=",", names=True)):
        out = palpate.render(scene, trajectory, renderer)
        assert_same(out, text)
    assert np.abs(out["force_z"]).max() > 0.1
    assert ("segment" in out) == ("tool" in scene)
    assert_same(palpate.render(str(tmp_path / "s.json"), columns, renderer), text)


def test_a_mesh_file_is_a_scene_of_one_object(protocols):
    mesh, columns = protocols / "shapes" / "torus.obj", path_of_stylus()
    columns["tip_x"] += 0.035
    alone, scene = (palpate.render(given, columns, "point")
                    for given in (mesh, {"objects": [{"shape": "mesh", "file": str(mesh)}]}))
    assert all(np.array_equal(alone[name], scene[name]) for name in alone)
    assert np.abs(alone["force_z"]).max() > 0


def test_faults_have_the_programs_words(program, tmp_path):
    bad = with_(QUICK, repetitions=0, colour="red")
    (tmp_path / "p.json").write_text(json.dumps(bad))
    (tmp_path / "good.json").write_text(json.dumps(QUICK))
    (tmp_path / "s.json").write_text(json.dumps({"objects": [{"shape": "cube", "edge_m": -1}]}))
    (tmp_path / "t.csv").write_text("t,tip_x,tip_y,tip_z,tail_x,tail_y,tail_z\n0,0,0,0,0,0,1\n0,0,0,0,0,0,1\n")
    stiff = with_(QUICK, material={"stiffness_n_per_m": 100000})
    (tmp_path / "stiff.json").write_text(json.dumps(stiff))
    t = {name: np.zeros(1) for name in palpate.POSE_COLUMNS}
    os.chdir(tmp_path)
    for call, arguments in (
            (lambda: palpate.simulate("p.json"), ["simulate", "p.json", "--db", "x.db"]),
            (lambda: palpate.simulate("none.json"), ["simulate", "none.json", "--db", "x.db"]),
            (lambda: palpate.simulate("stiff.json"), ["simulate", "stiff.json", "--db", "x.db"]),
            (lambda: palpate.simulate("good.json", participants=0), ["simulate", "good.json", "--db", "x.db", "--participants", 0]),
            (lambda: palpate.schedule("p.json", 1), ["schedule", "p.json", "--participant", 1]),
            (lambda: palpate.schedule("good.json", 0), ["schedule", "good.json", "--participant", 0]),
            (lambda: palpate.render("s.json", t, "ray"),
             ["render", "--scene", "s.json", "--renderer", "ray", "--trajectory", "t.csv", "--out", "o.csv"]),
            (lambda: palpate.render(CUBE, "t.csv", "ray"),
             ["render", "--scene", "cube.json", "--renderer", "ray", "--trajectory", "t.csv", "--out", "o.csv"]),
            (lambda: palpate.render(CUBE, t, "both"),
             ["render", "--scene", "cube.json", "--renderer", "both", "--trajectory", "t.csv", "--out", "o.csv"])):
        (tmp_path / "cube.json").write_text(json.dumps(CUBE))
        said = program(tmp_path, *arguments, status=2)
        with pytest.raises(palpate.InputError) as raised:
            call()
        assert str(raised.value).strip()
        assert str(raised.value) in said
    assert issubclass(palpate.InputError, ValueError)


def test_wrong_settings_are_named():
    person = palpate.settings(3)
    del person["motor"]["slide_speed_m_per_s"]
    person["percept"]["place"] = "elbow"
    person["mood"] = 3
    with pytest.raises(palpate.InputError) as raised:
        palpate.simulate(QUICK, person)
    for words in ("/motor/slide_speed_m_per_s: is missing", "/percept/place: must be tip or surface", "/mood: no such setting"):
        assert words in str(raised.value)
    with pytest.raises(ValueError, match="no version 4"):
        palpate.settings(4)
    with pytest.raises(ValueError):
        palpate.simulate(QUICK, with_(palpate.settings(), note=float("nan")))
    with pytest.raises(TypeError):
        palpate.simulate(QUICK, seed=-1)
    with pytest.raises(TypeError):
        palpate.simulate(None)


def test_wrong_paths_are_named():
    t = path_of_stylus()
    for change, words in (({"t": t["t"][::-1]}, "row 1: expected a time later"), ({"t": t["t"] * np.nan}, "row 0: expected a finite time"),
                          ({"tip_x": t["t"][:-1]}, "one length"), ({"tip_x": np.zeros((400, 1))}, "one length")):
        with pytest.raises(palpate.InputError, match=words):
            palpate.render(CUBE, with_(t, **change), "ray")
    with pytest.raises(palpate.InputError, match="missing: tail_z"):
        palpate.render(CUBE, {name: t[name] for name in palpate.POSE_COLUMNS[:-1]}, "ray")
    with pytest.raises(palpate.InputError, match="at least one row"):
        palpate.render(CUBE, {name: t[name][:0] for name in t}, "ray")


def test_parallel_threads_give_the_same_results():
    started, together = threading.Barrier(2, timeout=60), []

    def study(seed):
        started.wait()
        columns = palpate.simulate(QUICK, participants=1, seed=seed)["response_time"].tobytes()
        together.append(seed)
        return columns

    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        futures = [pool.submit(study, seed) for seed in (1, 2)]
        ticks = 0
        while len(together) < 2 and not any(f.done() and f.exception() for f in futures):
            ticks += 1  # this thread continues: the lock is free
            time.sleep(0.001)
        found = [f.result() for f in futures]
    assert ticks > 3
    assert found == [palpate.simulate(QUICK, participants=1, seed=seed)["response_time"].tobytes() for seed in (1, 2)]
    assert found[0] != found[1]


@pytest.mark.parametrize("call", ["palpate.simulate(%r, participants=100000)" % QUICK,
                                  "palpate.render(%r, many(), 'ray')" % CUBE])
def test_ctrl_c_ends_a_long_call(call):
    code = f"""
import sys, numpy as np, palpate
def many():
    t = np.arange(3000000) * 0.001
    return {{name: t if name == "t" else 0.02 * np.sin(t + i) + (0.1 if name == "tail_z" else 0)
            for i, name in enumerate(palpate.POSE_COLUMNS)}}
print("now", flush=True)
try:
    {call}
    print("came to its end", flush=True)
except KeyboardInterrupt:
    print("interrupted", flush=True)
"""
    child = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert child.stdout.readline() == "now\n"
    time.sleep(3)
    child.send_signal(signal.SIGINT)
    assert child.communicate(timeout=300)[0] == "interrupted\n"


def test_no_file_is_written(tmp_path):
    os.chdir(tmp_path)
    palpate.simulate(QUICK, participants=1)
    palpate.render(CUBE, path_of_stylus(), "ray")
    assert list(tmp_path.iterdir()) == []


def test_stubs_and_docstrings_match_the_module():
    stub = ast.parse((pathlib.Path(palpate.__file__).parent / "_palpate.pyi").read_text())
    stated = {node.name for node in stub.body if isinstance(node, (ast.FunctionDef, ast.ClassDef))}
    stated |= {node.target.id for node in stub.body if isinstance(node, ast.AnnAssign)}
    found = {name for name in dir(palpate._palpate) if not name.startswith("__") or name == "__version__"}
    assert stated == found
    for name in palpate.__all__:
        assert getattr(palpate, name) is not None
    for function in (palpate.simulate, palpate.render, palpate.schedule, palpate.settings):
        signature = inspect.signature(function)
        assert signature.return_annotation is not inspect.Signature.empty
        for parameter in signature.parameters.values():
            assert parameter.annotation is not inspect.Parameter.empty
            assert parameter.name in function.__doc__ or function is palpate.schedule


def test_the_stub_has_the_parameters_of_the_compiled_functions():
    stub = ast.parse((pathlib.Path(palpate.__file__).parent / "_palpate.pyi").read_text())

    def compiled(function):
        """Names in the first line that pybind11 writes: name(a: T, b: T) -> T"""
        return re.findall(r"[(,] ?(\w+)(?=[:,)])", function.__doc__.splitlines()[0].rpartition(" -> ")[0])

    functions = {node.name: node for node in stub.body if isinstance(node, ast.FunctionDef)}
    assert len(functions) > 5
    for name, node in functions.items():
        assert [arg.arg for arg in node.args.args] == compiled(getattr(palpate._palpate, name)), name
    made, = [node for kind in stub.body if isinstance(kind, ast.ClassDef) and kind.name == "Document" for node in kind.body]
    assert [arg.arg for arg in made.args.args] == compiled(palpate._palpate.Document.__init__)
    assert issubclass(palpate._palpate.InputError, ValueError)


TYPED = """
import asyncio
import palpate
from typing import Any, Dict

def loop(hand: palpate.Client) -> float:
    zero: int = hand.start(stimulus="ball", renderer="ray", trial=1)
    said: Dict[str, Any] = hand.answer("ball", t_ns=zero, correct=True)
    clock: palpate.Clock = hand.clock()
    hand.start("ball", trial="one")  # wrong
    hand.set("/objects/0")  # wrong
    hand.begin()  # wrong
    late: str = hand.mark(3)  # wrong
    hand.wait_for(("left", "fault"), 3)
    return clock.offset_ns + float(hand.samples()["force"][:, 2].sum()) + float(said["response_time_s"])

async def watch() -> None:
    async with await palpate.AsyncClient.from_token_file("token.json", role="watch") as eye:
        await eye.subscribe(250, ("tip", "force"))
        later: int = eye.start()  # wrong
        first: Dict[str, Any] = await eye.wait_for("first_contact")

asyncio.run(watch())
trials = palpate.simulate("p.json", {"motor": {}}, participants=2, seed=5)
palpate.simulate("p.json", seed="5")  # wrong
palpate.render({"objects": []}, trials, "ray")["force_x"].mean()
palpate.settings(3)["motor"]
palpate.schedule("p.json")  # wrong
"""


def test_a_type_checker_accepts_the_module_and_finds_wrong_use(tmp_path):
    mypy = shutil.which("mypy")
    if mypy is None:
        pytest.skip("mypy is not installed")
    program = tmp_path / "program.py"
    program.write_text(TYPED)
    folder = pathlib.Path(palpate.__file__).parent
    done = subprocess.run([mypy, "--strict", "--no-error-summary", "--cache-dir", tmp_path / "cache", "--python-executable",
                           sys.executable, program, folder / "__init__.py", folder / "client.py", folder / "_palpate.pyi"],
                          env={**os.environ, "MYPYPATH": str(folder.parent)}, cwd=tmp_path, capture_output=True, text=True, timeout=300)
    wrong = {number for number, line in enumerate(TYPED.splitlines(), 1) if line.endswith("# wrong")}
    found = {line.split(":")[1] for line in done.stdout.splitlines() if line.startswith("program.py:") and ": error:" in line}
    assert found == {str(number) for number in wrong}, done.stdout + done.stderr
    assert all(line.startswith("program.py:") for line in done.stdout.splitlines()), done.stdout


def test_both_clients_are_annotated_and_alike():
    def public(kind):
        return {name: getattr(kind, name) for name in dir(kind) if not name.startswith("_") and callable(getattr(kind, name))}

    blocking, awaited = public(palpate.Client), public(palpate.AsyncClient)
    assert set(awaited) - set(blocking) == {"connect"}
    assert set(blocking) <= set(awaited)
    for name, function in {**blocking, "connect": palpate.AsyncClient.connect}.items():
        signature = inspect.signature(function)
        assert function.__doc__, name
        assert signature.return_annotation is not inspect.Signature.empty, name
        for parameter in signature.parameters.values():
            assert parameter.name == "self" or parameter.annotation is not inspect.Parameter.empty, (name, parameter)
        if name not in ("connect", "from_token_file"):
            other = inspect.signature(awaited[name])
            assert list(other.parameters.values()) == list(signature.parameters.values()), name
            assert other.return_annotation == signature.return_annotation, name
    # connect() is the constructor of the other.
    made = inspect.signature(palpate.Client).parameters
    assert list(inspect.signature(palpate.AsyncClient.connect).parameters.values()) == list(made.values())


def test_without_its_compiled_part_the_message_explains_the_build(tmp_path):
    package = tmp_path / "palpate"
    package.mkdir()
    for name in ("__init__.py", "client.py", "_palpate.pyi", "py.typed"):
        shutil.copy(pathlib.Path(palpate.__file__).parent / name, package)
    done = subprocess.run([sys.executable, "-c", "import palpate"], env={**os.environ, "PYTHONPATH": str(tmp_path)},
                          capture_output=True, text=True, timeout=60)
    assert done.returncode == 1
    said = done.stderr[done.stderr.index("ImportError: palpate is here"):]
    assert f"was not built for Python {sys.version_info.major}.{sys.version_info.minor}" in said
    assert "cmake --build --preset release --target palpate_python" in said
