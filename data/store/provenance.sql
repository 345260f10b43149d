-- Schema version 3: protocol and files of each run, and seals that reveal later changes.

-- Every file that a protocol names (meshes), byte for byte.
CREATE TABLE files (
  id INTEGER PRIMARY KEY,
  sha256 TEXT NOT NULL UNIQUE CHECK (length(sha256) = 64),
  bytes BLOB NOT NULL
) STRICT;

CREATE TABLE protocol_files (
  protocol_id INTEGER NOT NULL REFERENCES protocols (id),
  name TEXT NOT NULL,              -- as the protocol names it
  file_id INTEGER NOT NULL REFERENCES files (id),
  PRIMARY KEY (protocol_id, name)
) STRICT, WITHOUT ROWID;

-- Participants with a new number, because two stations had given the same one.
CREATE TABLE renumberings (
  participant_id INTEGER PRIMARY KEY REFERENCES participants (id),
  enrolled_number INTEGER NOT NULL CHECK (enrolled_number >= 1)  -- orders the trials, also from here on
) STRICT;

-- The protocol of a run, if it differs from the participant's in its texts only.
ALTER TABLE runs ADD COLUMN protocol_id INTEGER REFERENCES protocols (id);
-- SHA-256 of the names and checksums of the protocol's files (seals.h); '': none, or not known.
ALTER TABLE runs ADD COLUMN files_sha256 TEXT NOT NULL DEFAULT '' CHECK (length(files_sha256) IN (0, 64));

-- The rows of a session form a chain (seals.h): a seal is the SHA-256 of the seal before and of what
-- the row holds. link counts them from 1. A run has two, for its begin and its end; an attempt is
-- sealed when it is over.
ALTER TABLE runs ADD COLUMN link INTEGER CHECK (link >= 1);
ALTER TABLE runs ADD COLUMN seal BLOB CHECK ((seal IS NULL) = (link IS NULL) AND (seal IS NULL OR length(seal) = 32));
ALTER TABLE runs ADD COLUMN end_link INTEGER CHECK (end_link > link);
ALTER TABLE runs ADD COLUMN end_seal BLOB
  CHECK ((end_seal IS NULL) = (end_link IS NULL) AND (end_seal IS NULL OR length(end_seal) = 32));
ALTER TABLE notes ADD COLUMN link INTEGER CHECK (link >= 1);
ALTER TABLE notes ADD COLUMN seal BLOB CHECK ((seal IS NULL) = (link IS NULL) AND (seal IS NULL OR length(seal) = 32));
-- Of packing, count and data of its samples; NULL: it has none.
ALTER TABLE attempts ADD COLUMN samples_sha256 BLOB CHECK (samples_sha256 IS NULL OR length(samples_sha256) = 32);
ALTER TABLE attempts ADD COLUMN link INTEGER CHECK (link >= 1);
ALTER TABLE attempts ADD COLUMN seal BLOB CHECK ((seal IS NULL) = (link IS NULL) AND (seal IS NULL OR length(seal) = 32));

-- Tombstones are keyed: code_hash = crypt(HMAC-SHA256(secret, code)). Secrets never leave databases;
-- a merged one has those of all its stations.
CREATE TABLE tombstone_secrets (
  id INTEGER PRIMARY KEY,
  secret BLOB NOT NULL UNIQUE CHECK (length(secret) = 32)
) STRICT;
-- NULL: made by version 2, code_hash = crypt(code).
ALTER TABLE tombstones ADD COLUMN secret_id INTEGER REFERENCES tombstone_secrets (id);
