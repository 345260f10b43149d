-- Schema version 4: measures of contact with the object of a trial.

-- NULL: recorded by a version that did not measure it. Sealed where it is there (seals.h).
ALTER TABLE attempts ADD COLUMN contact_share REAL CHECK (contact_share BETWEEN 0 AND 1);
-- s; NULL also where the stimulus has too many edges to resolve.
ALTER TABLE attempts ADD COLUMN edge_dwell REAL CHECK (edge_dwell >= 0);
