-- Schema version 5: trials of tasks, and answers to pages.

-- Additional values of a trial of a version 2 protocol, as JSON (store/task_text.h): task, block_name,
-- track, level, standard_level, catch_trial; of a completed one also intervals with their onsets,
-- success, number, confidence. NULL: version 1. Sealed where it is there (seals.h).
ALTER TABLE attempts ADD COLUMN task TEXT;

-- Personal data: answers to questionnaires, and consent given. Not exported unless asked.
CREATE TABLE page_answers (
  id INTEGER PRIMARY KEY,
  run_id INTEGER NOT NULL REFERENCES runs (id),
  page TEXT NOT NULL,
  item TEXT NOT NULL,
  version TEXT NOT NULL,           -- of a consent's text, as the protocol calls it
  text_sha256 TEXT NOT NULL CHECK (length(text_sha256) = 64),  -- of what was shown
  answer TEXT NOT NULL,            -- '': left out
  at_ns INTEGER NOT NULL,
  link INTEGER CHECK (link >= 1),
  seal BLOB CHECK ((seal IS NULL) = (link IS NULL) AND (seal IS NULL OR length(seal) = 32))
) STRICT;
CREATE INDEX page_answers_of_run ON page_answers (run_id);
