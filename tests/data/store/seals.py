"""The seals of a session's rows, made by what data/store/seals.h says and by nothing of palpate's."""

import hashlib
import struct

RUN = ("started_utc_ns, started_ns, program_version, build, device, device_calibration, response_device, "
       "response_latency, consent_version, consent_utc_ns, hand")
ATTEMPT = ("trial, attempt, block, renderer, shape, practice, orientation_w, orientation_x, orientation_y, "
           "orientation_z, began_ns, state, cut_off_reason, response, correct, timed_out, response_time, "
           "first_contact_time, onset_ns, response_ns, start_tip_x, start_tip_y, start_tip_z, start_tail_x, "
           "start_tail_y, start_tail_z, ticks, missed_ticks, longest_period_ns, faults, started_inside, max_force, "
           "samples_sha256, contact_share, edge_dwell, task")


def packed(value):
    if value is None:
        return b"n"
    if isinstance(value, int):
        return b"i" + struct.pack("<q", value)
    if isinstance(value, float):
        return b"r" + struct.pack("<d", value)
    letter, content = (b"t", value.encode()) if isinstance(value, str) else (b"b", value)
    return letter + struct.pack("<Q", len(content)) + content


def seal(before, kind, values):
    return hashlib.sha256(before + b"".join(map(packed, (kind, *values)))).digest()


def first_seal(base, session):
    """What stands for the session itself, before its rows."""
    return seal(bytes(32), "session", base.execute(
        "SELECT pr.sha256, pr.name, p.code, coalesce((SELECT enrolled_number FROM renumberings WHERE participant_id = "
        "p.id), p.number), p.simulated, p.seed, s.number, s.observer_sha256 FROM sessions s JOIN participants p ON "
        "p.id = s.participant_id JOIN protocols pr ON pr.id = p.protocol_id WHERE s.id = ?", (session,)).fetchone())


def rows(base, session):
    """(table, id, names of its link and seal, kind, values, link, seal) of every row that is sealed."""
    for row in base.execute(
            f"SELECT id, link, seal, {RUN}, (SELECT sha256 FROM protocols WHERE id = protocol_id), files_sha256 FROM runs "
            "WHERE session_id = ? ORDER BY id", (session,)).fetchall():
        yield "runs", row[0], ("link", "seal"), "run", row[3:], row[1], row[2]
    for row in base.execute("SELECT n.id, n.link, n.seal, r.link, n.at_ns, n.text FROM notes n JOIN runs r ON r.id = "
                            "n.run_id WHERE r.session_id = ? ORDER BY n.id", (session,)).fetchall():
        yield "notes", row[0], ("link", "seal"), "note", row[3:], row[1], row[2]
    for row in base.execute("SELECT p.id, p.link, p.seal, r.link, p.page, p.item, p.version, p.text_sha256, p.answer, p.at_ns "
                            "FROM page_answers p JOIN runs r ON r.id = p.run_id WHERE r.session_id = ? ORDER BY p.id",
                            (session,)).fetchall():
        yield "page_answers", row[0], ("link", "seal"), "page", row[3:], row[1], row[2]
    columns = ", ".join("a." + name for name in ATTEMPT.split(", "))
    for row in base.execute(f"SELECT a.id, a.link, a.seal, r.link, {columns} FROM attempts a JOIN runs r ON r.id = "
                            "a.run_id WHERE a.session_id = ? AND a.state <> 'running' ORDER BY a.id", (session,)).fetchall():
        values = row[3:-3] + (row[-3:-1] if row[-3:-1] != (None, None) else ()) + (row[-1:] if row[-1] is not None else ())
        yield "attempts", row[0], ("link", "seal"), "attempt", values, row[1], row[2]
    for row in base.execute("SELECT id, end_link, end_seal, link, end_reason, ended_ns FROM runs WHERE session_id = ? "
                            "AND end_reason <> 'running' ORDER BY id", (session,)).fetchall():
        yield "runs", row[0], ("end_link", "end_seal"), "end", row[3:], row[1], row[2]


def faults(base):
    """Links that do not hold, of a database as it is."""
    wrong = []
    for (session,) in base.execute("SELECT id FROM sessions ORDER BY id").fetchall():
        before = first_seal(base, session)
        chain = sorted(rows(base, session), key=lambda row: row[5] or 0)
        for place, (table, key, _, kind, values, link, sealed) in enumerate(chain, 1):
            if link != place or seal(before, kind, values) != sealed:
                wrong.append((session, table, key))
            before = sealed
    return wrong


def seal_again(base):
    """As somebody who deceives would: every seal is made anew over what the rows say now."""
    for (session,) in base.execute("SELECT id FROM sessions ORDER BY id").fetchall():
        before, place = first_seal(base, session), 0
        base.execute("UPDATE runs SET end_link = NULL, end_seal = NULL WHERE session_id = ?", (session,))
        for table, key, (link, name), kind, values, _, _ in list(rows(base, session)):
            if kind in ("note", "page", "attempt", "end"):  # the link of the run may be another one by now
                run = "id" if kind == "end" else "run_id"
                (of_run,) = base.execute(f"SELECT r.link FROM runs r WHERE r.id = (SELECT {run} FROM {table} WHERE id = ?)",
                                         (key,)).fetchone()
                values = (of_run, *values[1:])
            place += 1
            before = seal(before, kind, values)
            base.execute(f"UPDATE {table} SET {link} = ?, {name} = ? WHERE id = ?", (place, before, key))
    base.commit()
