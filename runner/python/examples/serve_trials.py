"""A block of trials as in PsychoPy, felt through palpate serve: python3 serve_trials.py TOKEN_FILE [--out TABLE.csv]

With PsychoPy, `Window` and `wait_keys` are psychopy.visual.Window and psychopy.event.waitKeys; here the keyboard is the
terminal's, or, with --keys, a list of what is pressed. The server runs a protocol with a block of the task "external":
    palpate serve --device NAME --protocol P.json --db study.db --participant P01 --token-file TOKEN_FILE
"""
import argparse
import csv
import pathlib
import random
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "palpate"))
from client import Client, ServeError  # noqa: E402  with the module: from palpate import Client, ServeError

MAY_COME_AGAIN = ("emergency", "forces-off", "stopped", "nothing-felt")  # the trial is shown again
FOREVER = 1e9  # s


class Window:
    """As psychopy.visual.Window, on a terminal."""

    def message(self, text):
        print(text, file=sys.stderr)

    def flip(self):
        pass


def wait_keys(choices, pressed):
    """As psychopy.event.waitKeys(keyList=choices)[0]."""
    if pressed:
        return pressed.pop(0)
    while (key := input(" or ".join(choices) + "? ")) not in choices:
        pass
    return key


def wait_for_person(hand, window, error, pressed):
    """Forces come again only when a person says so."""
    if error.code == "emergency":
        window.message(str(error))
        hand.wait_for("cleared", FOREVER)
        return
    window.message(f"{error}. Look what it was, then press g to go on.")
    if not pressed:
        wait_keys(["g"], pressed)
    hand.clear()


def felt_trial(hand, window, stimulus, renderer, keys, pressed):
    """Until it is on record: forces may go off before, as where the stylus is torn away."""
    while True:
        try:
            window.message("Take the stylus away from the middle and hold it still.")
            hand.start(stimulus=stimulus, renderer=renderer, trial=hand.next["trial"])
            window.message("What is it? " + ", ".join(f"{key}: {name}" for key, name in keys.items()))
            window.flip()
            return hand.answer(keys[wait_keys(list(keys), pressed)])
        except ServeError as error:
            if error.code == "timed-out":
                return error.stored
            if error.code not in MAY_COME_AGAIN:
                raise
            wait_for_person(hand, window, error, pressed)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("token_file")
    parser.add_argument("--out", default="trials.csv")
    parser.add_argument("--keys", default="", help="pressed one after the other, instead of the keyboard")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    chance, window, pressed = random.Random(given.seed), Window(), list(given.keys)
    with Client.from_token_file(given.token_file) as hand, open(given.out, "w", newline="") as file:
        table = None
        while hand.next is not None:
            keys = {str(i + 1): name for i, name in enumerate(hand.next["answers"])}
            trial = felt_trial(hand, window, chance.choice(hand.next["stimuli"]), "ray", keys, pressed)
            row = {name: trial[name] for name in ("trial", "stimulus", "renderer", "response", "correct", "timed_out", "response_time_s")}
            if table is None:
                table = csv.DictWriter(file, row)
                table.writeheader()
            table.writerow(row)


if __name__ == "__main__":
    main()
