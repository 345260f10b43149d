-- palpate's database (PRAGMA user_version = 5, application_id = 'PLPT'): this file, version 1, then
-- withdrawal.sql, version 2, provenance.sql, version 3, contact.sql, version 4, and tasks.sql, version 5.
-- SI units; *_ns are nanoseconds of the session's monotonic clock, *_utc_ns since 1970; booleans 0 or 1.
-- The program embeds them when it is built; a change is a new version with a migration (schema.cpp).

CREATE TABLE protocols (
  id INTEGER PRIMARY KEY,
  sha256 TEXT NOT NULL UNIQUE CHECK (length(sha256) = 64),
  name TEXT NOT NULL,
  text TEXT NOT NULL               -- the file, byte for byte
) STRICT;

CREATE TABLE participants (
  id INTEGER PRIMARY KEY,
  protocol_id INTEGER NOT NULL REFERENCES protocols (id),
  code TEXT NOT NULL CHECK (length(code) BETWEEN 1 AND 32 AND code NOT GLOB '*[^0-9A-Za-z]*'),
  number INTEGER NOT NULL CHECK (number >= 1),
  simulated INTEGER NOT NULL CHECK (simulated IN (0, 1)),
  seed TEXT CHECK (seed IS NULL OR simulated = 1),  -- decimal: 64 bits without sign
  UNIQUE (protocol_id, code),
  UNIQUE (protocol_id, number)
) STRICT;

CREATE TABLE sessions (
  id INTEGER PRIMARY KEY,
  participant_id INTEGER NOT NULL REFERENCES participants (id),
  number INTEGER NOT NULL CHECK (number >= 1),
  observer_sha256 TEXT NOT NULL,   -- settings of a simulated participant, else ''
  UNIQUE (participant_id, number)
) STRICT;

-- A session can be interrupted and resumed: one row for each process that ran a part of it.
CREATE TABLE runs (
  id INTEGER PRIMARY KEY,
  session_id INTEGER NOT NULL REFERENCES sessions (id),
  started_utc_ns INTEGER NOT NULL,  -- these two are one instant: the calendar of every *_ns of the run
  started_ns INTEGER NOT NULL,
  program_version TEXT NOT NULL,
  build TEXT NOT NULL,
  device TEXT NOT NULL,
  device_calibration TEXT NOT NULL,
  response_device TEXT NOT NULL,
  response_latency REAL,           -- s, measured; NULL: unknown
  consent_version TEXT NOT NULL,
  consent_utc_ns INTEGER,
  hand TEXT NOT NULL,
  end_reason TEXT NOT NULL
    CHECK (end_reason IN ('running', 'done', 'paused', 'aborted', 'withdrawn', 'interrupted')),
  ended_ns INTEGER,                -- NULL: running, or nobody saw it end
  CHECK ((ended_ns IS NULL) = (end_reason IN ('running', 'interrupted')))
) STRICT;
CREATE INDEX runs_of_session ON runs (session_id);

CREATE TABLE notes (
  id INTEGER PRIMARY KEY,
  run_id INTEGER NOT NULL REFERENCES runs (id),
  at_ns INTEGER NOT NULL,
  text TEXT NOT NULL
) STRICT;
CREATE INDEX notes_of_run ON notes (run_id);

-- Every presentation of a trial. Only completed ones are data; cut-off ones are kept, but marked.
CREATE TABLE attempts (
  id INTEGER PRIMARY KEY,
  session_id INTEGER NOT NULL REFERENCES sessions (id),
  run_id INTEGER NOT NULL REFERENCES runs (id),
  trial INTEGER NOT NULL CHECK (trial >= 1),  -- within the session
  attempt INTEGER NOT NULL CHECK (attempt >= 1),
  block INTEGER NOT NULL CHECK (block >= 1),
  renderer TEXT NOT NULL,
  shape TEXT NOT NULL,             -- name of the stimulus
  practice INTEGER NOT NULL CHECK (practice IN (0, 1)),
  orientation_w REAL NOT NULL,
  orientation_x REAL NOT NULL,
  orientation_y REAL NOT NULL,
  orientation_z REAL NOT NULL,
  began_ns INTEGER NOT NULL,       -- before anything was shown
  state TEXT NOT NULL CHECK (state IN ('running', 'completed', 'cut_off')),
  cut_off_reason TEXT CHECK ((cut_off_reason IS NOT NULL) = (state = 'cut_off')),
  -- from here on: of a completed attempt, else NULL
  response TEXT CHECK ((response IS NOT NULL) = (state = 'completed')),
  correct INTEGER CHECK (correct IN (0, 1)),
  timed_out INTEGER CHECK (timed_out IN (0, 1)),
  response_time REAL,              -- s, from time zero
  first_contact_time REAL,         -- s, from time zero; NULL: never touched
  onset_ns INTEGER,                -- time zero: forces go on
  response_ns INTEGER,
  start_tip_x REAL, start_tip_y REAL, start_tip_z REAL,     -- m, at time zero
  start_tail_x REAL, start_tail_y REAL, start_tail_z REAL,  -- m
  ticks INTEGER CHECK (ticks >= 0),
  missed_ticks INTEGER CHECK (missed_ticks >= 0),
  longest_period_ns INTEGER,
  faults INTEGER CHECK (faults >= 0),
  started_inside INTEGER CHECK (started_inside IN (0, 1)),
  max_force REAL,                  -- N
  UNIQUE (session_id, trial, attempt),
  CHECK (state <> 'completed' OR
         (correct IS NOT NULL AND timed_out IS NOT NULL AND response_time IS NOT NULL AND
          onset_ns IS NOT NULL AND response_ns IS NOT NULL AND
          start_tip_x IS NOT NULL AND start_tip_y IS NOT NULL AND start_tip_z IS NOT NULL AND
          start_tail_x IS NOT NULL AND start_tail_y IS NOT NULL AND start_tail_z IS NOT NULL AND
          ticks IS NOT NULL AND missed_ticks IS NOT NULL AND longest_period_ns IS NOT NULL AND
          faults IS NOT NULL AND started_inside IS NOT NULL AND max_force IS NOT NULL)),
  CHECK (timed_out IS NOT 1 OR (response = '' AND correct = 0))
) STRICT;
CREATE UNIQUE INDEX one_record_a_trial ON attempts (session_id, trial) WHERE state = 'completed';
CREATE UNIQUE INDEX one_open_attempt_a_run ON attempts (run_id) WHERE state = 'running';
CREATE INDEX attempts_of_run ON attempts (run_id);

-- Servo-rate samples of an attempt, packed; the packing is described in store/attempts.h.
CREATE TABLE samples (
  attempt_id INTEGER PRIMARY KEY REFERENCES attempts (id),
  packing INTEGER NOT NULL CHECK (packing >= 1),
  count INTEGER NOT NULL CHECK (count >= 1),
  data BLOB NOT NULL
) STRICT;
