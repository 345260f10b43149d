-- Schema version 2: exports, which a withdrawal lists, and tombstones, which it leaves.

-- The exports that palpate made of this database: a withdrawal lists those that hold the participant.
CREATE TABLE exports (
  id INTEGER PRIMARY KEY,
  path TEXT NOT NULL UNIQUE,       -- absolute; the next export to the same place replaces the row
  format TEXT NOT NULL,            -- 'csv', 'bids', 'psych-ds'
  made_utc_ns INTEGER NOT NULL
) STRICT;

CREATE TABLE export_participants (
  export_id INTEGER NOT NULL REFERENCES exports (id),
  participant_id INTEGER NOT NULL REFERENCES participants (id),
  PRIMARY KEY (export_id, participant_id)
) STRICT, WITHOUT ROWID;
CREATE INDEX exports_of_participant ON export_participants (participant_id);

-- One row for each withdrawn code; no other data of it remain.
CREATE TABLE tombstones (
  id INTEGER PRIMARY KEY,
  code_hash TEXT NOT NULL UNIQUE,  -- crypt(3), yescrypt: salted and slow
  cleared INTEGER NOT NULL CHECK (cleared IN (0, 1))  -- 0: log, free pages, backups may still hold it
) STRICT;

-- Exports that hold a participant who has withdrawn since.
CREATE TABLE tombstone_exports (
  tombstone_id INTEGER NOT NULL REFERENCES tombstones (id),
  export_id INTEGER NOT NULL REFERENCES exports (id),
  PRIMARY KEY (tombstone_id, export_id)
) STRICT, WITHOUT ROWID;
