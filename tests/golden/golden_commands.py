"""The commands that same_outputs.py runs: all that the READMEs show and test, and what they do not show.

A line is a list of steps that build on each other in a folder of their own; lines run beside each other. Every command and
every option that `palpate help` lists stands in some line, or in NOT_RUN with the reason.
"""

import json
import re
import subprocess

from golden_sessions import session_lines
from golden_steps import SOURCE, Call, File, Session, Shell, refused, steps
from markdown import PAGES, RUN

PROTOCOLS = sorted(path.name for path in (SOURCE / "protocols").glob("*.json")
                   if ".schema." not in path.name and ".texts." not in path.name)
SCENES = sorted(path.stem for path in (SOURCE / "protocols/scenes").glob("*.csv"))
MESHES = sorted(path.relative_to(SOURCE) for path in (SOURCE / "protocols").glob("*/*.obj"))
TASKS = [name for name in PROTOCOLS if name.startswith(("stiffness", "size", "roughness"))]
NOT_RUN = {"bench": "prints times and nothing else",
           "design": "serves a page at an address of its own; tests/runner/design asks it",
           "stability --full": "takes minutes; the same with more stiffnesses"}

ABOUT = File("about.json", '{"version": 1, "authors": [{"name": "Ada Example"}], "license": "CC-BY-4.0", "funding": ["A fund"]}')
HYPOTHESES = File("hypotheses.json", json.dumps([
    {"id": "H1", "text": "Cones are found faster with the ray.", "corroborated": "paired.cone.p_holm < alpha && paired.cone.reduction > 0",
     "refuted": "paired.cone.ci95_high < 5"}]))
RATING = File("hard.json", json.dumps({
    "version": 2, "name": "hard", "renderers": ["point", "ray"], "orientation": "fixed", "seed": 4,
    "stimuli": [{"name": "ball", "shape": "sphere", "radius_m": 0.03, "stiffness_n_per_m": 300}],
    "blocks": [{"name": "hardness", "task": "rate", "question": "How hard was it?", "stimuli": ["ball"], "repetitions": 4,
                "scale": [{"label": label} for label in ("soft", "rather soft", "medium", "rather hard", "hard")]}]}))
HARDER = File("harder.json", json.dumps([
    {"id": "H1", "text": "It feels harder with the ray.", "corroborated": "rating.hardness.p < alpha && rating.hardness.difference > 0",
     "refuted": "rating.hardness.ci95_high < 0.5"}]))
SETTINGS = File("settings.json", '{"motor": {"slide_speed_m_per_s": 0.04}}')
TETRAHEDRON = [((0, 0, 0), (0, 0.03, 0), (0.03, 0, 0)), ((0, 0, 0), (0.03, 0, 0), (0, 0, 0.03)),
               ((0, 0, 0), (0, 0, 0.03), (0, 0.03, 0)), ((0.03, 0, 0), (0, 0.03, 0), (0, 0, 0.03))]
STL = File("corner.stl", "solid corner\n" + "".join(
    "facet normal 0 0 0\nouter loop\n" + "".join("vertex {} {} {}\n".format(*corner) for corner in facet) + "endloop\nendfacet\n"
    for facet in TETRAHEDRON) + "endsolid corner\n")
OPEN_STL = File("open.stl", re.sub(r"facet normal.*?endfacet\n", "", STL.text, count=1, flags=re.S))


def all_lines(known):
    """Long ones first. `known`: the options of each command."""
    yield from examining_lines()
    yield from readme_lines()
    yield from study_lines()
    yield from session_lines()
    yield from cluster_lines()
    yield from registration_lines()
    yield from data_lines()
    yield from protocol_lines()
    yield from scene_lines()
    yield [*steps("--help", "--version"), refused("nonsense"), *(Call(["help", word]) for word in known)]


def options_by_command(program):
    def listed(pattern, *words):
        said = subprocess.run([program, *words], capture_output=True, text=True, check=True).stdout
        return re.findall(pattern, said, re.M)

    return {command: set(listed(r"^  (?:-h \[ )?(--[a-z-]+)", "help", command)) - {"--help"} for command in listed(r"^  ([a-z]+)  +\S", "--help")}


def not_run(known, lines):
    """What no line runs, a sentence each."""
    run = {command: set() for command in known}
    for step in (step for line in lines for step in line):
        for command, rest in called(step):
            run.get(command, set()).update({""}, re.findall(r"(?<!\S)--[a-z-]+", rest))
    wanted = {(command, option) for command, options in known.items() for option in ("", *options)}
    missing = sorted(f"{command} {option}".strip() for command, option in wanted
                     if option not in run[command] and command not in NOT_RUN and f"{command} {option}" not in NOT_RUN)
    return [f"palpate {name}: no line of golden_commands.py runs it" for name in missing]


def called(step):
    """(command, the other words) of each call of the program."""
    if isinstance(step, Shell):
        return re.findall(r"\bpalpate ([a-z]+)([^|&;#\n]*)", step.text.replace("\\\n", " "))
    return [(step.words[0], " ".join(step.words[1:]))]


def readme_lines():
    """What is shown and run, one line a page, without the commands that print times."""
    for name, page in PAGES.items():
        blocks = []
        for block in page.blocks:
            text = block.text if block.words == RUN else ""
            if block.language() == "console":
                text = "\n".join(line[2:] for line in block.text.splitlines() if line.startswith("$ "))
            text = re.sub(r"^palpate bench .*$", "", text, flags=re.M)
            # One session after the other: else rows come in the order in which sessions happen to end.
            text = re.sub(r"^palpate simulate .*$", r"\g<0> --jobs 1", text, flags=re.M)
            if text:
                blocks.append(Shell(f"{name}:{block.line}", text, timed="palpate devices" in text or "--explain" in text))
        if blocks:
            yield blocks


def after(database):
    yield from steps(f"analyze --db {database} --json {database}.json --report {database}.html --figures {database}.figures",
                     *(f"export --db {database} --format {format_} --out {database}.{format_}" for format_ in ("csv", "bids", "psych-ds")))


def study_lines():
    for name in TASKS + ["concave.json", "layered.json", "floating.json", "ho2000-interleaved.json"]:
        yield [*steps(f"simulate protocols/{name} --db study.db --participants 2 --jobs 1"), *after("study.db"),
               *steps("analyze --db study.db --function normal --scale log" if name in TASKS[1:] else "analyze --db study.db")]
    for version in ("1", "2"):
        yield [SETTINGS, *steps(f"simulate protocols/quick.json --db v{version}.db --participants 2 --jobs 1 --participant-version {version}"),
               *after(f"v{version}.db")]
    yield [*steps(*(f"simulate protocols/quick.json --db part{part}.db --participants 4 --jobs 1 --shard {part}/2" for part in (1, 2)),
                  "merge --out whole.db part1.db part2.db", "merge --out again.db --input whole.db --input part1.db --renumber",
                  "simulate protocols/quick.json --db whole.db --participants 5 --jobs 1 --seed 1"), *after("whole.db")]
    yield [*steps("simulate protocols/quick.json --db study.db --participants 6 --jobs 1 --seed 4"), *after("study.db"),
           *steps("analyze --db study.db --too-fast-s 1.5 --protocol quick --json slow.json",
                  "plan --db study.db --effect cone=22,cube=11 --studies 200 --trials 3,20 --json plan.json --figure power.svg --jobs 1",
                  "plan --db study.db --effect cone=22,cube=11 --studies 200 --trials 3,20,30 --reuse plan.json --json plan2.json",
                  "plan --db study.db --effect 30 --test model --studies 100 --participants 4-12 --trials 3 --goal any --power 0.7 --alpha 0.1 --protocol quick",
                  "export --db study.db --format csv --out relative.csv --times relative --codebook codebook.csv",
                  "plan --csv relative.csv --studies 100 --trials 3 --participants 4-40 --seed 3 --json plan3.json",
                  "plan --csv relative.csv --studies 100 --trials 3 --participants 4-40 --seed 3 --json plan3.json --force")]
    yield steps(
        "plan --jnd-effect 40 --studies 100 --trials 42 --participants 6-7",
        "plan --pse-effect 1 --studies 100 --trials 42 --participants 6-6 --json pse.json",
        "plan --threshold-effect 40 --studies 100 --trials 42 --participants 6-6",
        "plan --accuracy-effect 10 --accuracy 0.7 --studies 100 --trials 40 --participants 6-12",
        "plan --rating-effect 0 --equivalence 1 --studies 100 --participants 6-12",
        "plan --jnd-effect 30 --weber 0.2 --jnd-sd 0.2 --jnd-effect-sd 0.1 --pse-sd 0.3 --reach 2 --trials 42 --studies 100 --participants 6-7",
        "plan --gain-sd 0.15 --residual-sd 0.5 --effect cone=15 --studies 200 --trials 20",
        "plan --gain-sd 0.15 --shape-gain-sd 0.1 --residual-sd 0.5 --intercept-sd 0.4 --correlation 0.3 --share-used 0.9 --effect cone=40"
        " --test model --studies 100 --participants 4-8 --trials 5",
        "plan --coverage --studies 5 --seed 2 --jobs 2 --json coverage.json")


def data_lines():
    yield [*steps("simulate protocols/quick.json --db study.db --participants 3 --jobs 1",
                  "export --db study.db --format psych-ds --out study",
                  "export --db study.db --format psych-ds --out study --force --times absolute",
                  "export --db study.db --format csv --out trials.csv --pages"),
           Session("forget --db study.db --participant S001".split(), [("everything: ", "no\n")], status=1),
           refused("forget --db study.db --participant S001"),
           Call(["forget", "--db", "study.db", "--participant", "-", "--yes"], typed="S001\n"),
           *steps("forget --db study.db --participant S002 --yes", "export --db study.db --format csv --out rest.csv"),
           refused("forget --db study.db --participant S009 --yes")]
    yield [ABOUT,
           *steps("simulate protocols/quick.json --db moved.db --participants 2 --jobs 1",
                  "analyze --db moved.db --movement --movement-csv movement.csv --json movement.json --report movement.html --figures figures"
                  " --meshes . --jobs 1 --cutoff-hz 10",
                  "analyze --db moved.db --movement --movement-csv movement.csv --force",
                  "analyze --db moved.db --movement --protocol quick",
                  "export --db moved.db --format csv --out moved.csv", "analyze --csv moved.csv --json table.json",
                  "export --db moved.db --format bids --motion --contacts --movement --meshes . --about about.json --out bids --pages",
                  "export --db moved.db --format bids --jobs 2 --out packed",
                  "export --db moved.db --format psych-ds --contacts --movement --out psych-ds",
                  "replay --db moved.db --trial S001/1/1 --compare --out both.csv --json replay.json --meshes . --protocol quick",
                  "replay --db moved.db --trial S001/1/1 --json replay.json --force",
                  "watch --db moved.db --trial S001/1/1 --compare --out trial.html --meshes . --protocol quick",
                  "watch --db moved.db --trial S001/1/1 --trial S001/1/2 --out trial.html --force"),
           refused("replay --db moved.db --trial S001/1/999"), refused("watch --db moved.db --trial S009/1/1 --out none.html")]
    yield steps("simulate protocols/floating.json --db kept.db --participants 1 --jobs 1",
                "replay --db kept.db --trial S001/1/3 --out replayed.csv",
                "watch --db kept.db --trial S001/1/3 --compare --out trial.html")


def sweep(more):
    return f"sweep protocols/quick.json --space protocols/spaces/small.json --participants 2 --repetitions 1 {more}"


def cluster_lines():
    """Sweeps, and shards of them as files: what sbatch would run is run by hand."""
    yield [SETTINGS,
           *steps(sweep("--points 4 --jobs 1 --db small.sweep"), "analyze --sweep small.sweep --json sweep.json --report sweep.html",
                  "analyze --sweep small.sweep --pattern 'cone > 5 && cone > cube' --figures figures",
                  "export --db small.sweep --format csv --out sweep.csv",
                  sweep("--points 4 --settings settings.json --seed 2 --print-point 3 --db none.sweep"),
                  sweep("--points 10 --design saltelli --participant-version 2 --settings settings.json --seed 5 --db saltelli.sweep"),
                  "analyze --sweep saltelli.sweep --json saltelli.json --report saltelli.html",
                  *(sweep(f"--points 4 --jobs 1 --shard {part}/2 --db part{part}.sweep") for part in (1, 2)),
                  "merge --out whole.sweep part1.sweep part2.sweep")]
    plan = "plan --gain-sd 0.15 --residual-sd 0.5 --effect cone=30 --studies 100 --participants 4-12 --trials 3,5"
    yield [SETTINGS,
           *steps("cluster " + sweep("--points 4 --shards 2 --dir people --no-submit --design sobol --seed 3 --settings settings.json"
                                     " --participant-version 3 --time 01:00:00 --partition all"), "cluster status people"),
           Shell("shards", "people/shard.sh 1"), *steps("cluster status people"),
           Shell("finish", "people/shard.sh 2; people/finish.sh"), *steps("cluster status people"),
           *steps("cluster simulate protocols/quick.json --participants 3 --shards 2 --dir study --no-submit"),
           Shell("study", "study/shard.sh 1; study/shard.sh 2; study/finish.sh"), *steps("cluster status study"),
           *steps(f"cluster {plan} --dir power --no-submit"),
           Shell("power", "power/shard.sh 1; power/shard.sh 2; power/finish.sh"), *steps("cluster status power"),
           *with_slurm("cluster submit people", "cluster " + sweep("--points 2 --shards 2 --dir sent"), "cluster status sent",
                       "cluster submit sent"),
           refused("cluster " + sweep("--points 2 --shards 3 --dir sent")), refused("cluster status nowhere")]


def with_slurm(*texts):
    """sbatch takes a job and runs nothing; squeue says that it waits."""
    yield File("bin/sbatch", '#!/bin/sh\necho "$@" >> calls\necho 17\n', 0o700)
    yield File("bin/squeue", '#!/bin/sh\necho "[1-2] PENDING"\n', 0o700)
    yield from steps(*texts)


def registration_lines():
    plan = "plan --gain-sd 0.1 --residual-sd 0.3 --effect cone=50 --participants 2-6 --trials 3 --studies 100"
    register = "register protocols/quick.json --plan plan.json --hypotheses hypotheses.json --out registration --studies 40"
    yield [HYPOTHESES, ABOUT,
           *steps(f"{plan} --json plan.json", f"{register} --jobs 1", f"{register} --participants 4 --seed 3 --too-fast-s 0.3 --jobs 2 --force",
                  "simulate protocols/quick.json --db study.db --participants 4 --jobs 1"),
           *steps("register protocols/quick.json --plan plan.json --hypotheses hypotheses.json --out late --studies 20 --db study.db",
                  "analyze --db study.db --too-fast-s 0.3 --json analysis.json",
                  "check registration --db study.db --analysis analysis.json --json check.json --report check.html",
                  "check registration --db study.db --json check.json --force"),
           refused("check registration --db study.db --too-fast-s 0.5 --alpha 0.1", 1),
           Shell("digest", "palpate check registration --db study.db --digest $(sha256sum < registration/SHA256SUMS | cut -c-64)"),
           refused(f"check registration --db study.db --digest {64 * 'a'}", 1),
           *steps("bundle --db study.db --registration registration --about about.json --out study --format bids",
                  "bundle --db study.db --registration registration --about about.json --out study --force", "bundle --verify study"),
           Shell("its digest", "palpate bundle --verify study --digest $(sha256sum < registration/SHA256SUMS | cut -c-64)"),
           Shell("other data", "sed -i 2d study/data/trials.csv; palpate bundle --verify study", status=1)]
    yield [RATING, HARDER, ABOUT,
           *steps("plan --exponent-effect 30 --trials 28 --participants 8-9 --studies 100 --json exponent.json",
                  "plan --rating-effect 1.5 --trials 4 --participants 6-8 --studies 100 --json plan.json",
                  "plan --groups 2 --effect-interaction 15 --gain-sd 0.15 --residual-sd 0.5 --participants 4-40 --studies 200 --json groups.json",
                  "register hard.json --plan plan.json --hypotheses harder.json --participants 6 --out registration --studies 20",
                  "schedule hard.json --participant 2 --format order", "schedule protocols/quick.json --participant 1 --format order",
                  "schedule protocols/stiffness-2afc.json --participant 1 --format order",
                  "simulate hard.json --db study.db --participants 6", "check registration --db study.db --json check.json",
                  "bundle --db study.db --registration registration --about about.json --out study", "bundle --verify study",
                  "analyze --csv study/data/trials.csv --design hard.json --json analysis.json"),
           refused("register hard.json --plan exponent.json --hypotheses harder.json --out other", 2)]


def protocol_lines():
    for name in PROTOCOLS:
        yield steps(f"validate protocols/{name}",
                    *(f"schedule protocols/{name} --participant 3 --format {format_}" for format_ in ("table", "csv", "json")))
    broken = File("broken.json", '{"version": 1, "name": "broken", "renderers": ["line"], "stimuli": [{"shape": "cone"}], "repetitions": 0}')
    yield [*steps("schedule protocols/size-questplus.json --recover 20 --seed 2", "validate protocols/roughness-magnitude.json --texts",
                  "validate protocols/roughness-magnitude.json --language de", "validate protocols/stiffness-2afc.json --json"), refused("validate protocols/quick.json --calibration none.json"),
           broken, refused("validate broken.json"), refused("simulate broken.json --db broken.db"),
           refused("schedule broken.json --participant 1"),
           refused("run protocols/quick.json --db none.db --participant P01 --device simulated --no-window --group old"),
           refused("run protocols/quick.json --db none.db --participant P01 --device simulated --no-window --fill")]


def scene_lines():
    for scene in SCENES:
        renderers = ["ray"] if scene.startswith(("fig3b", "fig17")) else ["ray", "point"]
        path = f"protocols/scenes/{scene}"
        for renderer in renderers:
            yield [*steps(f"render --scene {path}.json --renderer {renderer} --trajectory {path}.csv --out forces.csv --bodies bodies.csv",
                          f"render --scene {path}.json --renderer {renderer} --trajectory {path}.csv --out forces.csv --force"),
                   *steps(f"render --scene {path}.json --renderer {renderer} --explain --json explained.timed.json", timed=True)]
        yield [*steps(f"validate {path}.json"),
               *steps(f"explore {path}.json --trajectory {path}.csv --renderer {renderers[-1]} --frames frames --every 400ms --size 320x180"
                      " --view 50,30,2 --labels", timed=True)]
    yield [STL, OPEN_STL, *steps("validate corner.stl"), refused("validate open.stl"), *steps(*(f"validate {mesh}" for mesh in MESHES))]
    path = "--trajectory protocols/scenes/fig13-two-objects.csv"
    yield [STL, *steps(f"render --scene corner.stl --renderer ray {path} --out corner.csv",
                       f"render --scene protocols/shapes/torus.obj --renderer point {path} --out torus.csv"),
           *steps(f"explore corner.stl {path} --animation corner.webp --every 1s --size 160x90",
                  f"explore corner.stl {path} --animation corner.webp --every 2s --size 160x90 --force", timed=True),
           refused("explore corner.stl --device simulated --calibration none.json --without-calibration --pictures kept", 1),
           refused("explore corner.stl --device touch --library none.so --serial A", 1),
           refused("explore corner.stl --device simulated --markers serial:none --marker-codes --sync --stream lsl", 1),
           refused("explore corner.stl --device inverse3 --service 127.0.0.1:9 --firmware none", 1)]


def examining_lines():
    """Their times are hidden: in texts and figures with all other numbers, which the JSON has as well."""
    yield steps("stability --soft --seed 3 --figure soft.svg --jobs 1 --force")
    yield steps("stability --json stability.json --report stability.timed.html --figure stability.svg --jobs 1", timed=True)
    yield steps("accuracy --quick --paths 1 --ticks 20 --most-triangles 400 --json accuracy.json --report accuracy.timed.html"
                " --figure accuracy.timed.svg --force", timed=True)
    yield steps("stability protocols/scenes/fig13-two-objects.json --device simulated --json buzz.json --report buzz.html --figure buzz.svg"
                " --jobs 2 --force")
    yield [refused("stability protocols/scenes/fig13-two-objects.json --device simulated --calibration none.json")]
    yield steps("accuracy protocols/scenes/fig13-two-objects.json --quick --renderer ray --json scene.json --report scene.timed.html"
                " --figure scene.timed.svg --force", timed=True)
    yield steps("accuracy protocols/scenes/fig13-two-objects.json --quick --trajectory protocols/scenes/fig13-two-objects.csv"
                " --json path.json --force", timed=True)
    yield steps("accuracy --search 20000 --seed 77 --jobs 2", "accuracy --search 20000 --unions --seed 2")
