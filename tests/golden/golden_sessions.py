"""Commands that need devices and answers: sessions on a terminal, servers with a program, devices without hardware.

Files named *.live.* and databases live*.db hold what a hand did at its time: see same_outputs.py.
"""

import json

from golden_steps import SOURCE, File, Serve, Session, Shell, refused, steps

# Slow and soft, so that no five ticks in a row are missed on a busy machine.
SLOW = {"servo": {"rate_hz": 100}, "home": {"rest_s": 0.1}, "material": {"stiffness_n_per_m": 60}, "samples": True, "orientation": "fixed"}
STIMULI = [{"name": "ball", "shape": "sphere", "radius_m": 0.02, "subdivisions": 1}, {"name": "box", "shape": "cube", "edge_m": 0.03}]
TEXTS = {"instructions": "Welcome, \u00dcbung", "break": "have a rest", "end": "good bye"}
SHAPES = {"version": 1, "name": "live", "renderers": ["point", "ray"], "seed": 7, **SLOW, "stimuli": STIMULI, "repetitions": 1, "texts": TEXTS,
          "blocks_per_renderer": 1, "response": {"keys": {"1": "ball", "2": "box"}, "time_out_s": 30}}
LEVEL = {"stimuli": ["ball"], "level": {"path": "/stiffness_n_per_m"}, "standard": "ball"}
TASKS = {"version": 2, "name": "tasks", "renderers": ["point"], "seed": 5, **SLOW, "texts": TEXTS,
         "stimuli": [{**STIMULI[0], "stiffness_n_per_m": 60}, STIMULI[1]],
         "pages": [{"name": "consent", "kind": "consent", "consent_version": "1", "text": "Do you take part?"},
                   {"name": "you", "kind": "questionnaire", "items": [
                       {"name": "hand", "kind": "choice", "question": "Which hand?", "choices": ["left", "right"]},
                       {"name": "age", "kind": "number", "question": "How many?", "min": 1, "max": 9}]}],
         "blocks": [{"name": "which", "task": "identify", "stimuli": ["ball", "box"], "repetitions": 1, "feedback": True, "question": "WHICH"},
                    {"name": "pair", "task": "compare", **LEVEL, "procedure": {"kind": "constant", "levels": [40], "repetitions": 1},
                     "question": "STIFFER", "inter_interval_s": 0.2,
                     "confidence": {"question": "SURE", "scale": [{"label": "guessed"}, {"label": "sure", "number": 5}]}},
                    {"name": "rate", "task": "rate", "stimuli": ["ball"], "repetitions": 1, "min": -10, "max": 100, "question": "HOW HARD"},
                    {"name": "adjust", "task": "adjust", **LEVEL, "min": 20, "max": 100, "turn": 10, "starts": [30], "repetitions": 1,
                     "question": "EQUAL"}]}
STAIRS = {**TASKS, "name": "stairs", "pages": [], "blocks": [
    {"name": "stairs", "task": "compare", **LEVEL, "question": "STIFFER",
     "procedure": {"kind": "staircase", "start": 90, "min": 50, "max": 100, "steps": [20, 10], "stop": {"trials": 4}}}]}
EXTERNAL = {**TASKS, "name": "served", "pages": [], "blocks": [
    {"name": "free", "task": "external", "stimuli": ["ball", "box"], "trials": 3, "answers": ["soft", "hard"],
     "level": {"path": "/stiffness_n_per_m"}, "min": 20, "max": 60}]}
BALL = {"objects": [{"shape": "sphere", "radius_m": 0.03, "subdivisions": 2, "stiffness_n_per_m": 50}]}
GO_ON = ("[space bar: go on]", " ")


ADVISOR = str(SOURCE / "runner/python/examples/propose_levels.py")


def session_lines():
    yield from run_lines()
    yield from serve_lines()
    yield from device_lines()


def file(name, content):
    return File(name, json.dumps(content))


def run(protocol, code, more):
    return (f"run {protocol} --db live.db --participant {code} --device simulated --no-window {more}").split()


def run_lines():
    new = "--new-participant --consent 1"
    yield [file("shapes.json", SHAPES), file("other.json", {**SHAPES, "texts": {**TEXTS, "end": "thank you"}}),
           Session(run("shapes.json", "P01", f"{new} --spoken --hand left --number 3 --session 1"),
                   [GO_ON, ("[trial, block 1 of 2, trial 1 of 4]", ":answer ball\n"), ("[trial, block 1 of 2, trial 2 of 4", ":note a bell rang\n:answer box\n"), GO_ON, ("[trial", ":repeat\n"),
                    ("[trial", ":stop\n:answer ball\n")]),
           *after_session("first"),
           Session(run("other.json", "P01", "--changed-protocol texts --response-latency 0.01 --markers udp:127.0.0.1:9 --sync --marker-codes"),
                   [GO_ON, ("[trial", "2"), GO_ON]),
           Session(run("shapes.json", "P1", "--without-noise --without-calibration"), [("new", "n\n")], status=2),
           Session(run("shapes.json", "P02", new), [GO_ON, ("[trial", "\x1b"), (":clear", ":clear\n:go\n"), ("[trial", ":quit withdrawn\n")]),
           Session(run("shapes.json", "P02", "--after-withdrawal"), [GO_ON, ("[trial", ":quit\n")]),
           *after_session("last"), *steps("replay --db live.db --trial P01/1/1 --compare", timed=True)]
    yield [file("tasks.json", TASKS),
           Session(run("tasks.json", "P01", new),
                   [("1 I agree", "1"), ("Which hand", "1"), ("How many", "9\n"), GO_ON, ("[trial", "1"), ("[trial", "1"), GO_ON, ("1 / 2\n", " "),
                    ("2 / 2\n", "1"), ("SURE", "1"), GO_ON, ("[trial", "9\n"), GO_ON, ("[trial", "4"), GO_ON]),
           *after_session("tasks")]
    yield [file("stairs.json", STAIRS),
           Shell("asked", f"python3 {ADVISOR} levels.sock & while [ ! -S levels.sock ]; do sleep 0.1; done; trap 'kill %1; rm levels.sock' EXIT\n"
                 "palpate simulate stairs.json --db asked.db --participants 2 --jobs 1 --ask levels.sock --ask-time-out-s 60"),
           *steps("export --db asked.db --format csv --out asked.csv"),
           refused("simulate stairs.json --db alone.db --participants 1 --ask none.sock"),
           refused("run stairs.json --db alone.db --participant P01 --device simulated --no-window --ask none.sock --ask-time-out-s 1")]
    simulated = "--device simulated --no-window"
    failing = ("--device falcon --serial 5 --no-window", "--device touch --library none.so --no-window", f"{simulated} --response-box none",
               "--device inverse3 --service 127.0.0.1:9 --calibration none.json --no-window", f"{simulated} --stream lsl:palpate")
    closed = (f"{simulated} --buttons", f"{simulated} --sound-device none", "--device simulated --full-screen --participant-monitor 1"
              " --console-monitor 2 --ui-scale 1.5")
    wrong = (f"{simulated} --language de", "--device mouse --no-window", "--device falcon --firmware none --no-window")
    yield [file("shapes.json", SHAPES), *(refused(f"run shapes.json --db none.db --participant P01 {more}", status, timed=more in closed)
                                          for status, group in ((1, failing), (1, closed), (2, wrong)) for more in group)]


def after_session(name):
    return steps(f"export --db live.db --format csv --out {name}.live.csv --codebook {name}.codebook.csv --force")


def serve_lines():
    """The simulated stylus strokes at its own time."""
    cube = {"objects": [{"shape": "cube", "edge_m": 0.03, "stiffness_n_per_m": 50}]}
    serve = "serve --device simulated --socket socket --rate 100"
    yield [file("ball.json", BALL),
           Serve(f"{serve} --scene ball.json --allow-origin http://localhost:8000".split(),
                 [("start", {"renderer": "ray"}), ("touch", {}), ("start", {}), ("nonsense", {}), ("load", cube),
                  ("set", {"path": "/objects/0/stiffness_n_per_m", "value": 20}), ("set", {"path": "/objects/0/nothing", "value": 20}),
                  ("mark", {"code": 7, "text": "flash"}), ("note", {"text": "a bell rang"}), ("picture", {}), ("answer", {"response": "soft"}),
                  ("start", {"renderer": "point"}), ("stop", {"reason": "enough"}), ("load", {"scene": cube}), ("load", {"scene": {"objects": []}}),
                  ("emergency", {}), ("start", {}), ("clear", {}), ("clock", {"t_client": 5}), ("alive", {}), ("bye", {})]),
           Serve(f"{serve} --token-file token.json --port 0 --calibration none.json --without-calibration".split(),
                 [("start", {}), ("load", {"scene": cube}), ("bye", {})])]
    external = "serve --device simulated --socket socket --protocol external.json --db live.db --participant P01 --token-file token.json"
    yield [file("external.json", EXTERNAL),
           Serve(f"{external} --new-participant --number 2 --session 1 --consent 1".split(),
                 [("start", {"stimulus": "cone", "level": 30}), ("start", {"stimulus": "ball", "level": 99, "renderer": "point"}),
                  ("answer", {"response": "soft"}),
                  ("start", {"stimulus": "ball", "level": 30, "renderer": "point", "trial": 1}), ("touch", {}), ("answer", {"response": "soft"}),
                  ("start", {"stimulus": "box", "level": 60, "renderer": "point"}), ("answer", {"response": "ball"}),
                  ("stop", {"reason": "a sneeze"}),
                  ("bye", {})]),
           Serve(external.split(),
                 [("start", {"stimulus": "box", "level": 60, "renderer": "point", "trial": 2}), ("answer", {"response": "hard", "correct": True}),
                  ("start", {"stimulus": "box", "level": 25, "renderer": "point", "trial": 3, "orientation_wxyz": [0.6, 0, 0.8, 0]}),
                  ("answer", {"response": "hard"})]),
           *after_session("served")]
    yield [refused("serve --device simulated --group old"), refused("serve --device simulated --fill"),
           refused("serve --device simulated --scene none.json"), refused("serve --device falcon --serial 5 --firmware none"),
           refused("serve --device touch --library none.so", 1), refused("serve --device inverse3 --service 127.0.0.1:9", 1),
           refused("serve --device falcon2 --serial A"),
           refused("serve --device simulated --protocol none.json"),
           refused("serve --device simulated --protocol protocols/quick.json --db marked.db --participant A --new-participant"
                   " --markers serial:none --marker-codes --sync --stream lsl --sound-device none --without-noise", 1)]


def device_lines():
    """As far as they go without a device: what they list and test, and what they say that is missing."""
    yield steps("devices", "devices --device simulated --json devices.json --rate 500", "devices --device simulated --json devices.json --force",
                "devices --device simulated --report report.timed.json",
                timed=True)
    yield [Shell("timing", "{ palpate devices --timing --seconds 1 --no-realtime --core 0 --json timing.json || true; } | grep -v '^This machine'\n"
                 "sed -i 's/:.*//' timing.json", timed=True)]
    failing = ("--calibrate --device falcon --calibration new.json --weights 0.1,0.2 --gravity 9.81 --sweep-seconds 2 --serial 5 --firmware none",
               "--calibrate --device falcon2 --calibration new.json --stylus-length 0.1 --offset 0,0,0.1 --points 6 --serial A --serial B",
               "--device touch --library none.so", "--device inverse3 --service 127.0.0.1:9", "--markers parport:/dev/none")
    wrong = ("--timing --device simulated --calibration none.json", "--timing --guarded --no-fifo --device falcon",
             "--calibrate --device simulated", "--device nothing", "--markers nowhere")
    yield [refused(f"devices {more}", status) for status, group in ((1, failing), (2, wrong)) for more in group]
